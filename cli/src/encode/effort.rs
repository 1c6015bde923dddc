//! How much is done for a stream: a preset and iterations of fitting to pictures, given or chosen for a time.

use super::choice::Choice;
use super::warnings::Warning;
use crate::numbers::{counted, frames};
use crate::setting_names::{PresetName, spelled};
use splatstream_encoder::{Effort, Work};

/// A time that was asked for, and what was chosen for it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Budget {
    seconds: f64,
    work: Work,
    effort: Effort,
}

impl Budget {
    /// The most that fits into a time.
    pub(super) fn of(seconds: f64, work: Work) -> Self {
        Self { seconds, work, effort: Effort::within(seconds, &work) }
    }

    /// What was chosen.
    pub(super) fn effort(&self) -> Effort {
        self.effort
    }

    fn expected(&self) -> f64 {
        self.effort.seconds(&self.work)
    }

    /// What the report says of it.
    pub(super) fn choice(&self) -> Choice {
        let Effort { preset, iterations } = self.effort;
        let fitted = match iterations {
            0 => String::new(),
            _ => format!(", {} of fitting to pictures", counted(iterations.into(), "iteration")),
        };
        let choice = format!("{}{fitted}", spelled(PresetName::from(preset)));
        let why = format!(
            "--time-budget {}: expected {:.2} seconds of one processor for {} in the first of {}, by a model of costs",
            self.seconds,
            self.expected(),
            counted(self.work.gaussians, "Gaussian"),
            frames(self.work.frames),
        );
        Choice::new("time budget", choice, why)
    }

    /// That even the least takes longer.
    pub(super) fn warning(&self) -> Option<Warning> {
        let message = format!(
            "the fast preset is expected to take {:.2} seconds of one processor, more than the {} of --time-budget; nothing is faster \
             but fewer Gaussians or frames",
            self.expected(),
            self.seconds
        );
        (self.expected() > self.seconds).then(|| Warning::new("time-budget-exceeded", message))
    }
}
