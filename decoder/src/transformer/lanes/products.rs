//! Sums of products of 16 bits, with the instructions of a machine. All of them give the same integers.
//!
//! No sum overflows (annex F.6).

use super::{Lane, high, low};
#[cfg(target_arch = "x86_64")]
pub(super) use x86::{Avx2, Sse2};

/// How a machine adds products.
pub(super) trait Products: Copy {
    /// A part of the values of a [`Lane`].
    type Part: Copy;

    /// Parts of a lane.
    const PARTS: usize;

    /// The same value everywhere.
    fn splat(self, value: i32) -> Self::Part;

    /// A part of a lane.
    fn load(self, lane: &Lane, part: usize) -> Self::Part;

    /// Writes a part of a lane.
    fn store(self, values: Self::Part, lane: &mut Lane, part: usize);

    /// Adds to each sum the products of both pairs of 16-bit halves.
    fn add(self, sum: Self::Part, a: Self::Part, b: Self::Part) -> Self::Part;
}

/// Without instructions of its own.
#[derive(Debug, Clone, Copy)]
pub(super) struct Portable;

impl Products for Portable {
    type Part = [i32; 8];

    const PARTS: usize = 2;

    #[inline(always)]
    fn splat(self, value: i32) -> Self::Part {
        [value; 8]
    }

    #[inline(always)]
    fn load(self, lane: &Lane, part: usize) -> Self::Part {
        lane.as_chunks().0.get(part).copied().unwrap_or([0; 8])
    }

    #[inline(always)]
    fn store(self, values: Self::Part, lane: &mut Lane, part: usize) {
        if let Some(slots) = lane.as_chunks_mut().0.get_mut(part) {
            *slots = values;
        }
    }

    #[inline(always)]
    fn add(self, mut sum: Self::Part, a: Self::Part, b: Self::Part) -> Self::Part {
        for (sum, (a, b)) in sum.iter_mut().zip(a.into_iter().zip(b)) {
            let low = low(a).wrapping_mul(low(b));
            *sum = sum.wrapping_add(low).wrapping_add(high(a).wrapping_mul(high(b)));
        }
        sum
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::super::Lane;
    use super::{Portable, Products};
    use core::arch::x86_64::{__m128i, __m256i};
    use pulp::bytemuck::cast;
    use pulp::core_arch::x86;
    use pulp::x86::V3;

    /// What every x86-64 has.
    #[derive(Debug, Clone, Copy)]
    pub(in super::super) struct Sse2(pub(in super::super) x86::Sse2);

    impl Products for Sse2 {
        type Part = [__m128i; 2];

        const PARTS: usize = 2;

        #[inline(always)]
        fn splat(self, value: i32) -> Self::Part {
            cast(Portable.splat(value))
        }

        #[inline(always)]
        fn load(self, lane: &Lane, part: usize) -> Self::Part {
            cast(Portable.load(lane, part))
        }

        #[inline(always)]
        fn store(self, values: Self::Part, lane: &mut Lane, part: usize) {
            Portable.store(cast(values), lane, part);
        }

        #[inline(always)]
        fn add(self, [s, t]: Self::Part, [a, b]: Self::Part, [c, d]: Self::Part) -> Self::Part {
            let [first, second] = [self.0._mm_madd_epi16(a, c), self.0._mm_madd_epi16(b, d)];
            [self.0._mm_add_epi32(s, first), self.0._mm_add_epi32(t, second)]
        }
    }

    /// A machine with AVX2.
    #[derive(Debug, Clone, Copy)]
    pub(in super::super) struct Avx2(pub(in super::super) V3);

    impl Products for Avx2 {
        type Part = [__m256i; 2];

        const PARTS: usize = 1;

        #[inline(always)]
        fn splat(self, value: i32) -> Self::Part {
            cast([value; 16])
        }

        #[inline(always)]
        fn load(self, lane: &Lane, _: usize) -> Self::Part {
            cast(*lane)
        }

        #[inline(always)]
        fn store(self, values: Self::Part, lane: &mut Lane, _: usize) {
            *lane = cast(values);
        }

        #[inline(always)]
        fn add(self, [s, t]: Self::Part, [a, b]: Self::Part, [c, d]: Self::Part) -> Self::Part {
            let avx2 = self.0.avx2;
            let [first, second] = [avx2._mm256_madd_epi16(a, c), avx2._mm256_madd_epi16(b, d)];
            [avx2._mm256_add_epi32(s, first), avx2._mm256_add_epi32(t, second)]
        }
    }
}
