//! Which predictor new Gaussians take.

use super::unit::{Draft, UnitCoder};
use crate::error::Error;
use crate::settings::PredictorChoice;
use splatstream_decoder::home::Home;
use splatstream_decoder::increment::{Applied, Situation};
use splatstream_decoder::layout::Section;

/// How predictors are chosen.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Chooser(pub(crate) PredictorChoice);

impl Chooser {
    /// Gives the new Gaussians of a draft their predictors, and what a decoder makes of it.
    ///
    /// # Errors
    /// What the decoder's own checks refuse.
    pub(crate) fn choose(
        self,
        coder: &UnitCoder<'_>,
        draft: &mut Draft,
        parents: &Home,
        situation: &Situation<'_>,
        _added: &[u32],
        _wanted: impl Fn(u32) -> ([i32; 3], i32, [i32; 3]),
    ) -> Result<Applied, Error> {
        coder.apply(draft, parents.clone(), situation)
    }
}

/// New Gaussians by predictor: none, knn, bilateral.
pub(crate) fn used(draft: &Draft) -> [u64; 3] {
    let mut counts = [0; 3];
    let total = draft.header.new_count as usize;
    let codes = draft.values.plane(Section::Predictors, 0);
    if codes.is_empty() {
        counts[0] = total as u64;
        return counts;
    }
    let run = 1_usize << draft.header.predictor_block_log2;
    for (place, &code) in codes.iter().enumerate() {
        counts[code as usize] += (total - place * run).min(run) as u64;
    }
    counts
}
