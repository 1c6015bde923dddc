//! What the entropy decoder asks of a machine: vectors of eight lanes.
//!
//! Every operation is one of integers that every machine has, and [`Portable`] spells it out. [`Avx2`] names the
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
pub use x86::Avx2;

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::{Machine, WIDE};
    use core::arch::x86_64::{__m128i, __m256i};
    use pulp::cast;
    use pulp::core_arch::x86::Avx2 as Instructions;
    use pulp::x86::V3;

    /// A machine with AVX2.
    #[derive(Debug, Clone, Copy)]
    pub struct Avx2(pub V3);

    /// For each set of lanes, as bits, how many lanes of the set come before each lane.
    static BEFORE: [[u8; WIDE]; 256] = before();

    #[expect(clippy::indexing_slicing, clippy::arithmetic_side_effects, reason = "evaluated when compiled")]
    const fn before() -> [[u8; WIDE]; 256] {
        let mut table = [[0; WIDE]; 256];
        let mut set = 0;
        while set < table.len() {
            let (mut lane, mut count) = (0, 0);
            while lane < WIDE {
                table[set][lane] = count;
                if set >> lane & 1 == 1 {
                    count += 1;
                }
                lane += 1;
            }
            set += 1;
        }
        table
    }

    /// The columns of four rows, in each half of 128 bits by itself.
    #[inline(always)]
    fn transpose_four(avx2: Instructions, [a, b, c, d]: [__m256i; 4]) -> [__m256i; 4] {
        let (low_ab, high_ab) = (avx2._mm256_unpacklo_epi32(a, b), avx2._mm256_unpackhi_epi32(a, b));
        let (low_cd, high_cd) = (avx2._mm256_unpacklo_epi32(c, d), avx2._mm256_unpackhi_epi32(c, d));
        [
            avx2._mm256_unpacklo_epi64(low_ab, low_cd),
            avx2._mm256_unpackhi_epi64(low_ab, low_cd),
            avx2._mm256_unpacklo_epi64(high_ab, high_cd),
            avx2._mm256_unpackhi_epi64(high_ab, high_cd),
        ]
    }

    impl Machine for Avx2 {
        type V = __m256i;

        #[inline(always)]
        fn load(self, values: [u32; WIDE]) -> __m256i {
            cast(values)
        }

        #[inline(always)]
        fn store(self, vector: __m256i) -> [u32; WIDE] {
            cast(vector)
        }

        #[inline(always)]
        fn add(self, a: __m256i, b: __m256i) -> __m256i {
            self.0.avx2._mm256_add_epi32(a, b)
        }

        #[inline(always)]
        fn sub(self, a: __m256i, b: __m256i) -> __m256i {
            self.0.avx2._mm256_sub_epi32(a, b)
        }

        #[inline(always)]
        fn mul(self, a: __m256i, b: __m256i) -> __m256i {
            self.0.avx2._mm256_mullo_epi32(a, b)
        }

        #[inline(always)]
        fn and(self, a: __m256i, b: __m256i) -> __m256i {
            self.0.avx2._mm256_and_si256(a, b)
        }

        #[inline(always)]
        fn or(self, a: __m256i, b: __m256i) -> __m256i {
            self.0.avx2._mm256_or_si256(a, b)
        }

        #[inline(always)]
        fn xor(self, a: __m256i, b: __m256i) -> __m256i {
            self.0.avx2._mm256_xor_si256(a, b)
        }

        #[inline(always)]
        fn shr<const BITS: i32>(self, a: __m256i) -> __m256i {
            self.0.avx2._mm256_srli_epi32::<BITS>(a)
        }

        #[inline(always)]
        fn greater(self, a: __m256i, b: __m256i) -> __m256i {
            self.0.avx2._mm256_cmpgt_epi32(a, b)
        }

        #[inline(always)]
        fn magnitude(self, a: __m256i) -> __m256i {
            self.0.avx2._mm256_abs_epi32(a)
        }

        #[inline(always)]
        fn any(self, a: __m256i) -> bool {
            self.0.avx._mm256_testz_si256(a, a) == 0
        }

        #[inline(always)]
        fn transpose(self, rows: [__m256i; WIDE]) -> [__m256i; WIDE] {
            let avx2 = self.0.avx2;
            let [a, b, c, d, e, f, g, h] = rows;
            // Pairs of rows, then of pairs, then of fours: in each half of 128 bits the columns of four rows.
            let four = (transpose_four(avx2, [a, b, c, d]), transpose_four(avx2, [e, f, g, h]));
            let ([a, b, c, d], [e, f, g, h]) = four;
            [
                avx2._mm256_permute2x128_si256::<0x20>(a, e),
                avx2._mm256_permute2x128_si256::<0x20>(b, f),
                avx2._mm256_permute2x128_si256::<0x20>(c, g),
                avx2._mm256_permute2x128_si256::<0x20>(d, h),
                avx2._mm256_permute2x128_si256::<0x31>(a, e),
                avx2._mm256_permute2x128_si256::<0x31>(b, f),
                avx2._mm256_permute2x128_si256::<0x31>(c, g),
                avx2._mm256_permute2x128_si256::<0x31>(d, h),
            ]
        }

        #[inline(always)]
        fn advance(
            self,
            states: __m256i,
            next: __m256i,
            mask: __m256i,
            words: &[u16; WIDE],
        ) -> (__m256i, usize) {
            let (avx, avx2) = (self.0.avx, self.0.avx2);
            let high = avx2._mm256_srli_epi32::<16>(next);
            let low = avx2._mm256_cmpeq_epi32(high, avx._mm256_setzero_si256());
            let takes = avx2._mm256_and_si256(low, mask);
            let [set, ..] = avx._mm256_movemask_ps(avx._mm256_castsi256_ps(takes)).to_le_bytes();
            let before = BEFORE.get(usize::from(set)).copied().unwrap_or_default();
            let places: __m128i = cast([u64::from_le_bytes(before), 0]);
            let own = avx2._mm256_permutevar8x32_epi32(
                avx2._mm256_cvtepu16_epi32(cast(*words)),
                avx2._mm256_cvtepu8_epi32(places),
            );
            let filled = avx2._mm256_or_si256(avx2._mm256_slli_epi32::<16>(next), own);
            let next = avx2._mm256_blendv_epi8(next, filled, takes);
            let states = avx2._mm256_blendv_epi8(states, next, mask);
            (states, usize::try_from(set.count_ones()).unwrap_or(0))
        }
    }
}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Values of all sizes, signed and not.
    fn vector() -> impl Strategy<Value = [u32; WIDE]> {
        proptest::array::uniform8(prop_oneof![0..STATE_LOW, any::<u32>(), Just(1 << 31)])
    }

    proptest! {
        #[test]
        fn vectors_calculate_as_the_text_says(a in vector(), b in vector()) {
            let Some(v3) = pulp::x86::V3::try_new() else { return Ok(()) };
            let (wide, plain) = (Avx2(v3), Portable);
            let [x, y] = [a, b].map(|values| wide.load(values));
            prop_assert_eq!(wide.store(wide.add(x, y)), plain.add(a, b));
            prop_assert_eq!(wide.store(wide.sub(x, y)), plain.sub(a, b));
            prop_assert_eq!(wide.store(wide.mul(x, y)), plain.mul(a, b));
            prop_assert_eq!(wide.store(wide.and(x, y)), plain.and(a, b));
            prop_assert_eq!(wide.store(wide.or(x, y)), plain.or(a, b));
            prop_assert_eq!(wide.store(wide.xor(x, y)), plain.xor(a, b));
            prop_assert_eq!(wide.store(wide.shr::<12>(x)), plain.shr::<12>(a));
            prop_assert_eq!(wide.store(wide.greater(x, y)), plain.greater(a, b));
            prop_assert_eq!(wide.store(wide.magnitude(x)), plain.magnitude(a));
            prop_assert_eq!(wide.any(x), plain.any(a));
        }

        #[test]
        fn vectors_take_the_words_that_lanes_take(
            states in vector(), next in vector(), lanes in 0_u32..256, words in any::<[u16; WIDE]>(),
        ) {
            let Some(v3) = pulp::x86::V3::try_new() else { return Ok(()) };
            let wide = Avx2(v3);
            let mask: [u32; WIDE] = core::array::from_fn(|lane| (lanes >> lane & 1).wrapping_neg());
            let (advanced, taken) = wide.advance(wide.load(states), wide.load(next), wide.load(mask), &words);
            prop_assert_eq!((wide.store(advanced), taken), Portable.advance(states, next, mask, &words));
        }

        #[test]
        fn rows_become_columns(rows in proptest::array::uniform8(vector())) {
            let Some(v3) = pulp::x86::V3::try_new() else { return Ok(()) };
            let wide = Avx2(v3);
            let columns = wide.transpose(rows.map(|row| wide.load(row))).map(|column| wide.store(column));
            prop_assert_eq!(columns, Portable.transpose(rows));
            prop_assert_eq!(Portable.transpose(columns), rows);
        }
    }
}
