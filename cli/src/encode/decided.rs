//! What was decided for a user who left it open.

use super::choice::Choice;
use super::choices;
use super::effort::Budget;
use super::warnings::Warning;
use crate::assumed_up::AssumedUp;

/// What was decided for a user who left it open.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Decided {
    /// What was taken to point up.
    pub(super) assumed_up: Option<AssumedUp>,
    /// What was chosen for a time.
    pub(super) budget: Option<Budget>,
}

impl Decided {
    /// What the report says of it.
    pub(super) fn choices(&self) -> impl Iterator<Item = Choice> {
        self.budget.as_ref().map(Budget::choice).into_iter().chain(self.assumed_up.map(choices::up))
    }

    /// What a user should know.
    pub(super) fn warnings(&self) -> Option<Warning> {
        self.budget.as_ref().and_then(Budget::warning)
    }
}
