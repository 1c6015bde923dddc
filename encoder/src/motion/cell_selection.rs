//! The cells worth listing at one size, and what they cost.
#![expect(
    clippy::arithmetic_side_effects,
    reason = "values of cells are clamped to the ranges of clause 6, codes rise"
)]

use super::rigid::{Point, Vector, minus, plus, rotated};
use super::tree::{Node, Tree, centre};
use super::{Cell, DEAD_ZONE, ROTATION, TRANSLATION};
use crate::entropy_cost::Histogram;
use splatstream_decoder::position::morton;

/// The most pairs of a cell that choices are tried on.
const TRIED: usize = 16;

/// The most pairs that the cost of a size is estimated from.
const ESTIMATED: usize = 32_768;

/// Bits of naming a cell among those of its block, and of its stale flag: what lists of cells were found to cost.
const LISTED_BITS: f32 = 4.0;

/// What it is worth that a Gaussian is carried to its place, in what a move there costs: who receives part of a frame
/// sees the rest where its cells bring it.
const CARRIED: f32 = 0.25;

/// A difference that the eye and the pairs do not see, grid steps, at the border of a cell.
const UNSEEN: f64 = 0.25;

/// The largest coded magnitudes.
const TRANSLATION_LIMIT: u32 = 1 << 20;
const ROTATION_LIMIT: u32 = 8191;

/// A motion as it is coded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Coded {
    /// Eighths of a step.
    pub(super) translation: [i32; 3],
    /// Q14.
    pub(super) rotation: [i32; 3],
}

impl Coded {
    /// Nothing moves: what a cell that is not listed does.
    pub(super) const STILL: Self = Self { translation: [0; 3], rotation: [0; 3] };

    /// Where a point of the cell about `centre` goes.
    pub(super) fn apply(&self, centre: Vector, point: Vector) -> Vector {
        let shift = self.translation.map(|value| f64::from(value) / TRANSLATION);
        let moved = plus(point, shift);
        if self.rotation == [0; 3] {
            return moved;
        }
        let arm = minus(point, centre);
        plus(moved, minus(rotated(self.rotation.map(|value| f64::from(value) / ROTATION), arm), arm))
    }

    /// With this rotation, a point must move by `shift`.
    fn through(rotation: [i32; 3], centre: Vector, point: Vector, shift: Vector) -> Option<Self> {
        let only = Self { translation: [0; 3], rotation };
        let rest = minus(shift, minus(only.apply(centre, point), point));
        let translation = rest.map(|value| libm::rint(value * TRANSLATION) as i32);
        let fits = translation.iter().all(|value| value.unsigned_abs() <= TRANSLATION_LIMIT)
            && rotation.iter().all(|value| value.unsigned_abs() <= ROTATION_LIMIT);
        fits.then_some(Self { translation, rotation })
    }

    /// Components that are nearly those of the cell before become them.
    #[expect(
        clippy::indexing_slicing,
        reason = "ranges of nodes lie in the list of points; axes are constants"
    )]
    fn snapped(&self, before: &Self, size: f64) -> Self {
        let rotation_tolerance = (UNSEEN * ROTATION / size) as i32;
        let translation_tolerance = (UNSEEN * TRANSLATION) as i32;
        let snap = |own: [i32; 3], other: [i32; 3], tolerance: i32| {
            [0, 1, 2].map(|axis: usize| {
                let near = (own[axis] - other[axis]).abs() <= tolerance;
                if near { other[axis] } else { own[axis] }
            })
        };
        Self {
            translation: snap(self.translation, before.translation, translation_tolerance),
            rotation: snap(self.rotation, before.rotation, rotation_tolerance),
        }
    }
}

/// log2 of 1 + a magnitude, nearly: the mantissa taken as its own logarithm.
#[inline]
fn log2_of_more(magnitude: f32) -> f32 {
    let bits = (1.0 + magnitude).to_bits();
    (bits >> 23) as f32 - 127.0 + (bits & 0x7f_ffff) as f32 / 8_388_608.0
}

/// What a difference costs; 0 is common.
fn difference_bits(a: [i32; 3], b: [i32; 3]) -> f32 {
    let bits = |a: i32, b: i32| if a == b { 0.5 } else { 2.0 + 1.2 * log2_of_more((a - b).abs() as f32) };
    bits(a[0], b[0]) + bits(a[1], b[1]) + bits(a[2], b[2])
}

/// What a move by this costs.
fn move_bits(rest: Vector) -> f32 {
    let [x, y, z] = rest.map(|value| value.abs() as f32);
    if x.max(y).max(z) < DEAD_ZONE as f32 {
        // A rest that is just inside is nearly as bad as one just outside.
        return 0.3 + x + y + z;
    }
    3.0 + log2_of_more(x) + log2_of_more(y) + log2_of_more(z)
}

/// The listing of all cells of one size.
pub(super) struct Listing {
    /// In Morton order.
    pub(super) cells: Vec<Cell>,
    /// Estimated bits of the list and of all moves.
    pub(super) bits: [f64; 2],
    /// What it is worth that Gaussians are carried elsewhere than the fit would have them, in bits.
    pub(super) astray: f64,
}

/// Chooses how each cell of a tree moves.
pub(super) fn listing(tree: &Tree) -> Listing {
    let mut before = Coded::STILL;
    let mut cells = Vec::new();
    let mut moves = Vec::with_capacity(tree.nodes.len());
    let mut astray = 0.0;
    for node in &tree.nodes {
        let chosen = chosen(tree, node, &before);
        if chosen != Coded::STILL {
            let [x, y, z] = node.index;
            let Coded { translation, rotation } = chosen;
            cells.push(Cell { code: morton(x, y, z), stale: false, translation, rotation });
            before = chosen;
        }
        moves.push(chosen);
        astray += f64::from(carried_bits(&chosen, node, centre(node.index, tree.cell_log2)));
    }
    let bits = [list_bits(&cells), all_move_bits(tree, &moves)];
    Listing { cells, bits, astray }
}

/// The cheapest of: standing still, shifting, rotating and shifting, each also nearly or wholly as the cell before.
#[expect(clippy::indexing_slicing, reason = "ranges of nodes lie in the list of points; axes are constants")]
fn chosen(tree: &Tree, node: &Node, before: &Coded) -> Coded {
    let centre = centre(node.index, tree.cell_log2);
    let size = (1_u64 << tree.cell_log2) as f64;
    let points = &tree.points[node.points.clone()];
    let step = points.len().div_ceil(TRIED).max(1);
    let tried: Vec<Point> = points.iter().step_by(step).copied().collect();
    let pivot = middle(&tried).unwrap_or(centre);
    let shift = minus(node.motion.apply(pivot), pivot);
    let rotation = node.motion.rotation.map(|value| libm::rint(value * ROTATION) as i32);
    let through = |rotation| Coded::through(rotation, centre, pivot, shift);
    let own = [through([0; 3]), through(rotation), through(before.rotation)];
    let snapped = own.map(|coded| coded.map(|coded| coded.snapped(before, size)));
    let cost = |coded: &Coded| {
        let moves: f32 = tried.iter().map(|p| move_bits(minus(p.to, coded.apply(centre, p.from)))).sum();
        let share = points.len() as f32 / tried.len().max(1) as f32;
        let listed = if *coded == Coded::STILL { 0.0 } else { LISTED_BITS + coded_bits(coded, before) };
        moves * share + listed + carried_bits(coded, node, centre)
    };
    let all = [Some(Coded::STILL), Some(*before)].into_iter().chain(snapped).chain(own).flatten();
    let mut best = (f32::INFINITY, Coded::STILL);
    for coded in all {
        let cost = cost(&coded);
        if cost < best.0 {
            best = (cost, coded);
        }
    }
    best.1
}

fn coded_bits(coded: &Coded, before: &Coded) -> f32 {
    difference_bits(coded.translation, before.translation) + difference_bits(coded.rotation, before.rotation)
}

/// What it costs that Gaussians are shown elsewhere than the fit would have them.
fn carried_bits(coded: &Coded, node: &Node, centre: Vector) -> f32 {
    let apart = minus(coded.apply(centre, centre), node.motion.apply(centre));
    let [x, y, z] = apart.map(|value| log2_of_more(value.abs() as f32));
    CARRIED * (node.points.len() + node.others.len()) as f32 * (x + y + z)
}

fn middle(points: &[Point]) -> Option<Vector> {
    let sum = points.iter().fold([0.0; 3], |sum, point| plus(sum, point.from));
    (!points.is_empty()).then(|| sum.map(|value| value / points.len() as f64))
}

/// Signed integers as an entropy coder sees them: small ones as they are, large ones by size and low bits.
#[derive(Default)]
struct Tally {
    tokens: Histogram,
    low_bits: u32,
}

impl Tally {
    fn add(&mut self, value: i32) {
        let magnitude = value.unsigned_abs();
        let token = if magnitude < 8 {
            (8 + value) as u32
        } else {
            let log2 = magnitude.ilog2();
            self.low_bits += log2;
            16 + 2 * log2 + u32::from(value < 0)
        };
        self.tokens.add(token as u8);
    }

    fn bits(&self) -> f64 {
        self.tokens.total_bits() + f64::from(self.low_bits)
    }
}

/// Bits of a list of cells.
pub(super) fn list_bits(cells: &[Cell]) -> f64 {
    let mut tallies: [Tally; 7] = core::array::from_fn(|_| Tally::default());
    let mut before = (0, Coded::STILL);
    for cell in cells {
        let step = (cell.code - before.0).min(1 << 24) as i32;
        let values = [
            cell.translation[0] - before.1.translation[0],
            cell.translation[1] - before.1.translation[1],
            cell.translation[2] - before.1.translation[2],
            cell.rotation[0] - before.1.rotation[0],
            cell.rotation[1] - before.1.rotation[1],
            cell.rotation[2] - before.1.rotation[2],
            step,
        ];
        for (tally, value) in tallies.iter_mut().zip(values) {
            tally.add(value);
        }
        before = (cell.code, Coded { translation: cell.translation, rotation: cell.rotation });
    }
    tallies.iter().filter(|_| !cells.is_empty()).map(Tally::bits).sum()
}

/// Bits of modes and moves that bring all points to their places, estimated from some.
#[expect(clippy::indexing_slicing, reason = "ranges of nodes lie in the list of points; axes are constants")]
fn all_move_bits(tree: &Tree, moves: &[Coded]) -> f64 {
    let step = tree.points.len().div_ceil(ESTIMATED).max(1);
    let mut tallies: [Tally; 3] = core::array::from_fn(|_| Tally::default());
    let mut modes = Histogram::default();
    let mut seen = 0_u32;
    for (node, coded) in tree.nodes.iter().zip(moves) {
        let centre = centre(node.index, tree.cell_log2);
        let first = node.points.start.next_multiple_of(step);
        for point in (first..node.points.end).step_by(step).map(|index| &tree.points[index]) {
            let rest = minus(point.to, coded.apply(centre, point.from));
            let moves = rest.iter().any(|value| value.abs() > DEAD_ZONE);
            seen += 1;
            modes.add(u8::from(moves));
            for (tally, value) in tallies.iter_mut().zip(rest).filter(|_| moves) {
                tally.add(libm::rint(value) as i32);
            }
        }
    }
    let bits: f64 = modes.entropy_bits() + tallies.iter().map(Tally::bits).sum::<f64>();
    if seen > 0 { bits * tree.points.len() as f64 / f64::from(seen) } else { 0.0 }
}
