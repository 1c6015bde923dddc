//! How far the outputs of a network are from those wanted.

use super::Sample;
use super::gradient::Gradient;
use super::lane::{Lane, Whole, ZERO};
use super::model::Model;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use splatstream_decoder::transformer::{LANES, LaneNetwork};
use splatstream_format::payload::Network;

/// Samples whose slopes are added in one go. The sums of these are added in their order, so that the number of threads
/// changes nothing.
const RUN: usize = 4;

/// The L1 distances of outputs to those wanted: exact sums, so that nothing depends on their order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Loss {
    /// For each output the sum of the distances, in step/64.
    pub sums: Vec<u64>,
    /// Gaussians.
    pub count: u64,
}

impl Loss {
    /// The loss of nothing.
    pub(super) fn new(outputs: usize) -> Self {
        Self { sums: vec![0; outputs], count: 0 }
    }

    /// What the decoder's network loses on samples.
    pub fn of(network: &Network, samples: &[Sample]) -> Self {
        let lanes = LaneNetwork::new(network);
        let one = |sample: &Sample| {
            let mut loss = Self::new(network.header.outputs());
            loss.compare(sample, lanes.outputs(&sample.batch).iter().map(|row| row.as_slice()));
            loss
        };
        samples.par_iter().map(one).reduce(|| Self::new(network.header.outputs()), Self::sum)
    }

    /// What outputs of 0 lose.
    pub fn of_base(samples: &[Sample], outputs: usize) -> Self {
        let mut loss = Self::new(outputs);
        for sample in samples {
            loss.compare(sample, std::iter::repeat([0; LANES].as_slice()));
        }
        loss
    }

    /// The mean distance of each output, in step/64.
    pub fn means(&self) -> impl Iterator<Item = f64> {
        let count = self.count.max(1) as f64;
        self.sums.iter().map(move |&sum| sum as f64 / count)
    }

    /// The sum of the mean distances, each times its weight.
    pub fn weighted(&self, weights: &[f32]) -> f64 {
        self.means().zip(weights).map(|(mean, &weight)| mean * f64::from(weight)).sum()
    }

    /// Adds another.
    #[expect(clippy::arithmetic_side_effects, reason = "sums of outputs of 32 bits over samples in memory")]
    pub(super) fn add(&mut self, other: &Self) {
        self.sums.iter_mut().zip(&other.sums).for_each(|(sum, other)| *sum += other);
        self.count += other.count;
    }

    fn sum(mut self, other: Self) -> Self {
        self.add(&other);
        self
    }

    /// Adds the distances of the outputs of a sample.
    #[expect(clippy::arithmetic_side_effects, reason = "sums of outputs of 32 bits over samples in memory")]
    fn compare<'o>(&mut self, sample: &Sample, outputs: impl Iterator<Item = &'o [i32]>) {
        for ((sum, wanted), outputs) in self.sums.iter_mut().zip(&sample.wanted).zip(outputs) {
            let apart = wanted.iter().zip(outputs).take(sample.used);
            *sum += apart.map(|(&a, &b)| u64::from(a.abs_diff(b))).sum::<u64>();
        }
        self.count += sample.used as u64;
    }
}

/// The slopes of the mean weighted loss of samples, parameter by parameter, and the loss.
pub(super) fn slopes(model: &Model<'_>, samples: &[&Sample], weights: &[f32]) -> (Vec<f32>, Loss) {
    let count: usize = samples.iter().map(|sample| sample.used).sum();
    let scales: Vec<f32> = weights.iter().map(|weight| weight / count.max(1) as f32).collect();
    let of_run = |samples: &[&Sample]| Arch::new().dispatch(Run { model, samples, scales: &scales });
    let runs: Vec<(Vec<f32>, Loss)> = samples.par_chunks(RUN).map(of_run).collect();
    let mut slopes = vec![0.0; model.layout.len()];
    let mut loss = Loss::new(weights.len());
    for (of_run, lost) in &runs {
        slopes.iter_mut().zip(of_run).for_each(|(sum, slope)| *sum += slope);
        loss.add(lost);
    }
    (slopes, loss)
}

/// Samples whose slopes are to be added.
struct Run<'r> {
    model: &'r Model<'r>,
    samples: &'r [&'r Sample],
    /// The slope of the loss for a distance of each output.
    scales: &'r [f32],
}

impl WithSimd for Run<'_> {
    type Output = (Vec<f32>, Loss);

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let mut gradient = Gradient::new(self.model.layout);
        let mut loss = Loss::new(self.scales.len());
        for sample in self.samples {
            let trace = self.model.forward::<Whole>(&sample.batch);
            let outputs = self.model.outputs(&trace);
            let slope = self.slope(sample, &outputs);
            self.model.backward::<Whole>(&trace, slope, &mut gradient);
            loss.compare(sample, outputs.iter().map(|row| row.as_slice()));
        }
        (gradient.totals(), loss)
    }
}

impl Run<'_> {
    /// The slopes of the loss for the outputs before their shift: their signs.
    #[inline(always)]
    fn slope(&self, sample: &Sample, outputs: &[[i32; LANES]]) -> Vec<Lane> {
        let mut slopes = vec![ZERO; outputs.len()];
        let unit = (1_u32 << self.model.layout.header.output_shift.min(31)) as f32;
        let rows = slopes.iter_mut().zip(self.scales).zip(sample.wanted.iter().zip(outputs));
        for ((slopes, scale), (wanted, outputs)) in rows {
            let apart = outputs.iter().zip(wanted).take(sample.used);
            for (slope, (output, wanted)) in slopes.iter_mut().zip(apart) {
                *slope = f32::from(output.cmp(wanted) as i8) * scale * unit;
            }
        }
        slopes
    }
}
