//! How the cells of a frame move.
//!
//! [`Tree`] fits a rigid motion to ever smaller cells, each as a correction of the larger cell's, so that a cell
//! with few pairs, or none, moves with what is around it. [`listing`](mod@listing) decides what of that is worth
//! its bits, and the cell size with the fewest bits of cells and moves together is taken.
//! [`follow`](follow::follow) puts this to use before there are pairs.

mod cell_selection;
pub(crate) mod follow;
mod pairs;
mod registration;
mod rigid;
pub(crate) mod stale_cells;
mod tree;

use cell_selection::{Coded, Listing, list_bits, listing};
use rigid::{Point, Vector};
use splatstream_decoder::position::morton;
use tree::{Tree, centre};

/// Coded units of translation in a grid step.
const TRANSLATION: f64 = 8.0;

/// One, as rotations are coded.
const ROTATION: f64 = 16_384.0;

/// Units of a fine position in a grid step.
const FINE: f64 = 64.0;

/// A Gaussian this near its target on every axis, grid steps, needs no move. Beyond half a step rounding would
/// move it; a little more saves many moves and costs little error.
const DEAD_ZONE: f64 = 0.75;

/// No cell size is tried with fewer pairs than this in a cell: a list of such cells costs more than the moves.
const PAIRS_IN_CELL: usize = 4;

/// Cells that a cell of a scene becomes when sizes are halved: scenes are made of surfaces.
const PARTS: usize = 4;

/// Sizes with more pairs than this in a cell, on average, say nothing about smaller ones.
const PAIRS_IN_COARSE_CELL: usize = 128;

/// A Gaussian of the reference and where the target has it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pair {
    /// Fine position in the reference, 1/64 of a grid step.
    pub(crate) from: [i32; 3],
    /// Position in the target, grid steps.
    pub(crate) to: [f32; 3],
}

/// A listed cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Cell {
    /// Morton code of its coordinates, in cells.
    pub(crate) code: u64,
    /// What is carried in it is not shown.
    pub(crate) stale: bool,
    /// Translation in eighths of a grid step.
    pub(crate) translation: [i32; 3],
    /// Vector part of the rotation's quaternion, Q14.
    pub(crate) rotation: [i32; 3],
}

/// Cells of a frame.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CellMotion {
    /// The side of a cell is 2 to this, grid steps.
    pub(crate) cell_log2: u8,
    /// In Morton order.
    pub(crate) cells: Vec<Cell>,
    /// Estimated bits of the cells, and of modes and moves of the pairs.
    pub(crate) bits: [f64; 2],
}

fn grid_position(fine: [i32; 3]) -> Vector {
    fine.map(|value| f64::from(value) / FINE)
}

/// The cells that bring the Gaussians of a reference nearest to their pairs, for the fewest bits.
///
/// `unmatched` are those without a pair: who has nothing newer is shown them where these cells bring them.
#[expect(
    clippy::arithmetic_side_effects,
    reason = "counts of pairs and nodes; positions on the grid have at most 26 bits"
)]
pub(crate) fn cell_motion(pairs: &[Pair], unmatched: &[[i32; 3]], position_bits: u8) -> CellMotion {
    let point = |pair: &Pair| Point { from: grid_position(pair.from), to: pair.to.map(f64::from) };
    let points: Vec<Point> = pairs.iter().map(point).collect();
    let others: Vec<Vector> = unmatched.iter().copied().map(grid_position).collect();
    let mut tree = Tree::new(&points, &others, position_bits);
    let mut best: Option<(f64, CellMotion)> = None;
    loop {
        let Listing { cells, bits, astray } = listing(&tree);
        let cost = bits[0] + bits[1] + astray;
        let better = best.as_ref().is_none_or(|&(least, _)| cost < least);
        if better {
            best = Some((cost, CellMotion { cell_log2: tree.cell_log2 as u8, cells, bits }));
        }
        let nodes = tree.nodes.len();
        let past_best = !better && nodes * PAIRS_IN_COARSE_CELL > points.len();
        if past_best || tree.cell_log2 == 0 || nodes * PARTS * PAIRS_IN_CELL > points.len() {
            break;
        }
        tree.split();
    }
    let none = CellMotion { cell_log2: position_bits, cells: Vec::new(), bits: [0.0; 2] };
    best.map_or(none, |(_, motion)| motion)
}

impl CellMotion {
    /// The coordinates, in cells, of the cell that holds a fine position, and their Morton code.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "counts of pairs and nodes; positions on the grid have at most 26 bits"
    )]
    fn cell(&self, fine: [i32; 3]) -> ([u32; 3], u64) {
        let index = fine.map(|value| ((value + 32) >> 6 >> self.cell_log2).max(0) as u32);
        (index, morton(index[0], index[1], index[2]))
    }

    /// Where a Gaussian of the reference is carried, grid steps: the decoder's within its rounding.
    #[expect(clippy::indexing_slicing, reason = "cells are found by their codes")]
    pub(crate) fn displaced(&self, fine: [i32; 3]) -> [f32; 3] {
        let (index, code) = self.cell(fine);
        let coded = match self.cells.binary_search_by_key(&code, |cell| cell.code) {
            Ok(found) => {
                let Cell { translation, rotation, .. } = self.cells[found];
                Coded { translation, rotation }
            }
            Err(_) => Coded::STILL,
        };
        coded.apply(centre(index, u32::from(self.cell_log2)), grid_position(fine)).map(|value| value as f32)
    }

    /// With these cells, by code, marked stale; cells that were not listed are added and do not move.
    #[expect(clippy::indexing_slicing, reason = "cells are found by their codes")]
    pub(crate) fn with_stale(mut self, codes: &[u64]) -> Self {
        for &code in codes {
            match self.cells.binary_search_by_key(&code, |cell| cell.code) {
                Ok(found) => self.cells[found].stale = true,
                Err(index) => {
                    self.cells
                        .insert(index, Cell { code, stale: true, translation: [0; 3], rotation: [0; 3] });
                }
            }
        }
        self.bits[0] = list_bits(&self.cells);
        self
    }
}

#[cfg(test)]
mod tests;
