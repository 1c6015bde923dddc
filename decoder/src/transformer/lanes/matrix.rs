//! A layer, four rows at a time, its columns in pairs.
//!
//! Rows are padded with 0 to fours and to pairs.

use super::products::Products;
use super::{Lane, packed};

/// Rows whose sums are kept in registers.
pub(super) const ROWS: usize = 4;

/// The weights and biases of a layer.
#[derive(Debug, Clone)]
pub(super) struct Matrix {
    /// Pairs of columns.
    pairs: usize,
    /// The weights of four rows pair by pair; then of the next four.
    weights: Vec<[i32; ROWS]>,
    bias: Vec<[i32; ROWS]>,
}

impl Matrix {
    /// A matrix of rows of `columns` weights. Columns are added until they are pairs, rows until they are a multiple of
    /// four; they are 0.
    pub(super) fn new(weights: &[i8], bias: &[i16], columns: usize) -> Self {
        let rows: Vec<&[i8]> = weights.chunks_exact(columns.max(1)).collect();
        let pairs = columns.div_ceil(2);
        let pair = |block: &[&[i8]], index: usize| {
            let mut out = [0; ROWS];
            for (slot, row) in out.iter_mut().zip(block) {
                let mut both = row.iter().skip(index.wrapping_mul(2)).copied().map(i32::from);
                *slot = packed(both.next().unwrap_or(0), both.next().unwrap_or(0));
            }
            out
        };
        let weights = rows.chunks(ROWS).flat_map(|block| (0..pairs).map(move |index| pair(block, index)));
        Self { pairs, weights: weights.collect(), bias: blocks(bias) }
    }

    /// Biases plus the products of all rows with pairs of values; `out` has room for a multiple of four.
    #[inline(always)]
    pub(super) fn multiply<P: Products>(&self, by: P, x: &[Lane], out: &mut [Lane]) {
        self.multiply_from(by, &self.bias, x, out);
    }

    /// As [`Self::multiply`], with other biases.
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    #[cfg_attr(target_arch = "wasm32", inline(never))]
    pub(super) fn multiply_from<P: Products>(
        &self,
        by: P,
        bias: &[[i32; ROWS]],
        x: &[Lane],
        out: &mut [Lane],
    ) {
        for part in 0..P::PARTS {
            let mut bias = bias.iter();
            for (block, out) in self.weights.chunks_exact(self.pairs.max(1)).zip(out.chunks_mut(ROWS)) {
                let mut sums = bias.next().copied().unwrap_or_default().map(|bias| by.splat(bias));
                for (weights, x) in block.iter().zip(x) {
                    let x = by.load(x, part);
                    for (sum, &weight) in sums.iter_mut().zip(weights) {
                        *sum = by.add(*sum, x, by.splat(weight));
                    }
                }
                out.iter_mut().zip(sums).for_each(|(out, sum)| by.store(sum, out, part));
            }
        }
    }
}

/// Biases by four rows.
pub(super) fn blocks(bias: &[i16]) -> Vec<[i32; ROWS]> {
    let block = |rows: &[i16]| {
        let mut out = [0; ROWS];
        out.iter_mut().zip(rows).for_each(|(slot, &bias)| *slot = bias.into());
        out
    };
    bias.chunks(ROWS).map(block).collect()
}
