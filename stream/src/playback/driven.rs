//! Playback that somebody looks at: the caller has the playhead, and GOPs are kept for when it comes back.

use super::Player;
use crate::control::{OperatingPoint, Playback, Rule, Shown};
use crate::manifest::Manifest;

/// What a player knows of a viewer.
#[derive(Debug, Default)]
pub(super) struct Viewer {
    /// The playhead has entered a GOP that was not taken yet.
    enters: bool,
    /// What was taken last.
    taken: Option<Shown>,
}

/// Players whose caller has the playhead, after [`Player::driven`].
impl<R: Rule> Player<R> {
    /// The same, whose caller says which GOP is shown, from the first one on.
    #[must_use]
    pub fn driven(mut self, now_us: u64) -> Self {
        self.session = self.session.driven();
        self.viewer = Some(Viewer { enters: true, ..Viewer::default() });
        self.session.go_to(now_us, 0);
        self
    }

    /// The playhead goes to a GOP, which is [shown](Player::show) as soon as it can be. A GOP that does not follow the one
    /// before was sought: what is being fetched is given up if it is in its way.
    pub fn go_to(&mut self, now_us: u64, gop: usize, is_sought: bool) {
        if is_sought {
            self.faults.retain(|key, _| key.0 != gop);
            self.session.retry(gop);
            let is_ready = self.session.state().is_ready(gop);
            let running = self.running.is_some().then(|| self.fetched_gop());
            if running.is_some_and(|running| running < gop || (running > gop && !is_ready)) {
                self.abandon();
                self.session.give_up(now_us);
                self.gives_up = true;
            }
        }
        self.session.go_to(now_us, gop);
        self.viewer.iter_mut().for_each(|viewer| viewer.enters = true);
    }

    /// The playhead is so far into the GOP that is shown.
    pub fn at(&mut self, now_us: u64, offset_us: u64) {
        self.session.at(now_us, offset_us);
    }

    /// The playhead stands still at speed 0, in which time what is shown becomes better, or moves at a speed in thousandths.
    pub fn run(&mut self, now_us: u64, speed_milli: u32) {
        self.session.run(now_us, speed_milli);
    }

    /// GOPs are shown at an operating point, as far as they have it; none leaves it to the rule. It holds from the next GOP
    /// that the playhead goes to.
    pub fn choose(&mut self, now_us: u64, point: Option<OperatingPoint>) {
        self.session.choose(now_us, point);
    }

    /// Whether the GOP that the playhead is in is to be shown again: it has begun, or has become better.
    pub fn is_due(&self) -> bool {
        self.due().is_some()
    }

    fn due(&self) -> Option<(usize, Option<Shown>)> {
        let (state, viewer) = (self.session.state(), self.viewer.as_ref()?);
        if state.playback() != Playback::Playing {
            return None;
        }
        let gop = state.current();
        let shown = state.shown().last().filter(|shown| shown.gop == gop).copied();
        (viewer.enters || viewer.taken != shown).then_some((gop, shown))
    }

    /// Takes the GOP that is due, unless it is skipped.
    pub(super) fn driven_gop(&mut self) -> Option<usize> {
        let (gop, shown) = self.due()?;
        let viewer = self.viewer.as_mut()?;
        (viewer.enters, viewer.taken) = (false, shown);
        Some(gop).filter(|&gop| !self.session.state().is_skipped(gop))
    }

    /// Lets go of GOPs that do not fit into the memory: those before the playhead first, then those that are furthest ahead of
    /// what can be played without a gap.
    pub(super) fn trim(&mut self) {
        if self.viewer.is_none() || self.store.bytes() <= self.options.memory {
            return;
        }
        let state = self.session.state();
        let (first, end) = (state.current(), state.first_missing());
        let running = self.fetched_gop();
        let known = self.store.gops();
        let behind = known.iter().filter(|gop| **gop < first);
        let ahead = known.iter().rev().filter(|gop| **gop > end);
        for &gop in behind.chain(ahead).filter(|gop| **gop != running) {
            if self.store.bytes() <= self.options.memory {
                return;
            }
            self.store.remove(gop);
            self.session.forget(gop);
        }
    }
}

impl Manifest {
    /// The GOP that a frame is in, or the one before a gap.
    pub fn gop_of(&self, frame: u32) -> Option<usize> {
        let after = self.gops.partition_point(|gop| gop.first_frame <= frame);
        if self.gops.is_empty() { None } else { Some(after.saturating_sub(1)) }
    }
}
