//! What a playback was like.

use crate::control::Ladder;
use crate::playback::{GopLog, Loss, PlayedGop};
use crate::qoe::Score;
use crate::simulation::Report;

/// Takes what is to be shown. It should return at once, as nothing is fetched meanwhile.
pub trait Screen {
    /// Shows a GOP from now on.
    fn show(&mut self, gop: &PlayedGop<'_>);
}

impl<F: FnMut(&PlayedGop<'_>)> Screen for F {
    fn show(&mut self, gop: &PlayedGop<'_>) {
        self(gop);
    }
}

/// A playback.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// What was played when. `requests` are those of HTTP, of which a fetch may have several.
    pub report: Report,
    /// All GOPs, in order.
    pub gops: Vec<GopLog>,
    /// What was left out, in the order in which it was given up.
    pub losses: Vec<Loss>,
    /// The presentation as it was planned.
    pub ladder: Ladder,
}

impl Outcome {
    /// What it was worth.
    pub fn score(&self) -> Score {
        Score::of(&self.ladder, &self.report)
    }
}
