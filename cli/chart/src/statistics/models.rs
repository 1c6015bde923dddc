//! The models in force for each section (clause 6.12), and what sections cost.

use super::symbols::BitsOfPlanes;
use super::{Planes, Statistics};
use splatstream_decoder::block::{BufferPool, Workspace};
use splatstream_decoder::increment::values::{PreparedSections, SectionCoding};
use splatstream_decoder::interrupt::Interrupt;
use splatstream_decoder::process::{Gop, Transforms};
use splatstream_decoder::steps::StepRule;
use splatstream_format::Result;
use splatstream_format::entropy::in_force::{ModelsInForce, ModelsOfFrame};
use splatstream_format::entropy::layout::ShCoding;
use splatstream_format::payload::{Cells, CodedSection, Increment};
use splatstream_format::syntax::SequenceParameters;
use std::collections::BTreeMap;

/// The frames of a GOP.
#[derive(Default)]
pub(super) struct Models {
    frame: u32,
    /// The models in force for the next unit of the frame.
    in_force: ModelsOfFrame,
    /// Of each earlier frame, those that frames which refer to it start with.
    first: BTreeMap<u32, ModelsInForce>,
}

impl Models {
    /// A frame starts with the models of the frame it refers to.
    pub(super) fn start_frame(&mut self, index: u32, gop: &Gop) {
        let role = index.checked_sub(gop.first_frame).map(|index| gop.header.role(index));
        let reference = role.and_then(|role| gop.first_frame.checked_add(role.reference?));
        let before = core::mem::take(&mut self.in_force.first);
        if gop.header.is_predicted() {
            self.first.insert(self.frame, before);
        }
        self.frame = index;
        let inherited = reference.and_then(|reference| self.first.get(&reference)).cloned();
        self.in_force.first = inherited.unwrap_or_default();
    }

    /// Adds the costs of the cells of a frame.
    pub(super) fn cells(
        &mut self,
        cells: &Cells<'_>,
        sequence: &SequenceParameters,
        statistics: &mut Statistics,
    ) -> Result<()> {
        let sections = core::slice::from_ref(&cells.coded);
        let steps = StepRule::new(sequence, [0; 5]);
        let coding = SectionCoding { dc_rank: 0, sh: ShCoding::None, steps };
        add(sections, &coding, &mut self.in_force.first, sequence, statistics)
    }

    /// Adds the costs of an increment.
    pub(super) fn increment(
        &mut self,
        increment: &Increment<'_>,
        refinement: u8,
        tools: Transforms<'_>,
        sequence: &SequenceParameters,
        statistics: &mut Statistics,
    ) -> Result<()> {
        let mut models = self.in_force.before(refinement).clone();
        let sh = ShCoding::of(&increment.header.sh(), tools.sh.map_or(0, |sh| sh.header.rank));
        let steps = StepRule::new(sequence, increment.header.attribute_step);
        let coding = SectionCoding { dc_rank: tools.dc.header.rank, sh, steps };
        add(&increment.sections, &coding, &mut models, sequence, statistics)?;
        self.in_force.follow(refinement, models);
        Ok(())
    }
}

/// Adds the costs of sections; `models` are those in force before them, and then after them.
fn add(
    sections: &[CodedSection<'_>],
    coding: &SectionCoding,
    models: &mut ModelsInForce,
    sequence: &SequenceParameters,
    statistics: &mut Statistics,
) -> Result<()> {
    let mut trace = BitsOfPlanes::default();
    let prepared = PreparedSections::new(sections, coding, models, &mut trace)?;
    // The bits of models come plane by plane through all sections.
    let mut bits = trace.bits.as_slice();
    for (coded, models) in prepared.sections() {
        let (here, after) = bits.split_at_checked(models.models.len()).unwrap_or((bits, &[]));
        let workspace = Workspace { buffers: &BufferPool::default(), interrupt: Interrupt::NEVER };
        let blocks = prepared.blocks(coded, models, sequence, workspace)?;
        let blocks: Vec<_> = blocks.into_iter().map(|block| block.with_sums(&models.layout)).collect();
        let planes = Planes { layout: &models.layout, models: &models.models, blocks: &blocks };
        statistics.add(coded.count, &planes, here);
        bits = after;
    }
    Ok(())
}
