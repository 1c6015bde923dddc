//! A writer of streams that no encoder would write.

use splatstream_format::entropy::STATE_LOW;
use splatstream_format::entropy::frequencies::Frequencies;
use splatstream_format::entropy::layout::{Attribute, Layout, PlaneInfo, Section, ShCoding, is_available};
use splatstream_format::entropy::model::{ContextAxis, PlaneModel, Source, write_models};
use splatstream_format::entropy::token::{Alphabet, split, zigzag};
use splatstream_format::entropy::writer::{BlockWriter, PlaneEncoder};
use splatstream_format::payload::{
    CellsBytes, Codebook, SectionBytes, Transform, Weights, write_frame, write_increment,
};
use splatstream_format::syntax::{
    EndOfStream, FileHeader, FrameHeader, FrameType, GopHeader, IncrementHeader, Profile, SequenceParameters,
    TransformHeader, TransformKind, UnitId, UnitType,
};
use splatstream_format::unit::write_unit;

/// Components of the transforms: all.
pub(crate) const DC_RANK: u8 = 3;
pub(crate) const SH_RANK: u8 = 45;
pub(crate) const SH: ShCoding = ShCoding::Coefficients { rank: SH_RANK };
/// log2 of the values with tokens of their own.
const DIRECT_LOG2: u8 = 4;

/// Parameters with SH of degree 3.
pub(crate) fn sequence(spatial: u8, temporal: u8, percents: &[u8], block_log2: u8) -> SequenceParameters {
    let mut refinement_percent = [0; 10];
    refinement_percent[..percents.len()].copy_from_slice(percents);
    SequenceParameters {
        sh_degree: 3,
        spatial_layer_count: spatial,
        temporal_layer_count: temporal,
        refinement_count: percents.len() as u8,
        refinement_percent,
        position_bits: 20,
        block_log2,
        sequence_flags: SequenceParameters::flags(false, false, false),
        size_weight: [100; 5],
        opacity_weight: [100; 3],
        anisotropy_weight: 100,
        opacity_reference: 10,
        anisotropy_reference: 20,
        frame_count: 0,
        ticks_per_second: 30,
        ticks_per_frame: 0,
        ..SequenceParameters::PLAIN
    }
}

/// A stream that is being written.
pub(crate) struct Writer {
    pub(crate) bytes: Vec<u8>,
    pub(crate) sequence: SequenceParameters,
    units: u32,
    frames: u32,
    /// First frame of the GOP, and its header.
    gop: (u32, GopHeader),
}

impl Writer {
    pub(crate) fn new(profile: Profile, level: u8, sequence: SequenceParameters) -> Self {
        let bytes =
            FileHeader::new(profile, level).and_then(|header| header.to_bytes()).expect("a file header");
        let mut writer = Self { bytes, sequence, units: 0, frames: 0, gop: (0, GopHeader::intra(0, 1)) };
        writer.unit(UnitId::stream(UnitType::SequenceParameters), &sequence.to_bytes().expect("parameters"));
        writer
    }

    pub(crate) fn unit(&mut self, id: UnitId, payload: &[u8]) {
        write_unit(&mut self.bytes, id, payload).expect("a unit");
        self.units += 1;
    }

    /// A GOP with its transforms.
    pub(crate) fn gop(&mut self, first: u32, header: GopHeader) {
        self.gop = (first, header);
        self.unit(UnitId::of_frame(UnitType::GopHeader, first), &header.to_bytes().expect("a gop_header"));
        for (transform_id, kind, rank) in [(0, TransformKind::Dc, DC_RANK), (1, TransformKind::Sh, SH_RANK)] {
            let dimension = kind.dimension(&self.sequence);
            let header = TransformHeader { transform_id, transform_kind: kind.code(), dimension, rank };
            let basis = vec![1; usize::from(dimension) * usize::from(rank)];
            let transform = Transform { header, mean: vec![0; dimension.into()], basis };
            let payload = transform.to_bytes(&self.sequence).expect("a transform");
            self.unit(UnitId::of_frame(UnitType::Transform, first), &payload);
        }
    }

    pub(crate) fn weights(&mut self, weights: &Weights) {
        let payload = weights.to_bytes().expect("a network");
        self.unit(UnitId::of_frame(UnitType::Weights, self.gop.0), &payload);
    }

    pub(crate) fn codebook(&mut self, codebook: &Codebook) {
        let payload = codebook.to_bytes().expect("a codebook");
        self.unit(UnitId::of_frame(UnitType::Codebook, self.gop.0), &payload);
    }

    pub(crate) fn frame(
        &mut self,
        index: u32,
        gaussians: u32,
        digest: Option<u64>,
        cells: Option<&CellsBytes>,
    ) {
        let role = self.gop.1.role(index - self.gop.0);
        let header = FrameHeader::new(role.frame_type, 0, Some(1), gaussians);
        let payload = write_frame(&header, digest, cells, &self.sequence).expect("a frame_header");
        let id = UnitId::of_frame(UnitType::FrameHeader, index).on_layers(0, role.temporal_layer);
        self.unit(id, &payload);
        self.frames += 1;
    }

    /// An increment; its sections are made of what `section` gives for those that its header has.
    pub(crate) fn increment(
        &mut self,
        index: u32,
        (spatial, refinement): (u8, u8),
        header: IncrementHeader,
        section: impl Fn(Section, u32) -> SectionBytes,
    ) {
        let role = self.gop.1.role(index - self.gop.0);
        let spatial =
            if role.frame_type == FrameType::Intra { spatial } else { self.sequence.spatial_layer_count - 1 };
        let header = header.with_flags();
        let present = Section::OF_INCREMENT.into_iter().filter(|&section| header.count(section) > 0);
        let sections: Vec<_> = present.map(|present| section(present, header.count(present))).collect();
        let payload = write_increment(&header, &self.sequence, &sections).expect("an increment");
        let id = UnitId::of_increment(index, refinement).on_layers(spatial, role.temporal_layer);
        self.unit(id, &payload);
    }

    pub(crate) fn finish(mut self) -> Vec<u8> {
        let end = EndOfStream { frame_count: self.frames, unit_count: self.units, index_offset: 0 };
        self.unit(UnitId::stream(UnitType::End), &end.to_bytes().expect("an end"));
        self.bytes
    }
}

/// A section in which all values of a plane are one: its blocks have no bytes but their states.
pub(crate) fn constant(
    (section, sh): (Section, ShCoding),
    count: u32,
    block_log2: u8,
    value: impl Fn(PlaneInfo) -> i32,
) -> SectionBytes {
    let layout = Layout::of_section(section, DC_RANK, sh);
    let model = |plane: &PlaneInfo| {
        let axes = axes(*plane, &[-2, -1, 0, 1, 2, 3, 4]);
        let contexts = axes[0].contexts() * axes[1].contexts();
        let token = split(unsigned(*plane, value(*plane)), DIRECT_LOG2).token;
        PlaneModel {
            bias: 0,
            direct_log2: DIRECT_LOG2,
            axes,
            tables: vec![Frequencies::single(token)],
            table_of_context: vec![0; contexts],
        }
    };
    let models: Vec<PlaneModel> = layout.planes().iter().map(model).collect();
    // The more new Gaussians a payload has, the longer it is: blocks with many states make it so.
    let lanes_log2 = if section == Section::New { 5 } else { 0 };
    let states = STATE_LOW.to_le_bytes().repeat(1 << lanes_log2);
    let block = [&[0][..], &states].concat();
    let blocks = vec![block; count.div_ceil(1 << block_log2) as usize];
    SectionBytes { lanes_log2, model: write_models(&models, &layout.alphabets(), None), blocks }
}

/// Two of the sources that a plane may use.
fn axes(plane: PlaneInfo, thresholds: &[i32]) -> [ContextAxis; 2] {
    let mut sources = Source::ALL
        .into_iter()
        .filter(|source| *source != Source::None && is_available(plane, *source))
        .rev();
    [(); 2].map(|()| match sources.next() {
        Some(source) => ContextAxis { source, thresholds: thresholds.to_vec() },
        None => ContextAxis::NONE,
    })
}

/// The section of a frame_header in which so many cells, each next to the one before, move by a step.
pub(crate) fn cells(cell_count: u32, cell_log2: u8, block_log2: u8) -> CellsBytes {
    let layout = Layout::of_section(Section::Cells, DC_RANK, ShCoding::None);
    let size = 1_u32 << block_log2;
    let of_row = |plane: &PlaneInfo, row: u32| match (plane.attribute, row % size) {
        (Attribute::Cell, 0) => row.into(),
        (Attribute::Cell, _) => 1,
        (Attribute::Translation | Attribute::CellRotation, 0) => u64::from(zigzag(1)),
        _ => 0,
    };
    let rows = |block: u32| block * size..cell_count.min((block + 1) * size);
    let models: Vec<PlaneModel> = layout
        .planes()
        .iter()
        .map(|plane| {
            let mut counts = [0_u64; 256];
            (0..cell_count)
                .for_each(|row| counts[usize::from(split(of_row(plane, row), DIRECT_LOG2).token)] += 1);
            PlaneModel {
                bias: 0,
                direct_log2: DIRECT_LOG2,
                axes: [ContextAxis::NONE, ContextAxis::NONE],
                tables: vec![Frequencies::from_counts(&counts)],
                table_of_context: vec![0],
            }
        })
        .collect();
    let block = |block: u32| {
        let mut writer = BlockWriter::new(0);
        for (plane, model) in layout.planes().iter().zip(&models) {
            let values: Vec<u64> = rows(block).map(|row| of_row(plane, row)).collect();
            writer
                .plane(&PlaneEncoder::new(model), &[], values.into_iter())
                .expect("every token has a frequency");
        }
        writer.finish()
    };
    let blocks = (0..cell_count.div_ceil(size)).map(block).collect();
    let section =
        SectionBytes { lanes_log2: 0, model: write_models(&models, &layout.alphabets(), None), blocks };
    CellsBytes { cell_count, cell_log2, section }
}

fn unsigned(plane: PlaneInfo, value: i32) -> u64 {
    if plane.alphabet == Alphabet::Attribute { zigzag(value).into() } else { u64::from(value.unsigned_abs()) }
}

/// A section of one block in which every plane has as many tables as it may, given in full or taken over.
pub(crate) fn crowded(section: Section, count: u32, is_first: bool, mode: i32) -> SectionBytes {
    let layout = Layout::of_section(section, DC_RANK, SH);
    let table = Frequencies::from_counts(&[1; 50]);
    let model = |plane: &PlaneInfo| {
        let axes = axes(*plane, &[1, 2, 3, 4, 5, 6, 7]);
        let contexts = axes[0].contexts() * axes[1].contexts();
        let table_of_context = (0..contexts as u8).collect();
        PlaneModel {
            bias: 0,
            direct_log2: DIRECT_LOG2,
            axes,
            tables: vec![table.clone(); contexts],
            table_of_context,
        }
    };
    let models: Vec<PlaneModel> = layout.planes().iter().map(model).collect();
    let mut writer = BlockWriter::new(0);
    for (plane, model) in layout.planes().iter().zip(&models) {
        let value = if plane.attribute == Attribute::Mode { mode } else { 1 };
        let values = vec![unsigned(*plane, value); count as usize];
        writer
            .plane(&PlaneEncoder::new(model), &[], values.into_iter())
            .expect("every token has a frequency");
    }
    let previous = (!is_first).then_some(models.as_slice());
    let model = write_models(&models, &layout.alphabets(), previous);
    SectionBytes { lanes_log2: 0, model, blocks: vec![writer.finish()] }
}
