//! Random numbers that are the same in every run.

use splatstream_gaussians::random::SplitMix64;

/// Dice over the generator that everything here uses.
pub(super) struct Dice(SplitMix64);

impl Dice {
    /// Dice; equal seeds give equal numbers.
    pub(super) fn new(seed: u64) -> Self {
        Self(SplitMix64::new(seed))
    }

    /// From 0 up to and without 1.
    pub(super) fn unit(&mut self) -> f64 {
        self.0.unit()
    }

    /// Nearly normal, mean 0, deviation 1: the sum of twelve even numbers.
    pub(super) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }

    /// The numbers below `count` in random order.
    pub(super) fn order(&mut self, count: usize) -> Vec<u32> {
        let mut order: Vec<u32> = (0..count as u32).collect();
        for last in (1..count).rev() {
            order.swap(last, (self.0.bits() % (last as u64 + 1)) as usize);
        }
        order
    }

    /// A share of the numbers below `count`, at least one if there is any.
    pub(super) fn some(&mut self, count: usize, share: f64) -> Vec<usize> {
        let kept = ((count as f64 * share) as usize).clamp(count.min(1), count);
        self.order(count).into_iter().take(kept).map(|row| row as usize).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_holds_different_numbers_and_is_never_empty() {
        let mut some = Dice::new(1).some(50, 0.5);
        some.sort_unstable();
        some.dedup();
        assert_eq!(some.len(), 25);
        assert_eq!(Dice::new(1).some(50, 0.001).len(), 1);
        assert!(Dice::new(1).some(0, 0.5).is_empty());
    }
}
