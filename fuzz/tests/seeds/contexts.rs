//! A stream by hand: every source of contexts in every plane where it may stand, which an encoder of so few
//! Gaussians never chooses. Its tables have one token each, so that blocks are empty and every value is 0.

use splatstream_decoder::digest::{list_digest, lists_digest};
use splatstream_decoder::frame::QuantizedFrame;
use splatstream_format::entropy::STATE_LOW;
use splatstream_format::entropy::frequencies::Frequencies;
use splatstream_format::entropy::layout::{Layout, PlaneInfo, ShCoding, is_available};
use splatstream_format::entropy::model::{ContextAxis, PlaneModel, Source, write_models};
use splatstream_format::payload::{SectionBytes, Transform, write_increment};
use splatstream_format::syntax::{
    EndOfStream, FrameHeader, GopHeader, IncrementHeader, Profile, SequenceParameters, ShMode,
    TransformHeader, TransformKind, UnitId, UnitType,
};
use splatstream_format::unit::{write_file_header, write_unit};

/// One more than a block holds.
const GAUSSIANS: u32 = 65;
/// Components of the transforms, and so planes with their own contexts.
const RANKS: (u8, u8) = (3, 9);
/// Thresholds of a source; two sources make 16 contexts.
const THRESHOLDS: [i32; 3] = [-2, 0, 5];

pub(crate) fn stream(sequence: &SequenceParameters) -> Vec<u8> {
    let layout = Layout::new(RANKS.0, ShCoding::Coefficients { rank: RANKS.1 });
    let models: Vec<PlaneModel> =
        (0..).zip(layout.planes()).map(|(index, plane)| model(index, *plane)).collect();
    // No words, one state in its place of rest, no raw bits.
    let block = [&[0][..], &STATE_LOW.to_le_bytes()].concat();
    let section = SectionBytes {
        lanes_log2: 0,
        model: write_models(&models, &layout.alphabets(), None),
        blocks: vec![block; GAUSSIANS.div_ceil(1 << sequence.block_log2) as usize],
    };
    let frame = QuantizedFrame::zeroed(GAUSSIANS as usize, sequence.sh_dimension().into());
    let header = IncrementHeader {
        refinement_digest: lists_digest(&[list_digest(&frame, 0..GAUSSIANS as usize).unwrap()]),
        new_count: GAUSSIANS,
        sh_mode: ShMode::Coefficients.code(),
        ..IncrementHeader::PLAIN
    };
    let units = [
        (UnitId::stream(UnitType::SequenceParameters), sequence.to_bytes()),
        (UnitId::of_frame(UnitType::GopHeader, 0), GopHeader::intra(0, 1).to_bytes()),
        (UnitId::of_frame(UnitType::Transform, 0), transform(0, TransformKind::Dc, RANKS.0, sequence)),
        (UnitId::of_frame(UnitType::Transform, 0), transform(1, TransformKind::Sh, RANKS.1, sequence)),
        (UnitId::of_frame(UnitType::FrameHeader, 0), FrameHeader::intra(0, Some(1), GAUSSIANS).to_bytes()),
        (UnitId::of_increment(0, 0), write_increment(&header.with_flags(), sequence, &[section])),
    ];
    let end = EndOfStream { frame_count: 1, unit_count: units.len() as u32, index_offset: 0 };
    let mut out = write_file_header(Profile::Intra, 1).unwrap();
    for (id, payload) in units.into_iter().chain([(UnitId::stream(UnitType::End), end.to_bytes())]) {
        write_unit(&mut out, id, &payload.unwrap()).unwrap();
    }
    out
}

/// Two of the sources that a plane may use, others for each plane.
fn model(index: usize, plane: PlaneInfo) -> PlaneModel {
    let sources: Vec<Source> = Source::ALL
        .into_iter()
        .filter(|source| *source != Source::None && is_available(plane, *source))
        .collect();
    let axis = |index: usize| ContextAxis {
        source: sources[index % sources.len()],
        thresholds: THRESHOLDS.to_vec(),
    };
    let contexts = (THRESHOLDS.len() + 1) * (THRESHOLDS.len() + 1);
    PlaneModel {
        bias: 0,
        direct_log2: 4,
        axes: [axis(index), axis(index * 3 + 1)],
        tables: vec![Frequencies::single(0)],
        table_of_context: vec![0; contexts],
    }
}

fn transform(
    transform_id: u8,
    kind: TransformKind,
    rank: u8,
    sequence: &SequenceParameters,
) -> splatstream_format::Result<Vec<u8>> {
    let dimension = kind.dimension(sequence);
    let header = TransformHeader { transform_id, transform_kind: kind.code(), dimension, rank };
    let weights = usize::from(dimension) * usize::from(rank);
    Transform { header, mean: vec![0; dimension.into()], basis: vec![0; weights] }.to_bytes(sequence)
}
