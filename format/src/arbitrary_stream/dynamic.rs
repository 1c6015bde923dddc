//! Streams of profile Dynamic: layers, predicted frames, increments whose counts fit their parents.

use super::increments::{Homes, Tools};
use super::{Output, codebook, increments, sequence_parameters, transform, weights};
use crate::payload::{Codebook, Index, OperatingPoints, SectionBytes, Transform, Weights, write_increment};
use crate::syntax::{
    EndOfStream, FrameHeader, GopHeader, IncrementHeader, IndexEntry, MAX_ID, MAX_LAYERS,
    OperatingPointEntry, PlaceInGop, Profile, SequenceParameters, TransformKind, UnitId, UnitType,
};
use crate::unit::write_file_header;
use arbitrary::{Arbitrary, Result, Unstructured};

/// A stream of profile Dynamic that obeys the syntax.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DynamicStream {
    /// Annex A.
    pub level: u8,
    /// The parameters of all frames.
    pub sequence: SequenceParameters,
    /// The groups in order.
    pub gops: Vec<DynamicGop>,
    /// What stands in the list of operating points, if there is one. The numbers in it are not those of the stream.
    pub points: Option<Vec<OperatingPointEntry>>,
    /// Whether there is an index.
    pub has_index: bool,
}

/// A group of pictures.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DynamicGop {
    /// The payload of the GOP header unit.
    pub header: GopHeader,
    /// Transforms with different identifiers; the first is a dc transform.
    pub transforms: Vec<Transform>,
    /// The payload of the weights unit, if there is one.
    pub weights: Option<Weights>,
    /// One frame or more, in order of their places.
    pub frames: Vec<DynamicFrame>,
}

/// A codebook, and the temporal layer that defines it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LayeredCodebook {
    /// The least layer that may use it.
    pub temporal_layer: u8,
    /// The payload.
    pub codebook: Codebook,
}

/// A frame with all its increments, or with the first of them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DynamicFrame {
    /// Its place in the group.
    pub place: u32,
    /// Codebooks before it: those that it may use, or new definitions of them.
    pub codebooks: Vec<LayeredCodebook>,
    /// The payload of the frame header unit.
    pub header: FrameHeader,
    /// One increment or more.
    pub increments: Vec<ArbitraryIncrement>,
}

/// An increment whose sections hold arbitrary bytes, or small values that most processes accept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ArbitraryIncrement {
    /// Place on the axes.
    pub spatial_layer: u8,
    /// Place on the axes, and home of what it adds.
    pub refinement: u8,
    /// The fixed part.
    pub header: IncrementHeader,
    /// The sections with a count above 0.
    pub sections: Vec<SectionBytes>,
}

impl<'a> Arbitrary<'a> for DynamicStream {
    fn arbitrary(u: &mut Unstructured<'a>) -> Result<Self> {
        let spatial_layer_count = u.int_in_range(1..=MAX_LAYERS)?;
        let temporal_layer_count = u.int_in_range(1..=MAX_LAYERS)?;
        let mut sequence =
            SequenceParameters { spatial_layer_count, temporal_layer_count, ..sequence_parameters(u)? };
        // Few values happen to be sorted.
        if u.ratio(7_u8, 8_u8)? {
            sequence.sequence_flags = SequenceParameters::flags(false, sequence.antialiased());
        }
        let gop_count = if u.ratio(1_u8, 16_u8)? { 0 } else { u.int_in_range(1..=2)? };
        let gops = (0..gop_count).map(|index| gop(u, index, &sequence)).collect::<Result<_>>()?;
        let points = if u.arbitrary()? { Some(points(u)?) } else { None };
        Ok(Self { level: u.int_in_range(1..=4)?, sequence, gops, points, has_index: u.arbitrary()? })
    }
}

impl DynamicStream {
    /// The bytes of the stream.
    pub fn to_bytes(&self) -> crate::Result<Vec<u8>> {
        let bytes = write_file_header(Profile::Dynamic, self.level)?;
        let mut out = Output { bytes, frame_count: 0, unit_count: 0 };
        out.unit(UnitId::stream(UnitType::SequenceParameters), &self.sequence.to_bytes()?)?;
        let mut entries = Vec::new();
        let mut first = 0_u32;
        for gop in &self.gops {
            entries.push(IndexEntry { frame: first, reserved_zero: 0, offset: out.position() });
            gop.write(first, &self.sequence, &mut out)?;
            first = first.saturating_add(gop.header.gop_frame_count);
        }
        if let Some(entries) = &self.points {
            let points = OperatingPoints { entries: entries.clone() };
            out.unit(UnitId::stream(UnitType::OperatingPoints), &points.to_bytes()?)?;
        }
        let index_offset = if self.has_index { out.position() } else { 0 };
        if self.has_index {
            out.unit(UnitId::stream(UnitType::Index), &Index { entries }.to_bytes()?)?;
        }
        let (frame_count, unit_count) = (out.frame_count, out.unit_count);
        let end = EndOfStream { frame_count, unit_count, index_offset };
        out.unit(UnitId::stream(UnitType::End), &end.to_bytes()?)?;
        Ok(out.bytes)
    }
}

impl DynamicGop {
    fn write(&self, first: u32, sequence: &SequenceParameters, out: &mut Output) -> crate::Result<()> {
        out.unit(UnitId::of_frame(UnitType::GopHeader, first), &self.header.to_bytes()?)?;
        for transform in &self.transforms {
            out.unit(UnitId::of_frame(UnitType::Transform, first), &transform.to_bytes(sequence)?)?;
        }
        if let Some(weights) = &self.weights {
            out.unit(UnitId::of_frame(UnitType::Weights, first), &weights.to_bytes()?)?;
        }
        for frame in &self.frames {
            for LayeredCodebook { temporal_layer, codebook } in &frame.codebooks {
                let id = UnitId::of_frame(UnitType::Codebook, first).on_layers(0, *temporal_layer);
                out.unit(id, &codebook.to_bytes()?)?;
            }
            let number = first.saturating_add(frame.place);
            let place = self.header.place(frame.place);
            let id = UnitId::of_frame(UnitType::FrameHeader, number);
            let id = id.on_layers(header_layer(&place, sequence), place.temporal_layer);
            out.unit(id, &frame.header.to_bytes()?)?;
            out.frame_count = out.frame_count.saturating_add(1);
            for increment in &frame.increments {
                let id = UnitId::of_frame(UnitType::Increment, number)
                    .on_layers(increment.spatial_layer, place.temporal_layer);
                let payload = increment.to_bytes(sequence)?;
                out.unit(UnitId { refinement: increment.refinement, ..id }, &payload)?;
            }
        }
        Ok(())
    }
}

impl ArbitraryIncrement {
    /// The bytes of the payload.
    pub fn to_bytes(&self, sequence: &SequenceParameters) -> crate::Result<Vec<u8>> {
        write_increment(&self.header, sequence, &self.sections)
    }
}

/// The spatial layer in the frame header unit of a frame.
fn header_layer(place: &PlaceInGop, sequence: &SequenceParameters) -> u8 {
    if place.reference.is_some() { sequence.spatial_layer_count.saturating_sub(1) } else { 0 }
}

/// A list of operating points, mostly empty: a decoder that has seen all of the stream refuses other numbers.
fn points(u: &mut Unstructured<'_>) -> Result<Vec<OperatingPointEntry>> {
    let count = u.int_in_range(0..=7)?;
    let entry = |refinement: u8| {
        Ok(OperatingPointEntry {
            spatial_layer: 0,
            temporal_layer: 0,
            refinement,
            reserved_zero: 0,
            frame_count: u.arbitrary()?,
            gaussian_count: u.arbitrary()?,
            byte_count: u.arbitrary()?,
        })
    };
    (0..u8::saturating_sub(count, 5)).map(entry).collect()
}

fn gop(u: &mut Unstructured<'_>, index: u32, sequence: &SequenceParameters) -> Result<DynamicGop> {
    let frame_count = u.int_in_range(1..=6)?;
    let header = if u.ratio(3_u8, 4_u8)? {
        GopHeader::predicted(
            index,
            frame_count,
            u.int_in_range(0..=sequence.temporal_layer_count.saturating_sub(1))?,
        )
    } else {
        GopHeader::intra(index, frame_count)
    };
    let dc = u.int_in_range(0..=MAX_ID)?;
    let mut transforms = vec![transform(u, dc, TransformKind::Dc, sequence)?];
    if sequence.sh_degree > 0 && u.arbitrary()? {
        transforms.push(transform(u, (dc ^ 1) & MAX_ID, TransformKind::Sh, sequence)?);
    }
    let weights = if u.ratio(1_u8, 3_u8)? { Some(weights(u)?) } else { None };
    let mut tools = Tools::new(&transforms, weights.is_some());
    let mut homes: Vec<(u32, Homes)> = Vec::new();
    let mut frames = Vec::new();
    for number in 0..frame_count {
        let place = header.place(number);
        // Frames that no other refers to may be absent.
        let is_leaf = place.temporal_layer > 0 && place.temporal_layer == header.temporal_depth;
        if is_leaf && u.ratio(1_u8, 5_u8)? {
            continue;
        }
        let codebooks = codebooks(u, &mut tools, &place, sequence)?;
        let reference = place.reference.and_then(|wanted| homes.iter().find(|(known, _)| *known == wanted));
        let reference = reference.map(|(_, homes)| homes);
        let is_whole = header.is_predicted();
        let (frame, made) =
            increments::frame(u, sequence, &tools, (number, &place, codebooks), reference, is_whole)?;
        homes.push((number, made));
        frames.push(frame);
    }
    Ok(DynamicGop { header, transforms, weights, frames })
}

/// Codebooks before a frame: new ones, or new definitions of those that are known.
fn codebooks(
    u: &mut Unstructured<'_>,
    tools: &mut Tools,
    place: &PlaceInGop,
    sequence: &SequenceParameters,
) -> Result<Vec<LayeredCodebook>> {
    let Some(rank) = tools.sh_rank() else { return Ok(Vec::new()) };
    let count = u.int_in_range(0..=2)?;
    let most = sequence.temporal_layer_count.saturating_sub(1).min(place.temporal_layer);
    let mut defined = Vec::new();
    for _ in 0..count {
        let id = u.int_in_range(0..=3)?;
        let temporal_layer = match tools.layer_of(id) {
            Some(known) => known,
            None => u.int_in_range(0..=most)?,
        };
        tools.define(id, temporal_layer);
        defined.push(LayeredCodebook { temporal_layer, codebook: codebook(u, id, rank)? });
    }
    Ok(defined)
}
