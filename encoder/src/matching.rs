//! Which Gaussian of a frame continues which Gaussian of its reference.
//!
//! Files whose rows keep their meaning are matched [by row](by_index). Of what is left, each Gaussian is compared
//! with those [near it](nearest), cheapest pair first. Nothing depends on threads or on the order of a hash table.
#![expect(
    clippy::indexing_slicing,
    reason = "rows are those of the clouds and of the matching; axes are constants"
)]

mod nearest;
mod order;

use crate::steps::Steps;
pub(crate) use nearest::{CLOSE, LIMIT, Link, Reach, features, links};

/// Rows that are looked at together: if most of them agree, those that do are no coincidence.
const RUN: usize = 64;

/// The share of a run that must agree, in quarters.
const RUN_QUARTERS: usize = 3;

/// The share of a file that must agree for all its rows to keep their meaning.
const TRACKED_PERCENT: usize = 95;

/// The most that rows may move apart, of their distance.
const STRAIN: f64 = 0.7;

/// Below this share of close matches a frame shares little with its reference. Unrelated captures, brought to one
/// place and size, reach 0.1 %; retrained frames of one scene, a quarter of a second apart, 93 %.
const LITTLE: f32 = 0.25;

/// From this share of matches on a frame shares much with its reference. Frames of the built-in scene, each Gaussian
/// jittered by a third of its size, reach 0.9 with a sixth of a second between them.
const MUCH: f32 = 0.6;

/// Gaussians as matching sees them; all planes of one length.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cloud<'a> {
    /// In grid steps; those of a reference may already be displaced by a guess of its motion.
    pub(crate) position: [&'a [f32]; 3],
    /// Natural log of the semi-axes in scene units, in any order.
    pub(crate) log_scale: [&'a [f32]; 3],
    /// Logit.
    pub(crate) opacity: &'a [f32],
    /// As in PLY.
    pub(crate) dc: [&'a [f32]; 3],
    /// The row of each in its file; empty: the index is the row.
    pub(crate) row: &'a [u32],
    /// Rows of the file, those left out included.
    pub(crate) row_count: u32,
}

impl Cloud<'_> {
    /// Gaussians.
    pub(crate) fn len(&self) -> usize {
        self.opacity.len()
    }

    /// Position of one.
    pub(crate) fn at(&self, index: u32) -> [f32; 3] {
        self.position.map(|plane| plane[index as usize])
    }

    fn log_volume(&self, index: u32) -> f32 {
        self.log_scale.iter().map(|plane| plane[index as usize]).sum()
    }

    /// The geometric mean of the two largest axes, scene units.
    pub(crate) fn size(&self, index: u32) -> f32 {
        let [a, b, c] = self.log_scale.map(|plane| plane[index as usize]);
        libm::expf(0.5 * (a + b + c - a.min(b).min(c)))
    }

    /// Opacity times area in scene units, what it covers at most.
    pub(crate) fn coverage(&self, index: u32) -> f32 {
        let size = self.size(index);
        size * size / (1.0 + libm::expf(-self.opacity[index as usize]))
    }

    /// Rows with their indices, by row.
    fn by_row(&self) -> Vec<(u32, u32)> {
        let row = |index: u32| self.row.get(index as usize).copied().unwrap_or(index);
        let mut rows: Vec<(u32, u32)> = (0..self.len() as u32).map(|index| (row(index), index)).collect();
        rows.sort_unstable();
        rows
    }
}

/// By how much attributes of one Gaussian may differ, in units: what is unlike does not depend on how finely it is coded.
const UNLIKE: Steps =
    Steps { position_bits: 13.4, log_scale: 0.12, rotation: 0.02, opacity: 0.14, dc: 0.074, sh: 0.08 };

/// In what units attributes are compared.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Measure {
    /// Scene units in a grid step.
    pub(crate) position_step: f32,
    /// Quantiser steps.
    pub(crate) steps: Steps,
    /// Quantiser steps that attributes of one Gaussian may differ by.
    pub(crate) same: f32,
}

impl Measure {
    /// The units in which attributes are compared where they are coded with these steps: a reference has their errors.
    pub(crate) fn steps_beside(coded: &Steps) -> Steps {
        Steps {
            log_scale: UNLIKE.log_scale.max(coded.log_scale),
            opacity: UNLIKE.opacity.max(coded.opacity),
            dc: UNLIKE.dc.max(coded.dc),
            ..UNLIKE
        }
    }
}

/// How far rows keep their meaning.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Every row is the same Gaussian in both.
    Tracked,
    /// Some rows are.
    Partly,
    /// No row is.
    Untracked,
}

/// The Gaussians that continue.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Matching {
    /// For each Gaussian of the reference the one that continues it; each at most once.
    pub(crate) target_of: Vec<Option<u32>>,
    /// How far rows keep their meaning.
    pub(crate) kind: Kind,
    /// Pairs found by row, of the larger frame.
    pub(crate) by_index: f32,
    /// Pairs found by place and attributes, of the larger frame.
    pub(crate) by_nearest: f32,
    /// Those among them that are hardly mistaken.
    pub(crate) close: f32,
}

/// Whether a frame is better coded without this reference: a scene cut.
pub(crate) fn shares_little(matching: &Matching) -> bool {
    matching.by_index + matching.close < LITTLE
}

/// Whether most Gaussians of a frame have a partner, be they as unlike as two trainings make them.
pub(crate) fn shares_much(matching: &Matching) -> bool {
    matching.by_index + matching.by_nearest >= MUCH
}

/// Pairs of the same row, where rows keep their meaning.
///
/// Such rows agree in opacity, colour and volume, whatever moves. If nearly all of two files of equal length do,
/// so are those that changed the same Gaussians; else only runs of rows that agree are trusted. Unrelated Gaussians
/// that look alike are told apart by how they move.
#[expect(clippy::arithmetic_side_effects, reason = "counts of pairs of one frame")]
pub(crate) fn by_index(reference: &Cloud<'_>, target: &Cloud<'_>, measure: &Measure) -> Matching {
    let common = common_rows(reference, target);
    let agree: Vec<bool> = common.iter().map(|&pair| agrees(reference, target, measure, pair)).collect();
    let agreeing = agree.iter().filter(|&&same| same).count();
    let larger = reference.len().max(target.len());
    let whole = reference.row_count == target.row_count
        && agreeing * 100 >= TRACKED_PERCENT * larger
        && coherent(reference, target, &common);
    let trusted = if whole { common } else { runs(reference, target, &common, &agree) };
    let mut matching = Matching {
        target_of: vec![None; reference.len()],
        kind: Kind::Untracked,
        by_index: 0.0,
        by_nearest: 0.0,
        close: 0.0,
    };
    if !trusted.is_empty() {
        matching.kind = if whole { Kind::Tracked } else { Kind::Partly };
        matching.by_index = trusted.len() as f32 / larger as f32;
        for (from, to) in trusted {
            matching.target_of[from as usize] = Some(to);
        }
    }
    matching
}

/// Places of the rows that both have.
fn common_rows(reference: &Cloud<'_>, target: &Cloud<'_>) -> Vec<(u32, u32)> {
    let others = target.by_row();
    let mut rest = others.iter().peekable();
    let mut common = Vec::new();
    for (row, index) in reference.by_row() {
        while rest.next_if(|&&(other, _)| other < row).is_some() {}
        if let Some(&(_, other)) = rest.next_if(|&&(other, _)| other == row) {
            common.push((index, other));
        }
    }
    common
}

fn agrees(reference: &Cloud<'_>, target: &Cloud<'_>, measure: &Measure, (from, to): (u32, u32)) -> bool {
    let Measure { steps, same, .. } = measure;
    let (a, b) = (from as usize, to as usize);
    // The three axes of one Gaussian may each be as far off as the others.
    let volume = (reference.log_volume(from) - target.log_volume(to)).abs();
    volume <= 3.0 * same * steps.log_scale
        && (reference.opacity[a] - target.opacity[b]).abs() <= same * steps.opacity
        && (0..3).all(|axis| (reference.dc[axis][a] - target.dc[axis][b]).abs() <= same * steps.dc)
}

/// The pairs that agree, of runs in which most do and move alike.
#[expect(clippy::arithmetic_side_effects, reason = "counts of pairs of one frame")]
fn runs(reference: &Cloud<'_>, target: &Cloud<'_>, common: &[(u32, u32)], agree: &[bool]) -> Vec<(u32, u32)> {
    let mut trusted = Vec::new();
    for (pairs, agree) in common.chunks_exact(RUN).zip(agree.chunks_exact(RUN)) {
        let same: Vec<(u32, u32)> =
            pairs.iter().zip(agree).filter(|&(_, &same)| same).map(|(&pair, _)| pair).collect();
        if 4 * same.len() >= RUN_QUARTERS * pairs.len() && coherent(reference, target, &same) {
            trusted.extend(same);
        }
    }
    trusted
}

/// Whether what follows each other moves alike: two rows of one file move apart by less than they are apart, unless
/// things turn by 40 degrees and more. Rows that mean nothing move by as much as they are apart.
fn coherent(reference: &Cloud<'_>, target: &Cloud<'_>, pairs: &[(u32, u32)]) -> bool {
    let difference = |a: [f32; 3], b: [f32; 3]| [0, 1, 2].map(|axis: usize| f64::from(a[axis] - b[axis]));
    let length = |d: [f64; 3]| d.iter().map(|value| value * value).sum::<f64>().sqrt();
    let (mut strain, mut apart) = (0.0, 0.0);
    for ((from, to), (next, next_to)) in pairs.iter().zip(pairs.iter().skip(1)) {
        let before = difference(reference.at(*from), reference.at(*next));
        let after = difference(target.at(*to), target.at(*next_to));
        strain += length([0, 1, 2].map(|axis: usize| after[axis] - before[axis]));
        apart += length(before);
    }
    strain <= STRAIN * apart
}

impl Matching {
    /// Pairs what is left by place and attributes, up to a cost of at most [`LIMIT`], and returns what it paired.
    pub(crate) fn add_nearest(
        &mut self,
        reference: &Cloud<'_>,
        target: &Cloud<'_>,
        measure: &Measure,
        reach: Reach,
        limit: f32,
    ) -> Vec<Link> {
        let (free, wanted) = (self.free(), self.wanted(target.len()));
        let mut found =
            links(&features(reference, &free, measure), &features(target, &wanted, measure), reach);
        found.retain(|link| link.cost <= limit);
        let larger = reference.len().max(target.len()).max(1) as f32;
        self.by_nearest += found.len() as f32 / larger;
        self.close += found.iter().filter(|link| link.cost <= CLOSE).count() as f32 / larger;
        for link in &found {
            self.target_of[link.from as usize] = Some(link.to);
        }
        found
    }

    /// The Gaussians of the reference that nothing continues.
    pub(crate) fn free(&self) -> Vec<u32> {
        (0..).zip(&self.target_of).filter(|(_, to)| to.is_none()).map(|(from, _)| from).collect()
    }

    /// Those of a target of so many Gaussians that continue nothing.
    pub(crate) fn wanted(&self, targets: usize) -> Vec<u32> {
        let mut taken = vec![false; targets];
        for &to in self.target_of.iter().flatten() {
            taken[to as usize] = true;
        }
        (0..).zip(taken).filter(|&(_, taken)| !taken).map(|(to, _)| to).collect()
    }
}

#[cfg(test)]
pub(crate) mod tests;
