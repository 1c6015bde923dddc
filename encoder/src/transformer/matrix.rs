//! Products of matrices with values of [`LANES`] Gaussians, and their slopes: where nearly all the time goes.
//!
//! Each product is compiled for the vectors of the machine on its own. No product of numbers is fused with a sum:
//! every machine gives the same slopes.
#![expect(
    clippy::arithmetic_side_effects,
    reason = "products of rows, columns and vectors of what is in memory"
)]

use super::lane::Lane;
use pulp::{Arch, Simd, WithSimd};
use splatstream_decoder::transformer::LANES;

/// Rows of a matrix that are worked on at once: their sums stay in registers.
const ROWS: usize = 8;

/// Rows whose slopes are: each has an input of its own.
const OUTER_ROWS: usize = 4;

/// A matrix, eight rows at a time.
#[derive(Debug)]
pub(super) struct Matrix {
    arch: Arch,
    columns: usize,
    /// The weights of eight rows column by column; then of the next eight. Rows that are not there have none.
    weights: Vec<[f32; ROWS]>,
}

impl Matrix {
    /// A matrix of `rows` times `columns` weights.
    pub(super) fn new(arch: Arch, rows: usize, columns: usize, weight: impl Fn(usize, usize) -> f32) -> Self {
        let mut weights = Vec::with_capacity(rows.div_ceil(ROWS) * columns);
        for first in (0..rows).step_by(ROWS) {
            for column in 0..columns {
                let there = |row: usize| if row < rows { weight(row, column) } else { 0.0 };
                weights.push(std::array::from_fn(|row| there(first + row)));
            }
        }
        Self { arch, columns, weights }
    }

    /// Adds the product of row i and `x` to value i.
    #[inline(always)]
    pub(super) fn multiply(&self, x: &[Lane], out: &mut [Lane]) {
        self.arch.dispatch(Product { matrix: self, x, out });
    }
}

struct Product<'p> {
    matrix: &'p Matrix,
    x: &'p [Lane],
    out: &'p mut [Lane],
}

impl WithSimd for Product<'_> {
    type Output = ();

    #[inline(always)]
    #[expect(
        clippy::indexing_slicing,
        reason = "a matrix has rows times columns weights, and lanes are whole vectors"
    )]
    fn with_simd<S: Simd>(self, simd: S) {
        let vectors = LANES / S::F32_LANES;
        let (x, _) = S::as_simd_f32s(self.x.as_flattened());
        let (out, _) = S::as_mut_simd_f32s(self.out.as_flattened_mut());
        let blocks = self.matrix.weights.chunks_exact(self.matrix.columns.max(1));
        for (block, out) in blocks.zip(out.chunks_mut(ROWS * vectors)) {
            for vector in 0..vectors {
                let mut sums = [simd.splat_f32s(0.0); ROWS];
                for (sum, out) in sums.iter_mut().zip(out.chunks_exact(vectors)) {
                    *sum = out[vector];
                }
                for (weights, x) in block.iter().zip(x.chunks_exact(vectors)) {
                    let x = x[vector];
                    for (sum, &weight) in sums.iter_mut().zip(weights) {
                        *sum = simd.add_f32s(*sum, simd.mul_f32s(simd.splat_f32s(weight), x));
                    }
                }
                for (out, sum) in out.chunks_exact_mut(vectors).zip(sums) {
                    out[vector] = sum;
                }
            }
        }
    }
}

/// Adds to weight c of row i of a matrix the sum over t of `slope[t][i] * x[t][c]`: what multiplying the rows of `x`
/// by it leaves of their results' slopes.
#[inline(always)]
pub(super) fn add_outer(
    arch: Arch,
    (slopes, rows): (&[Lane], usize),
    (x, columns): (&[Lane], usize),
    gradient: &mut [Lane],
) {
    if !gradient.is_empty() {
        arch.dispatch(Outer { slopes, rows, x, columns, gradient });
    }
}

struct Outer<'o> {
    slopes: &'o [Lane],
    rows: usize,
    x: &'o [Lane],
    columns: usize,
    gradient: &'o mut [Lane],
}

impl WithSimd for Outer<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let whole = self.rows / OUTER_ROWS * OUTER_ROWS;
        for first in (0..whole).step_by(OUTER_ROWS) {
            self.block::<S, OUTER_ROWS>(simd, first);
        }
        for first in whole..self.rows {
            self.block::<S, 1>(simd, first);
        }
    }
}

impl Outer<'_> {
    /// The weights of `N` rows from `first` on.
    #[inline(always)]
    #[expect(
        clippy::indexing_slicing,
        reason = "a matrix has rows times columns weights, and lanes are whole vectors"
    )]
    fn block<S: Simd, const N: usize>(&mut self, simd: S, first: usize) {
        let vectors = LANES / S::F32_LANES;
        let (slopes, _) = S::as_simd_f32s(self.slopes.as_flattened());
        let (x, _) = S::as_simd_f32s(self.x.as_flattened());
        let (gradient, _) = S::as_mut_simd_f32s(self.gradient.as_flattened_mut());
        let line = self.columns * vectors;
        let gradient = &mut gradient[first * line..(first + N) * line];
        let own = first * vectors..(first + N) * vectors;
        for index in 0..line {
            let vector = index % vectors;
            let mut sums = [simd.splat_f32s(0.0); N];
            for (sum, line) in sums.iter_mut().zip(gradient.chunks_exact(line)) {
                *sum = line[index];
            }
            for (slopes, x) in slopes.chunks_exact(self.rows * vectors).zip(x.chunks_exact(line)) {
                let x = x[index];
                for (sum, slope) in sums.iter_mut().zip(slopes[own.clone()].chunks_exact(vectors)) {
                    *sum = simd.add_f32s(*sum, simd.mul_f32s(slope[vector], x));
                }
            }
            for (line, sum) in gradient.chunks_exact_mut(line).zip(sums) {
                line[index] = sum;
            }
        }
    }
}
