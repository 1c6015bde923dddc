//! The machine of x86 processors with AVX2.

use super::{Machine, STATE_LOW, WIDE};
use core::arch::x86_64::{__m128i, __m256i};
use pulp::cast;
use pulp::core_arch::x86::Avx2 as Instructions;
use pulp::x86::{V3, V4};

/// A machine with AVX2, and how its lanes take words.
#[derive(Debug, Clone, Copy)]
pub struct Avx2<W>(V3, W);

impl Avx2<V3> {
    /// With no more than that.
    pub const fn new(v3: V3) -> Self {
        Self(v3, v3)
    }
}

impl Avx2<V4> {
    /// With AVX-512 for vectors of 256 bits.
    pub fn with_avx512(v4: V4) -> Self {
        Self(*v4, v4)
    }
}

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

/// Instructions by which lanes take words.
pub trait TakeWords: Copy {
    /// As [`Machine::advance`].
    fn advance(self, states: __m256i, next: __m256i, mask: __m256i, words: &[u16; WIDE]) -> (__m256i, usize);
}

impl TakeWords for V3 {
    #[inline(always)]
    fn advance(self, states: __m256i, next: __m256i, mask: __m256i, words: &[u16; WIDE]) -> (__m256i, usize) {
        let Self { avx, avx2, .. } = self;
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

/// An instruction gives each lane of a mask the next word: no table is asked for places.
impl TakeWords for V4 {
    #[inline(always)]
    fn advance(self, states: __m256i, next: __m256i, mask: __m256i, words: &[u16; WIDE]) -> (__m256i, usize) {
        let (avx, avx2, avx512) = (self.avx, self.avx2, self.avx512f);
        let low = avx512._mm256_cmplt_epu32_mask(next, avx._mm256_set1_epi32(STATE_LOW.cast_signed()));
        let lanes = avx512._mm256_test_epi32_mask(mask, mask);
        let takes = low & lanes;
        let own = avx512._mm256_maskz_expand_epi32(takes, avx2._mm256_cvtepu16_epi32(cast(*words)));
        let filled = avx2._mm256_or_si256(avx2._mm256_slli_epi32::<16>(next), own);
        let next = avx512._mm256_mask_blend_epi32(takes, next, filled);
        let states = avx512._mm256_mask_blend_epi32(lanes, states, next);
        (states, usize::try_from(takes.count_ones()).unwrap_or(0))
    }
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

impl<W: TakeWords> Machine for Avx2<W> {
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
    fn dot(self, a: __m256i, b: __m256i) -> __m256i {
        self.0.avx2._mm256_madd_epi16(a, b)
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
    fn reached(self, [a, b, c, d]: [__m256i; 4], thresholds: &[i16]) -> [__m256i; 4] {
        let (avx, avx2) = (self.0.avx, self.0.avx2);
        // Values that 16 bits do not hold become the nearest that they hold: the comparison comes to the same.
        let (low, high) = (avx2._mm256_packs_epi32(a, b), avx2._mm256_packs_epi32(c, d));
        let all = avx._mm256_set1_epi16(i16::try_from(thresholds.len()).unwrap_or(0));
        let (mut of_low, mut of_high) = (all, all);
        for &threshold in thresholds {
            let threshold = avx._mm256_set1_epi16(threshold);
            of_low = avx2._mm256_add_epi16(of_low, avx2._mm256_cmpgt_epi16(threshold, low));
            of_high = avx2._mm256_add_epi16(of_high, avx2._mm256_cmpgt_epi16(threshold, high));
        }
        let zero = avx._mm256_setzero_si256();
        [
            avx2._mm256_unpacklo_epi16(of_low, zero),
            avx2._mm256_unpackhi_epi16(of_low, zero),
            avx2._mm256_unpacklo_epi16(of_high, zero),
            avx2._mm256_unpackhi_epi16(of_high, zero),
        ]
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
    fn advance(self, states: __m256i, next: __m256i, mask: __m256i, words: &[u16; WIDE]) -> (__m256i, usize) {
        self.1.advance(states, next, mask, words)
    }
}
