//! The state machine of playback: events in, decisions out.

use super::fetch::Fetch;
use super::ladder::{Description, Gop, Ladder, LadderError};
use super::levels::Levels;
use super::rule::{Decision, Rule};
use super::state::{Playback, Request, Settings, Shown, State};
use super::throughput::Transfer;

/// One playback of a presentation under a rule. The caller has the clock, the network and the screen: it says what time it
/// is and what has arrived, sends the requests that it is given, and shows what [`State::shown`] says.
///
/// Times are microseconds on the caller's clock and never go back.
#[derive(Debug)]
pub struct Session<R> {
    pub(super) state: State,
    rule: R,
}

impl<R: Rule> Session<R> {
    /// A session that begins now, with nothing fetched.
    pub fn new(ladder: Ladder, settings: Settings, rule: R, now_us: u64) -> Self {
        let whole = rule.whole_gops();
        Self { state: State::new(ladder, settings, now_us, whole), rule }
    }

    /// What it knows.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Adds a GOP at the end of a growing presentation. Playback that had ended waits for it.
    ///
    /// # Errors
    ///
    /// Those of [`Ladder::push`].
    pub fn push(&mut self, now_us: u64, gop: Description) -> Result<(), LadderError> {
        self.advance(now_us);
        self.state.ladder.push(gop)?;
        self.state.grow();
        // It stands still since then.
        if self.state.playback == Playback::Ended {
            self.state.playback = Playback::Stalled;
        }
        Ok(())
    }

    /// What to do now. Ask again after doing it, until the answer is [`Decision::Wait`]; then when its time has come, when
    /// bytes have arrived, and when a GOP has ended ([`State::gop_end_us`]). A request counts as sent when it is returned.
    pub fn decide(&mut self, now_us: u64) -> Decision {
        self.advance(now_us);
        // A rule that held the start back may do so no longer.
        self.resume();
        let state = &mut self.state;
        if state.request.is_none() && state.retry_us > state.now_us {
            return Decision::Wait { until_us: state.retry_us };
        }
        let decision = self.rule.decide(state);
        match &decision {
            Decision::Fetch(fetch) if state.request.is_none() => {
                let now_us = state.now_us;
                let progress = Transfer { sent_us: now_us, first_us: now_us, last_us: now_us, bytes: 0 };
                state.request = Some(Request { fetch: fetch.clone(), begun: false, progress });
            }
            Decision::Abandon if state.request.is_some() => {
                self.end_request(true);
            }
            Decision::Fetch(_) | Decision::Abandon => {
                return Decision::Wait { until_us: state.now_us.saturating_add(1000) };
            }
            Decision::Rate { milli } => state.rate_milli = (*milli).max(1),
            Decision::Wait { .. } => {}
        }
        decision
    }

    /// Says how many bytes of the running request have arrived so far. The first call says that the response has begun, as
    /// soon as that is known, also with 0 bytes: throughput counts from then on. A request ends with its last byte.
    pub fn received(&mut self, now_us: u64, bytes: u64) {
        self.advance(now_us);
        let state = &mut self.state;
        let Some(request) = &mut state.request else { return };
        if !request.begun {
            request.begun = true;
            request.progress.first_us = state.now_us;
        }
        request.progress.last_us = state.now_us;
        request.progress.bytes = bytes.max(request.progress.bytes);
        let (gop, bytes) = (request.fetch.gop(), request.progress.bytes);
        if let (Some(arrived), Some(known)) = (state.arrived.get_mut(gop), state.ladder.gops().get(gop)) {
            arrive(arrived, known, &request.fetch, bytes);
            *arrived = state
                .available
                .get(gop)
                .map_or_else(|| arrived.clone(), |available| arrived.intersection(available));
        }
        if request.progress.bytes >= request.fetch.bytes() {
            state.failures = 0;
            self.end_request(true);
        }
        self.resume();
        self.improve();
    }

    /// Says that the running request has failed. What has arrived of it stays, unless the rule plays whole GOPs only. The
    /// next one waits for 0.1 s, and twice as long after each further failure of which nothing has arrived, up to 3.2 s.
    pub fn failed(&mut self, now_us: u64) {
        self.advance(now_us);
        let has_come = self.state.request.as_ref().is_some_and(|request| request.progress.bytes > 0);
        self.end_request(false);
        let state = &mut self.state;
        if has_come {
            state.failures = 0;
        }
        let wait_us = 100_000_u64 << state.failures.min(5);
        state.failures = state.failures.saturating_add(1);
        state.retry_us = state.now_us.saturating_add(wait_us);
    }

    /// Says that the running request was refused, as a file that is not there is. What has arrived of it stays as after
    /// [`Session::failed`], and the next one does not wait.
    pub fn refused(&mut self, now_us: u64) {
        self.advance(now_us);
        self.end_request(false);
    }

    /// Says that nothing more of a Representation can be had, of no GOP that there is or comes. What has arrived of it is played.
    pub fn give_up_on(&mut self, now_us: u64, representation: usize) {
        self.advance(now_us);
        let state = &mut self.state;
        state.obtainable.lower(representation, 0);
        for (available, arrived) in state.available.iter_mut().zip(&state.arrived) {
            available.lower(representation, arrived.of(representation));
        }
        self.resume();
    }

    /// Says that pieces of a GOP arrived damaged: those of a Representation from a refinement on. They are fetched again where
    /// they are wanted.
    pub fn damaged(&mut self, now_us: u64, gop: usize, representation: usize, refinement: u8) {
        self.advance(now_us);
        if let Some(arrived) = self.state.arrived.get_mut(gop) {
            arrived.lower(representation, refinement);
        }
    }

    /// Says that pieces of a GOP cannot be had: those of a Representation from a refinement on. What needs them is not
    /// fetched, nor what has arrived of them played. If the base is among them, the GOP is lost ([`State::is_lost`]).
    pub fn unavailable(&mut self, now_us: u64, gop: usize, representation: usize, refinement: u8) {
        self.advance(now_us);
        let state = &mut self.state;
        if let Some((available, arrived)) = state.available.get_mut(gop).zip(state.arrived.get_mut(gop)) {
            available.lower(representation, refinement);
            arrived.lower(representation, refinement);
        }
        self.resume();
    }

    /// The running request, if there is one, has ended. A GOP that waited for the whole of it may be ready now.
    pub(super) fn end_request(&mut self, wanted: bool) {
        let state = &mut self.state;
        let Some(request) = state.request.take() else { return };
        state.network.add(request.progress);
        let gop = request.fetch.gop();
        if let Some(fetched) = state.fetched.get_mut(gop) {
            *fetched = fetched.saturating_add(request.progress.bytes);
        }
        if let Some(settled) = state.settled.get_mut(gop) {
            *settled |= wanted;
            if let Some(arrived) = state.arrived.get_mut(gop).filter(|_| state.only_whole && !*settled) {
                *arrived = Levels::none(state.ladder.representations().len());
            }
        }
        self.resume();
    }

    /// Moves the playhead to the present, without asking for a decision.
    pub fn advance(&mut self, now_us: u64) {
        while let Some(end_us) = self.state.gop_end_us().filter(|&end_us| end_us <= now_us) {
            self.state.now_us = end_us.max(self.state.now_us);
            self.state.current = self.state.current.saturating_add(1);
            self.state.offset_ns = 0;
            self.begin();
        }
        let state = &mut self.state;
        if state.playback == Playback::Playing && !state.viewer.drives {
            let passed = now_us.saturating_sub(state.now_us);
            state.offset_ns =
                state.offset_ns.saturating_add(passed.saturating_mul(u64::from(state.rate_milli)));
        }
        state.now_us = now_us.max(state.now_us);
    }

    /// Begins the current GOP right after the one before, or stalls.
    pub(super) fn begin(&mut self) {
        let state = &mut self.state;
        state.pass_skipped();
        state.waiting_since_us = state.now_us;
        if state.current >= state.ladder.gops().len() {
            state.playback = Playback::Ended;
        } else if state.is_ready(state.current) {
            self.show();
        } else {
            state.playback = Playback::Stalled;
        }
    }

    /// Begins the current GOP after a start-up or a stall, as soon as enough is buffered.
    pub(super) fn resume(&mut self) {
        self.state.pass_skipped();
        let state = &self.state;
        let still = matches!(state.playback, Playback::Starting | Playback::Stalled);
        let missing = state.first_missing();
        let enough = state.buffer_us() >= state.settings.start_us || missing >= state.ladder.gops().len();
        if still && missing > state.current && enough && self.rule.may_start(state) {
            self.show();
        }
    }

    pub(super) fn show(&mut self) {
        let state = &mut self.state;
        let gop = state.current;
        let running = state.request.as_ref().filter(|request| request.fetch.gop() == gop);
        let running = running.map_or(0, |request| request.progress.bytes);
        let latency_us = state.latency_us();
        if state.is_lost(gop) {
            state.playback = Playback::Playing;
            return;
        }
        let Some(point) = state.showable(gop).cloned() else { return };
        state.playback = Playback::Playing;
        state.shown.push(Shown {
            gop,
            point: point.name,
            quality: point.quality,
            bytes: point.bytes,
            fetched: state.fetched.get(gop).map_or(0, |fetched| fetched.saturating_add(running)),
            gaussians: point.gaussians,
            began_us: state.now_us,
            waited_us: state.now_us.saturating_sub(state.waiting_since_us),
            latency_us,
            rate_milli: state.rate_milli,
        });
    }
}

/// Adds the pieces of a request that are within its first bytes.
fn arrive(arrived: &mut Levels, gop: &Gop, fetch: &Fetch, bytes: u64) {
    let mut left = bytes;
    for range in fetch.ranges() {
        let pieces = gop.pieces(range.representation).iter().zip(1_u8..);
        for (piece, count) in pieces.filter(|(_, count)| *count > range.from && *count <= range.to) {
            let Some(rest) = left.checked_sub(piece.bytes) else { return };
            left = rest;
            arrived.raise(range.representation, count);
        }
    }
}
