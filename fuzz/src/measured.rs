//! What work takes.

use crate::ceiling;
use std::time::Duration;

/// What some work took on the calling thread, on which it stays when a program is built for fuzzing.
#[derive(Debug, Clone, Copy)]
pub struct Taken {
    /// Bytes in use at the same time, besides those of before.
    pub peak: u64,
    /// Processor time, which does not depend on what else the machine does; zero where it is not known.
    pub time: Duration,
}

/// Does some work, and says what it took.
pub fn measured<T>(work: impl FnOnce() -> T) -> (T, Taken) {
    let start = processor_time();
    let (result, peak) = ceiling::peak_of(work);
    (result, Taken { peak: peak as u64, time: processor_time().saturating_sub(start) })
}

#[cfg(unix)]
fn processor_time() -> Duration {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    Duration::try_from(now).unwrap_or_default()
}

#[cfg(not(unix))]
fn processor_time() -> Duration {
    Duration::ZERO
}
