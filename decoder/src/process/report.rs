//! What a decoder has found wrong with a stream, clause 9.

use core::ops::RangeInclusive;
use splatstream_format::Error;

/// Errors in stream order, and frames that were never output.
#[derive(Debug, Clone, Default)]
pub(super) struct Report {
    pub(super) errors: Vec<Error>,
    /// Display indices, increasing; ranges that touch are joined.
    pub(super) lost: Vec<RangeInclusive<u32>>,
    /// Whether there have been errors that are no longer here.
    pub(super) had_errors: bool,
    /// How much of it is told next.
    told: Option<Found>,
}

/// How much had been found at some time: errors and ranges of lost frames.
#[derive(Debug, Clone, Copy)]
pub(super) struct Found {
    errors: usize,
    lost: usize,
}

impl Report {
    /// Whether no error has been found.
    pub(super) fn is_clean(&self) -> bool {
        self.errors.is_empty() && !self.had_errors
    }

    /// How much there is.
    pub(super) fn found(&self) -> Found {
        Found { errors: self.errors.len(), lost: self.lost.len() }
    }

    /// The next call of [`Report::take`] gives only what had been found at some time; of `None`, everything.
    pub(super) fn tell(&mut self, found: Option<Found>) {
        self.told = found;
    }

    /// Takes what has been found since the last call.
    pub(super) fn take(&mut self) -> (Vec<Error>, Vec<RangeInclusive<u32>>) {
        self.had_errors |= !self.errors.is_empty();
        let Found { errors, lost } = self.told.take().unwrap_or_else(|| self.found());
        let (errors, lost) = (errors.min(self.errors.len()), lost.min(self.lost.len()));
        (self.errors.drain(..errors).collect(), self.lost.drain(..lost).collect())
    }

    /// The frames with display indices from `first` up to, but without, `end` will not be output.
    pub(super) fn lose(&mut self, first: u64, end: u64) {
        let (Ok(start), Some(Ok(last))) = (u32::try_from(first), end.checked_sub(1).map(u32::try_from))
        else {
            return;
        };
        if first >= end {
            return;
        }
        match self.lost.last_mut() {
            Some(range) if u64::from(*range.end()).saturating_add(1) >= first => {
                *range = *range.start()..=last
            }
            _ => self.lost.push(start..=last),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_of_lost_frames_are_joined_and_reach_the_last_index() {
        let mut report = Report::default();
        for (first, end) in [(3, 3), (3, 5), (5, 6), (8, 9), ((1 << 32) - 1, 1 << 32), (1 << 32, 1 << 32)] {
            report.lose(first, end);
        }
        assert_eq!(report.lost, [3..=5, 8..=8, u32::MAX..=u32::MAX]);
    }
}
