//! Small streams from a seed: everything valid, digests included.
//!
//! The writer knows the syntax, not the decoding process. It writes increments with digests of 0, decodes the stream, and
//! puts in what the decoder computed, until no digest is wrong.

use splatstream_decoder::layout::{Layout, Section, ShCoding};
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::{Summary, decode_stream};
use splatstream_format::ErrorKind;
use splatstream_format::entropy::frequencies::Frequencies;
use splatstream_format::entropy::model::{ContextAxis, PlaneModel, write_models};
use splatstream_format::entropy::token::{Alphabet, split};
use splatstream_format::entropy::writer::{BlockWriter, PlaneEncoder};
use splatstream_format::payload::{
    CellsBytes, Codebook, SectionBytes, Transform, write_frame, write_increment,
};
use splatstream_format::syntax::{
    CodebookHeader, EndOfStream, FrameHeader, FrameType, GopHeader, IncrementHeader, IndexEntry, Profile,
    SequenceParameters, TransformHeader, UnitId, UnitType,
};
use splatstream_format::unit::{write_file_header, write_unit};
use std::collections::BTreeMap;

/// Numbers that are the same everywhere.
#[derive(Debug, Clone)]
pub(crate) struct Dice(u64);

impl Dice {
    pub(crate) const fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub(crate) fn below(&mut self, end: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % end
    }

    pub(crate) fn within(&mut self, low: i32, high: i32) -> i32 {
        low + self.below((high - low + 1) as u64) as i32
    }
}

/// What a stream shall be like.
#[derive(Debug, Clone)]
pub(crate) struct Plan {
    pub(crate) seed: u64,
    pub(crate) profile: Profile,
    pub(crate) spatial_layers: u8,
    /// Frames of each GOP.
    pub(crate) gops: Vec<u32>,
    /// Levels of temporal enhancement of predicted GOPs; none: all frames are I frames.
    pub(crate) temporal_depth: Option<u8>,
    pub(crate) percents: Vec<u8>,
    pub(crate) gaussians: u32,
    pub(crate) whole_anchor: bool,
    pub(crate) predictors: bool,
    /// Whether frame headers have the digest of carried lists.
    pub(crate) carried_digests: bool,
}

impl Plan {
    /// Two GOPs of static content.
    pub(crate) fn intra(seed: u64) -> Self {
        Self {
            seed,
            profile: Profile::Intra,
            spatial_layers: 1,
            gops: vec![2, 1],
            temporal_depth: None,
            percents: vec![20, 50, 100],
            gaussians: 200,
            whole_anchor: false,
            predictors: false,
            carried_digests: false,
        }
    }

    /// Two predicted GOPs in two spatial and two temporal layers.
    pub(crate) fn predicted(seed: u64) -> Self {
        Self {
            profile: Profile::Dynamic,
            spatial_layers: 2,
            gops: vec![4, 3],
            temporal_depth: Some(1),
            gaussians: 60,
            predictors: true,
            carried_digests: true,
            ..Self::intra(seed)
        }
    }

    pub(crate) fn sequence(&self) -> SequenceParameters {
        let mut refinement_percent = [0; 10];
        refinement_percent[..self.percents.len()].copy_from_slice(&self.percents);
        SequenceParameters {
            sh_degree: 1,
            spatial_layer_count: self.spatial_layers,
            temporal_layer_count: self.temporal_depth.unwrap_or(0) + 1,
            refinement_count: self.percents.len() as u8,
            refinement_percent,
            position_bits: 10,
            block_log2: 6,
            sequence_flags: SequenceParameters::flags(false, false, self.whole_anchor),
            linear_log2: 6,
            segment_log2: 6,
            feature_shift: 1,
            size_weight: [300, 200, 800, 100, 50],
            opacity_weight: [400, 500, 600],
            anisotropy_weight: 700,
            size_reference: 3,
            opacity_reference: 2,
            anisotropy_reference: 5,
            frame_count: self.gops.iter().sum(),
            ticks_per_second: 30,
            ticks_per_frame: 1,
            position_offset: [(-1.0_f32).to_bits(), 0, 1.5_f32.to_bits()],
            position_step: 0.01_f32.to_bits(),
            log_scale_offset: (-8.0_f32).to_bits(),
            log_scale_step: 0.1_f32.to_bits(),
            rotation_step: 0.01_f32.to_bits(),
            opacity_offset: 0.5_f32.to_bits(),
            opacity_step: 0.2_f32.to_bits(),
            dc_step: 0.03_f32.to_bits(),
            sh_step: 0.07_f32.to_bits(),
        }
    }

    pub(crate) fn script(&self) -> Script {
        let mut writer = Writer::new(self);
        for (gop, &frames) in self.gops.iter().enumerate() {
            writer.gop(gop as u32, frames);
        }
        let mut script = Script { profile: self.profile, level: 1, parts: writer.parts };
        script.fill_digests(self.percents.len() as u8 - 1);
        script
    }
}

/// A unit to be written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Part {
    pub(crate) id: UnitId,
    pub(crate) payload: Vec<u8>,
}

impl Part {
    pub(crate) fn new(id: UnitId, payload: Vec<u8>) -> Self {
        Self { id, payload }
    }
}

/// The units of a stream; an index and an end unit follow when it is written.
#[derive(Debug, Clone)]
pub(crate) struct Script {
    pub(crate) profile: Profile,
    pub(crate) level: u8,
    pub(crate) parts: Vec<Part>,
}

impl Script {
    /// The units alone, and the offset of each.
    fn units(&self) -> (Vec<u8>, Vec<usize>) {
        let mut bytes = write_file_header(self.profile, self.level).unwrap();
        let mut offsets = Vec::new();
        for part in &self.parts {
            offsets.push(bytes.len());
            write_unit(&mut bytes, part.id, &part.payload).unwrap();
        }
        (bytes, offsets)
    }

    /// The offset of each part, and of the unit after the last.
    pub(crate) fn offsets(&self) -> Vec<usize> {
        let (bytes, mut offsets) = self.units();
        offsets.push(bytes.len());
        offsets
    }

    pub(crate) fn bytes(&self) -> Vec<u8> {
        let (mut bytes, offsets) = self.units();
        let of_type = |unit_type| {
            self.parts.iter().zip(&offsets).filter(move |(part, _)| part.id.unit_type == unit_type)
        };
        let entry = |(part, &offset): (&Part, &usize)| IndexEntry {
            frame: part.id.frame,
            reserved_zero: 0,
            offset: offset as u64,
        };
        let entries = of_type(UnitType::GopHeader).map(entry).collect();
        // A script that was changed may have GOPs for which there is no index.
        let index = splatstream_format::payload::Index { entries }.to_bytes().ok();
        let end = EndOfStream {
            frame_count: of_type(UnitType::FrameHeader).count() as u32,
            unit_count: self.parts.len() as u32 + u32::from(index.is_some()),
            index_offset: if index.is_some() { bytes.len() as u64 } else { 0 },
        };
        if let Some(index) = index {
            write_unit(&mut bytes, UnitId::stream(UnitType::Index), &index).unwrap();
        }
        write_unit(&mut bytes, UnitId::stream(UnitType::End), &end.to_bytes().unwrap()).unwrap();
        bytes
    }

    /// The parts of a type, by index.
    pub(crate) fn indices(&self, unit_type: UnitType) -> Vec<usize> {
        (0..self.parts.len()).filter(|&index| self.parts[index].id.unit_type == unit_type).collect()
    }

    /// The part with an identifier.
    pub(crate) fn find(&self, id: UnitId) -> usize {
        self.parts.iter().position(|part| part.id == id).unwrap()
    }

    /// The script without some parts.
    pub(crate) fn without(&self, lost: impl Fn(usize) -> bool) -> Self {
        let parts = self.parts.iter().enumerate().filter(|(index, _)| !lost(*index));
        Self { parts: parts.map(|(_, part)| part.clone()).collect(), ..*self }
    }

    /// Puts in the digests that the decoder computes: of all lists, then of what is carried where the last list of every P
    /// and B frame is missing.
    fn fill_digests(&mut self, last: u8) {
        while self.patch(&self.clone()) {}
        let is_last = |index: usize| {
            let id = self.parts[index].id;
            id.unit_type == UnitType::Increment && id.refinement == last && !self.is_anchor(id.frame)
        };
        let short = self.without(is_last);
        self.patch(&short);
    }

    /// Whether a frame is the first of its GOP.
    fn is_anchor(&self, frame: u32) -> bool {
        self.indices(UnitType::GopHeader).into_iter().any(|gop| self.parts[gop].id.frame == frame)
    }

    /// Corrects the digests that are wrong in a script of some of these parts; whether there were any.
    fn patch(&mut self, script: &Self) -> bool {
        let (summary, _) = decoded(&script.bytes(), &Options::default());
        let offsets = script.offsets();
        for error in &summary.errors {
            let ErrorKind::Digest { computed, .. } = error.kind else { panic!("{error}") };
            let index = offsets.iter().rposition(|&offset| (offset as u64) < error.at).unwrap();
            let index = self.find(script.parts[index].id);
            // The digest of an increment stands after its flags, that of a frame header after its fixed part.
            let part = &mut self.parts[index];
            let start = if part.id.unit_type == UnitType::Increment { 2 } else { FrameHeader::SIZE };
            part.payload[start..start + 8].copy_from_slice(&computed.to_le_bytes());
        }
        !summary.errors.is_empty()
    }
}

/// Everything that comes out of a stream.
pub(crate) fn decoded(
    bytes: &[u8],
    options: &Options,
) -> (Summary, Vec<splatstream_decoder::process::DecodedFrame>) {
    let mut frames = Vec::new();
    let summary = decode_stream(bytes, options, |_, frame| {
        frames.push(frame);
        core::ops::ControlFlow::Continue(())
    });
    (summary, frames)
}

/// The bytes of a section: blocks of 64, one table for each plane.
pub(crate) fn section(layout: &Layout, deltas: &[u64], planes: &[Vec<i32>]) -> SectionBytes {
    let infos = layout.planes();
    let with_deltas = usize::from(infos[0].is_position());
    let entries = if with_deltas == 1 { deltas.len() } else { planes[0].len() };
    let symbol = |plane: usize, entry: usize| match (plane.checked_sub(with_deltas), infos[plane].alphabet) {
        (None, _) => deltas[entry],
        (Some(plane), Alphabet::Attribute) => {
            let value = planes[plane][entry];
            u64::from((value << 1 ^ value >> 31) as u32)
        }
        (Some(plane), _) => planes[plane][entry] as u64,
    };
    let model = |plane: usize| {
        let mut counts = vec![0; 256];
        (0..entries).for_each(|entry| counts[usize::from(split(symbol(plane, entry), 4).token)] += 1);
        PlaneModel {
            bias: 0,
            direct_log2: 4,
            axes: [ContextAxis::NONE, ContextAxis::NONE],
            tables: vec![Frequencies::from_counts(&counts)],
            table_of_context: vec![0],
        }
    };
    let models: Vec<PlaneModel> = (0..infos.len()).map(model).collect();
    let model_bytes = write_models(&models, &layout.alphabets(), None);
    let lanes_log2 = (entries % 4) as u8;
    let block = |start: usize| {
        let mut writer = BlockWriter::new(lanes_log2);
        for (plane, model) in models.iter().enumerate() {
            let block = start..entries.min(start + 64);
            let symbols = block.clone().map(|entry| symbol(plane, entry));
            writer.plane(&PlaneEncoder::new(model), &vec![0; block.len()], symbols).unwrap();
        }
        writer.finish()
    };
    let blocks = (0..entries).step_by(64).map(block).collect();
    SectionBytes { lanes_log2, model: model_bytes, blocks }
}

struct Writer<'p> {
    plan: &'p Plan,
    sequence: SequenceParameters,
    dice: Dice,
    parts: Vec<Part>,
    /// Sizes of the lists of the frames of this GOP, by index in the GOP.
    sizes: BTreeMap<u32, Vec<u32>>,
}

/// Transform 3 of kind dc, 4 of kind sh with two components; codebooks 7 and 1.
const DC: u8 = 3;
const SH: u8 = 4;

fn transform(transform_id: u8, transform_kind: u8, dimension: u8, rank: u8, mean: i32) -> Transform {
    let header = TransformHeader { transform_id, transform_kind, dimension, rank };
    let basis = (0..i16::from(rank) * i16::from(dimension)).map(|weight| weight * 97 % 4096 - 900).collect();
    Transform { header, mean: vec![mean; dimension.into()], basis }
}

impl<'p> Writer<'p> {
    fn new(plan: &'p Plan) -> Self {
        let sequence = plan.sequence();
        let parts =
            vec![Part::new(UnitId::stream(UnitType::SequenceParameters), sequence.to_bytes().unwrap())];
        Self { plan, sequence, dice: Dice::new(plan.seed), parts, sizes: BTreeMap::new() }
    }

    fn gop(&mut self, gop_index: u32, frames: u32) {
        let first: u32 = self.plan.gops.iter().take(gop_index as usize).sum();
        let header = match self.plan.temporal_depth {
            None => GopHeader::intra(gop_index, frames),
            Some(depth) => GopHeader::predicted(gop_index, frames, depth),
        };
        if gop_index > 0 {
            self.parts.push(self.parts[0].clone());
        }
        let id = |unit_type| UnitId::of_frame(unit_type, first);
        self.parts.push(Part::new(id(UnitType::GopHeader), header.to_bytes().unwrap()));
        for transform in [transform(DC, 0, 3, 3, -70), transform(SH, 1, 9, 2, 9)] {
            let payload = transform.to_bytes(&self.sequence).unwrap();
            self.parts.push(Part::new(id(UnitType::Transform), payload));
        }
        for (codebook_id, entries) in [(7, vec![1, -2, 30, 40, -128, 127]), (1, vec![0, 5, -81, 81])] {
            let entry_count_minus1 = entries.len() as u16 / 2 - 1;
            let header =
                CodebookHeader { codebook_id, component_count: 2, entry_count_minus1, value_bytes: 2 };
            let payload = Codebook { header, entries }.to_bytes().unwrap();
            self.parts.push(Part::new(id(UnitType::Codebook), payload));
        }
        self.sizes.clear();
        (0..frames).for_each(|index| self.frame(first, &header, index));
    }

    fn frame(&mut self, first: u32, gop: &GopHeader, index: u32) {
        let role = gop.role(index);
        let id = UnitId::of_frame(UnitType::FrameHeader, first + index).on_layers(0, role.temporal_layer);
        let refinements = self.sequence.refinement_count;
        let top = self.plan.spatial_layers - 1;
        let header_at = self.parts.len();
        self.parts.push(Part::new(id, Vec::new()));
        let mut sizes = vec![0; refinements.into()];
        let reference = role.reference.map(|reference| self.sizes[&reference].clone());
        let layers = if reference.is_some() { top..=top } else { 0..=top };
        for layer in layers {
            for refinement in 0..refinements {
                let slot = usize::from(refinement);
                let parents = reference.as_ref().map_or(sizes[slot], |sizes| sizes[slot]);
                let all = self.sequence.refinement_length(refinement, self.plan.gaussians);
                let target = all * u32::from(layer + 1) / u32::from(top + 1);
                let id =
                    UnitId::of_increment(first + index, refinement).on_layers(layer, role.temporal_layer);
                let intra = reference.is_none();
                sizes[slot] = self.increment(id, parents, intra.then(|| target - parents));
            }
        }
        let count = if reference.is_none() { self.plan.gaussians } else { sizes.iter().sum() };
        let header = FrameHeader::new(role.frame_type, DC, Some(SH), count);
        let cells = (role.frame_type != FrameType::Intra).then(|| self.cells());
        let digest = cells.as_ref().filter(|_| self.plan.carried_digests).map(|_| 0);
        let payload = write_frame(&header, digest, cells.as_ref(), &self.sequence).unwrap();
        self.parts[header_at].payload = payload;
        self.sizes.insert(index, sizes);
    }

    /// Cells around the middle of the grid, where all Gaussians are; some are stale.
    fn cells(&mut self) -> CellsBytes {
        let layout = Layout::of_section(Section::Cells, 0, ShCoding::None);
        // Cells of 16 steps: the first has the coordinates 32, 32, 32.
        let deltas: Vec<u64> = (0..6).map(|cell| if cell == 0 { 7 << 15 } else { 1 }).collect();
        let mut plane = |most: i32| -> Vec<i32> { (0..6).map(|_| self.dice.within(-most, most)).collect() };
        let mut planes: Vec<Vec<i32>> = [40, 40, 40, 700, 700, 700].map(&mut plane).into();
        planes.insert(0, vec![0, 1, 0, 0, 1, 0]);
        CellsBytes { cell_count: 6, cell_log2: 4, section: section(&layout, &deltas, &planes) }
    }

    /// Writes an increment; gives the size of its list. `new` is the number of new Gaussians of an I frame.
    fn increment(&mut self, id: UnitId, parents: u32, new: Option<u32>) -> u32 {
        let highest = if new.is_some() { 3 } else { 4 };
        let modes: Vec<i32> = (0..parents).map(|_| self.dice.within(0, highest)).collect();
        let new = new.unwrap_or_else(|| self.dice.below(9) as u32);
        let count = |holds: fn(i32) -> bool| modes.iter().filter(|mode| holds(**mode)).count() as u32;
        let has_predictors = self.plan.predictors && new > 0 && self.dice.below(3) > 0;
        let (sh, sh_mode) = match self.dice.below(3) {
            0 => (ShCoding::None, 0),
            1 => (ShCoding::Coefficients { rank: 2 }, 1),
            _ => (ShCoding::VectorQuantised { stages: 2 }, 2),
        };
        let plain = IncrementHeader::PLAIN;
        let header = IncrementHeader {
            parent_count: parents,
            move_count: count(|mode| mode & 1 != 0),
            update_count: count(|mode| mode & 2 != 0),
            remove_count: count(|mode| mode == 4),
            new_count: new,
            position_shift: self.dice.below(3) as u8,
            attribute_step: [(); 5].map(|()| self.dice.below(3) as u8),
            predictor_block_log2: if has_predictors { 2 } else { plain.predictor_block_log2 },
            neighbour_count: if has_predictors { 5 } else { plain.neighbour_count },
            bilateral_spatial: if has_predictors { 40 } else { 0 },
            bilateral_feature: if has_predictors { 3 } else { 0 },
            sh_mode,
            vq_stage_count: if sh_mode == 2 { 2 } else { 0 },
            codebook_ids: if sh_mode == 2 { [7, 1, 255, 255] } else { [255; 4] },
            compensation_log_scale: self.dice.within(-3, 3) as i8,
            compensation_opacity: self.dice.within(-3, 3) as i8,
            ..plain
        };
        let header = header.with_flags();
        let sections = self.sections(&header, modes, sh);
        let payload = write_increment(&header, &self.sequence, &sections).unwrap();
        self.parts.push(Part::new(id, payload));
        header.list_size()
    }

    fn sections(&mut self, header: &IncrementHeader, modes: Vec<i32>, sh: ShCoding) -> Vec<SectionBytes> {
        let layout = |section| Layout::of_section(section, 3, sh);
        let mut sections = Vec::new();
        for kind in Section::OF_INCREMENT {
            let count = header.count(kind);
            if count == 0 {
                continue;
            }
            let dice = &mut self.dice;
            let shift = 3 * u32::from(header.position_shift);
            let (deltas, planes) = match kind {
                Section::Modes => (Vec::new(), vec![modes.clone()]),
                Section::Moves => (Vec::new(), vec![vec![1; count as usize]; 3]),
                Section::Predictors => (Vec::new(), vec![(0..count).map(|_| dice.within(0, 2)).collect()]),
                // The first Gaussian of a block stands at the middle of the grid, the others after it.
                _ => {
                    let middle = 7_u64 << 27 >> shift;
                    let deltas = (0..count)
                        .map(|entry| if entry % 64 == 0 { middle } else { dice.below(900) >> shift })
                        .collect();
                    (deltas, attributes(dice, count, sh))
                }
            };
            let deltas = if kind == Section::Updates { Vec::new() } else { deltas };
            sections.push(section(&layout(kind), &deltas, &planes));
        }
        sections
    }
}

/// Small values of every attribute.
fn attributes(dice: &mut Dice, count: u32, sh: ShCoding) -> Vec<Vec<i32>> {
    let mut plane = |low: i32, high: i32| (0..count).map(|_| dice.within(low, high)).collect::<Vec<i32>>();
    let mut planes = vec![plane(-9, 9), plane(-3, 3), plane(-3, 3), plane(-9, 9)];
    planes.extend((0..3).map(|_| plane(-4, 4)));
    planes.extend((0..3).map(|_| plane(-30, 30)));
    match sh {
        ShCoding::None => {}
        ShCoding::Coefficients { .. } => planes.extend([plane(-5, 5), plane(-5, 5)]),
        ShCoding::VectorQuantised { .. } => planes.extend([plane(0, 2), plane(0, 1)]),
    }
    planes
}
