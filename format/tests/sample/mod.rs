//! A small stream with one unit of each known type, and the means to break it.
#![allow(dead_code, reason = "every test file uses a part")]
#![allow(clippy::unwrap_used, reason = "a sample that cannot be written is a failed test")]

pub(crate) mod case;

use splatstream_format::payload::{
    CellsBytes, Codebook, Index, Layer, Network, Part, SceneDescription, SectionBytes, Transform, UpAxis,
    Weights, write_frame, write_increment,
};
use splatstream_format::syntax::{
    Camera, CodebookHeader, EndOfStream, FrameHeader, FrameType, GopHeader, IncrementHeader, IndexEntry,
    NO_CODEBOOK, NetworkHeader, Profile, SequenceParameters, TransformHeader, UnitId, UnitType,
};
use splatstream_format::unit::{write_file_header, write_unit};
use splatstream_format::{Error, Limits, inspect::inspect};

/// Bytes of file_header, and of unit_header.
pub(crate) const FILE_HEADER: usize = 16;
pub(crate) const UNIT_HEADER: usize = 20;

/// Indices of the units in [`units`].
pub(crate) const SEQUENCE: usize = 0;
pub(crate) const SCENE: usize = 1;
pub(crate) const GOP: usize = 2;
pub(crate) const DC: usize = 3;
pub(crate) const SH: usize = 4;
pub(crate) const CODEBOOK: usize = 5;
pub(crate) const FRAME: usize = 6;
pub(crate) const INCREMENT: usize = 7;
pub(crate) const INDEX: usize = 8;
pub(crate) const END: usize = 9;

/// Indices of the units in [`dynamic_units`].
pub(crate) const WEIGHTS: usize = 2;
pub(crate) const P_FRAME: usize = 3;

pub(crate) type Units = Vec<(UnitId, Vec<u8>)>;

pub(crate) fn sequence() -> SequenceParameters {
    SequenceParameters {
        sh_degree: 1,
        spatial_layer_count: 1,
        temporal_layer_count: 1,
        refinement_count: 3,
        refinement_percent: [20, 50, 100, 0, 0, 0, 0, 0, 0, 0],
        position_bits: 16,
        block_log2: 6,
        sequence_flags: SequenceParameters::flags(true, false, false),
        linear_log2: 14,
        segment_log2: 10,
        feature_shift: 2,
        size_weight: [1, 2, 3, 4, 8191],
        opacity_weight: [5, 6, 7],
        anisotropy_weight: 8,
        size_reference: -100,
        opacity_reference: 200,
        anisotropy_reference: 300,
        frame_count: 1,
        ticks_per_second: 30,
        ticks_per_frame: 1,
        position_offset: [(-1.0_f32).to_bits(), 0, 1.0_f32.to_bits()],
        position_step: 0.001_f32.to_bits(),
        log_scale_offset: (-8.0_f32).to_bits(),
        log_scale_step: 0.0625_f32.to_bits(),
        rotation_step: 0.0078125_f32.to_bits(),
        opacity_offset: 0,
        opacity_step: 0.125_f32.to_bits(),
        dc_step: 0.03125_f32.to_bits(),
        sh_step: 0.0625_f32.to_bits(),
    }
}

/// Every element of an increment of profile Intra.
pub(crate) fn increment_header() -> IncrementHeader {
    IncrementHeader {
        refinement_digest: 0x0123_4567_89AB_CDEF,
        new_count: 100,
        position_shift: 2,
        attribute_step: [1, 2, 3, 4, 24],
        sh_mode: 2,
        vq_stage_count: 1,
        codebook_ids: [7, NO_CODEBOOK, NO_CODEBOOK, NO_CODEBOOK],
        compensation_log_scale: -1,
        compensation_opacity: 1,
        ..IncrementHeader::PLAIN
    }
    .with_flags()
}

pub(crate) fn scene() -> SceneDescription {
    SceneDescription {
        up_axis: UpAxis::MinusY,
        metres_per_unit: Some(0.5),
        background: Some([0.0, 0.5, 1.0]),
        bounds: Some([[-1.0, 0.0, 0.0], [1.0, 0.0, 2.0]]),
        title: Some("Kö".into()),
        cameras: vec![Camera {
            position: [1.0, 2.0, 3.0],
            rotation: [1.0, 0.0, 0.0, 0.0],
            vertical_field_of_view: 1.0,
        }],
        ..SceneDescription::default()
    }
}

fn transform(transform_id: u8, transform_kind: u8, dimension: u8, rank: u8) -> Vec<u8> {
    let header = TransformHeader { transform_id, transform_kind, dimension, rank };
    let mean = (0..i32::from(dimension)).map(|index| index * 1000 - 1).collect();
    let basis = (0..i16::from(rank) * i16::from(dimension)).map(|index| index * 7 - 4096).collect();
    Transform { header, mean, basis }.to_bytes(&sequence()).unwrap()
}

/// The units in order; the payloads can be edited before [`stream`].
pub(crate) fn units() -> Units {
    let codebook = Codebook {
        header: CodebookHeader { codebook_id: 7, component_count: 2, entry_count_minus1: 1, value_bytes: 1 },
        entries: vec![-128, 127, 0, 5],
    };
    let section = SectionBytes {
        lanes_log2: 3,
        model: vec![10, 11, 12],
        blocks: vec![vec![1, 2, 3, 4], vec![5, 6, 7, 8, 9]],
    };
    let increment = write_increment(&increment_header(), &sequence(), &[section]).unwrap();
    let mut units = vec![
        (UnitId::stream(UnitType::SequenceParameters), sequence().to_bytes().unwrap()),
        (UnitId::stream(UnitType::SceneDescription), scene().to_bytes().unwrap()),
        (UnitId::of_frame(UnitType::GopHeader, 0), GopHeader::intra(0, 1).to_bytes().unwrap()),
        (UnitId::of_frame(UnitType::Transform, 0), transform(3, 0, 3, 3)),
        (UnitId::of_frame(UnitType::Transform, 0), transform(4, 1, 9, 2)),
        (UnitId::of_frame(UnitType::Codebook, 0), codebook.to_bytes().unwrap()),
        (UnitId::of_frame(UnitType::FrameHeader, 0), FrameHeader::intra(3, Some(4), 500).to_bytes().unwrap()),
        (UnitId::of_increment(0, 0), increment),
    ];
    let entries = vec![IndexEntry { frame: 0, reserved_zero: 0, offset: unit_at(&units, GOP) }];
    units.push((UnitId::stream(UnitType::Index), Index { entries }.to_bytes().unwrap()));
    let end = EndOfStream { frame_count: 1, unit_count: 9, index_offset: unit_at(&units, INDEX) };
    units.push((UnitId::stream(UnitType::End), end.to_bytes().unwrap()));
    units
}

/// A network that has all parts that can be there together; its parameters are different numbers.
pub(crate) fn network() -> Network {
    let header = NetworkHeader {
        network_flags: NetworkHeader::flags(false, true, true, true),
        width_log2: 3,
        feed_forward_width: 2,
        geometry_width: 1,
        fourier_count: 1,
        rank_count: 2,
        dc_count: 1,
        sh_count: 1,
        token_shift: 8,
        output_shift: 4,
        layer_shift: [1, 15, 1, 15, 1, 15, 1, 15],
    };
    let mut numbers = (0..255).cycle();
    let layers = Part::ALL.map(|part| {
        let (weights, biases) = part.lengths(&header);
        let weights = numbers.by_ref().take(weights).map(|number: i16| (number - 128) as i8).collect();
        let bias = numbers.by_ref().take(biases).map(|number| number * 128 - 16_000).collect();
        Layer { weights, bias }
    });
    Network::new(header, layers).unwrap()
}

/// The units of a stream of profile Dynamic: a network, and a P frame of which cells move.
pub(crate) fn dynamic_units() -> Units {
    let weights = Weights::Carried(Box::new(network())).to_bytes().unwrap();
    let section = SectionBytes { lanes_log2: 0, model: vec![1, 2], blocks: vec![vec![9]] };
    let cells = CellsBytes { cell_count: 5, cell_log2: 16, section };
    let header = FrameHeader::new(FrameType::Predicted, 3, None, 7);
    let frame = write_frame(&header, Some(0xFEDC), Some(&cells), &sequence()).unwrap();
    let end = EndOfStream { frame_count: 1, unit_count: 4, index_offset: 0 };
    vec![
        (UnitId::stream(UnitType::SequenceParameters), sequence().to_bytes().unwrap()),
        (UnitId::of_frame(UnitType::GopHeader, 0), GopHeader::predicted(0, 2, 0).to_bytes().unwrap()),
        (UnitId::of_frame(UnitType::Weights, 0), weights),
        (UnitId::of_frame(UnitType::FrameHeader, 1), frame),
        (UnitId::stream(UnitType::End), end.to_bytes().unwrap()),
    ]
}

/// Offset of a unit in the stream of [`stream`].
pub(crate) fn unit_at(units: &Units, index: usize) -> u64 {
    let before = units.iter().take(index).map(|(_, payload)| UNIT_HEADER + payload.len());
    u64::try_from(FILE_HEADER + before.sum::<usize>()).unwrap()
}

/// The stream of profile Intra of these units, with checksums that fit.
pub(crate) fn stream(units: &Units) -> Vec<u8> {
    stream_of(Profile::Intra, units)
}

/// The stream of a profile.
pub(crate) fn stream_of(profile: Profile, units: &Units) -> Vec<u8> {
    let mut bytes = write_file_header(profile, 2).unwrap();
    for (id, payload) in units {
        write_unit(&mut bytes, *id, payload).unwrap();
    }
    bytes
}

/// Makes the checksum of the unit header at `at` fit again.
pub(crate) fn seal_unit_header(bytes: &mut [u8], at: usize) {
    let mut crc = crc32fast::Hasher::new();
    crc.update(&bytes[at..at + 6]);
    crc.update(&bytes[at + 8..at + 20]);
    let check = crc.finalize().to_le_bytes();
    bytes[at + 6..at + 8].copy_from_slice(&check[..2]);
}

/// Makes the checksum of the file header fit again.
pub(crate) fn seal_file_header(bytes: &mut [u8]) {
    let crc = crc32fast::hash(&bytes[..12]);
    bytes[12..16].copy_from_slice(&crc.to_le_bytes());
}

/// The first error of a stream, as the inspector finds it: it reads every unit and every payload.
pub(crate) fn verdict(bytes: &[u8]) -> Option<Error> {
    inspect(bytes, &Limits::default(), &mut |_| ())
}
