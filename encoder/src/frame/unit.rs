//! Codes one increment: values chosen elsewhere are applied as a decoder applies them, then entropy coded.

use super::grain::{Grain, Grains};
use crate::error::Error;
use crate::section::{SectionDraft, SectionPlan, biases};
use splatstream_decoder::colour::Colour;
use splatstream_decoder::increment::residual::AttributeCoding;
use splatstream_decoder::increment::values::{SectionValues, UnitValues};
use splatstream_decoder::increment::{Applied, Situation, Unit, apply};
use splatstream_decoder::interrupt::Interrupt;
use splatstream_decoder::layout::{Layout, Section};
use splatstream_decoder::list::GaussianList;
use splatstream_decoder::steps::StepRule;
use splatstream_format::Limits;
use splatstream_format::entropy::in_force::ModelsInForce;
use splatstream_format::payload::{Network, SectionBytes, write_increment};
use splatstream_format::syntax::{IncrementHeader, NO_PREDICTOR, SequenceParameters, ShHeader};

/// What the units of a frame have in common.
#[derive(Clone, Copy)]
pub(crate) struct UnitCoder<'a> {
    pub(crate) sequence: &'a SequenceParameters,
    pub(crate) colour: Colour<'a>,
    pub(crate) sh: ShHeader,
    pub(crate) plan: SectionPlan,
    /// How finely each refinement is coded.
    pub(crate) grains: Grains,
    /// Whether something may be coded as a difference to other Gaussians.
    pub(crate) has_differences: bool,
    /// The learned predictor of the GOP.
    pub(crate) network: Option<&'a Network>,
    /// New Gaussians of a unit that it may predict.
    pub(crate) max_learned: u32,
}

/// A unit before it is coded.
#[derive(Debug, Clone)]
pub(crate) struct Draft {
    pub(crate) header: IncrementHeader,
    pub(crate) values: UnitValues,
}

impl Draft {
    /// Whether new Gaussians are predicted.
    pub(crate) fn is_predicted(&self) -> bool {
        self.header.predictor_block_log2 != NO_PREDICTOR
    }

    /// Takes new Gaussians as they are without prediction.
    pub(crate) fn add(&mut self, new: SectionValues) {
        self.header.new_count = new.deltas.len() as u32;
        self.values.set(Section::New, new);
    }
}

impl UnitCoder<'_> {
    /// A unit that changes and adds nothing.
    pub(crate) fn blank(&self, grain: Grain) -> Draft {
        let Grain { position_shift, attribute_step } = grain;
        let ShHeader { sh_mode, vq_stage_count, codebook_ids } = self.sh;
        let header = IncrementHeader {
            position_shift,
            attribute_step,
            sh_mode,
            vq_stage_count,
            codebook_ids,
            ..IncrementHeader::PLAIN
        };
        Draft { header, values: UnitValues::default() }
    }

    /// Values of a plane in a block.
    pub(crate) fn block(&self) -> usize {
        1 << self.sequence.block_log2
    }

    /// The values of a section without positions.
    pub(crate) fn section(&self, planes: Vec<Vec<i32>>) -> SectionValues {
        SectionValues { deltas: Vec::new(), planes, block: self.block() }
    }

    /// The steps of a unit with these exponents.
    pub(crate) fn steps(&self, attribute_step: [u8; 5]) -> StepRule {
        StepRule::new(self.sequence, attribute_step)
    }

    /// How attributes are coded with these exponents of steps.
    pub(crate) fn coding(&self, attribute_step: [u8; 5]) -> AttributeCoding<'_> {
        AttributeCoding {
            steps: self.steps(attribute_step),
            canonical_axes: self.sequence.canonical_axes(),
            colour: self.colour,
            interrupt: Interrupt::NEVER,
        }
    }

    /// The planes of a section.
    pub(crate) fn layout(&self, section: Section) -> Layout {
        Layout::of_section(section, self.colour.dc.header.rank, self.colour.mode)
    }

    /// What a decoder makes of a draft.
    ///
    /// # Errors
    /// What the decoder's own checks refuse.
    pub(crate) fn apply(
        &self,
        draft: &Draft,
        parents: GaussianList,
        situation: &Situation<'_>,
    ) -> Result<Applied, Error> {
        let unit = Unit {
            header: &draft.header,
            values: &draft.values,
            coding: self.coding(draft.header.attribute_step),
            sequence: self.sequence,
            network: self.network,
            max_learned: self.max_learned,
            at: 0,
        };
        Ok(apply(&unit, parents, situation)?)
    }

    /// The payload of a unit, whose digest is known; `models` become those in force after it. `unpredicted`: models of
    /// its new Gaussians without prediction.
    ///
    /// # Errors
    /// A value that no token codes, a header that a decoder would refuse.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "lengths of what is in memory; NEW_PER_BYTE is a small constant"
    )]
    pub(crate) fn code(
        &self,
        draft: &Draft,
        unpredicted: &SectionDraft,
        models: &mut ModelsInForce,
    ) -> Result<Vec<u8>, Error> {
        let header = trimmed(draft.header);
        let mut sections = self.sections(draft, models)?;
        let values = draft.values.section(Section::New);
        let new = match (draft.is_predicted(), header.new_count) {
            (_, 0) => return Ok(write_increment(&header, self.sequence, &sections)?),
            (false, _) => unpredicted,
            (true, _) => {
                let steps = self.steps(header.attribute_step);
                &self.section_draft(Section::New, values, steps, models)
            }
        };
        let before = models.clone();
        sections.push(new.code(Section::New, values, &self.plan, models)?);
        // Gaussians that are all alike take nearly nothing, which A.2 does not allow.
        if u64::from(header.new_count) > Limits::NEW_PER_BYTE * length(&sections) as u64 {
            *models = before;
            sections.pop();
            sections.push(new.code_at_length(Section::New, values, &self.plan, models)?);
        }
        Ok(write_increment(&header, self.sequence, &sections)?)
    }

    /// Bytes of the sections that predictors change.
    ///
    /// # Errors
    /// A value that no token codes.
    pub(crate) fn new_bytes(
        &self,
        draft: &Draft,
        unpredicted: &SectionDraft,
        models: &ModelsInForce,
    ) -> Result<usize, Error> {
        let mut models = models.clone();
        let mut sections = Vec::new();
        if draft.is_predicted() {
            sections.push(self.own_section(Section::Predictors, draft, &mut models)?);
            sections.push(self.own_section(Section::New, draft, &mut models)?);
        } else {
            let values = draft.values.section(Section::New);
            sections.push(unpredicted.code(Section::New, values, &self.plan, &mut models)?);
        }
        Ok(length(&sections))
    }

    /// The sections of a draft but that of its new Gaussians.
    fn sections(&self, draft: &Draft, models: &mut ModelsInForce) -> Result<Vec<SectionBytes>, Error> {
        let parents = Section::OF_INCREMENT.into_iter().filter(|&section| section != Section::New);
        let present = parents.filter(|&section| draft.header.count(section) > 0);
        present.map(|section| self.own_section(section, draft, models)).collect()
    }

    /// A section of a draft.
    fn own_section(
        &self,
        section: Section,
        draft: &Draft,
        models: &mut ModelsInForce,
    ) -> Result<SectionBytes, Error> {
        let (steps, values) = (self.steps(draft.header.attribute_step), draft.values.section(section));
        let coded = self.section_draft(section, values, steps, models);
        coded.code(section, values, &self.plan, models)
    }

    /// Models for values of their own; `steps` are those of the unit.
    pub(crate) fn section_draft(
        &self,
        section: Section,
        values: &SectionValues,
        steps: StepRule,
        models: &ModelsInForce,
    ) -> SectionDraft {
        let layout = self.layout(section);
        let biases = biases(section, &layout, &[values], models, &self.plan);
        SectionDraft::new(layout, values, biases, steps, &self.plan)
    }
}

/// Bytes of the models and blocks of sections.
#[expect(
    clippy::arithmetic_side_effects,
    reason = "lengths of what is in memory; NEW_PER_BYTE is a small constant"
)]
fn length(sections: &[SectionBytes]) -> usize {
    let bytes =
        |section: &SectionBytes| section.model.len() + section.blocks.iter().map(Vec::len).sum::<usize>();
    sections.iter().map(bytes).sum()
}

/// The header without what nothing in the unit needs.
fn trimmed(header: IncrementHeader) -> IncrementHeader {
    let plain = IncrementHeader::PLAIN;
    let mut trimmed = header;
    if header.new_count == 0 && header.move_count == 0 {
        trimmed.position_shift = plain.position_shift;
    }
    if header.new_count == 0 && header.update_count == 0 {
        trimmed.attribute_step = plain.attribute_step;
        let ShHeader { sh_mode, vq_stage_count, codebook_ids } = plain.sh();
        (trimmed.sh_mode, trimmed.vq_stage_count, trimmed.codebook_ids) =
            (sh_mode, vq_stage_count, codebook_ids);
    }
    trimmed.with_flags()
}
