//! Random streams that obey the syntax: one generator for the property tests and for fuzzing.
//!
//! Valid by construction up to the sections: every header, order, count and checksum is right. Digests, and some of
//! the models and blocks, are arbitrary. What finds an error there has passed everything before.

use crate::payload::{
    CellsBytes, Codebook, ColourSpace, Index, OperatingPoints, SceneDescription, SectionBytes, Sorting,
    Transform, UpAxis, Weights, write_frame, write_increment,
};
use crate::syntax::{
    Camera, CodebookHeader, EndOfStream, FrameHeader, GopHeader, IncrementHeader, IndexEntry, MAX_ID,
    MAX_LAYERS, MAX_LINEAR_LOG2, OperatingPointEntry, Profile, SequenceParameters, TransformHeader,
    TransformKind, UnitId, UnitType, after,
};
use crate::unit::{write_file_header, write_unit};
use arbitrary::{Arbitrary, Result, Unstructured};
use frames::Tools;

mod coded;
mod frames;
mod network;

pub use network::weights;

/// Most bytes of a part of a section.
const MAX_SECTION: usize = 80;

/// A stream that obeys the syntax.
#[derive(Debug, Clone, PartialEq)]
pub struct ArbitraryStream {
    /// Annex A.
    pub profile: Profile,
    /// Annex A.
    pub level: u8,
    /// The parameters of all frames.
    pub sequence: SequenceParameters,
    /// What viewers may want to know.
    pub scene: Option<SceneDescription>,
    /// The GOPs in order.
    pub gops: Vec<ArbitraryGop>,
    /// What stands in the list of operating points, if there is one. The numbers in it are not those of the stream.
    pub points: Option<Vec<OperatingPointEntry>>,
    /// Whether there is an index.
    pub has_index: bool,
}

/// A GOP.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ArbitraryGop {
    /// Whether a copy of the sequence parameters comes before it.
    pub repeats_sequence: bool,
    /// The payload of the GOP header unit.
    pub header: GopHeader,
    /// The payload of a private unit after the header.
    pub private: Option<Vec<u8>>,
    /// Transforms with different identifiers; the first is a dc transform.
    pub transforms: Vec<Transform>,
    /// The payload of the weights unit, if there is one.
    pub weights: Option<Weights>,
    /// One frame or more, in display order.
    pub frames: Vec<ArbitraryFrame>,
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
pub struct ArbitraryFrame {
    /// Its index in the GOP.
    pub index: u32,
    /// Codebooks before it: those that it may use, or new definitions of them.
    pub codebooks: Vec<LayeredCodebook>,
    /// The fixed part of the frame header.
    pub header: FrameHeader,
    /// A digest of carried lists, which are not those of the frame.
    pub carried_digest: Option<u64>,
    /// How cells move.
    pub cells: Option<CellsBytes>,
    /// One increment or more in an I frame.
    pub increments: Vec<ArbitraryIncrement>,
}

/// An increment whose sections hold arbitrary bytes, or small values that most processes accept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ArbitraryIncrement {
    /// The layer that the increment belongs to.
    pub spatial_layer: u8,
    /// The list that it changes.
    pub refinement: u8,
    /// The elements before the sections.
    pub header: IncrementHeader,
    /// The sections with a count above 0.
    pub sections: Vec<SectionBytes>,
}

impl<'a> Arbitrary<'a> for ArbitraryStream {
    fn arbitrary(u: &mut Unstructured<'a>) -> Result<Self> {
        let profile = if u.ratio(1_u8, 4_u8)? { Profile::Intra } else { Profile::Dynamic };
        Self::of_profile(profile, u)
    }
}

impl ArbitraryStream {
    /// A stream of a profile.
    ///
    /// # Errors
    /// There are too few bytes.
    pub fn of_profile(profile: Profile, u: &mut Unstructured<'_>) -> Result<Self> {
        let mut sequence = sequence_parameters(u, profile)?;
        // Few values happen to be sorted.
        if u.ratio(7_u8, 8_u8)? {
            let (antialiased, whole_anchor) = (sequence.antialiased(), sequence.whole_anchor());
            sequence.sequence_flags = SequenceParameters::flags(false, antialiased, whole_anchor);
        }
        let scene = if u.ratio(1_u8, 4_u8)? { Some(scene_description(u)?) } else { None };
        let gop_count = if u.ratio(1_u8, 16_u8)? { 0 } else { u.int_in_range(1..=2)? };
        let gops = (0..gop_count).map(|index| gop(u, index, profile, &sequence)).collect::<Result<_>>()?;
        let points = if u.ratio(1_u8, 4_u8)? { Some(points(u)?) } else { None };
        let (level, has_index) = (u.int_in_range(1..=4)?, u.arbitrary()?);
        Ok(Self { profile, level, sequence, scene, gops, points, has_index })
    }

    /// The bytes of the stream.
    ///
    /// # Errors
    /// Parts that the text allows and that do not fit together: a defect of this module.
    pub fn to_bytes(&self) -> crate::Result<Vec<u8>> {
        let bytes = write_file_header(self.profile, self.level)?;
        let mut out = Output { bytes, frame_count: 0, unit_count: 0 };
        let sequence = self.sequence.to_bytes()?;
        out.unit(UnitId::stream(UnitType::SequenceParameters), &sequence)?;
        if let Some(scene) = &self.scene {
            out.unit(UnitId::stream(UnitType::SceneDescription), &scene.to_bytes()?)?;
        }
        let mut entries = Vec::new();
        let mut first = 0_u32;
        for gop in &self.gops {
            if gop.repeats_sequence {
                out.unit(UnitId::stream(UnitType::SequenceParameters), &sequence)?;
            }
            entries.push(IndexEntry { frame: first, reserved_zero: 0, offset: after(0, out.bytes.len()) });
            gop.write(first, &self.sequence, &mut out)?;
            first = first.saturating_add(gop.header.gop_frame_count);
        }
        if let Some(entries) = &self.points {
            let points = OperatingPoints { entries: entries.clone() };
            out.unit(UnitId::stream(UnitType::OperatingPoints), &points.to_bytes()?)?;
        }
        let index_offset = if self.has_index { after(0, out.bytes.len()) } else { 0 };
        if self.has_index {
            out.unit(UnitId::stream(UnitType::Index), &Index { entries }.to_bytes()?)?;
        }
        let (frame_count, unit_count) = (out.frame_count, out.unit_count);
        let end = EndOfStream { frame_count, unit_count, index_offset };
        out.unit(UnitId::stream(UnitType::End), &end.to_bytes()?)?;
        Ok(out.bytes)
    }
}

/// A stream being written, with what its end unit says.
struct Output {
    bytes: Vec<u8>,
    frame_count: u32,
    unit_count: u32,
}

impl Output {
    fn unit(&mut self, id: UnitId, payload: &[u8]) -> crate::Result<()> {
        self.unit_count = self.unit_count.saturating_add(1);
        write_unit(&mut self.bytes, id, payload)
    }
}

impl ArbitraryGop {
    fn write(&self, first: u32, sequence: &SequenceParameters, out: &mut Output) -> crate::Result<()> {
        out.unit(UnitId::of_frame(UnitType::GopHeader, first), &self.header.to_bytes()?)?;
        if let Some(private) = &self.private {
            out.unit(UnitId::stream(UnitType::User(200)), private)?;
        }
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
            let temporal_layer = self.header.role(frame.index).temporal_layer;
            frame.write(first.saturating_add(frame.index), temporal_layer, sequence, out)?;
        }
        Ok(())
    }
}

impl ArbitraryFrame {
    fn write(
        &self,
        number: u32,
        temporal_layer: u8,
        sequence: &SequenceParameters,
        out: &mut Output,
    ) -> crate::Result<()> {
        let id = UnitId::of_frame(UnitType::FrameHeader, number).on_layers(0, temporal_layer);
        out.unit(id, &write_frame(&self.header, self.carried_digest, self.cells.as_ref(), sequence)?)?;
        out.frame_count = out.frame_count.saturating_add(1);
        for increment in &self.increments {
            let id = UnitId::of_increment(number, increment.refinement);
            let id = id.on_layers(increment.spatial_layer, temporal_layer);
            out.unit(id, &write_increment(&increment.header, sequence, &increment.sections)?)?;
        }
        Ok(())
    }
}

/// Any parameters that are accepted in a profile.
///
/// # Errors
/// There are too few bytes.
pub fn sequence_parameters(u: &mut Unstructured<'_>, profile: Profile) -> Result<SequenceParameters> {
    let refinement_count = u.int_in_range(1..=crate::syntax::MAX_REFINEMENTS)?;
    let layers = if profile == Profile::Intra { 1 } else { MAX_LAYERS };
    let position_bits = u.int_in_range(1..=20)?;
    let (linear_log2, segment_log2) = companding(u, position_bits)?;
    let mut weight = || Ok(if u.ratio(1_u8, 4_u8)? { u.int_in_range(0..=8191)? } else { 0 });
    let size_weight = [weight()?, weight()?, weight()?, weight()?, weight()?];
    let opacity_weight = [weight()?, weight()?, weight()?];
    let anisotropy_weight = weight()?;
    let ticks_per_second: u32 = u.int_in_range(1..=u32::MAX)?;
    // Up to 100,000 frames in a second: the small frames made here stay within the rate of every level.
    let least_ticks = ticks_per_second.div_ceil(100_000);
    let ticks_per_frame = if u.arbitrary()? { 0 } else { u.int_in_range(least_ticks..=u32::MAX)? };
    let whole_anchor = u.ratio(1_u8, 4_u8)? && profile == Profile::Dynamic;
    Ok(SequenceParameters {
        sh_degree: u.int_in_range(0..=3)?,
        spatial_layer_count: u.int_in_range(1..=layers)?,
        temporal_layer_count: u.int_in_range(1..=layers)?,
        refinement_count,
        refinement_percent: percents(u, refinement_count)?,
        position_bits,
        block_log2: u.int_in_range(6..=16)?,
        sequence_flags: SequenceParameters::flags(u.arbitrary()?, u.arbitrary()?, whole_anchor),
        linear_log2,
        segment_log2,
        feature_shift: u.int_in_range(0..=7)?,
        size_weight,
        opacity_weight,
        anisotropy_weight,
        size_reference: u.int_in_range(-65_536..=65_535)?,
        opacity_reference: u.int_in_range(-32_768..=32_767)?,
        anisotropy_reference: u.int_in_range(0..=65_535)?,
        frame_count: 0,
        ticks_per_second,
        ticks_per_frame,
        position_offset: [offset(u)?, offset(u)?, offset(u)?],
        position_step: step(u, MAX_STEP)?,
        log_scale_offset: offset(u)?,
        log_scale_step: step(u, MAX_STEP)?,
        rotation_step: step(u, 1.0)?,
        opacity_offset: offset(u)?,
        opacity_step: step(u, MAX_STEP)?,
        dc_step: step(u, MAX_STEP)?,
        sh_step: step(u, MAX_STEP)?,
    })
}

/// Any `linear_log2` and `segment_log2` that are accepted.
fn companding(u: &mut Unstructured<'_>, position_bits: u8) -> Result<(u8, u8)> {
    let half = 1_u32.wrapping_shl(u32::from(position_bits).saturating_sub(1));
    let fits = |linear: u8, segment: u8| {
        let outside = half.saturating_sub(1_u32.wrapping_shl(linear.into()));
        outside.div_ceil(1_u32.wrapping_shl(segment.into())) <= 24
    };
    let linear: Vec<u8> = (0..=MAX_LINEAR_LOG2).filter(|&linear| fits(linear, linear)).collect();
    let linear = *u.choose(&linear)?;
    let segments: Vec<u8> = (0..=linear).filter(|&segment| fits(linear, segment)).collect();
    Ok((linear, *u.choose(&segments)?))
}

/// Any transform of a kind that is accepted. A sequence of degree 0 has none of kind sh.
///
/// # Errors
/// There are too few bytes.
pub fn transform(
    u: &mut Unstructured<'_>,
    transform_id: u8,
    kind: TransformKind,
    sequence: &SequenceParameters,
) -> Result<Transform> {
    let dimension = kind.dimension(sequence);
    let rank = u.int_in_range(1..=dimension.max(1))?;
    let header = TransformHeader { transform_id, transform_kind: kind.code(), dimension, rank };
    let mean = (0..dimension).map(|_| u.int_in_range(-(1 << 30)..=1 << 30)).collect::<Result<_>>()?;
    let weights = u16::from(dimension).saturating_mul(rank.into());
    let basis = (0..weights).map(|_| u.int_in_range(-(1 << 12)..=1 << 12)).collect::<Result<_>>()?;
    Ok(Transform { header, mean, basis })
}

/// Any small codebook that is accepted.
///
/// # Errors
/// There are too few bytes.
pub fn codebook(u: &mut Unstructured<'_>, codebook_id: u8, component_count: u8) -> Result<Codebook> {
    let (entry_count_minus1, value_bytes) = (u.int_in_range(0..=7)?, u.int_in_range(1..=2)?);
    let header = CodebookHeader { codebook_id, component_count, entry_count_minus1, value_bytes };
    let value = |u: &mut Unstructured<'_>| match value_bytes {
        1 => i8::arbitrary(u).map(i16::from),
        _ => i16::arbitrary(u),
    };
    let entries = (0..header.value_count()).map(|_| value(u)).collect::<Result<_>>()?;
    Ok(Codebook { header, entries })
}

/// Any scene description with few cameras.
///
/// # Errors
/// There are too few bytes.
pub fn scene_description(u: &mut Unstructured<'_>) -> Result<SceneDescription> {
    let number = |u: &mut Unstructured<'_>| offset(u).map(f32::from_bits);
    let numbers = |u: &mut Unstructured<'_>| Ok([number(u)?, number(u)?, number(u)?]);
    let unit = |u: &mut Unstructured<'_>| step(u, 1.0).map(f32::from_bits);
    let mut scene = SceneDescription {
        up_axis: *u.choose(UpAxis::ALL)?,
        colour_space: *u.choose(ColourSpace::ALL)?,
        sorting: *u.choose(Sorting::ALL)?,
        ..SceneDescription::default()
    };
    if u.arbitrary()? {
        scene.metres_per_unit = Some(f32::from_bits(step(u, MAX_OFFSET)?));
    }
    if u.arbitrary()? {
        scene.background = Some([unit(u)?, unit(u)?, unit(u)?]);
    }
    if u.arbitrary()? {
        let mut bounds: [[f32; 3]; 2] = [numbers(u)?, numbers(u)?];
        let [min, max] = &mut bounds;
        for (min, max) in min.iter_mut().zip(max) {
            if *min > *max {
                core::mem::swap(min, max);
            }
        }
        scene.bounds = Some(bounds);
    }
    if u.arbitrary()? {
        let letters = u.int_in_range(1..=20)?;
        scene.title = Some((0..letters).map(|_| char::arbitrary(u)).collect::<Result<_>>()?);
    }
    let cameras = u.int_in_range(0..=3)?;
    let camera = |u: &mut Unstructured<'_>| {
        let rotation = [number(u)?, number(u)?, number(u)?, number(u)?];
        Ok(Camera { position: numbers(u)?, rotation, vertical_field_of_view: unit(u)? })
    };
    scene.cameras = (0..cameras).map(|_| camera(u)).collect::<Result<_>>()?;
    Ok(scene)
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

fn gop(
    u: &mut Unstructured<'_>,
    index: u32,
    profile: Profile,
    sequence: &SequenceParameters,
) -> Result<ArbitraryGop> {
    let frame_count = u.int_in_range(1..=6)?;
    let dynamic = profile == Profile::Dynamic;
    let header = if dynamic && u.ratio(3_u8, 4_u8)? {
        let deepest = sequence.temporal_layer_count.saturating_sub(1);
        GopHeader::predicted(index, frame_count, u.int_in_range(0..=deepest)?)
    } else {
        GopHeader::intra(index, frame_count)
    };
    let dc = u.int_in_range(0..=MAX_ID)?;
    let mut transforms = vec![transform(u, dc, TransformKind::Dc, sequence)?];
    if sequence.sh_degree > 0 && u.arbitrary()? {
        transforms.push(transform(u, (dc ^ 1) & MAX_ID, TransformKind::Sh, sequence)?);
    }
    let weights = if dynamic && u.ratio(1_u8, 3_u8)? { Some(weights(u)?) } else { None };
    let tools = Tools::new(&transforms, profile, weights.is_some());
    let frames = frames::frames(u, &header, sequence, tools)?;
    let repeats_sequence = index > 0 && u.arbitrary()?;
    let private = if u.ratio(1_u8, 8_u8)? { Some(section(u)?) } else { None };
    Ok(ArbitraryGop { repeats_sequence, header, private, transforms, weights, frames })
}

/// `refinement_count` numbers that increase strictly to 100, then zeros.
fn percents(u: &mut Unstructured<'_>, refinement_count: u8) -> Result<[u8; 10]> {
    let mut percents = [0; 10];
    let mut before: u8 = 0;
    for (percent, left) in percents.iter_mut().zip((0..refinement_count).rev()) {
        // Room for the `left` greater ones that follow.
        let max = 100_u8.saturating_sub(left);
        let min = if left == 0 { 100 } else { before.saturating_add(1) };
        before = u.int_in_range(min..=max)?;
        *percent = before;
    }
    Ok(percents)
}

/// 2^-40 and 2^20: the order of positive floats is that of their bit patterns.
const MIN_STEP: f32 = f32::from_bits((127 - 40) << 23);
const MAX_STEP: f32 = f32::from_bits((127 + 20) << 23);
const MAX_OFFSET: f32 = f32::from_bits((127 + 40) << 23);
const SIGN: u32 = 1 << 31;

fn step(u: &mut Unstructured<'_>, max: f32) -> Result<u32> {
    u.int_in_range(MIN_STEP.to_bits()..=max.to_bits())
}

fn offset(u: &mut Unstructured<'_>) -> Result<u32> {
    let sign = if u.arbitrary()? { SIGN } else { 0 };
    Ok(sign | u.int_in_range(0..=MAX_OFFSET.to_bits())?)
}

fn section(u: &mut Unstructured<'_>) -> Result<Vec<u8>> {
    let length = u.int_in_range(0..=MAX_SECTION)?;
    let mut bytes = vec![0; length];
    u.fill_buffer(&mut bytes)?;
    Ok(bytes)
}
