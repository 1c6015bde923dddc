//! 6.2 to 6.5, annex A: what differs between the profiles, and units that belong to neither.

use crate::crafted::expect::{decode, decode_at, decode_with};
use crate::crafted::{FILE_HEADER, Part, Script, crc32, sample};
use crate::stream::expect::{ALL, points};
use crate::stream::sample::large;
use crate::stream::scene::Scene;
use splatstream_decoder::operating_point::extract;
use splatstream_decoder::process::Options;
use splatstream_format::Limits;
use splatstream_format::payload::OperatingPoints;
use splatstream_format::syntax::UnitType::{
    End, FrameHeader, GopHeader, Increment, Index, SequenceParameters,
};
use splatstream_format::syntax::{OperatingPointEntry, UnitHeader, UnitId, UnitType};

fn verdict(bytes: &[u8]) -> Option<&'static str> {
    decode(bytes).verdict().map(|error| error.kind.code())
}

/// A unit as bytes, critical or not.
fn flagged(unit_type: u8, critical: bool) -> Part {
    let mut bytes =
        vec![unit_type, critical.into(), 200, 201, 202, 0, 0, 0, 7, 7, 7, 7, 2, 0, 0, 0, 9, 9, 9, 9, 1, 2];
    crate::crafted::seal_header(&mut bytes);
    Part::Bytes(bytes)
}

// covers: SS-UH-004, SS-UH-005, SS-FH-003
#[test]
fn each_profile_skips_what_it_does_not_know_unless_it_is_critical() {
    let scripts =
        [(large().script(), vec![12, 127, 128, 255]), (sample::scene().script(), vec![9, 10, 12, 255])];
    for (script, unknown) in scripts {
        let frames = decode(&script.bytes()).frames;
        for unit_type in unknown {
            for place in [0, 1, 8, script.parts.len() - 1] {
                let with = |critical| {
                    let mut script = script.clone();
                    script.parts.insert(place, flagged(unit_type, critical));
                    script.bytes()
                };
                let skipped = decode(&with(false));
                assert_eq!((skipped.verdict(), &skipped.frames), (None, &frames), "{unit_type} {place}");
                assert_eq!(verdict(&with(true)), Some("RESERVED"), "{unit_type} {place}");
            }
        }
    }
    let mut bytes = large().bytes();
    bytes[10] = 2;
    let crc = crc32(&bytes[..12]);
    bytes[12..FILE_HEADER].copy_from_slice(&crc.to_le_bytes());
    assert_eq!(verdict(&bytes), Some("RESERVED"));
}

// covers: SS-GH-002, SS-GH-006, SS-FR-001, SS-UH-006
#[test]
fn profile_0_has_one_layer_of_each_kind_and_intra_frames() {
    let cases: [(UnitType, usize, u8, &str); 6] = [
        (SequenceParameters, 1, 2, "OUT_OF_RANGE"),
        (SequenceParameters, 2, 2, "OUT_OF_RANGE"),
        (GopHeader, 8, 1, "RESERVED"),
        (GopHeader, 9, 1, "RESERVED_BITS"),
        (FrameHeader, 0, 1, "RESERVED"),
        (FrameHeader, 0, 2, "RESERVED"),
    ];
    for (unit_type, place, value, code) in cases {
        let mut script = sample::scene().script();
        script.put(unit_type, 0, place, [value]);
        assert_eq!(verdict(&script.bytes()), Some(code), "{unit_type:?} {place}");
    }
    for (spatial, temporal) in [(0, 1), (1, 0)] {
        let mut script = sample::scene().script();
        *script.id(FrameHeader, 0) = UnitId::of_frame(FrameHeader, 0).on_layers(spatial, temporal);
        assert_eq!(verdict(&script.bytes()), Some("OUT_OF_RANGE"));
    }
    for (place, value) in [(1, 5), (2, 5), (1, 0), (2, 0)] {
        let mut script = large().script();
        script.put(SequenceParameters, 0, place, [value]);
        assert_eq!(verdict(&script.bytes()), Some("OUT_OF_RANGE"), "{place} {value}");
    }
}

/// The list of the sample of profile 0: three frames of 2, 5 and 10 Gaussians.
fn listed() -> Script {
    let mut script = sample::scene().script();
    let cost = |refinement: u8| {
        let parts = script.parts.iter().map(|part| match part {
            Part::Unit(id, payload) if id.unit_type != SequenceParameters && id.refinement <= refinement => {
                UnitHeader::SIZE + payload.len()
            }
            _ => 0,
        });
        parts.sum::<usize>() as u64
    };
    let entry = |(refinement, gaussians): (u8, u64)| OperatingPointEntry {
        spatial_layer: 0,
        temporal_layer: 0,
        refinement,
        reserved_zero: 0,
        frame_count: 3,
        gaussian_count: 3 * gaussians,
        byte_count: cost(refinement),
    };
    let list = OperatingPoints { entries: [(0, 2), (1, 5), (2, 10)].map(entry).to_vec() };
    let part = Part::unit(UnitType::OperatingPoints, 0, list.to_bytes().unwrap());
    script.insert_before(Index, 0, part);
    script
}

// covers: SS-PL-002, SS-PL-003, SS-OP-004
#[test]
fn a_stream_of_profile_0_may_have_a_list_too() {
    let script = listed();
    let bytes = script.bytes();
    let whole = decode(&bytes);
    assert_eq!((whole.verdict(), whole.frames), (None, decode(&sample::scene().bytes()).frames));
    for place in [4 + 4, 4 + 8, 4 + 16, 4 + 24 + 8] {
        let mut wrong = script.clone();
        wrong.payload(UnitType::OperatingPoints, 0)[place] ^= 1;
        assert_eq!(verdict(&wrong.bytes()), Some("MISMATCH"), "{place}");
        // Who passes units over does not know.
        assert_eq!(decode_at(&wrong.bytes(), 1).verdict(), None);
        assert!(decode_at(&wrong.bytes(), 2).verdict().is_some());
    }
    let point = crate::crafted::expect::point(1);
    let small = extract(&bytes, point, &Limits::default()).unwrap();
    assert_eq!(decode(&small).verdict(), None);
    assert_eq!(decode(&small).frames, decode_at(&bytes, 1).frames);
}

// covers: SS-SP-004, SS-BS-001
#[test]
fn sequence_parameters_that_come_again_do_not_end_a_frame() {
    let script = large().script();
    let frames = decode(&script.bytes()).frames;
    for (kind, n) in [(Increment, 1), (Increment, 8), (GopHeader, 1), (End, 0)] {
        let mut script = script.clone();
        let again = script.parts[0].clone();
        script.insert_before(kind, n, again);
        let decoded = decode(&script.bytes());
        assert_eq!((decoded.verdict(), &decoded.frames), (None, &frames), "{kind:?}");
        script.put(SequenceParameters, 1, 22, [9]);
        assert_eq!(verdict(&script.bytes()), Some("CONSTRAINT"), "{kind:?}");
    }
}

// covers: SS-LM-001, SS-LM-002, SS-PL-002
#[test]
fn a_list_with_every_operating_point_of_the_widest_sequence_is_checked() {
    let scene = large();
    let all: Vec<_> = points(&Scene {
        sequence: splatstream_format::syntax::SequenceParameters {
            spatial_layer_count: 4,
            temporal_layer_count: 4,
            refinement_count: 10,
            ..scene.sequence
        },
        ..scene.clone()
    });
    assert_eq!(all.len(), 160);
    let scene = Scene { points: Some(all), ..scene };
    for operating_point in [ALL, Options::default().operating_point] {
        let options = Options { operating_point, ..Options::default() };
        assert_eq!(decode_with(&scene.bytes(), &options).verdict(), None);
    }
}
