//! The slopes of all parameters.
#![expect(clippy::arithmetic_side_effects, reason = "products of counts that the trace was made with")]
#![expect(clippy::indexing_slicing, reason = "ranges are those of the layout that the lanes were made with")]

use super::lane::{Lane, ZERO, add_rows, total};
use super::matrix::add_outer;
use super::model::Trace;
use super::parameters::{DIFFERENCES, Layout};
use pulp::Arch;
use splatstream_format::payload::Part;

/// The slopes of all parameters, added over batches lane by lane.
pub(super) struct Gradient<'l> {
    layout: &'l Layout,
    arch: Arch,
    lanes: Vec<Lane>,
    /// Of the relative-position bias, for each axis and difference.
    differences: [Vec<f32>; 3],
}

impl<'l> Gradient<'l> {
    pub(super) fn new(layout: &'l Layout) -> Self {
        let differences = [(); 3].map(|()| vec![0.0; 2 * DIFFERENCES as usize + 1]);
        Self { layout, arch: Arch::new(), lanes: vec![ZERO; layout.len()], differences }
    }

    #[inline(always)]
    pub(super) fn weights(&mut self, part: Part) -> &mut [Lane] {
        &mut self.lanes[self.layout.weights(part)]
    }

    #[inline(always)]
    pub(super) fn bias(&mut self, part: Part) -> &mut [Lane] {
        &mut self.lanes[self.layout.bias(part)]
    }

    /// Adds those of a layer: `slopes` of what it gives for rows `x`.
    #[inline(always)]
    pub(super) fn add(&mut self, part: Part, slopes: &[Lane], x: &[Lane], rows: usize) {
        let (outputs, inputs) = (slopes.len() / rows, x.len() / rows);
        add_outer(self.arch, (slopes, outputs), (x, inputs), &mut self.lanes[self.layout.weights(part)]);
        add_rows(slopes, self.bias(part));
    }

    /// Adds that of the relative-position bias of neighbour `j` for row `m`.
    #[inline(always)]
    pub(super) fn add_position(&mut self, trace: &Trace<'_>, pair: (usize, usize), slope: &Lane) {
        for (axis, sums) in self.differences.iter_mut().enumerate() {
            let indices = trace.apart(pair, axis);
            slope.iter().zip(indices).for_each(|(slope, index)| sums[index] += slope);
        }
    }

    /// The slopes parameter by parameter.
    pub(super) fn totals(&self) -> Vec<f32> {
        let mut out: Vec<f32> = self.lanes.iter().map(total).collect();
        let fourier = &mut out[self.layout.weights(Part::Fourier)];
        for (frequency, weights) in fourier.chunks_exact_mut(6).enumerate() {
            for (pair, sums) in weights.chunks_exact_mut(2).zip(&self.differences) {
                for (sum, sines) in sums.iter().zip(self.layout.sines()) {
                    pair[0] += sum * sines[2 * frequency];
                    pair[1] += sum * sines[2 * frequency + 1];
                }
            }
        }
        out
    }
}
