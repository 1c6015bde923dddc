//! How a player plays: buffer and limits, how often it asks, and how it follows a presentation that grows.

use super::error::PlaybackError;
use crate::control::{Gop, Ladder, Settings};

/// How a player plays, and how often it asks.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Buffer and limits of the device. The buffer is made shorter where [`Options::memory`] needs it.
    pub settings: Settings,
    /// Requests for what improves a GOP before it is left out.
    pub attempts: u32,
    /// Requests for the base of a GOP before the GOP is left out.
    pub base_attempts: u32,
    /// Bytes of the package that are held at the same time.
    pub memory: u64,
    /// Of a presentation that grows.
    pub following: Following,
}

impl Default for Options {
    /// 3 attempts and 8 for the base, 1 GiB.
    fn default() -> Self {
        Self {
            settings: Settings::default(),
            attempts: 3,
            base_attempts: 8,
            memory: 1 << 30,
            following: Following::default(),
        }
    }
}

impl Options {
    /// The settings with a buffer that fits into the memory.
    ///
    /// # Errors
    /// A package whose GOPs are too large for it.
    pub(super) fn fitted(&self, ladder: &Ladder) -> Result<Settings, PlaybackError> {
        let bytes = |gop: &Gop| gop.points().iter().map(|point| point.bytes).max().unwrap_or(0);
        let largest = ladder.gops().iter().map(bytes).max().unwrap_or(0).max(1);
        // One is shown and one arrives beside those that are buffered.
        let fit = self.memory.checked_div(largest).unwrap_or(0).saturating_sub(2);
        if fit == 0 {
            return Err(PlaybackError::TooLarge(largest));
        }
        let shortest = ladder.gops().iter().map(Gop::duration_us).min().unwrap_or(1);
        let buffer_us = self.settings.buffer_us.min(fit.saturating_mul(shortest));
        let start_us = self.settings.start_us.min(buffer_us);
        Ok(Settings { buffer_us, start_us, ..self.settings.clone() })
    }
}

/// How a presentation that grows is followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Following {
    /// Whether playback starts with the first GOP that is listed, and not near the last one.
    pub from_start: bool,
    /// Time from capture to display that is aimed at; none is what the manifest says. As GOPs are fetched when they are
    /// complete, it is one and a half of the longest GOP at least.
    pub target_us: Option<u64>,
    /// Playback that comes later than the target by more than this goes on nearer to the last GOP.
    pub drift_us: u64,
    /// Playback ends with an error if the presentation has neither grown nor ended for so long.
    pub patience_us: u64,
}

impl Default for Following {
    /// From near the last GOP on; 15 s behind the target at most, and a minute of patience.
    fn default() -> Self {
        Self { from_start: false, target_us: None, drift_us: 15_000_000, patience_us: 60_000_000 }
    }
}
