//! Playback that somebody looks at: GOPs begin when the caller says so, in any order, and stand still as long as it wants.

use super::ladder::OperatingPoint;
use super::levels::Levels;
use super::rule::Rule;
use super::session::Session;

/// GOPs that have begun and are remembered, where they are played again and again.
const REMEMBERED: usize = 256;

/// Sessions whose caller has the playhead, as players of web pages do: after [`Session::driven`] no GOP begins by the clock.
impl<R: Rule> Session<R> {
    /// The same, whose caller says where the playhead is.
    #[must_use]
    pub fn driven(mut self) -> Self {
        self.state.viewer.drives = true;
        self
    }

    /// The playhead goes to the start of a GOP, from wherever it is. The GOP begins now or, if what is needed of it is not
    /// there, when that has arrived.
    pub fn go_to(&mut self, now_us: u64, gop: usize) {
        self.advance(now_us);
        let is_after_last = self.state.current.saturating_add(1) >= self.state.ladder.gops().len();
        self.state.viewer.loops |= is_after_last && gop == 0 && !self.state.shown.is_empty();
        self.state.current = gop;
        self.state.offset_ns = 0;
        if let Some(excess) = self.state.shown.len().checked_sub(REMEMBERED) {
            self.state.shown.drain(..excess);
        }
        self.begin();
    }

    /// The playhead is so far into the GOP that is shown.
    pub fn at(&mut self, now_us: u64, offset_us: u64) {
        self.advance(now_us);
        self.state.offset_ns = offset_us.saturating_mul(1000);
    }

    /// The playhead stands still, or goes on at a speed in thousandths. While it stands still, what is shown is improved where
    /// the network allows, and begins again with each improvement.
    pub fn run(&mut self, now_us: u64, speed_milli: u32) {
        self.advance(now_us);
        self.state.viewer.holds = speed_milli == 0;
        if speed_milli > 0 {
            self.state.viewer.speed_milli = speed_milli;
        }
        self.improve();
    }

    /// GOPs are shown at an operating point from the next one on, or where they lack it at the best below; none leaves it to
    /// the rule.
    pub fn choose(&mut self, now_us: u64, point: Option<OperatingPoint>) {
        self.advance(now_us);
        self.state.viewer.chosen = point;
        self.resume();
    }

    /// The request that is running is given up; what has arrived of it stays.
    pub fn give_up(&mut self, now_us: u64) {
        self.advance(now_us);
        self.end_request(true);
    }

    /// What has arrived of a GOP is there no more.
    pub fn forget(&mut self, gop: usize) {
        if let Some(arrived) = self.state.arrived.get_mut(gop) {
            *arrived = Levels::none(self.state.ladder.representations().len());
        }
    }

    /// What could not be had of a GOP is tried again.
    pub fn retry(&mut self, gop: usize) {
        let state = &mut self.state;
        if let Some((available, arrived)) = state.available.get_mut(gop).zip(state.arrived.get(gop)) {
            *available = state.obtainable.union(arrived);
        }
        self.state.retry_us = self.state.now_us;
    }

    /// Shows the current GOP again if it has become better in time.
    pub(super) fn improve(&mut self) {
        let state = &self.state;
        if !state.is_improved() {
            return;
        }
        let better = state.showable(state.current).map(|point| (point.quality, point.name));
        let shown = state.shown.last().filter(|shown| shown.gop == state.current);
        let is_better =
            |(quality, name)| shown.is_none_or(|shown| quality > shown.quality && name != shown.point);
        if better.is_some_and(is_better) {
            self.state.waiting_since_us = self.state.now_us;
            self.show();
        }
    }
}
