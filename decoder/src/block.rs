//! A block: coded planes in, integer attributes out. Blocks are independent, so all cores decode one frame.

use crate::attribute::{self, ATTRIBUTE_RANGE, in_range};
use crate::colour::Colour;
use crate::context::lanes::{DeltaContexts, PlaneContexts};
use crate::frame::FrameSlice;
use crate::increment::residual::Stage;
use crate::layout::{Attribute, Layout, PlaneInfo, Section};
use crate::position;
use crate::steps::{Exponents, StepRule};
use crate::vector::{Task, vectorized};
use core::ops::Range;
use splatstream_format::Result;
use splatstream_format::entropy::lanes::Segments;
use splatstream_format::entropy::model::Source;
use splatstream_format::entropy::reader::{BlockReader, PlaneDecoder};
use splatstream_format::entropy::token::Alphabet;

/// The values of a block as they are coded, and what contexts need of the reconstruction.
///
/// The decoder fills it plane by plane, the encoder before it chooses models.
#[derive(Debug, Clone)]
pub struct CodedBlock {
    /// Morton deltas, the first from 0.
    pub deltas: Vec<u64>,
    /// Coded values (bias not added) by plane; the position plane is empty.
    pub coded: Vec<Vec<i32>>,
    /// Log-scales without predictions, of new Gaussians: the largest first if the axes are canonical.
    pub log_scale: [Vec<i32>; 3],
    /// Opacity without predictions, of new Gaussians.
    pub opacity: Vec<i32>,
    lanes_log2: u8,
    steps: StepRule,
    /// The exponents of the steps of each attribute, as soon as what they follow from is there.
    exponents: [Exponents; 5],
    /// For each plane the sum of the magnitudes of the attribute's planes up to it; kept as planes are added,
    /// so that a group of n planes costs n additions and not n squared.
    magnitudes: Vec<Vec<i32>>,
}

impl CodedBlock {
    /// A block of 2^`lanes_log2` lanes with these deltas, and no planes yet. A block without positions has as many
    /// deltas of 0.
    pub fn new(deltas: Vec<u64>, lanes_log2: u8, steps: StepRule) -> Self {
        Self {
            deltas,
            coded: Vec::new(),
            log_scale: [const { Vec::new() }; 3],
            opacity: Vec::new(),
            lanes_log2,
            steps,
            exponents: [const { Exponents::Same(0) }; 5],
            magnitudes: Vec::new(),
        }
    }

    /// The segments of its lanes.
    pub fn segments(&self) -> Segments {
        Segments::new(self.len(), self.lanes_log2)
    }

    /// The exponents of the steps of an attribute of new Gaussians; the planes that they follow from have been added.
    pub fn exponents(&self, stage: Stage) -> &Exponents {
        const ABSENT: &Exponents = &Exponents::Same(0);
        self.exponents.get(stage as usize).unwrap_or(ABSENT)
    }

    /// Adds the next plane in coding order; `bias` is that of its model.
    pub fn push(&mut self, info: PlaneInfo, coded: Vec<i32>, bias: i32) {
        let before = if info.index > 0 { self.magnitudes.last().cloned() } else { None };
        self.push_with(before, info, coded, bias);
    }

    /// The same where no plane but the next needs what is known of the planes before; `has_sums` says whether a later one
    /// of the attribute needs sums of magnitudes.
    fn push_decoded(
        &mut self,
        info: PlaneInfo,
        coded: Vec<i32>,
        bias: i32,
        has_sums: bool,
        buffers: &mut Buffers,
    ) {
        let last = self.magnitudes.last_mut().map(core::mem::take).unwrap_or_default();
        let is_first = info.index == 0;
        match (has_sums, is_first) {
            (true, false) => self.push_with(Some(last), info, coded, bias),
            (true, true) => {
                let mut sums = if last.is_empty() { buffers.plane(self.len()) } else { last };
                sums.fill(0);
                self.push_with(Some(sums), info, coded, bias);
            }
            (false, _) => {
                buffers.planes.extend((last.capacity() > 0).then_some(last));
                self.push_with(Some(Vec::new()), info, coded, bias);
            }
        }
    }

    /// Takes memory for what contexts need of the reconstruction.
    fn reserve(&mut self, buffers: &mut Buffers) {
        for plane in self.log_scale.iter_mut().chain([&mut self.opacity]) {
            *plane = buffers.planes.pop().unwrap_or_default();
            plane.clear();
        }
    }

    /// Adds a plane and the sums of magnitudes up to it; `before` are those up to the plane before, if it is of the same
    /// attribute.
    fn push_with(&mut self, before: Option<Vec<i32>>, info: PlaneInfo, coded: Vec<i32>, bias: i32) {
        if info.section == Section::New {
            self.reconstruct(info, &coded, bias);
        }
        let sums = match before {
            Some(mut sums) => {
                let each = sums.iter_mut().zip(&coded);
                each.for_each(|(sum, &value)| *sum = sum.wrapping_add(value.wrapping_abs()));
                sums
            }
            None => coded.iter().map(|&value| value.wrapping_abs()).collect(),
        };
        self.magnitudes.push(sums);
        self.coded.push(coded);
    }

    /// Reconstructs what later planes take contexts and steps from; ranges are checked later.
    ///
    /// Values are below 98,304 and steps at most 6144, so that a sum of three products stays below 2^31.
    fn reconstruct(&mut self, info: PlaneInfo, coded: &[i32], bias: i32) {
        let copy = |exponents: &Exponents, plane: &mut Vec<i32>| {
            plane.extend_from_slice(coded);
            exponents.scale(plane, bias);
        };
        let [largest, middle, smallest] = &mut self.log_scale;
        let [of_log_scale, of_opacity, ..] = &self.exponents;
        match (info.attribute, info.index) {
            (Attribute::LogScale, 0) => {
                copy(&Exponents::Same(self.steps.of_largest()), largest);
                self.prepare(&[Stage::LogScale]);
            }
            (Attribute::LogScale, 1) => {
                copy(of_log_scale, middle);
                attribute::next_log_scale(largest, middle);
            }
            (Attribute::LogScale, _) => {
                copy(of_log_scale, smallest);
                attribute::next_log_scale(middle, smallest);
                self.prepare(&[Stage::Opacity]);
            }
            (Attribute::Opacity, _) => {
                copy(of_opacity, &mut self.opacity);
                self.prepare(&[Stage::Rotation, Stage::Dc, Stage::Sh]);
            }
            _ => {}
        }
    }

    /// Computes the exponents of some attributes.
    fn prepare(&mut self, stages: &[Stage]) {
        for &stage in stages {
            let log_scale = self.log_scale.each_ref().map(Vec::as_slice);
            let exponents = self.steps.exponents(stage, log_scale, &self.opacity);
            if let Some(slot) = self.exponents.get_mut(stage as usize) {
                *slot = exponents;
            }
        }
    }

    /// The sums of the magnitudes of the attribute's planes before `plane`, which is not its first.
    pub fn magnitudes_before(&self, plane: usize) -> &[i32] {
        self.magnitudes.get(plane.wrapping_sub(1)).map(Vec::as_slice).unwrap_or_default()
    }

    /// Gaussians in the block.
    pub fn len(&self) -> usize {
        self.deltas.len()
    }

    /// True if there is no Gaussian.
    pub fn is_empty(&self) -> bool {
        self.deltas.is_empty()
    }
}

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

/// Memory that blocks leave to the blocks after them: fresh memory costs more than what is done with it.
#[derive(Debug, Default)]
pub struct Buffers {
    planes: Vec<Vec<i32>>,
    deltas: Vec<u64>,
}

impl Buffers {
    /// A plane of so many values, which mean nothing.
    fn plane(&mut self, count: usize) -> Vec<i32> {
        let mut plane = self.planes.pop().unwrap_or_default();
        plane.resize(count, 0);
        plane
    }

    /// Takes the memory of a block.
    fn recycle(&mut self, block: CodedBlock) {
        let CodedBlock { deltas, coded, log_scale, opacity, magnitudes, .. } = block;
        self.deltas = deltas;
        let planes = coded.into_iter().chain(log_scale).chain([opacity]).chain(magnitudes);
        self.planes.extend(planes.filter(|plane| plane.capacity() > 0));
    }
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
    buffers: &mut Buffers,
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
    buffers: &mut Buffers,
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
        if info.is_position() {
            reader.deltas(decoder, &mut DeltaContexts::new(decoder), &mut block.deltas);
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
    fn run(self) {
        let Self { reader, decoder, mut contexts, alphabet, out } = self;
        match alphabet {
            Alphabet::Index => reader.indices(decoder, &mut contexts, out),
            _ => reader.signed(decoder, &mut contexts, out),
        }
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
        match info.attribute {
            Attribute::Rotation => {
                attribute::rotations(plane, decoder.bias(), of_rotation, at)?;
                out.write(ROTATION.wrapping_add(usize::from(info.index)), plane);
            }
            Attribute::Dc => of_dc.scale(plane, decoder.bias()),
            // Indices of codebook entries are whole: sums of their entries have steps.
            Attribute::Sh if info.alphabet == Alphabet::Attribute => of_sh.scale(plane, decoder.bias()),
            // Known already; the others are not in this section.
            _ => {}
        }
    }
    let first = |attribute: Attribute| {
        let planes = unit.layout.planes().iter();
        planes.take_while(|info| info.attribute < attribute).count()
    };
    let (dc, sh) = (first(Attribute::Dc), first(Attribute::Sh));
    let of = |range: Range<usize>| coded.get(range).unwrap_or_default();
    let colour = out.planes.get_mut(DC..).unwrap_or_default();
    unit.colour.reconstruct(of(dc..sh), of(sh..coded.len()), of_sh, colour, at)
}
