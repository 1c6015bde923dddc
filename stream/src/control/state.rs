//! What a session knows at one time: what has arrived, what is playing, what is being fetched.

use super::fetch::Fetch;
use super::ladder::{Gop, Ladder, OperatingPoint, Point};
use super::levels::Levels;
use super::options::{Choice, Limits, available_choices};
use super::throughput::{Network, Transfer};

/// How a session plays. The default is a stored presentation on a device without limits.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Playable time that is buffered at most, in microseconds.
    pub buffer_us: u64,
    /// Playable time that is needed before playback starts or goes on after a stall; less if the presentation ends.
    pub start_us: u64,
    /// What the device can take.
    pub limits: Limits,
    /// Set for a live presentation.
    pub live: Option<Live>,
}

impl Default for Settings {
    fn default() -> Self {
        Self { buffer_us: 25_000_000, start_us: 0, limits: Limits::default(), live: None }
    }
}

/// How a live presentation is played.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Live {
    /// When GOP 0 can be requested, on the caller's clock, which may be before that begins; each further one can be after
    /// its own duration.
    pub available_us: i64,
    /// Time from capture to display that is aimed at; not less than a GOP.
    pub target_us: u64,
    /// Least rate of playback, in thousandths.
    pub slowest_milli: u32,
    /// Largest rate of playback, in thousandths.
    pub fastest_milli: u32,
}

/// What playback is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Playback {
    /// It has not started.
    Starting,
    /// It moves.
    Playing,
    /// It waits for pieces.
    Stalled,
    /// All GOPs were played.
    Ended,
}

/// The running request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Request {
    /// What was asked for.
    pub fetch: Fetch,
    /// Whether the response has begun.
    pub begun: bool,
    /// When it was sent, when bytes first and last arrived, and how many.
    pub progress: Transfer,
}

/// A GOP that was played.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shown {
    /// Its index.
    pub gop: usize,
    /// What was played of it.
    pub point: OperatingPoint,
    /// Quality of that in dB.
    pub quality: f64,
    /// Bytes of that.
    pub bytes: u64,
    /// All bytes that were fetched for this GOP before it was played.
    pub fetched: u64,
    /// Gaussians of a frame of that, at most.
    pub gaussians: u64,
    /// When it began, on the caller's clock.
    pub began_us: u64,
    /// How long playback stood still before it; for GOP 0 the start-up.
    pub waited_us: u64,
    /// Time from capture to display in a live presentation.
    pub latency_us: Option<u64>,
    /// Rate of playback when it began, in thousandths.
    pub rate_milli: u32,
}

/// What a session knows at one time. Times are microseconds of the caller's clock.
#[derive(Clone, Debug)]
pub struct State {
    pub(super) ladder: Ladder,
    pub(super) settings: Settings,
    pub(super) now_us: u64,
    pub(super) playback: Playback,
    /// The GOP that is played, or that playback waits for.
    pub(super) current: usize,
    /// How far into it playback is, in nanoseconds.
    pub(super) offset_ns: u64,
    pub(super) rate_milli: u32,
    pub(super) waiting_since_us: u64,
    pub(super) arrived: Vec<Levels>,
    /// The pieces of each GOP that can be had, as far as is known.
    pub(super) available: Vec<Levels>,
    /// The same for a GOP of which nothing is known yet.
    pub(super) obtainable: Levels,
    pub(super) fetched: Vec<u64>,
    /// GOPs for which a request has ended as the rule wanted.
    pub(super) settled: Vec<bool>,
    /// GOPs that playback skips.
    pub(super) skipped: Vec<bool>,
    pub(super) only_whole: bool,
    pub(super) request: Option<Request>,
    /// Requests that failed since the last one that did not.
    pub(super) failures: u32,
    /// Nothing is requested before.
    pub(super) retry_us: u64,
    pub(super) network: Network,
    pub(super) shown: Vec<Shown>,
    pub(super) viewer: Viewer,
}

/// What somebody who looks at the presentation has asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Viewer {
    /// GOPs begin when the caller says so, not by the clock.
    pub(super) drives: bool,
    /// The playhead stands still: what is shown can still be improved.
    pub(super) holds: bool,
    /// The operating point that is wanted, in place of what the rule finds best.
    pub(super) chosen: Option<OperatingPoint>,
    /// Whether the playhead has gone from the last GOP to the first one.
    pub(super) loops: bool,
    /// Media time that passes in a second of the clock, in thousandths, apart from [`State::rate_milli`].
    pub(super) speed_milli: u32,
}

impl State {
    pub(super) fn new(ladder: Ladder, settings: Settings, now_us: u64, only_whole: bool) -> Self {
        let obtainable = Levels::all(ladder.representations().len());
        let mut state = Self {
            ladder,
            obtainable,
            settings,
            now_us,
            playback: Playback::Starting,
            current: 0,
            offset_ns: 0,
            rate_milli: 1000,
            waiting_since_us: now_us,
            arrived: Vec::new(),
            available: Vec::new(),
            fetched: Vec::new(),
            settled: Vec::new(),
            skipped: Vec::new(),
            only_whole,
            request: None,
            failures: 0,
            retry_us: now_us,
            network: Network::default(),
            shown: Vec::new(),
            viewer: Viewer { drives: false, holds: false, chosen: None, loops: false, speed_milli: 1000 },
        };
        state.grow();
        state
    }

    /// Makes room for all GOPs of the ladder.
    pub(super) fn grow(&mut self) {
        let gops = self.ladder.gops().len();
        self.arrived.resize(gops, Levels::none(self.ladder.representations().len()));
        self.available.resize(gops, self.obtainable.clone());
        self.fetched.resize(gops, 0);
        self.settled.resize(gops, false);
        self.skipped.resize(gops, false);
    }

    /// The presentation.
    pub fn ladder(&self) -> &Ladder {
        &self.ladder
    }

    /// How it is played.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The time of the last event.
    pub fn now_us(&self) -> u64 {
        self.now_us
    }

    /// What playback is doing.
    pub fn playback(&self) -> Playback {
        self.playback
    }

    /// How long playback has been standing still, in microseconds; 0 while it moves and at its end.
    pub fn waiting_us(&self) -> u64 {
        match self.playback {
            Playback::Starting | Playback::Stalled => self.now_us.saturating_sub(self.waiting_since_us),
            Playback::Playing | Playback::Ended => 0,
        }
    }

    /// The GOP that is played, or that playback waits for; the number of GOPs at the end.
    pub fn current(&self) -> usize {
        self.current
    }

    /// Rate of playback, in thousandths.
    pub fn rate_milli(&self) -> u32 {
        self.rate_milli
    }

    /// The running request.
    pub fn request(&self) -> Option<&Request> {
        self.request.as_ref()
    }

    /// The requests so far.
    pub fn network(&self) -> &Network {
        &self.network
    }

    /// The GOPs that were played or have begun.
    pub fn shown(&self) -> &[Shown] {
        &self.shown
    }

    /// The pieces of a GOP that have arrived, also those of a running request.
    pub fn arrived(&self, gop: usize) -> Option<&Levels> {
        self.arrived.get(gop)
    }

    /// The pieces of a GOP that can be had, as far as is known.
    pub fn available(&self, gop: usize) -> Option<&Levels> {
        self.available.get(gop)
    }

    /// Bytes of levels that have arrived, of all GOPs together.
    pub fn media_bytes(&self) -> u64 {
        let running = self.request.as_ref().map_or(0, |request| request.progress.bytes);
        self.fetched.iter().fold(running, |sum, bytes| sum.saturating_add(*bytes))
    }

    /// The first GOP that has not begun: pieces of earlier ones are of no use any more.
    pub fn first_open(&self) -> usize {
        match self.playback {
            Playback::Playing if self.is_improved() => self.current,
            Playback::Playing => self.current.saturating_add(1),
            Playback::Ended => self.ladder.gops().len(),
            Playback::Starting | Playback::Stalled => self.current,
        }
    }

    /// The first open GOP that cannot be played yet; the number of GOPs if all can.
    pub fn first_missing(&self) -> usize {
        let open = self.first_open();
        let gops = self.ladder.gops().len();
        (open..gops).find(|&gop| !self.is_ready(gop)).unwrap_or(gops)
    }

    /// Whether the base of a GOP cannot be had: the picture before it stands still for its duration.
    pub fn is_lost(&self, gop: usize) -> bool {
        let base = self.ladder.gops().get(gop).and_then(|gop| gop.points().first());
        base.zip(self.available.get(gop)).is_some_and(|(base, available)| !available.contains(&base.levels))
    }

    /// What can be done with a GOP on this device: the hull of the pieces that can be had (`choices`).
    pub fn choices(&self, gop: usize) -> Vec<Choice> {
        let of = |known: &Gop| {
            let (arrived, available) = self.arrived.get(gop).zip(self.available.get(gop))?;
            Some(match self.target(gop) {
                Some(target) => vec![Choice {
                    levels: arrived.union(&target.levels),
                    bytes: known.missing_bytes(&target.levels, arrived),
                    quality: target.quality,
                }],
                None => available_choices(known, arrived, available, &self.settings.limits),
            })
        };
        self.ladder.gops().get(gop).filter(|_| !self.is_skipped(gop)).and_then(of).unwrap_or_default()
    }

    /// Whether what is shown is shown again as soon as more of it has arrived: where a viewer has the playhead, as long as that
    /// stands still or is in the first quarter of the GOP.
    pub(super) fn is_improved(&self) -> bool {
        let duration_us = self.ladder.gops().get(self.current).map_or(0, Gop::duration_us);
        let is_early = self.offset_ns / 250 < duration_us;
        self.viewer.drives && self.playback == Playback::Playing && (self.viewer.holds || is_early)
    }

    /// Of the points of a GOP up to the one that a viewer has chosen, the best that can be had; none if none is chosen, or
    /// the GOP is lost.
    pub(super) fn target(&self, gop: usize) -> Option<&Point> {
        let most = self.viewer.chosen?;
        let (known, available) = self.ladder.gops().get(gop).zip(self.available.get(gop))?;
        let is_within = |name: &OperatingPoint| {
            name.spatial <= most.spatial
                && name.temporal <= most.temporal
                && name.refinement <= most.refinement
        };
        let points = known.points().iter().filter(|point| available.contains(&point.levels));
        let within = points.clone().filter(|point| is_within(&point.name));
        within.max_by(|a, b| a.quality.total_cmp(&b.quality)).or_else(|| points.clone().next())
    }

    /// What would be shown of a GOP now; none if it cannot be played.
    pub(super) fn showable(&self, gop: usize) -> Option<&Point> {
        let (known, arrived) = self.ladder.gops().get(gop).zip(self.arrived.get(gop))?;
        match self.target(gop) {
            Some(target) => Some(target).filter(|target| arrived.contains(&target.levels)),
            None => known.playable(arrived),
        }
    }

    /// Media seconds in a second of the clock.
    pub(super) fn speed(&self) -> f64 {
        f64::from(self.viewer.speed_milli) / 1000.0
    }

    /// Whether a GOP can be played, or is skipped.
    pub fn is_ready(&self, gop: usize) -> bool {
        if self.is_lost(gop) || self.is_skipped(gop) {
            return true;
        }
        let running = self.request.as_ref().is_some_and(|request| request.fetch.gop() == gop);
        let whole = !self.only_whole || (!running && self.settled.get(gop) == Some(&true));
        whole && self.showable(gop).is_some()
    }

    /// Quality of a GOP as it would be played now; none if it cannot be.
    pub fn quality(&self, gop: usize) -> Option<f64> {
        Some(self.showable(gop)?.quality)
    }

    /// Quality of what is before an open GOP: that of the GOP before it; none before the first.
    pub fn quality_before(&self, gop: usize) -> Option<f64> {
        let before = gop.checked_sub(1)?;
        if before >= self.first_open() {
            return self.quality(before);
        }
        self.shown.last().map(|shown| shown.quality)
    }

    /// Media time from the playhead to the end of what can be played without a gap, in microseconds.
    pub fn buffer_us(&self) -> u64 {
        self.media_until(self.first_missing())
    }

    /// Media time from the playhead to the start of a GOP, in microseconds; 0 if it has begun.
    pub fn media_until(&self, gop: usize) -> u64 {
        let gops = self.ladder.gops().iter().zip(&self.skipped).take(gop).skip(self.current);
        let played = gops.filter(|(_, skipped)| !**skipped).map(|(gop, _)| gop.duration_us());
        let until = played.fold(0, u64::saturating_add);
        until.saturating_sub(self.offset_ns / 1000)
    }

    /// When a GOP can be requested; 0 unless the presentation is live.
    pub fn available_us(&self, gop: usize) -> u64 {
        let available = self.settings.live.map(|live| self.captured_us(live, gop));
        available.and_then(|us| u64::try_from(us).ok()).unwrap_or(0)
    }

    /// When a GOP was captured to its end, on the caller's clock.
    fn captured_us(&self, live: Live, gop: usize) -> i64 {
        let before = self.ladder.gops().iter().take(gop.saturating_add(1)).skip(1).map(Gop::duration_us);
        live.available_us.saturating_add(signed(before.fold(0, u64::saturating_add)))
    }

    /// Time from capture to display of what is playing, in a live presentation.
    pub fn latency_us(&self) -> Option<u64> {
        let live = self.settings.live?;
        let duration_us = self.ladder.gops().get(self.current).or(self.ladder.gops().last())?.duration_us();
        let began_us = self.captured_us(live, self.current).saturating_sub(signed(duration_us));
        let captured_us = began_us.saturating_add(signed(self.offset_ns / 1000));
        Some(u64::try_from(signed(self.now_us).saturating_sub(captured_us)).unwrap_or(0))
    }

    /// When the GOP that is playing ends; none while playback stands still.
    pub fn gop_end_us(&self) -> Option<u64> {
        if self.playback != Playback::Playing || self.viewer.drives {
            return None;
        }
        let gop = self.ladder.gops().get(self.current)?;
        let left_ns = gop.duration_us().saturating_mul(1000).saturating_sub(self.offset_ns);
        let rate = u64::from(self.rate_milli).max(1);
        Some(self.now_us.saturating_add(left_ns.div_ceil(rate)))
    }
}

fn signed(us: u64) -> i64 {
    i64::try_from(us).unwrap_or(i64::MAX)
}
