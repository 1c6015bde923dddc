//! What choices save the first frame, as far as coding it tells: `encode` says so beside each choice.

use super::{Gop, Intra, SpanCoder};
use crate::error::Error;
use crate::frame::CodedFrame;
use crate::savings::{Saving, Tool};
use crate::settings::Preset;

impl SpanCoder<'_> {
    /// Whether it is told what choices save a frame: the first one, if it has Gaussians; not where time counts.
    pub(super) fn tells_savings(&self, number: u32) -> bool {
        let settings = self.common.settings;
        number == 0
            && self.report.coded.is_empty()
            && settings.preset != Preset::Fast
            && self.recorder.is_none()
    }

    /// Whether it is told what spatial layers save a frame.
    pub(super) fn weighs_layers(&self, number: u32) -> bool {
        let has_layers = self.common.sequence.spatial_layer_count > 1;
        has_layers && self.common.settings.finetune.is_none() && self.tells_savings(number)
    }

    /// Tells what spatial layers save the first frame, or rather cost it: it is coded without them as well.
    pub(super) fn weigh_layers(&mut self, gop: &Gop, last: u32, order: Vec<u32>) -> Result<(), Error> {
        let before = self.report.clone();
        let intra = Intra { target: self.target(gop.first)?, order };
        let alone = self.alone(gop.first, last, intra)?;
        self.report = before;
        let bits = 8.0 * (alone.intra_bytes - gop.intra_bytes);
        self.report.savings.push(Saving::measured(Tool::SpatialLayers, bits));
        Ok(())
    }
}

/// What tables of the refinement before save an I frame, if that was measured.
pub(super) fn worth_of_reuse(coded: &CodedFrame) -> Option<Saving> {
    let bytes: usize = coded.units.iter().map(|unit| unit.reuse_saves).sum();
    let bits = 8.0 * bytes as f64 / f64::from(coded.gaussians().max(1));
    (!coded.savings.is_empty()).then(|| Saving::measured(Tool::TableReuse, bits))
}
