//! Conditions of a bad network, for tests: the same seed gives the same faults.

use super::shaper::Bucket;
use crate::simulation::Trace;
use std::time::Duration;
use xxhash_rust::xxh64::xxh64;

/// What a network does to answers. The default leaves them alone.
#[derive(Debug, Clone, Default)]
pub struct Network {
    /// Bandwidth of all connections together.
    pub bandwidth: Option<Trace>,
    /// Time before each answer.
    pub latency: Duration,
    /// Share of answers whose connection is closed before their last byte, 0 to 1.
    pub drop_share: f64,
    /// Share of requests that are answered with 503, 0 to 1.
    pub fail_share: f64,
    /// Decides, with the number of the request, which ones they are.
    pub seed: u64,
}

impl Network {
    /// Whether the request of a number, from 0, is answered with 503.
    pub fn fails(&self, request: u64) -> bool {
        self.draw(request, b"fail") < self.fail_share
    }

    /// How many bytes of an answer's body arrive before its connection is closed; none if it stays open.
    pub fn drops_after(&self, request: u64, length: u64) -> Option<u64> {
        if length == 0 || self.draw(request, b"drop") >= self.drop_share {
            return None;
        }
        self.hash(request, b"byte").checked_rem(length)
    }

    pub(super) fn bucket(&self) -> Option<Bucket> {
        self.bandwidth.clone().and_then(Bucket::new)
    }

    /// A number from 0 up to but not including 1.
    fn draw(&self, request: u64, purpose: &[u8; 4]) -> f64 {
        let bits = u32::try_from(self.hash(request, purpose) >> 32).unwrap_or(u32::MAX);
        f64::from(bits) / (f64::from(u32::MAX) + 1.0)
    }

    fn hash(&self, request: u64, purpose: &[u8; 4]) -> u64 {
        xxh64(&[&request.to_le_bytes()[..], purpose].concat(), self.seed)
    }
}

#[cfg(test)]
#[allow(clippy::arithmetic_side_effects, reason = "an overflow is a failed test")]
#[allow(clippy::expect_used, clippy::indexing_slicing, reason = "a panic is a failed test")]
mod tests {
    use super::*;

    #[test]
    fn shares_are_met_and_repeat() {
        let network = Network { fail_share: 0.2, drop_share: 0.1, seed: 7, ..Network::default() };
        let fails: Vec<bool> = (0..100_000).map(|request| network.fails(request)).collect();
        let failed = fails.iter().filter(|fails| **fails).count();
        assert!((19_500..20_500).contains(&failed), "{failed}");
        let dropped =
            (0..100_000).filter_map(|request| network.drops_after(request, 1_000)).collect::<Vec<_>>();
        assert!((9_600..10_400).contains(&dropped.len()), "{}", dropped.len());
        assert!(dropped.iter().all(|&bytes| bytes < 1_000));
        assert!((0..100_000).all(|request| network.clone().fails(request) == network.fails(request)));
        let all = Network { fail_share: 1.0, drop_share: 1.0, ..network };
        assert!((0..1_000).all(|request| all.fails(request) && all.drops_after(request, 1).is_some()));
        assert!(
            (0..1_000)
                .all(|request| !Network::default().fails(request) && all.drops_after(request, 0).is_none())
        );
    }
}
