//! A state and the settings that it belongs to. These hold what is asked for of fitting, and that holds the state: here both are
//! known.

use super::state::FinetuneState;
use super::state_error::StateError;
use crate::plan::described;
use crate::settings::Settings;
use std::path::Path;

impl FinetuneState {
    /// In a directory without one. It is made when the first fit begins, if it is not there.
    ///
    /// # Errors
    /// A directory that has a state, or cannot be read.
    pub fn create(directory: &Path, settings: &Settings) -> Result<Self, StateError> {
        Self::create_for(directory, &described(settings))
    }

    /// As an earlier run has left it, or as [`create`](FinetuneState::create) makes it where none has left anything.
    ///
    /// # Errors
    /// The state of a run with other settings, or of another version of the encoder; a directory that cannot be read.
    pub fn resume(directory: &Path, settings: &Settings) -> Result<Self, StateError> {
        Self::resume_for(directory, &described(settings))
    }
}
