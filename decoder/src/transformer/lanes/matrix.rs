//! A layer, four rows at a time.
#![expect(
    clippy::float_arithmetic,
    reason = "integers below 2^22 in single precision: every result is exact"
)]

use super::{LANES, Lane};

/// Rows whose sums are kept in registers.
const ROWS: usize = 4;

/// The weights and biases of a layer.
#[derive(Debug, Clone)]
pub(super) struct Matrix {
    columns: usize,
    /// The weights of four rows column by column; then of the next four.
    weights: Vec<[f32; ROWS]>,
    bias: Vec<f32>,
}

impl Matrix {
    /// A matrix of rows of `columns` weights. Rows are added until they are a multiple of four.
    pub(super) fn new(weights: &[i8], bias: &[i16], columns: usize) -> Self {
        let rows: Vec<&[i8]> = weights.chunks_exact(columns.max(1)).collect();
        let column = |block: &[&[i8]], c: usize| {
            let mut out = [0.0; ROWS];
            for (slot, row) in out.iter_mut().zip(block) {
                *slot = row.get(c).copied().map_or(0.0, f32::from);
            }
            out
        };
        let weights = rows.chunks(ROWS).flat_map(|block| (0..columns).map(move |c| column(block, c)));
        Self { columns, weights: weights.collect(), bias: bias.iter().map(|&bias| bias.into()).collect() }
    }

    /// Biases plus the products of all rows; `out` has room for a multiple of four.
    #[inline(always)]
    pub(super) fn multiply(&self, x: &[Lane], out: &mut [Lane]) {
        self.multiply_from(&self.bias, x, out);
    }

    /// As [`Self::multiply`], with other biases.
    #[inline(always)]
    pub(super) fn multiply_from(&self, bias: &[f32], x: &[Lane], out: &mut [Lane]) {
        let mut bias = bias.iter().copied().chain(core::iter::repeat(0.0));
        for (block, out) in self.weights.chunks_exact(self.columns.max(1)).zip(out.chunks_mut(ROWS)) {
            let mut sums = [[0.0; LANES]; ROWS];
            sums.iter_mut().zip(&mut bias).for_each(|(sum, bias)| *sum = [bias; LANES]);
            for (weights, x) in block.iter().zip(x) {
                for (sum, weight) in sums.iter_mut().zip(weights) {
                    sum.iter_mut().zip(x).for_each(|(sum, x)| *sum += weight * x);
                }
            }
            out.iter_mut().zip(sums).for_each(|(out, sum)| *out = sum);
        }
    }
}
