//! How much work may take.

use crate::measured::measured;
use crate::yardstick::{slowness, slowness_now};
use std::time::Duration;

/// What work on an input may take.
#[derive(Debug, Clone, Copy)]
pub struct Allowance {
    /// Bytes in use at the same time.
    pub peak: u64,
    /// Processor time on a machine of [slowness] 1.
    pub time: Duration,
}

/// Work that takes longer than allowed is done again so often, and what it takes compared with the machine of that moment.
const LOOKS: u32 = 3;

/// Does some work within an allowance.
///
/// # Panics
/// The work took more.
pub fn within<T>(what: &str, allowed: &Allowance, work: impl Fn() -> T) -> T {
    let (result, taken) = measured(&work);
    assert!(taken.peak <= allowed.peak, "{what} holds {} bytes, {} are allowed", taken.peak, allowed.peak);
    let (mut time, mut most) = (taken.time, allowed.time.mul_f64(slowness()));
    for _ in 0..LOOKS {
        if time <= most {
            break;
        }
        most = allowed.time.mul_f64(slowness_now());
        time = measured(&work).1.time;
    }
    assert!(time <= most, "{what} takes {time:?}, {most:?} are allowed on this machine");
    result
}
