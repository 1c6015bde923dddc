//! The start of playback under the rule for layered streams: what is fetched before it, and how long it waits for that.

use super::Layered;
use crate::control::fetch::Fetch;
use crate::control::number::{real, seconds};
use crate::control::plan::{Outlook, best};
use crate::control::state::State;
use crate::control::throughput::Transfer;
use core::ops::Range;

/// Time from the beginning of a session within which the start may wait for more than the base.
const ALLOWANCE_US: u64 = 1_000_000;

/// A presentation up to this duration is short: it is fetched whole before it starts, where that is quick, and is kept for
/// when it is played again.
pub(super) const SHORT_US: u64 = 8_000_000;

/// A response that has come within this many seconds does not prove a higher throughput than if it had taken so long: its
/// bytes may have come at once with its head.
const PROVEN_SECONDS: f64 = 0.005;

/// Duration of a presentation from which a change of quality counts in full.
const LASTING_US: u64 = 4_000_000;

/// Duration of a stored presentation as a share of [`LASTING_US`], at most 1. A change of quality counts so much less in a
/// presentation that is shorter: what it costs would never be regained there, so that the base would be played to its end.
pub(super) fn shortness(state: &State) -> f64 {
    let us = if state.settings().live.is_some() { LASTING_US } else { state.ladder().duration_us() };
    (seconds(us) / seconds(LASTING_US)).min(1.0)
}

impl Layered {
    /// Whether the start, for which enough has arrived, waits: for a request that was sent for that, or for one that will be.
    pub(super) fn holds(&self, state: &State) -> bool {
        if !is_before_start(state) {
            return false;
        }
        match state.request() {
            // What is asked for first was planned for the throughput that is guessed: it is worth the wait if there is as much.
            Some(request) if state.network().last().is_none() => {
                proof(&request.progress) >= self.weights.first_guess
            }
            Some(_) => true,
            None => self.before_start(state).is_some(),
        }
    }

    /// What is fetched while the start waits, if it does. A presentation that can be had whole, so that none of it comes too
    /// late if playback starts within the allowance, is fetched whole. Otherwise the first GOP is fetched up to the point
    /// that a plan finds best in which the wait costs as much as a stall.
    pub(super) fn before_start(&self, state: &State) -> Option<Fetch> {
        if !is_before_start(state) {
            return None;
        }
        let outlook = Outlook { buffer: 0.0, before: None, ..self.proven(state)? };
        let left = seconds(ALLOWANCE_US.saturating_sub(state.waiting_us()));
        let late = lateness(state, &outlook);
        if late <= left {
            return whole_of_first(state, open(state)).filter(|_| late > 0.0);
        }
        let first = state.current();
        let stages = self.stages(state, first);
        let (index, _) = best(&stages, &outlook);
        let chosen = stages.into_iter().next()?.choices.into_iter().nth(index)?;
        let fits = outlook.time(chosen.bytes) <= left;
        if fits { Fetch::at_leisure(state, first, &chosen.levels) } else { None }
    }

    /// What is fetched next of a short presentation, if all that is missing of the GOPs that have not begun comes in time:
    /// then no picture has to become worse for a while, as it would by a rule that fears an empty buffer.
    pub(super) fn all_in_time(&self, state: &State) -> Option<Fetch> {
        let in_time = is_short(state) && !state.viewer.holds && lateness(state, &self.proven(state)?) <= 0.0;
        if in_time { whole_of_first(state, open(state)) } else { None }
    }

    /// The outlook with no more throughput than the last transfer proves, and some in reserve; none before the first transfer.
    fn proven(&self, state: &State) -> Option<Outlook> {
        let most = proof(state.network().last()?) / state.speed();
        let outlook = self.outlook(state);
        Some(Outlook { throughput: outlook.throughput.min(most) * self.weights.haste, ..outlook })
    }
}

/// The throughput in bits per second that a transfer proves.
fn proof(transfer: &Transfer) -> f64 {
    real(transfer.bytes) * 8.0 / transfer.duration().max(PROVEN_SECONDS)
}

/// Whether all of a stored presentation is buffered, and it is short.
fn is_short(state: &State) -> bool {
    let duration_us = state.ladder().duration_us();
    state.settings().live.is_none() && duration_us <= SHORT_US.min(state.settings().buffer_us)
}

/// Whether playback of a short presentation has not started, its first GOP can be played, and there is time to make it better.
fn is_before_start(state: &State) -> bool {
    state.shown().is_empty()
        && is_short(state)
        && !state.viewer.holds
        && state.waiting_us() < ALLOWANCE_US
        && state.is_ready(state.current())
        && !state.is_lost(state.current())
}

/// The GOPs that have not begun.
fn open(state: &State) -> Range<usize> {
    state.first_open()..state.ladder().gops().len()
}

/// How much later than when it begins all of a GOP is there, if everything is fetched: of the latest one, in seconds; 0 if none
/// is late.
fn lateness(state: &State, outlook: &Outlook) -> f64 {
    let (mut time, mut late) = (0.0, 0.0_f64);
    for gop in open(state) {
        let missing = state.choices(gop).last().map_or(0, |best| best.bytes);
        time += outlook.time(missing);
        if missing > 0 {
            late = late.max(time - seconds(state.media_until(gop)));
        }
    }
    late
}

/// All that is missing of the first of some GOPs that is not whole.
pub(super) fn whole_of_first(state: &State, mut gops: impl Iterator<Item = usize>) -> Option<Fetch> {
    gops.find_map(|gop| Fetch::at_leisure(state, gop, &state.choices(gop).pop()?.levels))
}
