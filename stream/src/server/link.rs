//! The link that all connections share, by the clock of the machine.

use super::shaper::Bucket;
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Duration;
use tokio::time::Instant;

/// The longest that an answer waits for its next bytes, in microseconds: a day.
const MAX_WAIT_US: u64 = 86_400_000_000;

/// A bucket whose trace starts with the first answer.
pub(super) struct Link {
    bucket: Mutex<Bucket>,
    start: OnceLock<Instant>,
}

impl Link {
    pub(super) fn new(bucket: Bucket) -> Self {
        Self { bucket: Mutex::new(bucket), start: OnceLock::new() }
    }

    /// When so many bytes are carried.
    pub(super) fn grant(&self, bytes: u32) -> Instant {
        let start = *self.start.get_or_init(Instant::now);
        let now_us = self.now_us();
        let until_us = self.bucket().grant(bytes, now_us).min(now_us.saturating_add(MAX_WAIT_US));
        start.checked_add(Duration::from_micros(until_us)).unwrap_or(start)
    }

    /// Bytes to ask for at once.
    pub(super) fn quantum(&self) -> u32 {
        self.bucket().quantum(self.now_us())
    }

    fn bucket(&self) -> MutexGuard<'_, Bucket> {
        self.bucket.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn now_us(&self) -> u64 {
        let elapsed = self.start.get().map(Instant::elapsed).unwrap_or_default();
        u64::try_from(elapsed.as_micros()).unwrap_or(u64::MAX)
    }
}
