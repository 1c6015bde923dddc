//! The machine of WebAssembly with vectors of 128 bits, of which two make one of eight lanes.

use super::{Machine, WIDE};
use core::arch::wasm32::{
    i16x8_add, i16x8_eq, i16x8_gt, i16x8_narrow_i32x4, i16x8_splat, i32x4_abs, i32x4_add, i32x4_bitmask,
    i32x4_dot_i16x8, i32x4_gt, i32x4_mul, i32x4_shr, i32x4_shuffle, i32x4_sub, i64x2_shuffle, u8x16_add_sat,
    u8x16_splat, u8x16_swizzle, u32x4_extend_high_u16x8, u32x4_extend_low_u16x8, u32x4_shl, u32x4_shr,
    u32x4_splat, v128, v128_and, v128_andnot, v128_any_true, v128_or, v128_xor,
};
use pulp::cast;

/// A machine with vectors of 128 bits.
#[derive(Debug, Clone, Copy)]
pub struct Simd128;

/// For each set of four lanes, as bits, the bytes of the word that each lane takes of a vector of words: as many words come
/// before it as lanes of the set. 255 is no byte.
static OWN_WORD: [[u8; 16]; 16] = own_word();

#[expect(clippy::indexing_slicing, clippy::arithmetic_side_effects, reason = "evaluated when compiled")]
const fn own_word() -> [[u8; 16]; 16] {
    let mut table = [[u8::MAX; 16]; 16];
    let mut set = 0;
    while set < table.len() {
        let (mut lane, mut count) = (0, 0);
        while lane < 4 {
            table[set][4 * lane] = 2 * count;
            table[set][4 * lane + 1] = 2 * count + 1;
            if set >> lane & 1 == 1 {
                count += 1;
            }
            lane += 1;
        }
        set += 1;
    }
    table
}

/// What a function makes of both halves.
#[inline(always)]
fn halves(a: [v128; 2], b: [v128; 2], make: impl Fn(v128, v128) -> v128) -> [v128; 2] {
    let ([a, c], [b, d]) = (a, b);
    [make(a, b), make(c, d)]
}

/// The columns of four rows.
#[inline(always)]
fn transpose_four([a, b, c, d]: [v128; 4]) -> [v128; 4] {
    let (low_ab, high_ab) = (i32x4_shuffle::<0, 4, 1, 5>(a, b), i32x4_shuffle::<2, 6, 3, 7>(a, b));
    let (low_cd, high_cd) = (i32x4_shuffle::<0, 4, 1, 5>(c, d), i32x4_shuffle::<2, 6, 3, 7>(c, d));
    [
        i64x2_shuffle::<0, 2>(low_ab, low_cd),
        i64x2_shuffle::<1, 3>(low_ab, low_cd),
        i64x2_shuffle::<0, 2>(high_ab, high_cd),
        i64x2_shuffle::<1, 3>(high_ab, high_cd),
    ]
}

/// Gives four lanes with a mask their next state, with words after the first `skipped`; also how many were taken.
#[inline(always)]
fn advance_four(state: v128, next: v128, mask: v128, words: v128, skipped: u8) -> (v128, u8) {
    // Halves that are 0, of which the high one counts: engines have no comparison of unsigned values in one instruction.
    let low = i32x4_shr(i16x8_eq(next, u32x4_splat(0)), 16);
    let takes = v128_and(low, mask);
    let set = i32x4_bitmask(takes);
    let own = OWN_WORD.get(usize::from(set & 15)).copied().unwrap_or_default();
    let places = u8x16_add_sat(cast(own), u8x16_splat(skipped.wrapping_mul(2)));
    let filled = v128_or(u32x4_shl(next, 16), u8x16_swizzle(words, places));
    let taken = u8::try_from(set.count_ones()).unwrap_or(0);
    (select(mask, select(takes, filled, next), state), taken)
}

/// One of two by a mask. Compilers see through this where the mask is constant, and through the instruction for it not.
#[inline(always)]
fn select(mask: v128, set: v128, clear: v128) -> v128 {
    v128_or(v128_and(set, mask), v128_andnot(clear, mask))
}

impl Machine for Simd128 {
    type V = [v128; 2];

    #[inline(always)]
    fn load(self, values: [u32; WIDE]) -> [v128; 2] {
        cast(values)
    }

    #[inline(always)]
    fn store(self, vector: [v128; 2]) -> [u32; WIDE] {
        cast(vector)
    }

    #[inline(always)]
    fn splat(self, value: u32) -> [v128; 2] {
        [u32x4_splat(value); 2]
    }

    #[inline(always)]
    fn add(self, a: [v128; 2], b: [v128; 2]) -> [v128; 2] {
        halves(a, b, |a, b| i32x4_add(a, b))
    }

    #[inline(always)]
    fn sub(self, a: [v128; 2], b: [v128; 2]) -> [v128; 2] {
        halves(a, b, |a, b| i32x4_sub(a, b))
    }

    #[inline(always)]
    fn mul(self, a: [v128; 2], b: [v128; 2]) -> [v128; 2] {
        halves(a, b, |a, b| i32x4_mul(a, b))
    }

    #[inline(always)]
    fn dot(self, a: [v128; 2], b: [v128; 2]) -> [v128; 2] {
        halves(a, b, |a, b| i32x4_dot_i16x8(a, b))
    }

    #[inline(always)]
    fn and(self, a: [v128; 2], b: [v128; 2]) -> [v128; 2] {
        halves(a, b, |a, b| v128_and(a, b))
    }

    #[inline(always)]
    fn or(self, a: [v128; 2], b: [v128; 2]) -> [v128; 2] {
        halves(a, b, |a, b| v128_or(a, b))
    }

    #[inline(always)]
    fn xor(self, a: [v128; 2], b: [v128; 2]) -> [v128; 2] {
        halves(a, b, |a, b| v128_xor(a, b))
    }

    #[inline(always)]
    fn shr<const BITS: i32>(self, a: [v128; 2]) -> [v128; 2] {
        a.map(|half| u32x4_shr(half, BITS.cast_unsigned()))
    }

    #[inline(always)]
    fn greater(self, a: [v128; 2], b: [v128; 2]) -> [v128; 2] {
        halves(a, b, |a, b| i32x4_gt(a, b))
    }

    #[inline(always)]
    fn magnitude(self, a: [v128; 2]) -> [v128; 2] {
        a.map(|half| i32x4_abs(half))
    }

    #[inline(always)]
    fn reached(self, values: [[v128; 2]; 4], thresholds: &[i16]) -> [[v128; 2]; 4] {
        // Values that 16 bits do not hold become the nearest that they hold: the comparison comes to the same.
        let [[a, b], [c, d], [e, f], [g, h]] = values;
        let [a, b] = [i16x8_narrow_i32x4(a, b), i16x8_narrow_i32x4(c, d)];
        let [c, d] = [i16x8_narrow_i32x4(e, f), i16x8_narrow_i32x4(g, h)];
        let all = i16x8_splat(i16::try_from(thresholds.len()).unwrap_or(0));
        let (mut of_a, mut of_b, mut of_c, mut of_d) = (all, all, all, all);
        for &threshold in thresholds {
            let threshold = i16x8_splat(threshold);
            of_a = i16x8_add(of_a, i16x8_gt(threshold, a));
            of_b = i16x8_add(of_b, i16x8_gt(threshold, b));
            of_c = i16x8_add(of_c, i16x8_gt(threshold, c));
            of_d = i16x8_add(of_d, i16x8_gt(threshold, d));
        }
        [of_a, of_b, of_c, of_d].map(|of| [u32x4_extend_low_u16x8(of), u32x4_extend_high_u16x8(of)])
    }

    #[inline(always)]
    fn any(self, [low, high]: [v128; 2]) -> bool {
        v128_any_true(v128_or(low, high))
    }

    #[inline(always)]
    fn transpose(self, rows: [[v128; 2]; WIDE]) -> [[v128; 2]; WIDE] {
        let [[a, i], [b, j], [c, k], [d, l], [e, m], [f, n], [g, o], [h, p]] = rows;
        // The quarters: columns of the upper four rows and of the lower four, each of the left and the right half.
        let ([a, b, c, d], [e, f, g, h]) = (transpose_four([a, b, c, d]), transpose_four([e, f, g, h]));
        let ([i, j, k, l], [m, n, o, p]) = (transpose_four([i, j, k, l]), transpose_four([m, n, o, p]));
        [[a, e], [b, f], [c, g], [d, h], [i, m], [j, n], [k, o], [l, p]]
    }

    #[inline(always)]
    fn advance(
        self,
        states: [v128; 2],
        next: [v128; 2],
        mask: [v128; 2],
        words: &[u16; WIDE],
    ) -> ([v128; 2], usize) {
        let words = cast(*words);
        let ([state, high_state], [next, high_next], [mask, high_mask]) = (states, next, mask);
        let (low, first) = advance_four(state, next, mask, words, 0);
        let (high, second) = advance_four(high_state, high_next, high_mask, words, first);
        ([low, high], usize::from(first.wrapping_add(second)))
    }
}
