//! What a rule sees and answers.

use super::fetch::Fetch;
use super::levels::Levels;
use super::options::{order, whole_ranges};
use super::state::State;

/// What the caller of a session is asked to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Decision {
    /// Send one request, for byte ranges of one GOP that are to arrive in this order.
    Fetch(Fetch),
    /// Ask again at this time, or when bytes arrive, whatever comes first.
    Wait {
        /// Microseconds of the caller's clock.
        until_us: u64,
    },
    /// Give the running request up. What has arrived of it stays.
    Abandon,
    /// Play at another rate.
    Rate {
        /// Thousandths of the normal rate.
        milli: u32,
    },
}

impl Fetch {
    /// What is missing of a set of pieces, so ordered that any part of it is worth as much as it can be; none if all are
    /// there or the GOP is not.
    pub fn towards(state: &State, gop: usize, wanted: &Levels) -> Option<Self> {
        Self::new(gop, order(state.ladder().gops().get(gop)?, state.arrived(gop)?, wanted))
    }

    /// The same with one range for each Representation, for when there is time for all of it.
    pub fn at_leisure(state: &State, gop: usize, wanted: &Levels) -> Option<Self> {
        Self::new(gop, whole_ranges(state.ladder().gops().get(gop)?, state.arrived(gop)?, wanted))
    }
}

/// Decides what a player does next.
pub trait Rule {
    /// What to do in a state. [`Decision::Fetch`] is ignored while a request is running, [`Decision::Abandon`] otherwise.
    fn decide(&mut self, state: &State) -> Decision;

    /// Whether a GOP is played only when all that was chosen for it has arrived, as players without layers do. Otherwise
    /// what is there when its time comes is played.
    fn whole_gops(&self) -> bool {
        false
    }

    /// Whether playback may start in a state in which enough has arrived for it. It starts later where more is to come first.
    fn may_start(&self, state: &State) -> bool {
        let _ = state;
        true
    }
}

impl<R: Rule + ?Sized> Rule for Box<R> {
    fn decide(&mut self, state: &State) -> Decision {
        (**self).decide(state)
    }

    fn whole_gops(&self) -> bool {
        (**self).whole_gops()
    }

    fn may_start(&self, state: &State) -> bool {
        (**self).may_start(state)
    }
}
