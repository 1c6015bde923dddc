//! What the rule for layered streams does with time in which nothing else is to be fetched.

use super::start::{SHORT_US, whole_of_first};
use super::{Layered, request};
use crate::control::fetch::Fetch;
use crate::control::number::seconds;
use crate::control::plan::{Outlook, best};
use crate::control::state::State;

/// Whether GOPs that were played are fetched, since they are likely to be played again: a viewer has the playhead, all of the
/// presentation fits into the buffer, and it is short or is played in a loop.
pub(super) fn is_played_again(state: &State) -> bool {
    let duration_us = state.ladder().duration_us();
    let is_kept = state.settings().live.is_none() && duration_us <= state.settings().buffer_us;
    state.viewer.drives && is_kept && (duration_us <= SHORT_US || state.viewer.loops)
}

impl Layered {
    /// What improves GOPs of a presentation whose bases are all there: first those that are still to begin, then all of them
    /// for the next round.
    pub(super) fn in_spare_time(&self, state: &State, outlook: &Outlook) -> Option<Fetch> {
        if state.settings().live.is_some() || state.first_missing() < state.ladder().gops().len() {
            return None;
        }
        self.before_end(state, outlook).or_else(|| for_next_round(state))
    }

    /// The improvement that a plan begins with which treats all GOPs that have not begun as one: a single GOP that is better
    /// than those around it gains nothing, so that choosing one GOP at a time would improve none. The plan may
    /// begin with a later GOP, if nothing can come in time for those before it.
    fn before_end(&self, state: &State, outlook: &Outlook) -> Option<Fetch> {
        let stages = self.stages(state, state.first_open());
        let mut rest = stages.as_slice();
        while let Some((stage, later)) = rest.split_first() {
            let outlook = Outlook {
                throughput: outlook.throughput * self.weights.haste,
                buffer: seconds(state.media_until(stage.gop)),
                before: state.quality_before(stage.gop),
                price: 0.0,
                ..*outlook
            };
            let (index, _) = best(rest, &outlook);
            if let Some(chosen) = stage.choices.get(index).filter(|chosen| chosen.bytes > 0) {
                return request(state, &outlook, stage.gop, &chosen.levels);
            }
            rest = later;
        }
        None
    }
}

/// All that is missing of a GOP, in the order in which the next round comes to them: that after the playhead first.
fn for_next_round(state: &State) -> Option<Fetch> {
    let gops = state.ladder().gops().len();
    let open = state.first_open().min(gops);
    if is_played_again(state) { whole_of_first(state, (open..gops).chain(0..open)) } else { None }
}
