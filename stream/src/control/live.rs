//! What playback of a live presentation does besides: other settings while it plays, and GOPs that are skipped.

use super::rule::Rule;
use super::session::Session;
use super::state::{Playback, Settings, State};
use core::ops::Range;

impl<R: Rule> Session<R> {
    /// Goes on with other settings.
    pub fn set(&mut self, now_us: u64, settings: Settings) {
        self.advance(now_us);
        self.state.settings = settings;
    }

    /// Skips GOPs that have not begun: playback goes on with the one after them, as if they were not there. A request
    /// for one of them ends; gives whether there was one.
    pub fn skip(&mut self, now_us: u64, gops: Range<usize>) -> bool {
        self.advance(now_us);
        let from = gops.start.max(self.state.first_open());
        for skipped in self.state.skipped.iter_mut().take(gops.end).skip(from) {
            *skipped = true;
        }
        let fetched = self.state.request.as_ref().map(|request| request.fetch.gop());
        let ends = fetched.is_some_and(|gop| self.state.is_skipped(gop));
        if ends {
            self.end_request(false);
        }
        self.resume();
        ends
    }

    /// Whether a viewer can go back to a GOP before the playhead; what had arrived of one that is not kept is forgotten.
    pub fn keep(&mut self, now_us: u64, gop: usize, is_kept: bool) {
        self.advance(now_us);
        for skipped in self.state.skipped.iter_mut().skip(gop).take(1) {
            *skipped = !is_kept;
        }
        if !is_kept {
            self.forget(gop);
        }
    }
}

impl State {
    /// Whether playback skips a GOP.
    pub fn is_skipped(&self, gop: usize) -> bool {
        self.skipped.get(gop) == Some(&true)
    }

    /// Moves the playhead, which stands at the start of a GOP, after GOPs that are skipped.
    pub(super) fn pass_skipped(&mut self) {
        if self.playback == Playback::Playing && self.offset_ns > 0 {
            return;
        }
        while self.is_skipped(self.current) {
            self.current = self.current.saturating_add(1);
        }
    }
}
