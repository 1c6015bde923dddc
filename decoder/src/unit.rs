//! The refinement units of a frame, all their blocks at once on all cores.

use crate::block::{CodedBlock, UnitParameters, decode_block, decode_coded};
use crate::entropy_state::{UnitEntropy, of_refinement};
use crate::frame::{FrameSlice, QuantizedFrame};
use crate::gop::{Gop, Transforms};
use crate::layout::Layout;
use rayon::prelude::*;
use splatstream_format::entropy::model::{ModelTrace, PlaneModel, read_models};
use splatstream_format::entropy::reader::PlaneDecoder;
use splatstream_format::payload::Refinement;
use splatstream_format::syntax::{RefinementHeader, SequenceParameters};
use splatstream_format::{Error, Result};

/// A refinement unit whose payload has been divided.
#[derive(Debug, Clone, Copy)]
pub struct CodedUnit<'r, 'a> {
    /// The payload's parts.
    pub refinement: &'r Refinement<'a>,
    /// Absolute offset of the payload.
    pub payload_at: u64,
}

/// A unit with its models read: blocks can be decoded in any order.
pub struct PreparedUnit<'g, 'r, 'a> {
    unit: CodedUnit<'r, 'a>,
    /// The coded planes.
    pub layout: Layout,
    /// One model a plane; empty if the unit has no Gaussian.
    pub models: Vec<PlaneModel>,
    colour: crate::colour::Colour<'g>,
}

impl<'g, 'r, 'a> PreparedUnit<'g, 'r, 'a> {
    /// Reads the models of a unit; `before` are planes and models of the last unit that had some.
    ///
    /// # Errors
    /// Malformed or invalid models, codebooks that are not defined.
    pub fn new(
        unit: CodedUnit<'r, 'a>,
        gop: &'g Gop,
        transforms: Transforms<'g>,
        before: Option<(&Layout, &[PlaneModel])>,
        trace: &mut impl ModelTrace,
    ) -> Result<Self> {
        let refinement = unit.refinement;
        let colour =
            gop.colour(transforms, &refinement.header.sh(), 0, (&RefinementHeader::TABLE, unit.payload_at))?;
        let layout = Layout::new(transforms.dc.header.rank, colour.mode);
        let models = if refinement.header.gaussian_count == 0 {
            Vec::new()
        } else {
            let alphabets = layout.alphabets();
            let reusable = layout.reusable(before);
            read_models(refinement.model, refinement.model_at, &alphabets, &reusable, trace)?
        };
        layout.check(&models, refinement.model_at)?;
        Ok(Self { unit, layout, models, colour })
    }

    /// The models with their tables expanded: 5 KB a table.
    fn decoders(&self) -> Vec<PlaneDecoder> {
        self.models.iter().map(PlaneDecoder::new).collect()
    }

    fn tables(&self) -> usize {
        self.models.iter().map(|model| model.tables.len()).fold(0, usize::wrapping_add)
    }

    /// What the sequence and the unit say about a block.
    pub fn parameters(&self, sequence: &SequenceParameters) -> UnitParameters<'_> {
        let header = &self.unit.refinement.header;
        UnitParameters {
            position_bits: sequence.position_bits,
            position_shift: header.position_shift,
            canonical_axes: sequence.canonical_axes(),
            rotation_thresholds: sequence.rotation_threshold,
            lanes_log2: header.lanes_log2,
            layout: &self.layout,
            colour: self.colour,
        }
    }

    /// Bytes, absolute offset and Gaussians of each block.
    pub fn blocks(&self, sequence: &SequenceParameters) -> Vec<(&'a [u8], u64, usize)> {
        let mut left = usize::try_from(self.unit.refinement.header.gaussian_count).unwrap_or(0);
        let size = 1_usize.wrapping_shl(u32::from(sequence.block_log2));
        let with_count = |&(bytes, at): &(&'a [u8], u64)| {
            let count = left.min(size);
            left = left.wrapping_sub(count);
            (bytes, at, count)
        };
        self.unit.refinement.blocks.iter().map(with_count).collect()
    }

    /// The coded values of every block, for statistics.
    ///
    /// # Errors
    /// As decoding.
    pub fn coded_blocks(&self, sequence: &SequenceParameters) -> Result<Vec<CodedBlock>> {
        let (lanes_log2, decoders) = (self.unit.refinement.header.lanes_log2, self.decoders());
        self.blocks(sequence)
            .into_iter()
            .map(|(bytes, at, count)| decode_coded(bytes, at, count, &self.layout, lanes_log2, &decoders))
            .collect()
    }
}

/// Decodes the units of a frame, in order of refinement, one behind the other.
///
/// Gives the frame and for each unit its Gaussians or its error. A unit that fails fails alone, and with it
/// those that reuse its models; the Gaussians of a failed unit mean nothing.
pub fn decode_units(
    units: &[CodedUnit<'_, '_>],
    gop: &Gop,
    transforms: Transforms<'_>,
    sequence: &SequenceParameters,
) -> (QuantizedFrame, Vec<Result<usize>>) {
    let (prepared, failure) = prepare(units, gop, transforms);
    let blocks: Vec<_> = prepared.iter().map(|unit| unit.blocks(sequence)).collect();
    let lengths: Vec<usize> = blocks.iter().flatten().map(|&(_, _, count)| count).collect();
    let total = lengths.iter().copied().fold(0, usize::wrapping_add);
    let mut frame = QuantizedFrame::zeroed(total, usize::from(sequence.sh_dimension()));
    let mut outputs = frame.slices(&lengths).into_iter();
    let mut results: Vec<Result<usize>> = Vec::with_capacity(units.len());
    let mut rest = prepared.iter().zip(&blocks).collect::<Vec<_>>();
    while !rest.is_empty() {
        let later = rest.split_off(group_length(&rest));
        results.extend(decode_group(&rest, sequence, &mut outputs));
        rest = later;
    }
    results.extend(failure.map(Err));
    (frame, results)
}

/// The entropy states of units that have been decoded without an error. Their blocks are decoded once more.
pub fn entropy_states(
    units: &[CodedUnit<'_, '_>],
    gop: &Gop,
    transforms: Transforms<'_>,
    sequence: &SequenceParameters,
) -> Vec<UnitEntropy> {
    let (prepared, _) = prepare(units, gop, transforms);
    let state = |unit: &PreparedUnit<'_, '_, '_>| {
        let blocks = unit.coded_blocks(sequence).ok()?;
        let state = of_refinement(unit.unit.refinement, &unit.layout, &unit.models, &blocks)?;
        Some(UnitEntropy { payload_at: unit.unit.payload_at, state })
    };
    prepared.iter().filter_map(state).collect()
}

/// Bytes, offset and Gaussians of a block.
type Block<'a> = (&'a [u8], u64, usize);

/// A prepared unit and its blocks.
type UnitBlocks<'p, 'g, 'r, 'a> = (&'p PreparedUnit<'g, 'r, 'a>, &'p Vec<Block<'a>>);

/// How many of the units, at least one, have their tables expanded at the same time. All of those of an honest
/// frame; a stream made to take memory gets one unit at a time.
fn group_length(units: &[UnitBlocks<'_, '_, '_, '_>]) -> usize {
    const MOST_TABLES: usize = 1 << 12;
    let mut tables = 0_usize;
    let fits = |(unit, _): &&UnitBlocks<'_, '_, '_, '_>| {
        tables = tables.wrapping_add(unit.tables());
        tables <= MOST_TABLES
    };
    units.iter().take_while(fits).count().max(1)
}

/// Decodes all blocks of some units at once; for each unit its Gaussians or its first error.
fn decode_group<'f>(
    units: &[UnitBlocks<'_, '_, '_, '_>],
    sequence: &SequenceParameters,
    outputs: &mut impl Iterator<Item = FrameSlice<'f>>,
) -> Vec<Result<usize>> {
    let decoders: Vec<Vec<PlaneDecoder>> = units.par_iter().map(|(unit, _)| unit.decoders()).collect();
    let tasks: Vec<_> = units
        .iter()
        .zip(&decoders)
        .enumerate()
        .flat_map(|(place, ((unit, blocks), decoders))| {
            blocks.iter().map(move |&block| (place, unit, decoders, block))
        })
        .zip(outputs)
        .collect();
    let decoded: Vec<(usize, Result<usize>)> = tasks
        .into_par_iter()
        .map(|((place, unit, decoders, (bytes, at, count)), mut out)| {
            let done = decode_block(bytes, at, &unit.parameters(sequence), decoders, &mut out);
            (place, done.map(|()| count))
        })
        .collect();
    let mut results: Vec<Result<usize>> = units.iter().map(|_| Ok(0)).collect();
    for (place, block) in decoded {
        let Some(slot) = results.get_mut(place) else { continue };
        match (slot.as_mut(), block) {
            (Ok(gaussians), Ok(count)) => *gaussians = gaussians.wrapping_add(count),
            (Ok(_), Err(error)) => *slot = Err(error),
            (Err(_), _) => {}
        }
    }
    results
}

/// Reads the models of the units up to the first that cannot be read.
fn prepare<'g, 'r, 'a>(
    units: &[CodedUnit<'r, 'a>],
    gop: &'g Gop,
    transforms: Transforms<'g>,
) -> (Vec<PreparedUnit<'g, 'r, 'a>>, Option<Error>) {
    let mut prepared: Vec<PreparedUnit<'g, 'r, 'a>> = Vec::with_capacity(units.len());
    let mut failure = None;
    for &unit in units {
        let before = prepared.iter().rev().find(|unit| !unit.models.is_empty());
        let before = before.map(|unit| (&unit.layout, unit.models.as_slice()));
        match PreparedUnit::new(unit, gop, transforms, before, &mut ()) {
            Ok(unit) => prepared.push(unit),
            Err(error) => {
                failure = Some(error);
                break;
            }
        }
    }
    (prepared, failure)
}
