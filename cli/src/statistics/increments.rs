//! Increments: the models in force for each (clause 6.12), and what its sections cost.

use super::symbols::BitsOfPlanes;
use super::{Planes, Statistics};
use splatstream_decoder::gop::{Gop, Transforms};
use splatstream_decoder::increment::values::PreparedIncrement;
use splatstream_format::entropy::in_force::{ModelsInForce, ModelsOfFrame};
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
    /// The models in force for the next unit of the frame.
    in_force: ModelsOfFrame,
    /// Of each earlier frame, those that frames which refer to it start with.
    first: BTreeMap<u32, ModelsInForce>,
}

impl Increments {
    /// A frame starts with the models of the frame it refers to.
    pub(super) fn start_frame(&mut self, number: u32, gop: &Gop) {
        let place = number.checked_sub(gop.first_frame).map(|place| gop.header.place(place));
        let reference = place.and_then(|place| gop.first_frame.checked_add(place.reference?));
        self.first.insert(self.frame, core::mem::take(&mut self.in_force.first));
        self.frame = number;
        let inherited = reference.and_then(|reference| self.first.get(&reference)).cloned();
        self.in_force.first = inherited.unwrap_or_default();
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
        let mut models = self.in_force.before(unit.header.refinement).clone();
        let sh = ShCoding::of(&increment.header.sh(), tools.sh.map_or(0, |sh| sh.header.rank));
        let mut trace = BitsOfPlanes::default();
        let prepared = PreparedIncrement::new(&increment, tools.dc.header.rank, sh, &mut models, &mut trace)?;
        self.in_force.follow(unit.header.refinement, models);
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
