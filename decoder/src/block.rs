//! A block: coded planes in, integer attributes out. Blocks are independent, so all cores decode one frame.

use crate::colour::Colour;
use crate::context::lanes::{DeltaContexts, PlaneContexts};
use crate::frame::FrameSlice;
use crate::layout::{Layout, PlaneInfo};
use crate::steps::StepRule;
use crate::vector::{Task, vectorized};
use reconstruction::Reconstruction;
use splatstream_format::Result;
use splatstream_format::entropy::machine::Machine;
use splatstream_format::entropy::model::Source;
use splatstream_format::entropy::reader::{BlockReader, Delta, Index, PlaneDecoder, Signed};
use splatstream_format::entropy::token::Alphabet;

mod reconstruction;

pub use crate::buffers::{BufferPool, Buffers, Workspace};
pub use crate::coded_block::CodedBlock;

/// What the elements of the sequence and of the unit say about every block of the unit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct UnitParameters<'a> {
    /// Bits of a coordinate.
    pub(crate) position_bits: u8,
    /// Low bits of coordinates that the unit leaves out.
    pub(crate) position_shift: u8,
    /// The steps of the attributes.
    pub(crate) steps: StepRule,
    /// Whether the axes are sorted.
    pub(crate) canonical_axes: bool,
    /// log2 of the number of rANS states.
    pub(crate) lanes_log2: u8,
    /// The coded planes.
    pub(crate) layout: &'a Layout,
    /// How colour components become colour.
    pub(crate) colour: Colour<'a>,
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
pub(crate) fn decode_block(
    bytes: &[u8],
    at: u64,
    unit: &UnitParameters<'_>,
    decoders: &[PlaneDecoder],
    buffers: &mut Buffers,
    out: &mut FrameSlice<'_>,
) -> Result<()> {
    let count = out.planes.first().map_or(0, |plane| plane.len());
    let planes = CodedPlanes { lanes_log2: unit.lanes_log2, layout: unit.layout, steps: unit.steps };
    let mut reconstruction = Reconstruction::new(unit, at, out);
    let block =
        decode_planes(bytes, at, count, &planes, decoders, buffers, |block, plane, info, bias, buffers| {
            reconstruction.take(block, plane, info, bias, buffers);
        })?;
    let reconstructed = reconstruction.finish(&block, buffers);
    block.leave(buffers);
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
    buffers: &mut Buffers,
) -> Result<CodedBlock> {
    decode_planes(bytes, at, count, unit, decoders, buffers, |_, _, _, _, _| ())
}

/// The same. After each plane `take` is called with its number and bias, and may take what no later plane needs: all but
/// that plane.
fn decode_planes(
    bytes: &[u8],
    at: u64,
    count: usize,
    unit: &CodedPlanes<'_>,
    decoders: &[PlaneDecoder],
    buffers: &mut Buffers,
    mut take: impl FnMut(&mut CodedBlock, usize, PlaneInfo, i32, &mut Buffers),
) -> Result<CodedBlock> {
    let mut reader = BlockReader::open(bytes, at, unit.lanes_log2)?;
    let mut deltas = core::mem::take(&mut buffers.deltas);
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
        take(&mut block, plane, info, decoder.bias(), buffers);
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
