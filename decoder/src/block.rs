//! A block: coded planes in, integer attributes out. Blocks are independent, so all cores decode one frame.

use crate::attribute::{self, ATTRIBUTE_RANGE, in_range};
use crate::colour::Colour;
use crate::context::{DeltaNeighbours, Neighbours, axis_contexts, combine, is_serial};
use crate::frame::FrameSlice;
use crate::layout::{Attribute, Layout, PlaneInfo};
use crate::position;
use splatstream_format::Result;
use splatstream_format::entropy::model::Source;
use splatstream_format::entropy::reader::{BlockReader, PlaneDecoder};
use splatstream_format::entropy::token::Alphabet;

/// The values of a block as they are coded, and what contexts need of the reconstruction.
///
/// The decoder fills it plane by plane, the encoder before it chooses models.
#[derive(Debug, Clone, Default)]
pub struct CodedBlock {
    /// Morton deltas, the first from 0.
    pub deltas: Vec<u64>,
    /// Coded values (bias not added) by plane; the position plane is empty.
    pub coded: Vec<Vec<i32>>,
    /// Reconstructed log-scales, largest first if the axes are canonical.
    pub log_scale: [Vec<i32>; 3],
    /// Reconstructed opacity.
    pub opacity: Vec<i32>,
    /// For each plane the sum of the magnitudes of the attribute's planes up to it; kept as planes are added,
    /// so that a group of n planes costs n additions and not n squared.
    magnitudes: Vec<Vec<i32>>,
}

impl CodedBlock {
    /// A block with these deltas, and no planes yet.
    pub fn new(deltas: Vec<u64>) -> Self {
        Self { deltas, ..Self::default() }
    }

    /// Adds the next plane in coding order.
    pub fn push(&mut self, info: PlaneInfo, coded: Vec<i32>) {
        let before = if info.index > 0 { self.magnitudes.last() } else { None };
        let sums = match before {
            Some(before) => before
                .iter()
                .zip(&coded)
                .map(|(&sum, &value)| sum.wrapping_add(value.wrapping_abs()))
                .collect(),
            None => coded.iter().map(|&value| value.wrapping_abs()).collect(),
        };
        self.magnitudes.push(sums);
        self.coded.push(coded);
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
    /// Low bits that the unit leaves out of log_scale, opacity, rotation, dc, sh.
    pub attribute_shift: [u8; 5],
    /// Whether the axes are sorted.
    pub canonical_axes: bool,
    /// rotation_threshold of the sequence.
    pub rotation_thresholds: [u8; 3],
    /// log2 of the number of rANS states.
    pub lanes_log2: u8,
    /// The coded planes.
    pub layout: &'a Layout,
    /// How colour components become colour.
    pub colour: Colour<'a>,
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
    out: &mut FrameSlice<'_>,
) -> Result<()> {
    let count = out.planes.first().map_or(0, |plane| plane.len());
    let block = decode_coded(bytes, at, count, unit.layout, unit.lanes_log2, decoders)?;
    let biases: Vec<i32> = decoders.iter().map(PlaneDecoder::bias).collect();
    reconstruct(&block, unit, &biases, at, out)
}

/// Clause 8.4: the coded values of a block of `count` values a plane, its entropy state checked.
///
/// # Errors
/// Malformed. No range is checked: [`reconstruct`] does that.
pub fn decode_coded(
    bytes: &[u8],
    at: u64,
    count: usize,
    layout: &Layout,
    lanes_log2: u8,
    decoders: &[PlaneDecoder],
) -> Result<CodedBlock> {
    let mut reader = BlockReader::open(bytes, at, lanes_log2)?;
    let mut block = CodedBlock::new(vec![0; count]);
    for (plane, (&info, decoder)) in layout.planes().iter().zip(decoders).enumerate() {
        let coded = read_plane(&mut reader, decoder, plane, info, &mut block);
        block.push(info, coded);
        keep_for_contexts(&mut block, info, decoder.bias());
    }
    reader.finish()?;
    Ok(block)
}

fn read_plane(
    reader: &mut BlockReader<'_>,
    decoder: &PlaneDecoder,
    plane: usize,
    info: PlaneInfo,
    block: &mut CodedBlock,
) -> Vec<i32> {
    let [first, second] = decoder.axes();
    if info.is_position() {
        read_deltas(reader, decoder, &mut block.deltas);
        return Vec::new();
    }
    let mut out = vec![0; block.len()];
    let on_first = axis_contexts(first, plane, block);
    let on_second = axis_contexts(second, plane, block);
    if info.alphabet == Alphabet::Index {
        reader.indices(decoder, &combine(&on_first, &on_second, second.contexts()), &mut out);
    } else if is_serial(first.source) || is_serial(second.source) {
        read_serial(reader, decoder, [&on_first, &on_second], &mut out);
    } else {
        reader.signed(decoder, &combine(&on_first, &on_second, second.contexts()), &mut out);
    }
    out
}

/// Reads a plane with a context axis that depends on its own values; `known` are the contexts of the other.
fn read_serial(reader: &mut BlockReader<'_>, decoder: &PlaneDecoder, known: [&[u8]; 2], out: &mut [i32]) {
    let [first, second] = decoder.axes().each_ref().map(|axis| axis.source);
    let [known_first, known_second] = known;
    let at = |known: &[u8], index: usize| known.get(index).copied().unwrap_or(0);
    match (is_serial(first), is_serial(second)) {
        (true, false) => {
            let context = |index: usize, neighbours: &Neighbours| {
                decoder.context(decoder.first_context(neighbours.value(first)), at(known_second, index))
            };
            reader.signed_serial(decoder, following(context), out);
        }
        (false, _) => {
            let context = |index: usize, neighbours: &Neighbours| {
                decoder.context(at(known_first, index), decoder.second_context(neighbours.value(second)))
            };
            reader.signed_serial(decoder, following(context), out);
        }
        (true, true) => {
            let context = |_: usize, neighbours: &Neighbours| {
                let a = decoder.first_context(neighbours.value(first));
                decoder.context(a, decoder.second_context(neighbours.value(second)))
            };
            reader.signed_serial(decoder, following(context), out);
        }
    }
}

/// Keeps the neighbours of the value that is read next.
#[inline(always)]
fn following(context: impl Fn(usize, &Neighbours) -> u8) -> impl FnMut(usize, i32) -> u8 {
    let mut neighbours = Neighbours::default();
    move |index, previous| {
        if index > 0 {
            neighbours.push(previous);
        }
        context(index, &neighbours)
    }
}

fn read_deltas(reader: &mut BlockReader<'_>, decoder: &PlaneDecoder, deltas: &mut [u64]) {
    let [has_first, has_second] = decoder.axes().each_ref().map(|axis| axis.source != Source::None);
    let mut neighbours = DeltaNeighbours::default();
    let context = |index: usize, previous: u64| {
        if index > 0 {
            neighbours.push(previous);
        }
        let value = neighbours.value();
        let first = if has_first { decoder.first_context(value) } else { 0 };
        let second = if has_second { decoder.second_context(value) } else { 0 };
        decoder.context(first, second)
    };
    reader.deltas(decoder, context, deltas);
}

/// Reconstructs what later planes take contexts from, as soon as its plane is there; ranges are checked later.
fn keep_for_contexts(block: &mut CodedBlock, info: PlaneInfo, bias: i32) {
    let Some(coded) = block.coded.last() else { return };
    let [largest, middle, smallest] = &mut block.log_scale;
    let values = || attribute::unbias(coded, bias);
    match (info.attribute, info.index) {
        (Attribute::LogScale, 0) => *largest = values(),
        (Attribute::LogScale, 1) => *middle = attribute::next_log_scale(largest, &values()),
        (Attribute::LogScale, _) => *smallest = attribute::next_log_scale(middle, &values()),
        (Attribute::Opacity, _) => block.opacity = values(),
        _ => {}
    }
}

/// Index of the first plane of an attribute of a [`FrameSlice`].
const OPACITY: usize = 3;
const ROTATION: usize = 4;
const DC: usize = 7;

/// Coded planes, all there, to the integer attributes of the block. The encoder calls this too.
///
/// `biases` are those of the plane models, by plane.
///
/// # Errors
/// Invalid if a value is out of range.
pub fn reconstruct(
    block: &CodedBlock,
    unit: &UnitParameters<'_>,
    biases: &[i32],
    at: u64,
    out: &mut FrameSlice<'_>,
) -> Result<()> {
    position::positions(&block.deltas, unit.position_bits, unit.position_shift, &mut out.position, at)?;
    let [log_scale_shift, opacity_shift, rotation_shift, dc_shift, sh_shift] = unit.attribute_shift;
    let log_scales = log_scales(block, unit, biases, log_scale_shift, at)?;
    let opacity = attribute::shifted(&block.opacity, opacity_shift);
    in_range(&opacity, &ATTRIBUTE_RANGE, "opacity", "7.6.2", at)?;
    for (index, plane) in log_scales.iter().enumerate() {
        out.write(index, plane);
    }
    out.write(OPACITY, &opacity);
    let mut dc_components = Vec::new();
    let mut sh_components = Vec::new();
    let [largest, _, smallest] = &log_scales;
    for ((info, coded), &bias) in unit.layout.planes().iter().zip(&block.coded).zip(biases) {
        match info.attribute {
            Attribute::Rotation => {
                let values = attribute::unbias(coded, bias);
                let thresholds = unit.rotation_thresholds;
                let rotation =
                    attribute::rotations(&values, largest, smallest, thresholds, rotation_shift, at)?;
                out.write(ROTATION.wrapping_add(usize::from(info.index)), &rotation);
            }
            Attribute::Dc => dc_components.push(attribute::unbias_shifted(coded, bias, dc_shift)),
            // Indices of codebook entries are whole: their entries are shifted.
            Attribute::Sh if info.alphabet == Alphabet::Index => sh_components.push(coded.clone()),
            Attribute::Sh => sh_components.push(attribute::unbias_shifted(coded, bias, sh_shift)),
            // Known already; the others are not in this section.
            _ => {}
        }
    }
    let colour = out.planes.get_mut(DC..).unwrap_or_default();
    unit.colour.reconstruct(&dc_components, &sh_components, sh_shift, colour, at)
}

/// The log-scales of a block. They are sums of values, so that shifting the sums shifts the values.
fn log_scales(
    block: &CodedBlock,
    unit: &UnitParameters<'_>,
    biases: &[i32],
    shift: u8,
    at: u64,
) -> Result<[Vec<i32>; 3]> {
    let log_scales = block.log_scale.each_ref().map(|plane| attribute::shifted(plane, shift));
    for (plane, log_scale) in (1..).zip(&log_scales) {
        let coded = block.coded.get(plane).map(Vec::as_slice).unwrap_or_default();
        let values = attribute::unbias_shifted(coded, biases.get(plane).copied().unwrap_or(0), shift);
        attribute::check_log_scale(&values, log_scale, unit.canonical_axes && plane > 1, at)?;
    }
    Ok(log_scales)
}
