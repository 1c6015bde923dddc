//! SS-TR-003 to SS-TR-008 for all Gaussians of a batch at once.
//!
//! Activations and weights have 8 bits. Two of them, of neighbouring rows, share an `i32` of each lane as 16-bit
//! halves (`packed`): machines multiply such pairs and add both products in one instruction. No sum overflows (7.12),
//! so the order of its terms means nothing.
//!
//! The rows of a batch have the widths of the header of its network,
//! so that what is taken in place of an element that is not there never is.

use super::{Batch, INPUTS_MAX, LANES, OUTPUTS_MAX, RANKS, act, round};
use products::{Portable, Products};
use pulp::{Simd, WithSimd};

mod attention;
mod columns;
mod finish;
mod matrix;
mod prepared;
mod products;

pub(crate) use columns::Columns;
pub use prepared::LaneNetwork;

/// A value, or a pair of values, of each Gaussian of a batch.
pub(crate) type Lane = [i32; LANES];

const ZERO: Lane = [0; LANES];

/// Widths of an embedding, of the geometry network and of the feed-forward block, at most.
const WIDTH: usize = 64;
const GEOMETRY: usize = 32;
const FEED_FORWARD: usize = 128;

/// Pairs of inputs of an embedding, at most.
const INPUT_PAIRS: usize = INPUTS_MAX.div_ceil(2) + GEOMETRY / 2;

/// Two values in an `i32`.
#[inline(always)]
pub(crate) fn packed(low: i32, high: i32) -> i32 {
    (low & 0xFFFF) | high.wrapping_shl(16)
}

#[inline(always)]
fn low(pair: i32) -> i32 {
    pair.wrapping_shl(16).wrapping_shr(16)
}

#[inline(always)]
fn high(pair: i32) -> i32 {
    pair.wrapping_shr(16)
}

#[inline(always)]
fn clamp(x: i32) -> i32 {
    x.clamp(-127, 127)
}

/// Each value of two lanes goes through `each`, then they are packed.
#[inline(always)]
fn pair(low: &Lane, high: &Lane, each: impl Fn(i32) -> i32) -> Lane {
    let mut out = ZERO;
    for (out, (&low, &high)) in out.iter_mut().zip(low.iter().zip(high)) {
        *out = packed(each(low), each(high));
    }
    out
}

/// Bytes of each lane, row by row, in pairs.
#[inline(always)]
fn packed_bytes(rows: &[[i8; LANES]], out: &mut [Lane]) {
    for (out, rows) in out.iter_mut().zip(rows.chunks(2)) {
        if let [first, rest @ ..] = rows {
            let second = rest.first().unwrap_or(&[0; LANES]);
            *out = pair(&first.map(i32::from), &second.map(i32::from), |value| value);
        }
    }
}

/// Sums two by two, each through `each`.
#[inline(always)]
fn pairs(sums: &[Lane], out: &mut [Lane], each: impl Fn(i32) -> i32 + Copy) {
    for (out, sums) in out.iter_mut().zip(sums.chunks(2)) {
        if let [first, rest @ ..] = sums {
            *out = pair(first, rest.first().unwrap_or(&ZERO), each);
        }
    }
}

#[inline(always)]
fn add(sums: &mut Lane, terms: &Lane) {
    sums.iter_mut().zip(terms).for_each(|(sum, &term)| *sum = sum.wrapping_add(term));
}

/// Whose instructions a network runs with. The outputs are the same.
#[derive(Debug, Clone, Copy)]
pub enum Machine {
    /// Any.
    Portable,
    /// One with SSE2, as every x86-64 is.
    #[cfg(target_arch = "x86_64")]
    Sse2(pulp::core_arch::x86::Sse2),
    /// One with AVX2.
    #[cfg(target_arch = "x86_64")]
    Avx2(pulp::x86::V3),
}

impl Machine {
    /// Those that this machine can be, the fastest last.
    pub fn all() -> Vec<Self> {
        #[cfg(all(target_arch = "x86_64", not(feature = "portable")))]
        let own =
            [pulp::core_arch::x86::Sse2::try_new().map(Self::Sse2), pulp::x86::V3::try_new().map(Self::Avx2)];
        #[cfg(not(all(target_arch = "x86_64", not(feature = "portable"))))]
        let own = [None; 2];
        core::iter::once(Self::Portable).chain(own.into_iter().flatten()).collect()
    }
}

impl LaneNetwork {
    /// The outputs for every Gaussian of a batch, in step/64: row k is output k.
    pub fn outputs(&self, batch: &Batch) -> [[i32; LANES]; OUTPUTS_MAX] {
        self.outputs_on(self.machine, batch)
    }

    /// The same with the instructions of a machine.
    pub fn outputs_on(&self, machine: Machine, batch: &Batch) -> [[i32; LANES]; OUTPUTS_MAX] {
        match machine {
            Machine::Portable => OneBatch { network: self, batch, by: Portable }.outputs(),
            #[cfg(target_arch = "x86_64")]
            Machine::Sse2(sse2) => OneBatch { network: self, batch, by: products::Sse2(sse2) }.outputs(),
            #[cfg(target_arch = "x86_64")]
            Machine::Avx2(v3) => {
                Simd::vectorize(v3, OneBatch { network: self, batch, by: products::Avx2(v3) })
            }
        }
    }
}

struct OneBatch<'b, P> {
    network: &'b LaneNetwork,
    batch: &'b Batch,
    by: P,
}

/// Room for the sums of a layer.
type Sums = [Lane; FEED_FORWARD];

impl<P: Products> WithSimd for OneBatch<'_, P> {
    type Output = [[i32; LANES]; OUTPUTS_MAX];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        self.outputs()
    }
}

impl<P: Products> OneBatch<'_, P> {
    #[inline(always)]
    fn outputs(&self) -> [[i32; LANES]; OUTPUTS_MAX] {
        let header = &self.network.header;
        let mut sums = [ZERO; FEED_FORWARD];
        let h = self.embeddings(&mut sums);
        let steps = header.width() / 2;
        let mut pool = [ZERO; WIDTH / 2];
        let pool = pool.get_mut(..steps).unwrap_or_default();
        if header.full_attention() {
            let mut rows = h.clone();
            for (m, row) in rows.chunks_exact_mut(steps).enumerate() {
                self.attend(row, Some(m), &h, &mut sums);
                self.finish(row, &mut sums);
            }
            self.mean(&rows, pool);
        } else {
            self.mean(&h, pool);
            for (x, &[first, second]) in pool.iter_mut().zip(&self.network.query) {
                for x in x {
                    *x = packed(clamp(low(*x).wrapping_add(first)), clamp(high(*x).wrapping_add(second)));
                }
            }
            self.attend(pool, None, &h, &mut sums);
            self.finish(pool, &mut sums);
        }
        self.network.head.multiply(self.by, pool, &mut sums);
        let (shift, unit) = (self.shift(7), header.output_shift.into());
        let mut outputs = [[0; LANES]; OUTPUTS_MAX];
        for (outputs, sums) in outputs.iter_mut().zip(sums).take(header.outputs()) {
            *outputs = sums.map(|sum| round(sum, shift).clamp(-1023, 1023).wrapping_shl(unit));
        }
        outputs
    }

    #[inline(always)]
    fn shift(&self, index: usize) -> u32 {
        self.network.header.layer_shift.get(index).copied().unwrap_or(1).into()
    }

    /// SS-TR-003: the embeddings of all neighbours, one after the other, in pairs.
    #[inline(always)]
    fn embeddings(&self, sums: &mut Sums) -> Vec<Lane> {
        let (network, batch) = (self.network, self.batch);
        let steps = network.header.width() / 2;
        let mut h = vec![ZERO; steps.wrapping_mul(batch.neighbours())];
        let mut input = [ZERO; INPUT_PAIRS];
        let inputs = network.header.inputs().div_ceil(2);
        let geometry = usize::from(network.header.geometry_width);
        let shift = self.shift(0);
        for (rank, row) in h.chunks_exact_mut(steps).enumerate() {
            let (token, after) = input.split_at_mut_checked(inputs).unwrap_or_default();
            packed_bytes(batch.token(rank), token);
            if geometry > 0 {
                let mut near = [ZERO; 2];
                packed_bytes(batch.near(rank), &mut near);
                network.geometry.multiply(self.by, &near, sums);
                pairs(sums.get(..geometry).unwrap_or_default(), after, |sum| round(sum, shift).clamp(0, 127));
            }
            let ranks = network.ranks.get(rank).or(network.ranks.last()).map_or(&[][..], Vec::as_slice);
            network.embedding.multiply_from(self.by, ranks, &input, sums);
            let shift = self.shift(1);
            pairs(sums, row, |sum| act(sum, shift));
        }
        h
    }

    /// The mean of rows, halves up.
    #[inline(always)]
    fn mean(&self, rows: &[Lane], out: &mut [Lane]) {
        let count = u32::try_from(self.batch.neighbours().clamp(1, RANKS)).unwrap_or(1);
        // (2 sum + count) / (2 count) with 128 added, so that it is positive. The numerator is below 2^13, the reciprocal
        // at most 2^17 and less than 1 too large: the quotient is exact.
        let divisor = count.wrapping_mul(2);
        let reciprocal = (1_u32 << 18).div_ceil(divisor);
        let start = divisor.wrapping_mul(128).wrapping_add(count).cast_signed();
        let mean = |sum: i32| {
            let numerator = sum.wrapping_mul(2).wrapping_add(start);
            numerator.wrapping_mul(reciprocal.cast_signed()).wrapping_shr(18).wrapping_sub(128)
        };
        let width = out.len();
        for (index, out) in out.iter_mut().enumerate() {
            let (mut first, mut second) = (ZERO, ZERO);
            for row in rows.iter().skip(index).step_by(width.max(1)) {
                add(&mut first, &row.map(low));
                add(&mut second, &row.map(high));
            }
            *out = pair(&first, &second, mean);
        }
    }

    /// Adds to a row, in pairs, sums that are rounded.
    #[inline(always)]
    fn join(row: &mut [Lane], sums: &[Lane], shift: u32) {
        let mut rounded = [ZERO; WIDTH / 2];
        pairs(sums, &mut rounded, |sum| act(sum, shift));
        for (row, more) in row.iter_mut().zip(&rounded) {
            for (x, &more) in row.iter_mut().zip(more) {
                let both = [low(*x).wrapping_add(low(more)), high(*x).wrapping_add(high(more))];
                *x = packed(clamp(both[0]), clamp(both[1]));
            }
        }
    }
}
