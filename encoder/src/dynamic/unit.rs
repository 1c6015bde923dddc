//! Codes one increment: values chosen elsewhere are applied as a decoder applies them, then entropy coded.

use super::wanted::Wanted;
use crate::error::Error;
use crate::section::{SectionPlan, code_section};
use crate::settings::NEIGHBOURS;
use splatstream_decoder::colour::Colour;
use splatstream_decoder::home::Home;
use splatstream_decoder::increment::residual::AttributeCoding;
use splatstream_decoder::increment::values::{SectionValues, UnitValues};
use splatstream_decoder::increment::{Applied, Situation, Unit, apply};
use splatstream_decoder::layout::{Layout, Section};
use splatstream_format::entropy::in_force::ModelsInForce;
use splatstream_format::payload::{Network, SectionBytes, write_increment};
use splatstream_format::syntax::{IncrementHeader, SequenceParameters, ShHeader};

/// What the units of a frame have in common.
#[derive(Clone, Copy)]
pub(crate) struct UnitCoder<'a> {
    pub(crate) sequence: &'a SequenceParameters,
    pub(crate) colour: Colour<'a>,
    pub(crate) sh: ShHeader,
    pub(crate) plan: SectionPlan,
    /// Whether the frame is an intra frame.
    pub(crate) intra: bool,
    /// The learned predictor of the GOP.
    pub(crate) network: Option<&'a Network>,
    /// New Gaussians of a unit that it may predict.
    pub(crate) most_learned: u32,
}

/// A unit before it is coded.
#[derive(Debug, Clone)]
pub(crate) struct Draft {
    pub(crate) header: IncrementHeader,
    pub(crate) values: UnitValues,
}

impl UnitCoder<'_> {
    /// A unit that changes and adds nothing.
    pub(crate) fn blank(&self) -> Draft {
        let ShHeader { sh_mode, vq_stage_count, codebook_ids } = self.sh;
        let header = IncrementHeader {
            neighbour_count: NEIGHBOURS,
            sh_mode,
            vq_stage_count,
            codebook_ids,
            ..IncrementHeader::PLAIN
        };
        Draft { header, values: UnitValues::default() }
    }

    /// Puts the positions of new Gaussians in a draft, on the lattice of its position shift. Brings `added`, their
    /// places in `all`, in Morton order, and gives what they shall become.
    pub(crate) fn place_new(&self, draft: &mut Draft, all: &Wanted, added: &mut [u32]) -> Wanted {
        let shift = draft.header.position_shift;
        added.sort_by_key(|&place| (all.code(place, shift), place));
        let codes: Vec<u64> = added.iter().map(|&place| all.code(place, shift)).collect();
        let block = 1 << self.sequence.block_log2;
        draft.header.new_count = added.len() as u32;
        let new = SectionValues { deltas: deltas(&codes, block), planes: Vec::new(), block };
        draft.values.set(Section::New, new);
        all.select(added)
    }

    /// How attributes are coded with some shifts.
    pub(crate) fn coding(&self, shift: [u8; 5]) -> AttributeCoding<'_> {
        AttributeCoding {
            shift,
            canonical_axes: self.sequence.canonical_axes(),
            rotation_thresholds: self.sequence.rotation_threshold,
            colour: self.colour,
        }
    }

    /// How a decoder sees a draft.
    pub(crate) fn unit<'d>(&'d self, draft: &'d Draft) -> Unit<'d> {
        Unit {
            header: &draft.header,
            values: &draft.values,
            coding: self.coding(draft.header.attribute_shift),
            sequence: self.sequence,
            intra: self.intra,
            network: self.network,
            most_learned: self.most_learned,
            at: 0,
        }
    }

    /// What a decoder makes of a draft.
    ///
    /// # Errors
    /// What the decoder's own checks refuse.
    pub(crate) fn apply(
        &self,
        draft: &Draft,
        parents: Home,
        situation: &Situation<'_>,
    ) -> Result<Applied, Error> {
        Ok(apply(&self.unit(draft), parents, situation)?)
    }

    /// Codes the sections of a draft; `models` become those in force after it.
    ///
    /// # Errors
    /// A value that no token codes.
    pub(crate) fn sections(
        &self,
        draft: &Draft,
        models: &mut ModelsInForce,
    ) -> Result<Vec<SectionBytes>, Error> {
        let code = |section: Section, models: &mut ModelsInForce| {
            let layout = Layout::of_section(section, self.colour.dc.header.rank, self.colour.mode);
            code_section(section, &layout, draft.values.section(section), &self.plan, models)
        };
        let present = Section::ALL.into_iter().filter(|&section| draft.header.count(section) > 0);
        present.map(|section| code(section, models)).collect()
    }

    /// The payload of a unit.
    ///
    /// # Errors
    /// A header that a decoder would refuse.
    pub(crate) fn payload(
        &self,
        header: &IncrementHeader,
        sections: &[SectionBytes],
    ) -> Result<Vec<u8>, Error> {
        Ok(write_increment(header, self.sequence, sections)?)
    }
}

/// Differences of rising codes; they start anew in each block.
pub(crate) fn deltas(codes: &[u64], block: usize) -> Vec<u64> {
    let before = |place: usize| if place.is_multiple_of(block) { 0 } else { codes[place - 1] };
    codes.iter().enumerate().map(|(place, &code)| code - before(place)).collect()
}
