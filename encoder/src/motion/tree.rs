//! Cells of cells, and how each moves.

use super::rigid::{Point, Rigid, Vector};
use core::ops::Range;
use splatstream_decoder::position::morton;

/// A cell with what it holds.
#[derive(Debug, Clone)]
pub(super) struct Node {
    /// Place of the cell, in cells.
    pub(super) index: [u32; 3],
    /// Points with a known destination.
    pub(super) points: Range<usize>,
    /// Points without.
    pub(super) others: Range<usize>,
    /// How it moves: as its points do, or as the cell that it is part of.
    pub(super) motion: Rigid,
}

/// All cells of one size that hold anything, in Morton order.
pub(super) struct Tree {
    /// The side of a cell is 2 to this, grid steps.
    pub(super) cell_log2: u32,
    /// The cells.
    pub(super) nodes: Vec<Node>,
    /// In Morton order.
    pub(super) points: Vec<Point>,
    /// In Morton order; with the index that each was given at.
    pub(super) others: Vec<(Vector, u32)>,
    codes: [Vec<u64>; 2],
}

/// Orders by Morton code of the nearest grid point.
fn sorted(positions: impl Iterator<Item = Vector>) -> Vec<(u64, u32)> {
    let code = |position: Vector| {
        // The grid has at most 20 bits, and its points are not negative.
        let [x, y, z] = position.map(|value| (value + 0.5).clamp(0.0, 1_048_575.0) as u32);
        morton(x, y, z)
    };
    let mut codes: Vec<(u64, u32)> = positions.map(code).zip(0..).collect();
    codes.sort_unstable();
    codes
}

impl Tree {
    /// One cell that holds everything.
    #[expect(
        clippy::indexing_slicing,
        reason = "ranges of nodes lie in the lists of points and codes; axes are constants"
    )]
    pub(super) fn new(points: &[Point], others: &[Vector], position_bits: u8) -> Self {
        let [first, second] = [sorted(points.iter().map(|point| point.from)), sorted(others.iter().copied())];
        let points: Vec<Point> = first.iter().map(|&(_, index)| points[index as usize]).collect();
        let others: Vec<(Vector, u32)> =
            second.iter().map(|&(_, index)| (others[index as usize], index)).collect();
        let cell_log2 = u32::from(position_bits);
        let all = Node {
            index: [0; 3],
            points: 0..points.len(),
            others: 0..others.len(),
            motion: Rigid::STILL.about(centre([0; 3], cell_log2)),
        };
        let codes = [first, second].map(|list| list.into_iter().map(|(code, _)| code).collect());
        let mut tree = Self { cell_log2, nodes: vec![all], points, others, codes };
        tree.fit();
        tree
    }

    /// The same with cells of half the size.
    pub(super) fn split(&mut self) {
        let Some(cell_log2) = self.cell_log2.checked_sub(1) else { return };
        let nodes = core::mem::take(&mut self.nodes);
        self.cell_log2 = cell_log2;
        self.nodes = nodes.iter().flat_map(|node| self.parts(node)).collect();
        self.fit();
    }

    #[expect(
        clippy::indexing_slicing,
        reason = "ranges of nodes lie in the lists of points and codes; axes are constants"
    )]
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "places in lists in memory; indices of cells have at most 20 bits"
    )]
    fn parts(&self, node: &Node) -> Vec<Node> {
        let end = |list: usize, range: &Range<usize>, part: u64| {
            let codes = &self.codes[list][range.clone()];
            range.start + codes.partition_point(|code| (code >> (3 * self.cell_log2)) & 7 <= part)
        };
        let (mut points, mut others) = (node.points.clone(), node.others.clone());
        let mut parts = Vec::new();
        for part in 0..8_u32 {
            let ends = (end(0, &points, u64::from(part)), end(1, &others, u64::from(part)));
            let index = [0, 1, 2].map(|axis: usize| 2 * node.index[axis] + ((part >> axis) & 1));
            let (held, rest) = (points.start..ends.0, others.start..ends.1);
            points.start = ends.0;
            others.start = ends.1;
            if held.is_empty() && rest.is_empty() {
                continue;
            }
            let motion = node.motion.about(centre(index, self.cell_log2));
            parts.push(Node { index, points: held, others: rest, motion });
        }
        parts
    }

    #[expect(
        clippy::indexing_slicing,
        reason = "ranges of nodes lie in the lists of points and codes; axes are constants"
    )]
    fn fit(&mut self) {
        let size = (1_u64 << self.cell_log2) as f64;
        for node in &mut self.nodes {
            node.motion = node.motion.refined(&self.points[node.points.clone()], size);
        }
    }
}

/// The centre of a cell, grid steps.
pub(super) fn centre(index: [u32; 3], cell_log2: u32) -> Vector {
    index.map(|index| (f64::from(index) + 0.5) * (1_u64 << cell_log2) as f64)
}
