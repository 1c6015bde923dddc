//! Playback that somebody looks at: the caller has the playhead, and GOPs are kept for when it comes back.

use super::follow::Follow;
use super::{Options, PlaybackError, Player, first_gop};
use crate::control::{OperatingPoint, Playback, Rule, Shown};
use crate::manifest::Manifest;

/// Playback that a pause or a seek has brought farther than this behind the target stays behind a presentation that grows.
const BEHIND_US: u64 = 2_000_000;

/// What a player knows of a viewer.
#[derive(Debug, Default)]
pub(super) struct Viewer {
    /// The playhead has entered a GOP that was not taken yet.
    enters: bool,
    /// What was taken last.
    taken: Option<Shown>,
    /// Whether the viewer has gone back in a presentation that grows, or paused it: playback does not hurry then.
    is_behind: bool,
}

/// Players whose caller has the playhead, after [`Player::driven`].
impl<R: Rule> Player<R> {
    /// A playback whose caller says which GOP is shown. It starts with the first one or, where the presentation grows, near the
    /// last one, and those before it can be gone back to.
    ///
    /// # Errors
    /// As [`Player::new`].
    pub fn driven(manifest: Manifest, options: Options, rule: R, now_us: u64) -> Result<Self, PlaybackError> {
        let follow = Follow::begin(&manifest, &options.following, now_us);
        let mut player = Self::of(manifest, options, rule, follow, now_us)?;
        player.session = player.session.driven();
        player.viewer = Some(Viewer { enters: true, ..Viewer::default() });
        let first = if player.options.following.from_start { 0 } else { player.edge().unwrap_or(0) };
        player.session.go_to(now_us, first);
        Ok(player)
    }

    /// The GOP that is as far from the end of a presentation that grows as is aimed at; none if it does not grow.
    pub fn edge(&self) -> Option<usize> {
        self.follow.as_ref().map(|follow| follow.join(&self.manifest))
    }

    /// Whether the playhead stays behind a presentation that grows: the viewer has sought a GOP more than two seconds before
    /// [`Player::edge`], or has paused for longer than that. Otherwise playback keeps to the latency that is aimed at.
    pub fn is_behind(&self) -> bool {
        self.viewer.as_ref().is_some_and(|viewer| viewer.is_behind)
    }

    /// Media time that passes in a second, in thousandths, so that playback keeps to the latency that is aimed at.
    pub fn pace_milli(&self) -> u32 {
        if self.follow.is_none() || self.is_behind() { 1000 } else { self.state().rate_milli() }
    }

    /// The first GOP that can be gone back to.
    pub fn first_kept(&self) -> usize {
        let gops = self.manifest.gops.len();
        (0..gops).find(|&gop| !self.state().is_skipped(gop)).unwrap_or(gops)
    }

    /// The playhead goes to a GOP, which is [shown](Player::show) as soon as it can be. A GOP that does not follow the one
    /// before was sought: what is being fetched is given up if it is in its way.
    pub fn go_to(&mut self, now_us: u64, gop: usize, is_sought: bool) {
        if is_sought {
            self.attempts.forget(gop);
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
        let to_edge_us = self.edge().map_or(0, |edge| self.session.state().media_until(edge));
        if let Some(viewer) = &mut self.viewer {
            viewer.enters = true;
            viewer.is_behind = if is_sought { to_edge_us > BEHIND_US } else { viewer.is_behind };
        }
    }

    /// The playhead is so far into the GOP that is shown.
    pub fn at(&mut self, now_us: u64, offset_us: u64) {
        self.session.at(now_us, offset_us);
    }

    /// The playhead stands still at speed 0, in which time what is shown becomes better, or moves at a speed in thousandths.
    pub fn run(&mut self, now_us: u64, speed_milli: u32) {
        self.session.run(now_us, speed_milli);
        let state = self.session.state();
        let near_us =
            self.follow.as_ref().map_or(u64::MAX, |follow| follow.target_us.saturating_add(BEHIND_US));
        let is_late = state.latency_us().is_some_and(|us| us > near_us);
        let is_paused = speed_milli == 0 && state.playback() == Playback::Playing;
        if let Some(viewer) = &mut self.viewer {
            viewer.is_behind = is_paused || (viewer.is_behind && is_late);
        }
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

/// Where a viewer can go back to.
impl<R: Rule> Player<R> {
    /// Lets go of GOPs before the playhead that a manifest lists no more, and takes back those that it lists again, as that of
    /// a presentation that has ended does.
    pub(super) fn forget_unlisted(&mut self, now_us: u64, manifest: &Manifest) {
        if self.viewer.is_none() {
            return;
        }
        let first = first_gop(manifest);
        let current = self.session.state().current();
        let known = self.manifest.gops.iter_mut().zip(&self.logs);
        for (gop, (info, log)) in known.enumerate().take(current) {
            let is_listed = log.number >= first;
            if is_listed == self.session.state().is_skipped(gop) {
                self.session.keep(now_us, gop, is_listed);
            }
            if !is_listed && !info.subsegments.is_empty() {
                self.store.remove(gop);
                info.subsegments = Vec::new();
            }
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
