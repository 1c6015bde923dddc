//! Increments: the models in force for each (clause 6.12), and what its sections cost.

use super::symbols::BitsOfPlanes;
use super::{Planes, Statistics};
use splatstream_decoder::gop::{Gop, Transforms};
use splatstream_decoder::increment::values::PreparedIncrement;
use splatstream_format::entropy::in_force::ModelsInForce;
use splatstream_format::entropy::layout::ShCoding;
use splatstream_format::payload::Increment;
use splatstream_format::syntax::SequenceParameters;
use splatstream_format::unit::Unit;
use splatstream_format::{Limits, Result};
use std::collections::BTreeMap;

/// The increments of a group.
#[derive(Default)]
pub(super) struct Increments {
    frame: u32,
    /// Of each frame, the models in force for the next unit 0 that follows it: of the next layer, or of a frame that
    /// refers to it.
    first: BTreeMap<u32, ModelsInForce>,
    /// The models in force for the next unit of a higher refinement.
    current: ModelsInForce,
}

impl Increments {
    /// A frame starts with the models of the frame it refers to.
    pub(super) fn start_frame(&mut self, number: u32, gop: &Gop) {
        let place = number.checked_sub(gop.first_frame).map(|place| gop.header.place(place));
        let reference = place.and_then(|place| gop.first_frame.checked_add(place.reference?));
        let inherited = reference.and_then(|reference| self.first.get(&reference)).cloned();
        self.first.insert(number, inherited.unwrap_or_default());
        self.frame = number;
    }

    /// Adds the costs of a unit.
    pub(super) fn unit(
        &mut self,
        unit: &Unit<'_>,
        sequence: &SequenceParameters,
        tools: Transforms<'_>,
        limits: &Limits,
        statistics: &mut Statistics,
    ) -> Result<()> {
        let increment = Increment::parse(unit.payload, unit.payload_at, sequence, limits)?;
        let is_first = unit.header.refinement == 0;
        let first = self.first.entry(self.frame).or_default();
        let mut models = if is_first { first.clone() } else { self.current.clone() };
        let sh = ShCoding::of(&increment.header.sh(), tools.sh.map_or(0, |sh| sh.header.rank));
        let mut trace = BitsOfPlanes::default();
        let prepared = PreparedIncrement::new(&increment, tools.dc.header.rank, sh, &mut models, &mut trace)?;
        if is_first {
            first.clone_from(&models);
        }
        self.current = models;
        // The bits of models come plane by plane through all sections.
        let mut bits = trace.bits.as_slice();
        for (coded, models) in prepared.sections() {
            let (here, behind) = bits.split_at_checked(models.models.len()).unwrap_or((bits, &[]));
            let blocks = prepared.blocks(coded, models, sequence)?;
            let planes = Planes { layout: &models.layout, models: &models.models, blocks: &blocks };
            statistics.add(coded.count, &planes, here);
            bits = behind;
        }
        Ok(())
    }
}
