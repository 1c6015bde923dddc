//! Clauses 8.1 to 8.6 for increments: the sections of a unit to the values of its planes.

use crate::attribute;
use crate::block::{CodedPlanes, decode_coded};
use crate::buffers::Workspace;
use crate::coded_block::CodedBlock;
use crate::cores;
use crate::interrupt::Interrupt;
use crate::steps::StepRule;
use splatstream_format::entropy::in_force::{ModelsInForce, SectionModels};
use splatstream_format::entropy::layout::{Layout, Section, ShCoding};
use splatstream_format::entropy::model::{ModelTrace, read_models};
use splatstream_format::entropy::reader::PlaneDecoder;
use splatstream_format::payload::CodedSection;
use splatstream_format::syntax::{IncrementHeader, SequenceParameters};
use splatstream_format::{Error, Result};

/// The values of a section, bias added, the blocks one after the other.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct SectionValues {
    /// Of the plane of the position alphabet: the deltas. Empty if the section has none.
    pub deltas: Vec<u64>,
    /// Of every other plane, in plane order.
    pub planes: Vec<Vec<i32>>,
    /// Values of a plane in each block but the last, where deltas start again from 0.
    pub block: usize,
}

/// The values of an increment.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct UnitValues {
    sections: [SectionValues; Section::COUNT],
}

impl UnitValues {
    /// The values of a section; none of a section that is absent.
    pub fn section(&self, section: Section) -> &SectionValues {
        // Every section has an index below COUNT.
        const ABSENT: &SectionValues = &SectionValues { deltas: Vec::new(), planes: Vec::new(), block: 0 };
        self.sections.get(section.index()).unwrap_or(ABSENT)
    }

    /// Establishes that there are as many values of each section as the header of a unit counts, so that whoever takes
    /// them in the order of Gaussians finds one for each. Of a section that is not counted nobody takes any.
    ///
    /// # Errors
    /// A fault: decoding the sections has given others.
    pub(crate) fn check(&self, header: &IncrementHeader) -> Result<()> {
        let is_counted = |section: Section| {
            let values = self.section(section);
            let count = header.count(section) as usize;
            let has_all = values.planes.iter().all(|plane| plane.len() == count);
            count == 0 || has_all && !values.planes.is_empty()
        };
        let has_positions = self.section(Section::New).deltas.len() == header.new_count as usize;
        match has_positions && Section::OF_INCREMENT.into_iter().all(is_counted) {
            true => Ok(()),
            false => Err(Error::fault("as many values of a section as its unit counts")),
        }
    }

    /// Sets the values of a section.
    pub fn set(&mut self, section: Section, values: SectionValues) {
        if let Some(slot) = self.sections.get_mut(section.index()) {
            *slot = values;
        }
    }

    /// The values of one plane of a section, counted without that of the position alphabet; none of a section that is absent.
    /// A section that a unit counts has its planes.
    pub fn plane(&self, section: Section, plane: usize) -> &[i32] {
        self.section(section).planes.get(plane).map(Vec::as_slice).unwrap_or_default()
    }
}

/// Sections with their models read: blocks can be decoded in any order.
#[derive(Debug)]
pub struct PreparedSections<'r, 'a> {
    sections: &'r [CodedSection<'a>],
    models: Vec<SectionModels>,
    steps: StepRule,
}

/// What the planes of the sections of a unit depend on besides their models.
#[derive(Debug, Clone, Copy)]
pub struct SectionCoding {
    /// Components of the dc transform.
    pub dc_rank: u8,
    /// How the spherical harmonics are coded.
    pub sh: ShCoding,
    /// The steps of the attributes.
    pub steps: StepRule,
}

impl<'r, 'a> PreparedSections<'r, 'a> {
    /// Reads the models of the sections of a unit; `in_force` are those before the unit, and become those after it.
    ///
    /// # Errors
    /// Malformed or invalid by clauses 5.12 and 6.12.
    pub fn new(
        sections: &'r [CodedSection<'a>],
        coding: &SectionCoding,
        in_force: &mut ModelsInForce,
        trace: &mut impl ModelTrace,
    ) -> Result<Self> {
        let mut models = Vec::with_capacity(sections.len());
        for coded in sections {
            let layout = Layout::of_section(coded.section, coding.dc_rank, coding.sh);
            let reusable = in_force.reusable(coded.section, &layout);
            let read = read_models(coded.model, coded.model_at, &layout.alphabets(), &reusable, trace)?;
            layout.check(&read, coded.model_at)?;
            models.push(SectionModels { layout, models: read });
        }
        for (coded, models) in sections.iter().zip(&models) {
            in_force.replace(coded.section, models.clone());
        }
        Ok(Self { sections, models, steps: coding.steps })
    }

    /// The sections with their planes and models.
    pub fn sections(&self) -> impl Iterator<Item = (&CodedSection<'a>, &SectionModels)> {
        self.sections.iter().zip(&self.models)
    }

    /// Distinct tables of all planes.
    pub fn tables(&self) -> usize {
        let models = self.models.iter().flat_map(|section| &section.models);
        models.map(|model| model.tables.len()).fold(0, usize::saturating_add)
    }

    /// Values of all sections.
    pub(crate) fn values(&self) -> u64 {
        let of_section = |(coded, models): (&CodedSection<'_>, &SectionModels)| {
            let planes = u64::try_from(models.models.len()).unwrap_or(u64::MAX);
            u64::from(coded.count).saturating_mul(planes)
        };
        self.sections().map(of_section).fold(0, u64::saturating_add)
    }

    /// Decodes the blocks of all sections.
    ///
    /// # Errors
    /// Malformed; of several faults, that of the first block.
    pub fn decode(&self, sequence: &SequenceParameters, workspace: Workspace<'_>) -> Result<UnitValues> {
        let mut values = UnitValues::default();
        for (coded, models) in self.sections() {
            let blocks = self.blocks(coded, models, sequence, workspace)?;
            values.set(coded.section, joined(blocks, models, sequence, workspace.interrupt)?);
        }
        Ok(values)
    }

    /// The coded values of the blocks of a section.
    ///
    /// # Errors
    /// As [`PreparedSections::decode`].
    pub fn blocks(
        &self,
        coded: &CodedSection<'a>,
        models: &SectionModels,
        sequence: &SequenceParameters,
        workspace: Workspace<'_>,
    ) -> Result<Vec<CodedBlock>> {
        let decoders: Vec<PlaneDecoder> = models.models.iter().map(PlaneDecoder::new).collect();
        let planes = CodedPlanes { lanes_log2: coded.lanes_log2, layout: &models.layout, steps: self.steps };
        let values = (coded.count as usize).saturating_mul(decoders.len());
        let decode = |(bytes, at, count)| {
            workspace.run(|buffers| decode_coded(bytes, at, count, &planes, &decoders, buffers))
        };
        cores::map(values, blocks_of(coded, sequence), decode).into_iter().collect()
    }
}

/// Bytes, absolute offset and number of entries of each block of a section.
pub(crate) fn blocks_of<'a>(
    coded: &CodedSection<'a>,
    sequence: &SequenceParameters,
) -> Vec<(&'a [u8], u64, usize)> {
    let mut left = coded.count as usize;
    let size = block_size(sequence);
    let with_count = |&(bytes, at): &(&'a [u8], u64)| {
        let count = left.min(size);
        left = left.saturating_sub(count);
        (bytes, at, count)
    };
    coded.blocks.iter().map(with_count).collect()
}

/// Values of a plane in a whole block: at most 2^16 (6.4).
fn block_size(sequence: &SequenceParameters) -> usize {
    1_usize.wrapping_shl(u32::from(sequence.block_log2))
}

/// The blocks of a section one after the other, biases added. The memory of the first block is used again.
fn joined(
    blocks: Vec<CodedBlock>,
    models: &SectionModels,
    sequence: &SequenceParameters,
    interrupt: &Interrupt,
) -> Result<SectionValues> {
    let has_deltas = models.layout.planes().first().is_some_and(|plane| plane.is_position());
    let mut blocks = blocks.into_iter();
    let mut values = SectionValues { block: block_size(sequence), ..SectionValues::default() };
    if let Some(first) = blocks.next() {
        (values.deltas, values.planes) = (first.deltas, first.coded);
    }
    for block in blocks {
        interrupt.check()?;
        values.deltas.extend_from_slice(&block.deltas);
        for (plane, more) in values.planes.iter_mut().zip(&block.coded) {
            plane.extend_from_slice(more);
        }
    }
    for (plane, model) in values.planes.iter_mut().zip(&models.models) {
        interrupt.check()?;
        attribute::unbias(plane, model.bias);
    }
    match has_deltas {
        true => drop(values.planes.drain(..1)),
        false => values.deltas = Vec::new(),
    }
    Ok(values)
}
