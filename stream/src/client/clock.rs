//! The clock of a playback.

use std::time::{Duration, Instant};

/// Microseconds from the start, in which time may be skipped.
#[derive(Debug)]
pub(super) struct Clock {
    start: Instant,
    skipped_us: u64,
    real_time: bool,
}

impl Clock {
    pub(super) fn new(real_time: bool) -> Self {
        Self { start: Instant::now(), skipped_us: 0, real_time }
    }

    pub(super) fn now_us(&self) -> u64 {
        let passed = u64::try_from(self.start.elapsed().as_micros()).unwrap_or(u64::MAX);
        passed.saturating_add(self.skipped_us)
    }

    /// Waits until a time, or skips the time until then if nobody else's time passes meanwhile.
    pub(super) fn wait_until(&mut self, until_us: u64, is_shared: bool) {
        let left_us = until_us.saturating_sub(self.now_us());
        if self.real_time || is_shared {
            std::thread::sleep(Duration::from_micros(left_us));
        } else {
            self.skipped_us = self.skipped_us.saturating_add(left_us);
        }
    }
}
