//! The nearest candidates with the vectors of WebAssembly.
//!
//! There the lesser of two f64 is one instruction, and that of two integers of 64 bits takes many. A key, which is below
//! 2^50, is exact as an f64.

use super::{Around, CANDIDATES, Nearest};
use crate::vector::halves;
use core::arch::wasm32::{
    f64x2, f64x2_add, f64x2_le, f64x2_mul, f64x2_pmax, f64x2_pmin, f64x2_splat, i32x4_splat, i32x4_sub,
    i64x2_add, i64x2_extend_high_i32x4, i64x2_extend_low_i32x4, i64x2_extract_lane, i64x2_shuffle,
    i64x2_splat, i64x2_sub, u32x4, u32x4_le, u32x4_splat, v128, v128_and, v128_bitselect,
};
use pulp::cast;

/// The key of a candidate that is not known.
const UNKNOWN: f64 = f64::INFINITY;
/// 2^52: a key plus this has the key in its low 52 bits.
const TO_BITS: f64 = 4_503_599_627_370_496.0;

/// The smallest keys, and whether a candidate that has none of them is as near as one that has.
///
/// In each of two columns the smallest keys are kept in order. The lesser ones of each in one column and that at the same
/// place from behind in the other are the smallest of both; they rise and fall, and two steps put them in order.
#[inline(always)]
pub(super) fn nearest(around: &Around<'_>) -> Nearest {
    let keys = keys(around);
    let mut columns = [f64x2_splat(UNKNOWN); 4];
    for &pair in keys.as_flattened() {
        let mut larger = pair;
        for slot in &mut columns {
            (*slot, larger) = (f64x2_pmin(*slot, larger), f64x2_pmax(*slot, larger));
        }
    }
    let [a, b, c, d] = columns;
    let lesser = |one, other| f64x2_pmin(one, i64x2_shuffle::<1, 0>(other, other));
    let [a, b, c, d] = [lesser(a, d), lesser(b, c), lesser(c, b), lesser(d, a)];
    let (a, c, b, d) = (f64x2_pmin(a, c), f64x2_pmax(a, c), f64x2_pmin(b, d), f64x2_pmax(b, d));
    let smallest = [f64x2_pmin(a, b), f64x2_pmax(a, b), f64x2_pmin(c, d), f64x2_pmax(c, d)].map(integer);
    let [.., farthest] = smallest;
    Nearest { keys: smallest, is_tied: farthest != u64::MAX && within(&keys, farthest) > 4 }
}

/// The keys of all candidates, two to a vector.
#[inline(always)]
fn keys(around: &Around<'_>) -> [[v128; 2]; CANDIDATES.div_ceil(4)] {
    let [x, y, z] = around.own.map(|part| u32x4_splat(part));
    let [xs, ys, zs] = around.position.map(|plane| plane.as_chunks::<4>().0);
    let known = around.known_from.as_chunks::<4>().0;
    let (row, mut numbers) = (u32x4_splat(around.row), f64x2(0.0, 1.0));
    let mut is_candidate = i32x4_splat(-1);
    let mut keys = [[f64x2_splat(UNKNOWN); 2]; CANDIDATES.div_ceil(4)];
    let points = xs.iter().zip(ys).zip(zs).zip(known);
    for ((pairs, left), (((&xs, &ys), &zs), &known)) in keys.iter_mut().zip(left()).zip(points) {
        let [x, y, z] = [(xs, x), (ys, y), (zs, z)].map(|(other, own)| halves(i32x4_sub(cast(other), own)));
        if left < 4 {
            is_candidate = u32x4(u32::MAX, 0, 0, 0);
        }
        let is_known = v128_and(u32x4_le(cast(known), row), is_candidate);
        let masks = [i64x2_extend_low_i32x4(is_known), i64x2_extend_high_i32x4(is_known)];
        for (half, (slot, mask)) in pairs.iter_mut().zip(masks).enumerate() {
            let square = |[low, high]: [v128; 2]| {
                let side = if half == 0 { low } else { high };
                f64x2_mul(side, side)
            };
            let distance = f64x2_add(f64x2_add(square(x), square(y)), square(z));
            let key = f64x2_add(f64x2_mul(distance, f64x2_splat(64.0)), numbers);
            *slot = v128_bitselect(key, f64x2_splat(UNKNOWN), mask);
            numbers = f64x2_add(numbers, f64x2_splat(2.0));
        }
    }
    keys
}

/// How many candidates are left at each group of four.
#[inline(always)]
fn left() -> impl Iterator<Item = usize> {
    (0..=CANDIDATES).rev().step_by(4)
}

/// How many keys are of no greater distance than a key.
#[inline(always)]
fn within(keys: &[[v128; 2]], key: u64) -> i64 {
    let largest = f64x2_splat((key | 63) as f64);
    let mut counts = i64x2_splat(0);
    for &pair in keys.as_flattened() {
        counts = i64x2_sub(counts, f64x2_le(pair, largest));
    }
    i64x2_extract_lane::<0>(i64x2_add(counts, i64x2_shuffle::<1, 0>(counts, counts)))
}

/// The first of two keys as an integer, all ones if it is not known.
#[inline(always)]
fn integer(key: v128) -> u64 {
    let bits = i64x2_extract_lane::<0>(f64x2_add(key, f64x2_splat(TO_BITS))).cast_unsigned();
    if bits == UNKNOWN.to_bits() { u64::MAX } else { bits & ((1 << 52) - 1) }
}
