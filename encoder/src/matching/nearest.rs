//! Pairs by place and attributes.
#![expect(clippy::arithmetic_side_effects, reason = "positions in lists in memory and levels of 0 to 20")]
#![expect(
    clippy::indexing_slicing,
    reason = "rows are those of the clouds; cells are found by their codes in sorted lists"
)]

use super::{Cloud, Measure};
use rayon::prelude::*;
use splatstream_decoder::position::morton;

/// Attributes compared: three axes by size, opacity, three of colour.
const ATTRIBUTES: usize = 7;

/// What a square step of difference in one attribute costs; a distance of a radius costs [`LIMIT`].
///
/// Attributes of the same Gaussian, trained twice, differ by two steps or three, those of neighbours by six and more.
const ATTRIBUTE_WEIGHT: f32 = 1.0 / 16.0;

/// The cost of the worst pair: at the edge of the radius with equal attributes, or in place and each attribute 4.5
/// steps off, which is still cheaper to code than a new Gaussian.
pub(crate) const LIMIT: f32 = 9.0;

/// The cost of a pair that is hardly mistaken: chance seldom finds seven attributes within 1.5 steps.
pub(crate) const CLOSE: f32 = 1.0;

/// The most Gaussians of the reference that one of the target is compared with.
const COMPARED: usize = 192;

/// The most of them that it keeps as possible partners.
const KEPT: usize = 6;

/// What each doubling of a difference adds to its bits.
const DOUBLING_BITS: f32 = 1.6;

/// Beyond this logit Gaussians are opaque or invisible alike.
const LOGIT: f32 = 7.0;

/// How far a Gaussian may be from the one that continues it, whichever is more.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reach {
    /// Of its own size.
    pub(crate) scales: f32,
    /// Grid steps.
    pub(crate) least: f32,
}

/// One Gaussian, ready to be compared.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Feature {
    /// Its index in its frame.
    pub(super) index: u32,
    /// Grid steps.
    position: [f32; 3],
    /// Size in grid steps: the geometric mean of the two largest axes.
    size: f32,
    /// In steps.
    attributes: [f32; ATTRIBUTES],
}

/// Two Gaussians that are one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Link {
    /// Place in the reference.
    pub(crate) from: u32,
    /// Place in the target.
    pub(crate) to: u32,
    /// How unlike they are, 0 to [`LIMIT`].
    pub(crate) cost: f32,
}

/// Those of a cloud, ready to be compared.
pub(crate) fn features(cloud: &Cloud<'_>, indices: &[u32], measure: &Measure) -> Vec<Feature> {
    let steps = &measure.steps;
    let feature = |&index: &u32| {
        let row = index as usize;
        let mut axes = cloud.log_scale.map(|plane| plane[row]);
        axes.sort_unstable_by(f32::total_cmp);
        let [a, b, c] = axes.map(|axis| axis / steps.log_scale);
        let [red, green, blue] = cloud.dc.map(|plane| plane[row] / steps.dc);
        let opacity = cloud.opacity[row].clamp(-LOGIT, LOGIT) / steps.opacity;
        Feature {
            index,
            position: cloud.at(index),
            size: cloud.size(index) / measure.position_step,
            attributes: [a, b, c, opacity, red, green, blue],
        }
    };
    indices.par_iter().map(feature).collect()
}

/// Gaussians of the reference by Morton code: those of a cell of any size follow each other.
struct Grid<'a> {
    codes: Vec<u64>,
    members: Vec<&'a Feature>,
}

/// Whole grid steps; what is outside is at the border.
fn whole(position: [f32; 3]) -> [u32; 3] {
    position.map(|value| value.clamp(0.0, 1_048_575.0) as u32)
}

/// The cell of size 2^level on one axis, and its neighbour on the nearer side.
fn two_cells(index: u32, level: u32) -> [u32; 2] {
    let cell = index >> level;
    let upper = level > 0 && (index >> (level - 1)) & 1 == 1;
    [cell, if upper { cell + 1 } else { cell.saturating_sub(1) }]
}

impl<'a> Grid<'a> {
    fn new(features: &'a [Feature]) -> Self {
        let code = |feature: &Feature| {
            let [x, y, z] = whole(feature.position);
            morton(x, y, z)
        };
        let mut sorted: Vec<(u64, u32)> =
            features.par_iter().map(code).zip(0..features.len() as u32).collect();
        sorted.par_sort_unstable();
        let members = sorted.iter().map(|&(_, index)| &features[index as usize]).collect();
        Self { codes: sorted.into_iter().map(|(code, _)| code).collect(), members }
    }

    /// The eight cells of size 2^level about a place, as runs of members.
    fn runs(&self, index: [u32; 3], level: u32) -> [(usize, usize); 8] {
        let cells = index.map(|value| two_cells(value, level));
        let mut runs = [(0, 0); 8];
        for (corner, run) in runs.iter_mut().enumerate() {
            let [x, y, z] = [0, 1, 2].map(|axis: usize| cells[axis][(corner >> axis) & 1]);
            let doubled = (0..3).any(|axis| (corner >> axis) & 1 == 1 && cells[axis][0] == cells[axis][1]);
            if doubled {
                continue;
            }
            let code = morton(x, y, z);
            let first = self.codes.partition_point(|&other| other >> (3 * level) < code);
            let window = &self.codes[first..self.codes.len().min(first + COMPARED + 1)];
            *run = (first, first + window.partition_point(|&other| other >> (3 * level) == code));
        }
        runs
    }

    /// Members within a radius or, where they are too many, within as much of it as holds few enough.
    fn about(&self, position: [f32; 3], radius: f32) -> impl Iterator<Item = &'a Feature> {
        let index = whole(position);
        let mut level = (0..20).find(|&level| 2.0 * radius <= (1_u32 << level) as f32).unwrap_or(20);
        let mut runs = self.runs(index, level);
        while level > 0 && runs.iter().map(|(first, end)| end - first).sum::<usize>() > COMPARED {
            level -= 1;
            runs = self.runs(index, level);
        }
        runs.into_iter().flat_map(|(first, end)| &self.members[first..end]).take(COMPARED).copied()
    }
}

fn cost(from: &Feature, to: &Feature, radius: f32) -> f32 {
    let squares = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f32>();
    let distance = squares(&from.position, &to.position) / (radius * radius);
    if distance > 1.0 {
        return f32::INFINITY;
    }
    LIMIT * distance + ATTRIBUTE_WEIGHT * squares(&from.attributes, &to.attributes)
}

/// Bits that the differences of two Gaussians take, nearly.
pub(super) fn apart_bits(from: &Feature, to: &Feature) -> f32 {
    let bits = |(a, b): (&f32, &f32)| DOUBLING_BITS * libm::log2f(1.0 + (a - b).abs());
    let position: f32 = from.position.iter().zip(&to.position).map(bits).sum();
    position + from.attributes.iter().zip(&to.attributes).map(bits).sum::<f32>()
}

/// Possible partners of one Gaussian of the target, cheapest first.
fn candidates(grid: &Grid<'_>, to: &Feature, reach: Reach) -> Vec<Link> {
    let radius = reach.least.max(reach.scales * to.size).max(1.0);
    let mut kept: Vec<Link> = Vec::with_capacity(KEPT + 1);
    for from in grid.about(to.position, radius) {
        let cost = cost(from, to, radius);
        let wanted = cost <= LIMIT && kept.get(KEPT - 1).is_none_or(|last| cost < last.cost);
        if !wanted {
            continue;
        }
        let index = kept.partition_point(|link| link.cost <= cost);
        kept.insert(index, Link { from: from.index, to: to.index, cost });
        kept.truncate(KEPT);
    }
    kept
}

/// The cheapest pairs first, each Gaussian in one: what pairing mutual favourites over and over ends in.
pub(crate) fn links(reference: &[Feature], target: &[Feature], reach: Reach) -> Vec<Link> {
    let grid = Grid::new(reference);
    let mut all: Vec<Link> = target.par_iter().flat_map_iter(|to| candidates(&grid, to, reach)).collect();
    // No cost is negative: their bits have their order.
    all.par_sort_unstable_by_key(|link| (link.cost.to_bits(), link.to, link.from));
    let length = |features: &[Feature]| features.iter().map(|f| f.index as usize + 1).max().unwrap_or(0);
    let (mut used, mut served) = (vec![false; length(reference)], vec![false; length(target)]);
    let free = |link: &Link| {
        let (used, served) = (&mut used[link.from as usize], &mut served[link.to as usize]);
        let free = !*used && !*served;
        (*used, *served) = (*used || free, *served || free);
        free
    };
    all.into_iter().filter(free).collect()
}
