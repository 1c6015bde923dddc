//! Cells in which what a client still has is worse than nothing.

use super::CellMotion;
use crate::matching::{Cloud, Matching, Measure};

/// A cell is stale if more than this share of what is carried in it, by opacity times area, is wrong. Where less is
/// wrong, the rest hides holes: one frame after a change, carrying all is 10 dB better than carrying nothing.
const WRONG: f64 = 0.5;

/// Of its own size: a Gaussian that is shown further from its place than this is shown wrong. Nearer, it still covers
/// what its neighbours, shown as wrong as it is, leave open.
const ASTRAY: f32 = 4.0;

/// Grid steps that no Gaussian is astray by.
const NEAR: f32 = 4.0;

/// A reference's Gaussians as clients hold them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Held<'a> {
    /// Opacity, size and where the cells bring them.
    pub(crate) carried: Cloud<'a>,
    /// Fine positions in the reference.
    pub(crate) from: &'a [[i32; 3]],
    /// Their partners in the target.
    pub(crate) matching: &'a Matching,
}

/// Codes of the cells, increasing, in which most of what is carried has no partner in the target, or one elsewhere.
#[expect(clippy::indexing_slicing, reason = "rows are those of the matching; axes are constants")]
pub(crate) fn stale_cells(
    motion: &CellMotion,
    held: &Held<'_>,
    target: &Cloud<'_>,
    measure: &Measure,
) -> Vec<u64> {
    let Held { carried, from, matching } = held;
    let mut sorted: Vec<(u64, u32)> = from.iter().map(|&fine| motion.cell(fine).1).zip(0..).collect();
    sorted.sort_unstable();
    let wrong = |index: u32| {
        let Some(to) = matching.target_of[index as usize] else { return true };
        let (a, b) = (carried.at(index), target.at(to));
        let square: f32 = (0..3).map(|axis| (a[axis] - b[axis]) * (a[axis] - b[axis])).sum();
        let far = (ASTRAY * carried.size(index) / measure.position_step).max(NEAR);
        square > far * far
    };
    let is_stale = |members: &&[(u64, u32)]| {
        let (mut all, mut bad) = (0.0, 0.0);
        for &(_, index) in *members {
            let weight = f64::from(carried.coverage(index));
            all += weight;
            bad += if wrong(index) { weight } else { 0.0 };
        }
        bad > WRONG * all
    };
    let cells = sorted.chunk_by(|a, b| a.0 == b.0).filter(is_stale);
    cells.filter_map(|members| members.first()).map(|&(code, _)| code).collect()
}
