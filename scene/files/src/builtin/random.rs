//! Random numbers from integers: the same on every machine, and any stream of them at once.

use splatstream_gaussians::random::{STEP, SplitMix64, mix};

/// A generator that a key chooses among many.
pub(super) struct Random(SplitMix64);

impl Random {
    /// The stream that `key` names; streams of different keys are unrelated.
    pub(super) fn new(key: [u64; 4]) -> Self {
        let with = |state: u64, part: u64| mix(state.wrapping_add(STEP) ^ mix(part.wrapping_add(STEP)));
        Self(SplitMix64::new(key.into_iter().fold(0, with)))
    }

    /// Uniform, at least 0 and below 1, in steps of 2⁻⁵³.
    pub(super) fn unit(&mut self) -> f64 {
        self.0.unit()
    }

    /// Uniform between the two.
    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Uniform, 0 to `count` − 1. The bias is below `count` / 2³².
    pub(super) fn below(&mut self, count: u64) -> u64 {
        ((self.0.bits() >> 32) * count) >> 32
    }

    pub(super) fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }

    /// Nearly normal with mean 0 and deviation 1: the sum of four uniform numbers, so within ±3.47.
    pub(super) fn normal(&mut self) -> f64 {
        let bits = self.0.bits();
        let sum: u64 = [0, 16, 32, 48].iter().map(|shift| bits >> shift & 0xffff).sum();
        // Four uniform numbers of 0 to 65535 have mean 131070 and deviation 65536 / √3.
        (sum as f64 - 131_070.0) / 65_536.0 * 3.0_f64.sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_numbers_have_mean_0_and_deviation_1() {
        let mut random = Random::new([7, 0, 0, 0]);
        let numbers: Vec<f64> = (0..20_000).map(|_| random.normal()).collect();
        let mean = numbers.iter().sum::<f64>() / 20_000.0;
        let variance = numbers.iter().map(|number| number * number).sum::<f64>() / 20_000.0;
        assert!(mean.abs() < 0.03 && (variance - 1.0).abs() < 0.03, "{mean} {variance}");
    }
}
