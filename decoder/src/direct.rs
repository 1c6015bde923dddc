//! New Gaussians without predictors: blocks are decoded straight into the planes of the frame, those of all units at once.
//!
//! The blocks of a unit depend on nothing but its models, and these are read beforehand. So every core takes the next
//! block, whichever unit it is of, and writes to the part of the planes that belongs to it. This is how frames decode
//! whose units only add Gaussians: all frames of static content, and I frames of one spatial layer.

use crate::block::{UnitParameters, decode_block};
use crate::buffers::{Buffers, Workspace};
use crate::cores;
use crate::frame::{FrameSlice, PLANES, QuantizedFrame};
use crate::increment::residual::AttributeCoding;
use crate::increment::values::{PreparedSections, blocks_of};
use splatstream_format::entropy::in_force::SectionModels;
use splatstream_format::entropy::layout::Section;
use splatstream_format::entropy::model::PlaneModel;
use splatstream_format::entropy::reader::PlaneDecoder;
use splatstream_format::payload::{CodedSection, Increment};
use splatstream_format::syntax::{IncrementHeader, SequenceParameters};
use splatstream_format::{Error, Result};

/// Values that take as long as the table of a plane.
const VALUES_OF_TABLE: usize = 64;

/// A unit whose blocks can be decoded straight into planes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DirectUnit<'r, 'a> {
    pub(crate) header: &'r IncrementHeader,
    pub(crate) prepared: &'r PreparedSections<'r, 'a>,
    pub(crate) coding: AttributeCoding<'r>,
}

/// Whether a unit does nothing but add Gaussians without predictors.
pub(crate) fn is_direct(increment: &Increment<'_>) -> bool {
    let header = &increment.header;
    let only_new = increment.sections.iter().all(|coded| coded.section == Section::New);
    header.parent_count == 0 && only_new
}

/// A block, where it goes, and the unit that it is of.
struct Task<'t, 'f, 'a> {
    unit: usize,
    parameters: UnitParameters<'t>,
    decoders: &'t [PlaneDecoder],
    bytes: &'a [u8],
    at: u64,
    out: FrameSlice<'f>,
}

/// Decodes units one after the other. Gives the planes, and for each unit its Gaussians or its first error; the Gaussians
/// of a unit with an error mean nothing.
///
/// # Errors
/// A fault: the planes are not those of the blocks. So it is where an interrupt is requested.
pub(crate) fn decode(
    units: &[DirectUnit<'_, '_>],
    sequence: &SequenceParameters,
    workspace: Workspace<'_>,
) -> Result<(QuantizedFrame, Vec<Result<usize>>)> {
    const APART: Error = Error::fault("a part of the planes for each block of a unit");
    let sections: Vec<Option<(&CodedSection<'_>, &SectionModels)>> =
        units.iter().map(|unit| unit.prepared.sections().next()).collect();
    let blocks: Vec<(usize, &[u8], u64, usize)> = sections
        .iter()
        .enumerate()
        .filter_map(|(unit, section)| section.map(|(coded, _)| (unit, coded)))
        .flat_map(|(unit, coded)| {
            blocks_of(coded, sequence).into_iter().map(move |(bytes, at, count)| (unit, bytes, at, count))
        })
        .collect();
    let lengths: Vec<usize> = blocks.iter().map(|&(.., count)| count).collect();
    let total = lengths.iter().copied().fold(0, usize::saturating_add);
    let sh_planes = usize::from(sequence.sh_dimension());
    let blank = || workspace.buffers.frames.blank(total, sh_planes, workspace.interrupt);
    let (decoders, mut planes) = cores::join(total.saturating_mul(PLANES), || decoders(&sections), blank);
    let values = planes.values();
    let task = |((unit, bytes, at, _), out)| {
        let (coded, models) = sections.get(unit).copied().flatten()?;
        let parameters = parameters(units.get(unit)?, coded, models, sequence);
        Some(Task { unit, parameters, decoders: decoders.get(unit)?, bytes, at, out })
    };
    let slices = planes.slices(&lengths).ok_or(APART)?;
    let tasks: Option<Vec<Task<'_, '_, '_>>> = blocks.into_iter().zip(slices).map(task).collect();
    let tasks = lengths.into_iter().zip(tasks.ok_or(APART)?).collect();
    let decoded: Vec<(usize, Result<usize>)> =
        cores::map_longest_first(values, tasks, |task| workspace.run(|buffers| run(buffers, task)));
    let mut results: Vec<Result<usize>> = units.iter().map(|_| Ok(0)).collect();
    for (unit, block) in decoded {
        let slot = results.get_mut(unit).ok_or(APART)?;
        *slot = slot.and_then(|gaussians| block.map(|count| gaussians.saturating_add(count)));
    }
    Ok((planes, results))
}

/// The decoders of the planes of each unit.
fn decoders(sections: &[Option<(&CodedSection<'_>, &SectionModels)>]) -> Vec<Vec<PlaneDecoder>> {
    let of_units: Vec<&[PlaneModel]> =
        sections.iter().map(|section| section.map_or(&[][..], |(_, models)| &models.models)).collect();
    let all: Vec<&PlaneModel> = of_units.iter().copied().flatten().collect();
    // What a table is made of counts like values.
    let tables = all.iter().map(|model| model.tables.len()).fold(0, usize::saturating_add);
    let mut all = cores::map(tables.saturating_mul(VALUES_OF_TABLE), all, PlaneDecoder::new).into_iter();
    of_units.iter().map(|models| all.by_ref().take(models.len()).collect()).collect()
}

fn run(buffers: &mut Buffers, task: Task<'_, '_, '_>) -> (usize, Result<usize>) {
    let Task { unit, parameters, decoders, bytes, at, mut out } = task;
    let count = out.planes.first().map_or(0, |plane| plane.len());
    (unit, decode_block(bytes, at, &parameters, decoders, buffers, &mut out).map(|()| count))
}

/// What the sequence and a unit say about a block.
fn parameters<'t>(
    unit: &DirectUnit<'t, '_>,
    coded: &CodedSection<'_>,
    models: &'t SectionModels,
    sequence: &SequenceParameters,
) -> UnitParameters<'t> {
    UnitParameters {
        position_bits: sequence.position_bits,
        position_shift: unit.header.position_shift,
        steps: unit.coding.steps,
        canonical_axes: sequence.canonical_axes(),
        lanes_log2: coded.lanes_log2,
        layout: &models.layout,
        colour: unit.coding.colour,
    }
}
