//! A token bucket over a trace, by a clock that the caller has.

use crate::simulation::Trace;

/// Time that one grant should take, so that connections share the link evenly.
const QUANTUM_US: u64 = 5_000;

/// A link with the bandwidth of a trace, which gives all its connections together what the trace carries.
///
/// Between two times it grants what [`Trace::carried`] says, the integral of the bandwidth, as a simulator does.
#[derive(Debug, Clone)]
pub struct Bucket {
    trace: Trace,
    /// Millionths of a bit that are granted or forfeited.
    granted: u128,
}

impl Bucket {
    /// Microseconds that the bucket may be behind: what timers and threads cost in accuracy is caught up within it, and a link
    /// that was idle for longer starts with so much credit.
    pub const DEPTH_US: u64 = 20_000;

    /// A link at time 0 of its trace; none if the trace never carries anything.
    pub fn new(trace: Trace) -> Option<Self> {
        (trace.mean() > 0).then_some(Self { trace, granted: 0 })
    }

    /// Grants bytes: the time in microseconds, `now_us` or later, at which the link has carried them.
    pub fn grant(&mut self, bytes: u32, now_us: u64) -> u64 {
        let forfeited = self.trace.carried(now_us.saturating_sub(Self::DEPTH_US));
        let carried = u128::from(bytes).saturating_mul(8_000_000);
        self.granted = self.granted.max(forfeited).saturating_add(carried);
        self.trace.time_of(self.granted).unwrap_or(u64::MAX).max(now_us)
    }

    /// Bytes to ask for at once, 1 KiB to 64 KiB.
    pub fn quantum(&self, now_us: u64) -> u32 {
        let until = self.trace.carried(now_us.saturating_add(QUANTUM_US));
        let carried = until.saturating_sub(self.trace.carried(now_us));
        let bytes = carried.checked_div(8_000_000).unwrap_or(0);
        u32::try_from(bytes).unwrap_or(u32::MAX).clamp(1 << 10, 1 << 16)
    }
}

#[cfg(test)]
#[allow(clippy::arithmetic_side_effects, reason = "an overflow is a failed test")]
#[allow(clippy::expect_used, clippy::indexing_slicing, reason = "a panic is a failed test")]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn traces() -> impl Strategy<Value = Trace> {
        let steps = prop::collection::vec((1_000_u64..3_000_000, 0_u64..200_000_000), 1..12);
        steps.prop_filter_map("a trace that carries something", |steps| {
            Trace::new(&steps).ok().filter(|trace| trace.mean() > 1_000)
        })
    }

    proptest! {
        #[test]
        fn a_busy_link_carries_the_integral_of_its_trace(trace in traces(), sizes in prop::collection::vec(1_u32..65_536, 1..200)) {
            let mut bucket = Bucket::new(trace.clone()).expect("it carries something");
            let (mut now, mut sent) = (0, 0_u128);
            for size in sizes {
                now = bucket.grant(size, now);
                sent += u128::from(size) * 8_000_000;
                // To the microsecond.
                prop_assert!(trace.carried(now) >= sent);
                prop_assert!(now == 0 || trace.carried(now - 1) < sent);
            }
        }

        #[test]
        fn late_callers_get_no_more_than_the_trace_and_the_depth(
            trace in traces(), calls in prop::collection::vec((1_u32..65_536, 0_u64..100_000), 1..200),
        ) {
            let mut bucket = Bucket::new(trace.clone()).expect("it carries something");
            let mut grants = Vec::new();
            let mut now = 0;
            for (size, late) in calls {
                now = bucket.grant(size, now) + late;
                grants.push((now - late, u128::from(size) * 8_000_000));
            }
            for first in 0..grants.len() {
                let mut sent = 0;
                for &(time, size) in &grants[first..] {
                    sent += size;
                    // What the first one needed may have been carried before it was granted.
                    let start = grants[first].0.saturating_sub(Bucket::DEPTH_US);
                    prop_assert!(trace.carried(time) - trace.carried(start) + grants[first].1 >= sent);
                }
            }
        }
    }

    #[test]
    fn a_link_that_was_idle_has_little_credit() {
        let mut bucket = Bucket::new(Trace::constant(8_000_000)).expect("it carries something");
        assert_eq!(bucket.grant(1_000, 0), 1_000);
        assert_eq!(bucket.grant(20_000, 10_000_000), 10_000_000);
        assert_eq!(bucket.grant(1_000, 10_000_000), 10_001_000);
        assert_eq!(bucket.quantum(0), 5_000);
        assert!(Bucket::new(Trace::constant(0)).is_none());
    }
}
