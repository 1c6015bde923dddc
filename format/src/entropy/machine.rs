//! What the entropy decoder asks of a machine: vectors of eight lanes.
//!
//! Every operation is one of integers that every machine has, and [`Portable`] spells it out. Others name their
//! instructions, because compilers do not find all of them in loops: above all how lanes take words from a stream one
//! after the other. How many lanes before it take one tells a lane which word is its own; a table of all 256 answers,
//! and an instruction that permutes words by it, do that for eight lanes at once.

use super::STATE_LOW;

/// Lanes of a vector.
pub const WIDE: usize = 8;

/// Eight integers of 32 bits, and a way to calculate with them; all ways give the same.
pub trait Machine: Copy {
    /// A vector.
    type V: Copy;

    /// Eight values.
    fn load(self, values: [u32; WIDE]) -> Self::V;
    /// The values of a vector.
    fn store(self, vector: Self::V) -> [u32; WIDE];
    /// The sum, modulo 2^32.
    fn add(self, a: Self::V, b: Self::V) -> Self::V;
    /// The difference, modulo 2^32.
    fn sub(self, a: Self::V, b: Self::V) -> Self::V;
    /// The product, modulo 2^32.
    fn mul(self, a: Self::V, b: Self::V) -> Self::V;
    /// The sum of the products of the low halves and of the high halves, which are signed values of 16 bits.
    fn dot(self, a: Self::V, b: Self::V) -> Self::V;
    /// The bits that both have.
    fn and(self, a: Self::V, b: Self::V) -> Self::V;
    /// The bits that one of two or both have.
    fn or(self, a: Self::V, b: Self::V) -> Self::V;
    /// The bits that one of two has.
    fn xor(self, a: Self::V, b: Self::V) -> Self::V;
    /// The values shifted right by so many bits, zeros at the top.
    fn shr<const BITS: i32>(self, a: Self::V) -> Self::V;
    /// All bits where a is the greater one, as signed values; none elsewhere.
    fn greater(self, a: Self::V, b: Self::V) -> Self::V;
    /// The magnitudes of signed values.
    fn magnitude(self, a: Self::V) -> Self::V;
    /// For each signed value, how many of some thresholds above -32768, of which there are fewer than 2^15, it reaches.
    fn reached(self, values: [Self::V; 4], thresholds: &[i16]) -> [Self::V; 4];
    /// Whether any bit is set.
    fn any(self, a: Self::V) -> bool;
    /// Row i of the result has value i of every row.
    fn transpose(self, rows: [Self::V; WIDE]) -> [Self::V; WIDE];

    /// Gives lanes with a mask their next state, and others the one they had. Next states below their bound take the next
    /// word each, in the order of lanes. Also gives how many words were taken.
    fn advance(self, states: Self::V, next: Self::V, mask: Self::V, words: &[u16; WIDE]) -> (Self::V, usize);

    /// The same value in all lanes.
    #[inline(always)]
    fn splat(self, value: u32) -> Self::V {
        self.load([value; WIDE])
    }
}

/// Any machine.
#[derive(Debug, Clone, Copy)]
pub struct Portable;

/// What a function makes of the values of two vectors.
#[inline(always)]
fn each(a: [u32; WIDE], b: [u32; WIDE], make: impl Fn(u32, u32) -> u32) -> [u32; WIDE] {
    let mut result = a;
    result.iter_mut().zip(b).for_each(|(slot, b)| *slot = make(*slot, b));
    result
}

impl Machine for Portable {
    type V = [u32; WIDE];

    #[inline(always)]
    fn load(self, values: [u32; WIDE]) -> Self::V {
        values
    }

    #[inline(always)]
    fn store(self, vector: Self::V) -> [u32; WIDE] {
        vector
    }

    #[inline(always)]
    fn add(self, a: Self::V, b: Self::V) -> Self::V {
        each(a, b, u32::wrapping_add)
    }

    #[inline(always)]
    fn sub(self, a: Self::V, b: Self::V) -> Self::V {
        each(a, b, u32::wrapping_sub)
    }

    #[inline(always)]
    fn mul(self, a: Self::V, b: Self::V) -> Self::V {
        each(a, b, u32::wrapping_mul)
    }

    #[inline(always)]
    fn dot(self, a: Self::V, b: Self::V) -> Self::V {
        let half = |value: u32| (value.wrapping_shl(16).cast_signed() >> 16, value.cast_signed() >> 16);
        each(a, b, |a, b| {
            let ((low_a, high_a), (low_b, high_b)) = (half(a), half(b));
            low_a.wrapping_mul(low_b).wrapping_add(high_a.wrapping_mul(high_b)).cast_unsigned()
        })
    }

    #[inline(always)]
    fn and(self, a: Self::V, b: Self::V) -> Self::V {
        each(a, b, |a, b| a & b)
    }

    #[inline(always)]
    fn or(self, a: Self::V, b: Self::V) -> Self::V {
        each(a, b, |a, b| a | b)
    }

    #[inline(always)]
    fn xor(self, a: Self::V, b: Self::V) -> Self::V {
        each(a, b, |a, b| a ^ b)
    }

    #[inline(always)]
    fn shr<const BITS: i32>(self, a: Self::V) -> Self::V {
        a.map(|value| value.wrapping_shr(BITS.cast_unsigned()))
    }

    #[inline(always)]
    fn greater(self, a: Self::V, b: Self::V) -> Self::V {
        each(a, b, |a, b| u32::from(a.cast_signed() > b.cast_signed()).wrapping_neg())
    }

    #[inline(always)]
    fn magnitude(self, a: Self::V) -> Self::V {
        a.map(|value| value.cast_signed().unsigned_abs())
    }

    #[inline(always)]
    fn reached(self, values: [Self::V; 4], thresholds: &[i16]) -> [Self::V; 4] {
        let mut counts = [[0; WIDE]; 4];
        for (counts, values) in counts.iter_mut().zip(values) {
            for &threshold in thresholds {
                *counts = each(*counts, values, |count, value| {
                    count.wrapping_add(u32::from(i32::from(threshold) <= value.cast_signed()))
                });
            }
        }
        counts
    }

    #[inline(always)]
    fn any(self, a: Self::V) -> bool {
        a.iter().fold(0, |any, &value| any | value) != 0
    }

    #[inline(always)]
    fn transpose(self, rows: [Self::V; WIDE]) -> [Self::V; WIDE] {
        let mut columns = [[0; WIDE]; WIDE];
        for (row, values) in rows.iter().enumerate() {
            for (column, &value) in columns.iter_mut().zip(values) {
                column.get_mut(row).into_iter().for_each(|slot| *slot = value);
            }
        }
        columns
    }

    #[inline(always)]
    fn advance(self, states: Self::V, next: Self::V, mask: Self::V, words: &[u16; WIDE]) -> (Self::V, usize) {
        let (mut states, mut taken) = (states, 0_usize);
        for ((state, next), mask) in states.iter_mut().zip(next).zip(mask) {
            // Choices of values, not branches, for no processor guesses them.
            let word = words.get(taken & 7).copied().unwrap_or(0);
            let low = (next < STATE_LOW) & (mask != 0);
            let filled = if low { next.wrapping_shl(16) | u32::from(word) } else { next };
            *state = if mask == 0 { *state } else { filled };
            taken = taken.wrapping_add(usize::from(low));
        }
        (states, taken)
    }
}

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
mod simd128;
#[cfg(test)]
mod tests;

#[cfg(target_arch = "x86_64")]
pub use avx2::Avx2;
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
pub use simd128::Simd128;
