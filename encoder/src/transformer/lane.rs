//! Values of [`LANES`] Gaussians at once.
//!
//! Everything is inlined into the pass that calls it, so that it is compiled for the vectors of the machine. No product
//! is fused with a sum: every machine gives the same slopes.

use splatstream_decoder::transformer::LANES;

/// One value of each Gaussian of a batch.
pub(super) type Lane = [f32; LANES];

pub(super) const ZERO: Lane = [0.0; LANES];

/// Added and taken away again, it leaves no fraction of a number below 2^22.
const WHOLE: f32 = 12_582_912.0;

/// Whether a pass rounds.
pub(super) trait Arithmetic {
    const ROUNDED: bool;
}

/// The integers of 7.17.6, to the last bit.
pub(super) struct Whole;

impl Arithmetic for Whole {
    const ROUNDED: bool = true;
}

/// The function that the slopes are those of.
#[cfg(test)]
pub(super) struct Real;

#[cfg(test)]
impl Arithmetic for Real {
    const ROUNDED: bool = false;
}

/// One part of `2^shift`.
#[inline(always)]
pub(super) fn unit(shift: u8) -> f32 {
    1.0 / (1_u32 << shift.min(31)) as f32
}

/// Round(x, shift) of clause 4.2: half a unit more than an integer is no tie.
#[inline(always)]
pub(super) fn round<A: Arithmetic>(x: &Lane, shift: u8) -> Lane {
    let unit = unit(shift);
    if A::ROUNDED { x.map(|x| ((x + 0.5) * unit + WHOLE) - WHOLE) } else { x.map(|x| x * unit) }
}

/// The mean of `count` rows of which `sum` is the sum, halves up. Clause 7.17.6.
#[inline(always)]
pub(super) fn mean<A: Arithmetic>(sum: &Lane, count: f32) -> Lane {
    let part = 1.0 / (2.0 * count);
    if A::ROUNDED {
        // The numerator is an integer below 2^13: its quotient is off by less than the 1/128 that is left of a half.
        sum.map(|x| ((2.0 * x + count) * part - 0.5 + 1.0 / 128.0 + WHOLE) - WHOLE)
    } else {
        sum.map(|x| 2.0 * x * part)
    }
}

#[inline(always)]
pub(super) fn clamp(x: Lane, low: f32, high: f32) -> Lane {
    x.map(|x| {
        let x = if x > low { x } else { low };
        if x < high { x } else { high }
    })
}

#[inline(always)]
pub(super) fn act<A: Arithmetic>(x: &Lane, shift: u8) -> Lane {
    clamp(round::<A>(x, shift), -127.0, 127.0)
}

/// Replaces a value by what `each` makes of it and of another.
///
/// Both are read before anything is written: so the compiler need not know that they are apart.
#[inline(always)]
pub(super) fn join(a: &mut Lane, b: &Lane, each: impl Fn(f32, f32) -> f32) {
    let (mut x, y) = (*a, *b);
    x.iter_mut().zip(&y).for_each(|(x, y)| *x = each(*x, *y));
    *a = x;
}

/// Adds the product of two values.
#[inline(always)]
pub(super) fn add_product(sum: &mut Lane, a: &Lane, b: &Lane) {
    let (mut x, a, b) = (*sum, *a, *b);
    x.iter_mut().zip(a.iter().zip(&b)).for_each(|(x, (a, b))| *x += a * b);
    *sum = x;
}

/// What is left of a slope where a clamp may have acted on a value: nothing at its ends.
#[inline(always)]
pub(super) fn stop(slope: &mut Lane, value: &Lane, low: f32, high: f32, scale: f32) {
    join(slope, value, |slope, value| if value > low && value < high { slope * scale } else { 0.0 });
}

/// As [`stop`], for the rows of an activation.
#[inline(always)]
pub(super) fn stop_act(slopes: &mut [Lane], values: &[Lane], scale: f32) {
    for (slope, value) in slopes.iter_mut().zip(values) {
        stop(slope, value, -127.0, 127.0, scale);
    }
}

/// The sum of all lanes, in one order.
pub(super) fn total(lane: &Lane) -> f32 {
    let mut sums = *lane;
    let mut half = LANES / 2;
    while half > 0 {
        let (low, high) = sums.split_at_mut(half);
        low.iter_mut().zip(high).for_each(|(low, high)| *low += *high);
        half /= 2;
    }
    sums[0]
}

/// Place `at` of values in rows of `width`.
#[inline(always)]
#[expect(
    clippy::arithmetic_side_effects,
    clippy::indexing_slicing,
    reason = "rows are counted by what they are cut from"
)]
pub(super) fn row(values: &[Lane], width: usize, at: usize) -> &[Lane] {
    &values[at * width..(at + 1) * width]
}

/// As [`row`].
#[inline(always)]
#[expect(
    clippy::arithmetic_side_effects,
    clippy::indexing_slicing,
    reason = "rows are counted by what they are cut from"
)]
pub(super) fn row_mut(values: &mut [Lane], width: usize, at: usize) -> &mut [Lane] {
    &mut values[at * width..(at + 1) * width]
}

/// Adds the rows of slopes to one row.
#[inline(always)]
pub(super) fn add_rows(slopes: &[Lane], sums: &mut [Lane]) {
    for slopes in slopes.chunks_exact(sums.len().max(1)) {
        sums.iter_mut().zip(slopes).for_each(|(sum, slope)| join(sum, slope, |a, b| a + b));
    }
}
