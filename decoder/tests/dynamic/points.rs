//! 7.19 and 6.16: operating points, extraction, and the unit that lists what they cost.

use crate::crafted::expect::decode_with;
use crate::crafted::{Part, Script};
use crate::random::plans;
use crate::stream::expect::{ALL, point, points};
use crate::stream::scene::Scene;
use crate::stream::shown::belongs;
use splatstream_decoder::operating_point::{OperatingPoint, extract};
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::decode_stream_inside;
use splatstream_format::Limits;
use splatstream_format::payload::OperatingPoints;
use splatstream_format::syntax::{UnitId, UnitType};
use std::ops::ControlFlow;

/// Scenes with every list that a stream can have.
pub(crate) fn listed() -> Vec<Scene> {
    let list = |scene: Scene| Scene { points: Some(points(&scene)), ..scene };
    plans().iter().map(|plan| list(plan.scene())).collect()
}

fn extracted(bytes: &[u8], at: OperatingPoint) -> Vec<u8> {
    extract(bytes, at, &Limits::default()).unwrap()
}

/// The stream of 7.11 with "belongs" of 7.19: a script without the other units.
fn by_hand(scene: &Scene, script: &Script, at: OperatingPoint) -> Vec<u8> {
    let mut script = script.clone();
    script.parts.retain(|part| match part {
        Part::Unit(id, _) => belongs(scene, id, at),
        _ => true,
    });
    for part in &mut script.parts {
        if let Part::Unit(UnitId { unit_type: UnitType::OperatingPoints, .. }, payload) = part {
            let mut list = OperatingPoints::parse(payload, 0).unwrap();
            list.entries.retain(|entry| {
                let (s, t, r) = entry.key();
                s <= at.spatial && t <= at.temporal && r <= at.refinement
            });
            *payload = list.to_bytes().unwrap();
        }
    }
    script.bytes()
}

fn decoded_at(
    bytes: &[u8],
    operating_point: OperatingPoint,
) -> Vec<splatstream_decoder::process::DecodedFrame> {
    let decoded = decode_with(bytes, &Options { operating_point, ..Options::default() });
    assert_eq!(decoded.verdict(), None, "{operating_point}");
    decoded.frames
}

// covers: SS-OP-004, SS-OP-006, SS-OP-007, SS-OP-008, SS-OP-009
#[test]
fn extraction_gives_the_units_that_belong_and_decodes_as_the_stream_does_there() {
    for scene in listed() {
        let mut script = scene.script();
        let private = UnitId { refinement: 1, temporal_layer: 1, ..UnitId::stream(UnitType::User(130)) };
        script.parts.insert(3, Part::Unit(private, vec![1, 2, 3]));
        let bytes = script.bytes();
        let all = points(&scene);
        for &at in &all {
            let small = extracted(&bytes, at);
            assert_eq!(small, by_hand(&scene, &script, at), "{at}");
            let expected = decoded_at(&bytes, at);
            assert_eq!(decoded_at(&small, at), expected, "{at}");
            assert_eq!(decoded_at(&small, ALL), expected, "{at}, all of it");
            for &other in all.iter().filter(|other| is_below(**other, at)) {
                assert_eq!(extracted(&small, other), extracted(&bytes, other), "{at}, then {other}");
                assert_eq!(
                    extracted(&extracted(&bytes, other), at),
                    extracted(&bytes, other),
                    "{other}, then {at}"
                );
            }
        }
        assert_eq!(extracted(&bytes, ALL), bytes);
    }
}

fn is_below(lower: OperatingPoint, upper: OperatingPoint) -> bool {
    lower.spatial <= upper.spatial && lower.temporal <= upper.temporal && lower.refinement <= upper.refinement
}

// covers: SS-OP-006, SS-OP-008
#[test]
fn a_receiver_of_all_spatial_layers_holds_the_intra_frame_of_a_predicted_gop_completely() {
    let scene = plans()[2].scene();
    let bytes = scene.bytes();
    let lowest = decoded_at(&bytes, point(1, 2, 0));
    assert_eq!(lowest.iter().map(|frame| frame.refinements).collect::<Vec<_>>(), [4, 1, 1, 1, 1, 1]);
    // Below the highest spatial layer there are intra frames only, cut as op_r says.
    let base = decoded_at(&bytes, point(0, 2, 1));
    let shown: Vec<_> =
        base.iter().map(|frame| (frame.number, frame.refinements, frame.spatial_layer)).collect();
    assert_eq!(shown, [(0, 2, 0)]);
}

// covers: SS-PL-002, SS-PL-003
#[test]
fn the_list_is_checked_by_who_decodes_all_and_changes_nothing() {
    for scene in listed() {
        let with = scene.bytes();
        let without = Scene { points: None, ..scene.clone() }.bytes();
        assert_eq!(decoded_at(&with, ALL), decoded_at(&without, ALL));
        let mut script = scene.script();
        // frame_count, gaussian_count and byte_count of the last entry.
        let length = script.payload(UnitType::OperatingPoints, 0).len();
        for place in [length - 20, length - 16, length - 8] {
            let mut wrong = script.clone();
            wrong.payload(UnitType::OperatingPoints, 0)[place] ^= 1;
            let verdict = |operating_point: OperatingPoint| {
                let options = Options { operating_point, tolerant: true, ..Options::default() };
                decode_with(&wrong.bytes(), &options).verdict().map(|error| error.kind.code())
            };
            let highest = *points(&scene).last().unwrap();
            for all in [ALL, OperatingPoint::ALL, highest] {
                assert_eq!(verdict(all), Some("MISMATCH"), "{all}");
            }
            if highest.refinement > 0 && scene.gops[0].frames.len() > 1 {
                let lower = OperatingPoint { refinement: highest.refinement - 1, ..highest };
                assert_eq!(verdict(lower), None, "some units do not belong");
            }
        }
    }
}

/// Bytes of the fixed part of the list, and of an entry.
const HEAD: usize = 4;
const ENTRY: usize = 24;

type Edit = fn(&mut Vec<u8>);

// covers: SS-PL-001, SS-PL-002, SS-ER-006, SS-ER-003
#[test]
fn the_list_is_checked_in_the_order_of_9_3() {
    // Code and place from which the error stands at, from the last check to the first: all later ones are broken too.
    let ladder: [(&str, usize, Edit); 11] = [
        ("MISMATCH", HEAD + ENTRY + 16, |list| list[HEAD + ENTRY + 16] ^= 1),
        ("MISMATCH", HEAD + ENTRY + 4, |list| list[HEAD + ENTRY + 4] ^= 1),
        ("MISMATCH", HEAD + 8, |list| list[HEAD + 8] ^= 1),
        ("RESERVED_BITS", HEAD + 2 * ENTRY + 3, |list| list[HEAD + 2 * ENTRY + 3] = 1),
        ("CONSTRAINT", HEAD + ENTRY, |list| list[HEAD + ENTRY + 2] = 0),
        ("OUT_OF_RANGE", HEAD + ENTRY + 2, |list| list[HEAD + ENTRY + 2] = 10),
        ("OUT_OF_RANGE", HEAD + 1, |list| list[HEAD + 1] = 4),
        ("OUT_OF_RANGE", HEAD, |list| list[HEAD] = 4),
        ("TRAILING_BYTES", 0, |list| list.push(0)),
        ("SHORT_SECTION", 0, |list| list[1] = 1),
        ("RESERVED_BITS", 2, |list| list[3] = 1),
    ];
    let base = listed()[1].script();
    for rungs in 1..=ladder.len() {
        let mut script = base.clone();
        let list = script.payload(UnitType::OperatingPoints, 0);
        ladder[..rungs].iter().for_each(|(.., edit)| edit(list));
        let start = script.at(script.find(UnitType::OperatingPoints, 0)) + 20;
        let (code, offset, _) = ladder[rungs - 1];
        let decoded = decode_with(&script.bytes(), &Options { tolerant: true, ..Options::default() });
        let error = decoded.end.unwrap();
        assert_eq!(error.kind.code(), code, "{rungs}: {error}");
        assert!(offset == 0 || error.at == start + offset as u64, "{rungs}: {error}");
    }
    let mut script = base.clone();
    script.payload(UnitType::OperatingPoints, 0).truncate(3);
    let error = decode_with(&script.bytes(), &Options::default()).end.unwrap();
    assert_eq!(error.kind.code(), "SHORT_SECTION");
}

// covers: SS-PL-002, SS-PL-003
#[test]
fn a_list_that_is_wrong_is_no_error_to_who_has_lost_a_unit_or_started_inside() {
    let scene = &listed()[1];
    let mut script = scene.script();
    script.payload(UnitType::OperatingPoints, 0)[HEAD + 4] ^= 1;
    let tolerant = Options { tolerant: true, ..Options::default() };
    let mut lossy = script.clone();
    lossy.damage(UnitType::Increment, 1);
    let decoded = decode_with(&lossy.bytes(), &tolerant);
    assert_eq!((decoded.end, decoded.verdict().unwrap().kind.code()), (None, "CHECK_SUM"));
    let second = script.at(script.find(UnitType::GopHeader, 1));
    let inside = |bytes: &[u8]| {
        decode_stream_inside(bytes, second, &Options::default(), |_, _| ControlFlow::Continue(())).end
    };
    assert_eq!(inside(&script.bytes()), None);
    // Its form is looked at all the same.
    script.payload(UnitType::OperatingPoints, 0)[HEAD] = 4;
    assert_eq!(inside(&script.bytes()).unwrap().kind.code(), "OUT_OF_RANGE");
}

// covers: SS-PL-001, SS-PL-002
#[test]
fn a_list_may_have_no_entries_or_points_that_no_unit_reaches() {
    let scene = plans()[1].scene();
    let lists = [Vec::new(), vec![point(0, 0, 0), point(0, 3, 9), point(3, 0, 0), point(3, 3, 9)]];
    for list in lists {
        let scene = Scene { points: Some(list), ..scene.clone() };
        assert_eq!(decoded_at(&scene.bytes(), ALL).len(), 9);
    }
}
