//! A block: coded planes in, integer attributes out. Blocks are independent, so all cores decode one frame.

use crate::attribute::{self, ATTRIBUTE_RANGE, in_range};
use crate::coded_block::{Buffers, CodedBlock};
use crate::colour::{Colour, Components};
use crate::context::lanes::{DeltaContexts, PlaneContexts};
use crate::frame::FrameSlice;
use crate::layout::{Attribute, Layout, PlaneInfo};
use crate::position;
use crate::steps::StepRule;
use crate::vector::{Task, vectorized};
use core::ops::Range;
use splatstream_format::Result;
use splatstream_format::entropy::machine::Machine;
use splatstream_format::entropy::model::Source;
use splatstream_format::entropy::reader::{BlockReader, Delta, Index, PlaneDecoder, Signed};
use splatstream_format::entropy::token::Alphabet;

/// What the elements of the sequence and of the unit say about every block of the unit.
#[derive(Debug, Clone, Copy)]
pub struct UnitParameters<'a> {
    /// Bits of a coordinate.
    pub position_bits: u8,
    /// Low bits of coordinates that the unit leaves out.
    pub position_shift: u8,
    /// The steps of the attributes.
    pub steps: StepRule,
    /// Whether the axes are sorted.
    pub canonical_axes: bool,
    /// log2 of the number of rANS states.
    pub lanes_log2: u8,
    /// The coded planes.
    pub layout: &'a Layout,
    /// How colour components become colour.
    pub colour: Colour<'a>,
}

/// How the planes of the blocks of a section are coded.
#[derive(Debug, Clone, Copy)]
pub struct CodedPlanes<'a> {
    /// log2 of the number of rANS states.
    pub lanes_log2: u8,
    /// The coded planes.
    pub layout: &'a Layout,
    /// The steps of the attributes of the unit.
    pub steps: StepRule,
}

/// Clause 7.6.3 for one block of new Gaussians without predictors at absolute offset `at`, of as many Gaussians as `out` holds.
///
/// # Errors
/// Malformed or invalid as the clauses say.
pub fn decode_block(
    bytes: &[u8],
    at: u64,
    unit: &UnitParameters<'_>,
    decoders: &[PlaneDecoder],
    buffers: &mut Buffers<'_>,
    out: &mut FrameSlice<'_>,
) -> Result<()> {
    let count = out.planes.first().map_or(0, |plane| plane.len());
    let planes = CodedPlanes { lanes_log2: unit.lanes_log2, layout: unit.layout, steps: unit.steps };
    let mut block = decode_coded(bytes, at, count, &planes, decoders, buffers)?;
    let reconstructed = reconstruct(&mut block, unit, decoders, at, out);
    buffers.recycle(block);
    reconstructed
}

/// Clause 8.4: the coded values of a block of `count` values a plane, its entropy state checked.
///
/// # Errors
/// Malformed. No range is checked.
pub fn decode_coded(
    bytes: &[u8],
    at: u64,
    count: usize,
    unit: &CodedPlanes<'_>,
    decoders: &[PlaneDecoder],
    buffers: &mut Buffers<'_>,
) -> Result<CodedBlock> {
    let mut reader = BlockReader::open(bytes, at, unit.lanes_log2)?;
    let mut deltas = core::mem::take(&mut buffers.deltas);
    deltas.clear();
    deltas.resize(count, 0);
    let mut block = CodedBlock::new(deltas, unit.lanes_log2, unit.steps);
    block.reserve(buffers);
    let has_sums = has_sums(unit.layout, decoders);
    let planes = unit.layout.planes().iter().zip(decoders).zip(has_sums);
    for (plane, ((&info, decoder), has_sums)) in planes.enumerate() {
        buffers.interrupt.check()?;
        if info.is_position() {
            vectorized(ReadDeltas { reader: &mut reader, decoder, out: &mut block.deltas });
            block.push_decoded(info, Vec::new(), 0, false, buffers);
            continue;
        }
        let mut coded = buffers.plane(count);
        let contexts = PlaneContexts::new(decoder, plane, info, &block);
        let (alphabet, out) = (info.alphabet, coded.as_mut_slice());
        vectorized(ReadPlane { reader: &mut reader, decoder, contexts, alphabet, out });
        block.push_decoded(info, coded, decoder.bias(), has_sums, buffers);
    }
    reader.finish()?;
    Ok(block)
}

/// For each plane whether a later one of its attribute has the sums of magnitudes as a source.
fn has_sums(layout: &Layout, decoders: &[PlaneDecoder]) -> Vec<bool> {
    let is_source =
        |decoder: &PlaneDecoder| decoder.axes().iter().any(|axis| axis.source == Source::GroupMagnitude);
    let users: Vec<&PlaneInfo> = layout
        .planes()
        .iter()
        .zip(decoders)
        .filter(|(_, decoder)| is_source(decoder))
        .map(|(info, _)| info)
        .collect();
    let has_later = |info: &PlaneInfo| {
        users.iter().any(|later| later.attribute == info.attribute && later.index > info.index)
    };
    layout.planes().iter().map(has_later).collect()
}

/// The symbols of a plane that is not of the position alphabet, to be read.
struct ReadPlane<'r, 'b> {
    reader: &'r mut BlockReader<'b>,
    decoder: &'r PlaneDecoder,
    contexts: PlaneContexts<'r>,
    alphabet: Alphabet,
    out: &'r mut [i32],
}

impl Task for ReadPlane<'_, '_> {
    #[inline(always)]
    fn run(self, machine: impl Machine) {
        let Self { reader, decoder, mut contexts, alphabet, out } = self;
        match alphabet {
            Alphabet::Index => reader.plane::<Index, _>(machine, decoder, &mut contexts, out),
            _ => reader.plane::<Signed, _>(machine, decoder, &mut contexts, out),
        }
    }
}

/// The symbols of a plane of the position alphabet, to be read.
struct ReadDeltas<'r, 'b> {
    reader: &'r mut BlockReader<'b>,
    decoder: &'r PlaneDecoder,
    out: &'r mut [u64],
}

impl Task for ReadDeltas<'_, '_> {
    #[inline(always)]
    fn run(self, machine: impl Machine) {
        let Self { reader, decoder, out } = self;
        reader.plane::<Delta, _>(machine, decoder, &mut DeltaContexts::new(decoder), out);
    }
}

/// Index of the first plane of an attribute of a [`FrameSlice`].
const OPACITY: usize = 3;
const ROTATION: usize = 4;
const DC: usize = 7;

/// Coded planes, all there, to the integer attributes of the block. The planes are of no use afterwards.
///
/// # Errors
/// Invalid if a value is out of range.
fn reconstruct(
    block: &mut CodedBlock,
    unit: &UnitParameters<'_>,
    decoders: &[PlaneDecoder],
    at: u64,
    out: &mut FrameSlice<'_>,
) -> Result<()> {
    position::positions(&block.deltas, unit.position_bits, unit.position_shift, &mut out.position, at)?;
    let log_scale = block.log_scale.each_ref().map(Vec::as_slice);
    attribute::check_log_scales(log_scale, unit.canonical_axes, at)?;
    in_range(&block.opacity, &ATTRIBUTE_RANGE, "opacity", "7.6.2", at)?;
    for (index, plane) in log_scale.into_iter().enumerate() {
        out.write(index, plane);
    }
    out.write(OPACITY, &block.opacity);
    let CodedBlock { coded, exponents, .. } = block;
    let [_, _, of_rotation, of_dc, of_sh] = exponents;
    for ((info, plane), decoder) in unit.layout.planes().iter().zip(coded.iter_mut()).zip(decoders) {
        if info.attribute == Attribute::Rotation {
            attribute::rotations(plane, decoder.bias(), of_rotation, at)?;
            out.write(ROTATION.wrapping_add(usize::from(info.index)), plane);
        }
    }
    let first = |attribute: Attribute| {
        let planes = unit.layout.planes().iter();
        planes.take_while(|info| info.attribute < attribute).count()
    };
    let (dc, sh, end) = (first(Attribute::Dc), first(Attribute::Sh), coded.len());
    let biases: Vec<i32> = decoders.iter().map(PlaneDecoder::bias).collect();
    let components = |range: Range<usize>, exponents| Components {
        coded: coded.get(range.clone()).unwrap_or_default(),
        biases: biases.get(range).unwrap_or_default(),
        exponents,
    };
    let colour = out.planes.get_mut(DC..).unwrap_or_default();
    unit.colour.reconstruct(components(dc..sh, of_dc), components(sh..end, of_sh), colour, at)
}
