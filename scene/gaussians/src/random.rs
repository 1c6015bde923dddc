//! Numbers that look random and are the same for the same seed, on every machine: for scenes made from a seed, for
//! clustering and for training.

/// The generator SplitMix64: a counter and a mixing function. Source: Steele, Lea and Flood, "Fast splittable pseudorandom
/// number generators", 2014. Not for secrets.
///
/// ```
/// use splatstream_gaussians::random::SplitMix64;
/// let (mut one, mut other) = (SplitMix64::new(7), SplitMix64::new(7));
/// assert_eq!(one.bits(), other.bits());
/// ```
#[derive(Debug, Clone)]
pub struct SplitMix64(u64);

/// The golden ratio as a 64-bit fraction: the step of the counter.
pub const STEP: u64 = 0x9e37_79b9_7f4a_7c15;

/// Mixes 64 bits so that each of them depends on all others.
#[must_use]
pub const fn mix(mut bits: u64) -> u64 {
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ (bits >> 31)
}

impl SplitMix64 {
    /// A generator; equal seeds give equal numbers.
    #[must_use]
    pub const fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// The next 64 bits.
    pub const fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(STEP);
        mix(self.0)
    }

    /// Uniform, at least 0 and below 1, in steps of 2⁻⁵³.
    pub const fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform, at least -1 and below 1, in steps of 2⁻²³.
    pub const fn signed(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / 8_388_608.0 - 1.0
    }

    /// Uniform, 0 to `bound` - 1; 0 if `bound` is 0. The bias is below `bound` / 2⁶⁴.
    #[expect(clippy::arithmetic_side_effects, reason = "128 bits hold the product of two numbers of 64")]
    pub const fn below(&mut self, bound: usize) -> usize {
        // The product is below bound * 2^64: its upper half fits.
        ((self.bits() as u128 * bound as u128) >> 64) as usize
    }

    /// Brings things into any order.
    #[expect(clippy::arithmetic_side_effects, reason = "`last` is below a length")]
    pub fn shuffle<T>(&mut self, things: &mut [T]) {
        for last in (1..things.len()).rev() {
            things.swap(last, self.below(last + 1));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_are_those_of_the_published_generator() {
        let mut random = SplitMix64::new(1_234_567);
        assert_eq!([(); 2].map(|()| random.bits()), [6_457_827_717_110_365_317, 3_203_168_211_198_807_973]);
    }

    #[test]
    fn numbers_stay_within_their_bounds() {
        let mut random = SplitMix64::new(3);
        for bound in 1..200 {
            assert!(random.below(bound) < bound);
            assert!((0.0..1.0).contains(&random.unit()) && (-1.0..1.0).contains(&random.signed()));
        }
        let mut order: Vec<usize> = (0..50).collect();
        random.shuffle(&mut order);
        assert!(!order.is_sorted());
        order.sort_unstable();
        assert!(order.into_iter().eq(0..50));
    }
}
