//! One frame to its units.
//!
//! An [I frame](intra) stands for itself, a [predicted frame](predicted) changes the lists of its reference. Both put
//! their [new Gaussians](new_list) into lists, choose what these are [predicted](predictors) from, and hand each
//! [unit](unit) over to be coded.

pub(crate) mod axis_matching;
pub(crate) mod cells;
pub(crate) mod compensation;
pub(crate) mod deviation;
mod difference;
pub(crate) mod grain;
pub(crate) mod intra;
pub(crate) mod ladder;
pub(crate) mod learning;
mod moves;
pub(crate) mod new_list;
pub(crate) mod predicted;
pub(crate) mod predictors;
pub(crate) mod rate_distortion;
pub(crate) mod recorder;
pub(crate) mod residuals;
pub(crate) mod steadiness;
pub(crate) mod survivors;
pub(crate) mod target;
pub(crate) mod training_memory;
pub(crate) mod unit;
mod update_decision;
pub(crate) mod visible_difference;
mod worth;

use crate::error::Error;
use crate::matching::Matching;
use crate::savings::Saving;
use deviation::Deviation;
use splatstream_decoder::list::GaussianList;
use splatstream_format::entropy::in_force::ModelsInForce;
use splatstream_format::payload::CellsBytes;
use splatstream_format::syntax::IncrementHeader;
use target::Target;
use unit::UnitCoder;

/// A coded frame that others refer to.
pub(crate) struct Reference {
    pub(crate) lists: Vec<GaussianList>,
    /// log2 of how many frames it is later than the one it refers to.
    pub(crate) span_log2: u8,
    /// What is carried of each list; none where anchors are nested, as only who has all of the I frame compares it.
    carried: Vec<GaussianList>,
    /// The models in force for a frame that refers to this one.
    models: ModelsInForce,
    /// The row in its file of each Gaussian, list by list.
    rows: Vec<Vec<u32>>,
    /// Rows of the file.
    row_count: u32,
    /// What its Gaussians differ by from their source; none: nothing of it stays in frames that refer to this one.
    deviation: Option<Deviation>,
}

impl Reference {
    /// Has what is predicted from a frame follow what was decoded of it, and not its source alone. `is_fitted`: all of the way, since
    /// values were chosen by pictures.
    ///
    /// # Errors
    /// Lists whose planes make no frame.
    pub(crate) fn differs_from(
        &mut self,
        target: &Target,
        coder: &UnitCoder<'_>,
        is_fitted: bool,
    ) -> Result<(), Error> {
        self.deviation = Some(Deviation::of((&self.lists, &self.rows), target, coder, is_fitted)?);
        Ok(())
    }

    /// Whether it differs from its source because values were fitted.
    pub(crate) fn is_fitted(&self) -> bool {
        self.deviation.as_ref().is_some_and(|deviation| deviation.is_fitted)
    }

    /// What it differs by from its source, if that is what rounding has made of it.
    pub(crate) fn rounded(&self) -> Option<&Deviation> {
        self.deviation.as_ref().filter(|deviation| !deviation.is_fitted)
    }

    /// What a frame shall become that is predicted from this one; none: what its source has.
    pub(crate) fn followed(
        &self,
        target: &Target,
        matching: &Matching,
        coder: &UnitCoder<'_>,
    ) -> Option<Target> {
        let deviation = self.deviation.as_ref()?;
        Some(deviation.added_to(target, (&self.lists, matching), coder))
    }
}

/// A unit ready to be written.
pub(crate) struct CodedUnit {
    pub(crate) spatial_layer: u8,
    pub(crate) refinement: u8,
    pub(crate) header: IncrementHeader,
    pub(crate) payload: Vec<u8>,
    /// New Gaussians by predictor.
    pub(crate) predicted: [u64; 4],
    /// Bytes that prediction saves, where both were coded.
    pub(crate) prediction_saves: usize,
    /// Bytes that models of the refinement before save, where that was measured.
    pub(crate) reuse_saves: usize,
}

/// A frame ready to be written.
pub(crate) struct CodedFrame {
    pub(crate) cells: Option<CellsBytes>,
    pub(crate) carried_digest: Option<u64>,
    pub(crate) units: Vec<CodedUnit>,
    /// The frame as others refer to it.
    pub(crate) reference: Reference,
    /// What choices save, where that was asked for.
    pub(crate) savings: Vec<Saving>,
}

impl CodedFrame {
    /// Bytes of its units, without their headers.
    #[expect(clippy::arithmetic_side_effects, reason = "lengths of what is in memory")]
    pub(crate) fn bytes(&self) -> f64 {
        let units: usize = self.units.iter().map(|unit| unit.payload.len()).sum();
        let cells = self.cells.as_ref().map_or(0, |cells| {
            cells.section.model.len() + cells.section.blocks.iter().map(Vec::len).sum::<usize>()
        });
        (units + cells) as f64
    }

    /// Bits of a Gaussian of the last refinement that adds any, its updates included; 0 if none does.
    #[expect(clippy::arithmetic_side_effects, reason = "lengths of what is in memory")]
    pub(crate) fn least_bits(&self) -> f64 {
        let last =
            self.units.iter().filter(|unit| unit.header.new_count > 0).map(|unit| unit.refinement).max();
        let units = self.units.iter().filter(|unit| Some(unit.refinement) == last);
        let (bytes, new) = units.fold((0, 0.0), |(bytes, new), unit| {
            (bytes + unit.payload.len(), new + f64::from(unit.header.new_count))
        });
        if new > 0.0 { 8.0 * bytes as f64 / new } else { 0.0 }
    }

    /// Gaussians of the frame.
    pub(crate) fn gaussians(&self) -> u32 {
        self.reference.lists.iter().map(GaussianList::len).sum::<usize>() as u32
    }
}
