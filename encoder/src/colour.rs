//! Colour on its way in: transforms, components, and the choice between coefficients and codebooks.
#![expect(
    clippy::arithmetic_side_effects,
    reason = "lengths of what is in memory; a rank of a transform is 1 or more"
)]

use crate::combination::Combination;
use crate::entropy_cost::entropy_of;
use crate::grid::nearest_integer;
use crate::pca::Components;
use crate::savings::{BIT, Saving, Tool};
use crate::settings::{Preset, ShChoice};
use crate::vq;
use rayon::prelude::*;
use splatstream_decoder::steps::step;
use splatstream_format::payload::{Codebook, Transform};
use splatstream_format::syntax::{TransformHeader, TransformKind};

/// A basis entry of 1.
const UNIT: f64 = 4096.0;
/// Means are on a grid this much finer than the step.
const FRACTION: f64 = 64.0;
/// The largest mean the syntax carries.
const MEAN_LIMIT: f64 = 16_777_215.0;
/// Gaussians on which coefficients and codebooks are compared.
const TRIAL: usize = 1 << 13;
/// Gaussians whose components a thread takes from their planes at once, at least.
const AT_ONCE: usize = 1 << 10;

/// The transform unit of `components`, for a step.
pub(crate) fn transform(kind: TransformKind, components: &Components, step: f32) -> Transform {
    let dimension = components.rows.len();
    let mean = components
        .mean
        .iter()
        .map(|&mean| libm::round(mean / f64::from(step) * FRACTION).clamp(-MEAN_LIMIT, MEAN_LIMIT) as i32);
    let basis = components.rows.iter().flatten().map(|&entry| libm::round(entry * UNIT) as i16).collect();
    Transform {
        header: TransformHeader {
            transform_id: 0,
            transform_kind: kind.code(),
            dimension: dimension as u8,
            rank: dimension as u8,
        },
        mean: mean.collect(),
        basis,
    }
}

/// What makes components, in units of the step, of colours.
pub(crate) fn forwards(transform: &Transform, step: f32) -> Combination {
    let scale = 1.0 / (step * UNIT as f32);
    let mean = |&mean: &i32| (f64::from(mean) * f64::from(step) / FRACTION) as f32;
    let weights: Vec<Vec<f32>> =
        transform.rows().map(|row| row.iter().map(|&weight| f32::from(weight) * scale).collect()).collect();
    let start = vec![0.0; weights.len()];
    Combination { before: transform.mean.iter().map(mean).collect(), weights, start }
}

/// Components in units of the step; one plane per component.
pub(crate) fn components(transform: &Transform, planes: &[&[f32]], step: f32) -> Vec<Vec<f32>> {
    forwards(transform, step).of(planes)
}

/// Drops the last components that round to 0 for every Gaussian, with these steps; at least one stays.
pub(crate) fn drop_unused(
    transform: &mut Transform,
    planes: &mut Vec<Vec<f32>>,
    exponent: impl Fn(usize) -> u8,
) {
    let is_used = |plane: &Vec<f32>| {
        plane.iter().enumerate().any(|(row, value)| value.abs() >= 0.5 * step(exponent(row)) as f32)
    };
    let used = planes.iter().rposition(is_used).map_or(1, |last| last + 1);
    planes.truncate(used);
    transform.basis.truncate(used * usize::from(transform.header.dimension));
    transform.header.rank = used as u8;
}

/// How SH of a GOP is coded, and the figures that the choice rests on.
#[derive(Debug, Clone)]
pub(crate) struct ShPlan {
    /// The codebooks; none: coefficients.
    pub(crate) codebooks: Vec<Codebook>,
    /// Bits per Gaussian and mean squared error (in steps) of coefficients, then of vector quantisation, on the
    /// sample; none if not compared.
    pub(crate) trial: Option<[(f64, f64); 2]>,
}

/// Chooses between coefficients and codebooks.
///
/// A bit is worth [`BIT`].
pub(crate) fn plan_sh(
    components: &[Vec<f32>],
    exponent: impl Fn(usize) -> u8 + Sync,
    gaussians_of_gop: usize,
    choice: ShChoice,
    preset: Preset,
) -> ShPlan {
    let count = components.first().map_or(0, Vec::len);
    let coefficients = ShPlan { codebooks: Vec::new(), trial: None };
    let try_it = choice == ShChoice::VectorQuantised || choice == ShChoice::Auto && preset != Preset::Fast;
    if !try_it || count < 2 {
        return coefficients;
    }
    let rank = components.len();
    let rows = sampled_rows(components, &exponent, (count / (2 * TRIAL)).max(1));
    let entries = vq::entry_count(gaussians_of_gop, choice == ShChoice::VectorQuantised);
    let (trial, pays) = compare(&rows, rank, gaussians_of_gop, entries);
    let trial = Some(trial);
    if choice == ShChoice::Auto && !pays {
        return ShPlan { trial, ..coefficients };
    }
    let all = sampled_rows(components, &exponent, (count / (vq::TRAINING_PER_ENTRY * entries)).max(1));
    ShPlan { codebooks: vec![vq::train(&all, rank, entries.min(count))], trial }
}

/// Bits per Gaussian and squared error of coefficients and of a codebook, on the rows of a sample that the codebook was
/// not trained on; and whether the codebook has the lower cost. Its entries are shared by `gaussians`.
pub(crate) fn compare(
    rows: &[f32],
    rank: usize,
    gaussians: usize,
    entries: usize,
) -> ([(f64, f64); 2], bool) {
    let (training, test) = vq::halves(rows, rank);
    let book = vq::train(&training, rank, entries.min(training.len() / rank / 4).max(1));
    let (indices, error) = vq::assign(&book, &test, rank);
    let tested = (test.len() / rank).max(1) as f64;
    let carried = vq::bits_of(&book, rank) / gaussians.max(1) as f64;
    let by_vq = (entropy_of(&indices) / tested + carried, error / tested);
    let by_coefficients = coefficient_cost(&test, rank);
    let cost = |(bits, error): (f64, f64)| error + BIT * bits;
    ([by_coefficients, by_vq], cost(by_vq) < cost(by_coefficients))
}

/// The components of every `stride`-th Gaussian in its own steps, one after the other.
#[expect(clippy::indexing_slicing, reason = "rows are those of the planes")]
fn sampled_rows(components: &[Vec<f32>], exponent: impl Fn(usize) -> u8 + Sync, stride: usize) -> Vec<f32> {
    let count = components.first().map_or(0, Vec::len);
    let mut sampled = vec![0.0; count.div_ceil(stride) * components.len()];
    sampled.par_chunks_exact_mut(components.len().max(1)).with_min_len(AT_ONCE).enumerate().for_each(
        |(number, values)| {
            let row = number * stride;
            let step = step(exponent(row)) as f32;
            values.iter_mut().zip(components).for_each(|(value, plane)| *value = plane[row] / step);
        },
    );
    sampled
}

/// What principal components save against coefficients as they are, on some of the Gaussians.
pub(crate) fn worth_of_transform(
    components: &[Vec<f32>],
    planes: &[&[f32]],
    exponent: impl Fn(usize) -> u8 + Sync,
    step: f32,
) -> Saving {
    let stride = (components.first().map_or(0, Vec::len) / TRIAL).max(1);
    let some = |plane: &&[f32]| -> Vec<f32> { plane.iter().step_by(stride).copied().collect() };
    let planes: Vec<Vec<f32>> = planes.iter().map(some).collect();
    let planes: Vec<&[f32]> = planes.iter().map(Vec::as_slice).collect();
    let identity = transform(TransformKind::Sh, &Components::identity(planes.len()), step);
    let plain = self::components(&identity, &planes, step);
    let [own, other] = [
        (sampled_rows(components, &exponent, stride), components.len()),
        (sampled_rows(&plain, |row| exponent(row * stride), 1), plain.len()),
    ]
    .map(|(rows, rank)| coefficient_cost(&rows, rank));
    Saving::between(Tool::ShTransform, own, other)
}

/// Bits and squared error per Gaussian of rounding every component.
fn coefficient_cost(rows: &[f32], rank: usize) -> (f64, f64) {
    let gaussians = (rows.len() / rank).max(1) as f64;
    let mut bits = 0.0;
    let mut error = 0.0;
    for component in 0..rank {
        let values = rows.iter().skip(component).step_by(rank);
        let rounded: Vec<i32> = values.clone().map(|&value| nearest_integer(value)).collect();
        bits += entropy_of(&rounded);
        error += values
            .zip(&rounded)
            .map(|(&v, &r)| f64::from(v - r as f32) * f64::from(v - r as f32))
            .sum::<f64>();
    }
    (bits / gaussians, error / gaussians)
}
