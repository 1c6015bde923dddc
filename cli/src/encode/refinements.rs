//! How many Gaussians each refinement brings, as `--refinements` says it.

use crate::failure::Failure;
use splatstream_encoder::{FrameSource, Settings, refinements_by_slope};
use splatstream_format::syntax::MAX_REFINEMENTS;
use std::str::FromStr;

/// Before the number of refinements whose shares are to be chosen.
const CHOSEN: &str = "auto:";

/// What the option takes.
const ALLOWED: &str = "--refinements takes 1 to 10 rising percentages, the last 100, as 10,20,50,100";

/// The shares of the Gaussians up to each refinement.
#[derive(Clone)]
pub(super) enum Refinements {
    /// Percentages.
    Given(Vec<u8>),
    /// So many, where pictures gain most.
    Chosen(u8),
}

impl FromStr for Refinements {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if let Some(count) = text.strip_prefix(CHOSEN) {
            let count = count.parse().ok().filter(|count| (1..=MAX_REFINEMENTS).contains(count));
            return count.map(Self::Chosen).ok_or_else(|| format!("'{text}' is not auto:1 to auto:10"));
        }
        let percent = |word: &str| word.parse().map_err(|_| format!("'{word}' is not a percentage"));
        text.split(',').map(percent).collect::<Result<_, _>>().map(Self::Given)
    }
}

impl Refinements {
    /// Refuses percentages that no stream can have.
    pub(super) fn check(&self) -> Result<(), Failure> {
        let Self::Given(percents) = self else { return Ok(()) };
        let is_rising = percents.is_sorted_by(|a, b| a < b) && percents.first() != Some(&0);
        if is_rising && percents.len() <= MAX_REFINEMENTS.into() && percents.last() == Some(&100) {
            return Ok(());
        }
        Err(Failure::Usage(ALLOWED.to_owned()))
    }

    /// Puts the percentages for the frames of a source into settings that are complete but for them.
    pub(super) fn put(
        &self,
        source: &mut dyn FrameSource,
        settings: &mut Settings,
    ) -> Result<(), splatstream_encoder::Error> {
        settings.refinements = match self {
            Self::Given(percents) => percents.clone(),
            Self::Chosen(count) => refinements_by_slope(source, settings, *count)?,
        };
        Ok(())
    }
}
