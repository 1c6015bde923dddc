//! Random streams that obey the syntax: one generator for the property tests and for fuzzing.
//!
//! Valid by construction up to the sections: every header, order, count and check sum is right, and the bytes
//! inside models and blocks are arbitrary. What finds an error there has passed everything before. Those of profile
//! Intra are here, those of profile Dynamic in [`dynamic`].

use crate::payload::{Codebook, Index, Transform, write_refinement};
use crate::syntax::{
    CodebookHeader, EndOfStream, FrameHeader, GopHeader, IndexEntry, MAX_ID, NO_CODEBOOK, Profile,
    RefinementHeader, SequenceParameters, ShMode, TransformHeader, TransformKind, UnitId, UnitType, after,
};
use crate::unit::{write_file_header, write_unit};
use arbitrary::{Arbitrary, Result, Unstructured};

mod coded;
pub mod dynamic;
mod increments;
mod network;

pub use network::weights;

/// Most Gaussians of a frame: enough for several blocks.
const MAX_GAUSSIANS: u32 = 2000;
/// Most bytes of a section.
const MAX_SECTION: usize = 80;

/// A stream that obeys the syntax.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ArbitraryStream {
    /// Annex A.
    pub level: u8,
    /// The parameters of all frames.
    pub sequence: SequenceParameters,
    /// The groups in order.
    pub gops: Vec<ArbitraryGop>,
    /// Whether there is an index.
    pub has_index: bool,
}

/// A group of pictures.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ArbitraryGop {
    /// Transforms with different identifiers; the first is a dc transform.
    pub transforms: Vec<Transform>,
    /// Codebooks with different identifiers.
    pub codebooks: Vec<Codebook>,
    /// One frame or more.
    pub frames: Vec<ArbitraryFrame>,
    /// The payload of a private unit behind the header of the group.
    pub private: Option<Vec<u8>>,
}

/// A frame with all its refinements, or with the first of them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ArbitraryFrame {
    /// The payload of the frame header unit.
    pub header: FrameHeader,
    /// One refinement or more.
    pub refinements: Vec<ArbitraryRefinement>,
}

/// A refinement whose sections hold arbitrary bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ArbitraryRefinement {
    /// The fixed part.
    pub header: RefinementHeader,
    /// What stands in the place of the models.
    pub model: Vec<u8>,
    /// What stands in the place of each block.
    pub blocks: Vec<Vec<u8>>,
}

impl<'a> Arbitrary<'a> for ArbitraryStream {
    fn arbitrary(u: &mut Unstructured<'a>) -> Result<Self> {
        let sequence = sequence_parameters(u)?;
        let gop_count = u.int_in_range(0..=3)?;
        let gops = (0..gop_count).map(|_| gop(u, &sequence)).collect::<Result<Vec<_>>>()?;
        Ok(Self { level: u.int_in_range(1..=4)?, sequence, gops, has_index: u.arbitrary()? })
    }
}

impl ArbitraryStream {
    /// The bytes of the stream.
    pub fn to_bytes(&self) -> crate::Result<Vec<u8>> {
        let mut out =
            Output { bytes: write_file_header(Profile::Intra, self.level)?, frame_count: 0, unit_count: 0 };
        out.unit(UnitId::stream(UnitType::SequenceParameters), &self.sequence.to_bytes()?)?;
        let mut entries = Vec::new();
        for (gop_index, gop) in (0..).zip(&self.gops) {
            entries.push(IndexEntry { frame: out.frame_count, reserved_zero: 0, offset: out.position() });
            out.gop(gop_index, gop, &self.sequence)?;
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

/// A stream being written, with what its end unit says.
struct Output {
    bytes: Vec<u8>,
    frame_count: u32,
    unit_count: u32,
}

impl Output {
    fn position(&self) -> u64 {
        after(0, self.bytes.len())
    }

    fn unit(&mut self, id: UnitId, payload: &[u8]) -> crate::Result<()> {
        self.unit_count = self.unit_count.saturating_add(1);
        write_unit(&mut self.bytes, id, payload)
    }

    fn gop(
        &mut self,
        gop_index: u32,
        gop: &ArbitraryGop,
        sequence: &SequenceParameters,
    ) -> crate::Result<()> {
        let first = self.frame_count;
        let frames = u32::try_from(gop.frames.len()).unwrap_or(u32::MAX);
        let header = GopHeader::intra(gop_index, frames).to_bytes()?;
        self.unit(UnitId::of_frame(UnitType::GopHeader, first), &header)?;
        if let Some(private) = &gop.private {
            self.unit(UnitId::stream(UnitType::User(200)), private)?;
        }
        for transform in &gop.transforms {
            self.unit(UnitId::of_frame(UnitType::Transform, first), &transform.to_bytes(sequence)?)?;
        }
        for codebook in &gop.codebooks {
            self.unit(UnitId::of_frame(UnitType::Codebook, first), &codebook.to_bytes()?)?;
        }
        gop.frames.iter().try_for_each(|frame| self.frame(frame, sequence))
    }

    fn frame(&mut self, frame: &ArbitraryFrame, sequence: &SequenceParameters) -> crate::Result<()> {
        let place = self.frame_count;
        self.frame_count = place.saturating_add(1);
        self.unit(UnitId::of_frame(UnitType::FrameHeader, place), &frame.header.to_bytes()?)?;
        for (number, refinement) in (0..).zip(&frame.refinements) {
            self.unit(UnitId::of_refinement(place, number), &refinement.to_bytes(sequence)?)?;
        }
        Ok(())
    }
}

impl ArbitraryRefinement {
    /// The bytes of the payload.
    pub fn to_bytes(&self, sequence: &SequenceParameters) -> crate::Result<Vec<u8>> {
        write_refinement(&self.header, sequence, &self.model, &self.blocks)
    }
}

/// Any parameters that are accepted.
pub fn sequence_parameters(u: &mut Unstructured<'_>) -> Result<SequenceParameters> {
    let refinement_count = u.int_in_range(1..=crate::syntax::MAX_REFINEMENTS)?;
    let mut rotation_threshold: [u8; 3] = u.arbitrary()?;
    rotation_threshold.sort_unstable_by(|a, b| b.cmp(a));
    Ok(SequenceParameters {
        sh_degree: u.int_in_range(0..=3)?,
        spatial_layer_count: 1,
        temporal_layer_count: 1,
        refinement_count,
        refinement_percent: percents(u, refinement_count)?,
        position_bits: u.int_in_range(1..=20)?,
        block_log2: u.int_in_range(6..=16)?,
        sequence_flags: SequenceParameters::flags(u.arbitrary()?, u.arbitrary()?),
        rotation_threshold,
        frame_count: 0,
        ticks_per_second: u.int_in_range(1..=u32::MAX)?,
        ticks_per_frame: u.arbitrary()?,
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

/// Any transform of a kind that is accepted. A sequence of degree 0 has none of kind sh.
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

/// Any refinement with a number of Gaussians. `stages` are the codebooks it may use; `has_sh` says whether the
/// frame has an sh transform.
pub fn refinement(
    u: &mut Unstructured<'_>,
    sequence: &SequenceParameters,
    gaussian_count: u32,
    stages: &[u8],
    has_sh: bool,
) -> Result<ArbitraryRefinement> {
    let modes = match (has_sh, stages.is_empty()) {
        (false, _) => ShMode::None,
        (true, true) => ShMode::Coefficients,
        (true, false) => ShMode::VectorQuantised,
    };
    let sh_mode = u.int_in_range(0..=modes.code())?;
    let vq_stage_count = if sh_mode == ShMode::VectorQuantised.code() { u.int_in_range(1..=4)? } else { 0 };
    let mut codebook_ids = [NO_CODEBOOK; 4];
    for id in codebook_ids.iter_mut().take(vq_stage_count.into()) {
        *id = *u.choose(stages)?;
    }
    let header = RefinementHeader {
        refinement_digest: u.arbitrary()?,
        gaussian_count,
        position_shift: u.int_in_range(0..=sequence.position_bits.saturating_sub(1))?,
        lanes_log2: u.int_in_range(0..=5)?,
        sh_mode,
        vq_stage_count,
        codebook_ids,
    };
    let model = if gaussian_count == 0 { Vec::new() } else { section(u)? };
    let blocks = (0..header.block_count(sequence)).map(|_| section(u)).collect::<Result<_>>()?;
    Ok(ArbitraryRefinement { header, model, blocks })
}

fn gop(u: &mut Unstructured<'_>, sequence: &SequenceParameters) -> Result<ArbitraryGop> {
    let dc = u.int_in_range(0..=MAX_ID)?;
    let mut transforms = vec![transform(u, dc, TransformKind::Dc, sequence)?];
    let mut codebooks = Vec::new();
    if sequence.sh_degree > 0 && u.arbitrary()? {
        let sh = transform(u, (dc ^ 1) & MAX_ID, TransformKind::Sh, sequence)?;
        let codebook_count = u.int_in_range(0..=3)?;
        codebooks = (0..codebook_count).map(|id| codebook(u, id, sh.header.rank)).collect::<Result<_>>()?;
        transforms.push(sh);
    }
    let frame_count = u.int_in_range(1..=3)?;
    let frames =
        (0..frame_count).map(|_| frame(u, sequence, &transforms, &codebooks)).collect::<Result<_>>()?;
    let private = if u.arbitrary()? { Some(section(u)?) } else { None };
    Ok(ArbitraryGop { transforms, codebooks, frames, private })
}

fn frame(
    u: &mut Unstructured<'_>,
    sequence: &SequenceParameters,
    transforms: &[Transform],
    codebooks: &[Codebook],
) -> Result<ArbitraryFrame> {
    let id_of = |kind| {
        let found = transforms.iter().find(|transform| transform.header.kind() == Some(kind));
        found.map(|transform| transform.header.transform_id)
    };
    let gaussian_count = u.int_in_range(0..=MAX_GAUSSIANS)?;
    let sh = id_of(TransformKind::Sh);
    let header = FrameHeader::intra(id_of(TransformKind::Dc).unwrap_or(0), sh, gaussian_count);
    let stages: Vec<u8> = codebooks.iter().map(|codebook| codebook.header.codebook_id).collect();
    // A frame may stop at any refinement.
    let refinement_count = u.int_in_range(1..=sequence.refinement_count)?;
    let refinements = (0..refinement_count).map(|number| {
        let added = sequence.refinement_length(number, gaussian_count);
        refinement(u, sequence, added, &stages, sh.is_some())
    });
    Ok(ArbitraryFrame { header, refinements: refinements.collect::<Result<_>>()? })
}

/// Strictly increasing to 100 in `refinement_count` places, then zero.
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
