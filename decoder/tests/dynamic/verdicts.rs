//! 7.13.3, 7.20.3 and 9.3: which errors are reported where several could be, and where they stand.

use crate::crafted::expect::{Decoded, decode_with};
use crate::crafted::{Part, Script};
use crate::stream::draw::codebooks;
use crate::stream::sample::{large, small, unit};
use splatstream_decoder::process::Options;
use splatstream_format::syntax::UnitType::{Codebook, End, FrameHeader, GopHeader, Increment, Index};
use splatstream_format::syntax::{UnitId, UnitType};

fn decoded(script: &Script) -> Decoded {
    decode_with(&script.bytes(), &Options { tolerant: true, ..Options::default() })
}

/// Display index, code and place of what each frame lost.
fn losses(script: &Script) -> Vec<(u32, &'static str, u64)> {
    let decoded = decoded(script);
    assert_eq!(decoded.end, None);
    let mut lost = Vec::new();
    for frame in &decoded.frames {
        let faults = frame.lost.into_iter().chain(frame.carried_fault);
        lost.extend(faults.map(|error| (frame.number, error.kind.code(), error.at)));
    }
    lost
}

fn at(script: &Script, kind: UnitType, n: usize) -> u64 {
    script.at(script.find(kind, n))
}

// covers: SS-BS-002, SS-BS-009, SS-UH-007, SS-ER-007
#[test]
fn a_unit_of_something_else_behind_a_lost_one_is_fatal() {
    let of_something_else: [fn(&mut Script); 3] = [
        |s| s.id(Increment, 3).frame = 77,
        |s| s.id(Increment, 3).temporal_layer = 3,
        |s| s.id(Increment, 3).spatial_layer = 2,
    ];
    for change in of_something_else {
        let mut scene = small();
        let mut alone = scene.script();
        change(&mut alone);
        let end = decoded(&alone).end;
        assert!(matches!(end.unwrap().kind.code(), "MISMATCH" | "OUT_OF_RANGE"));
        // A damaged payload is not looked at, so the header says the same.
        alone.damage(Increment, 3);
        assert_eq!(decoded(&alone).verdict(), end);
        unit(&mut scene).edit = |h| h.refinement_digest ^= 1;
        let mut script = scene.script();
        change(&mut script);
        let whole = decoded(&script);
        assert_eq!((whole.verdict().unwrap().kind.code(), whole.end), ("DIGEST", end));
    }
}

// covers: SS-BS-012, SS-ER-007, SS-ER-008
#[test]
fn what_stands_behind_a_lost_unit_is_not_looked_at() {
    let mut scene = small();
    unit(&mut scene).edit = |h| h.refinement_digest ^= 1;
    let behind: [fn(&mut Script); 3] = [
        |s| s.id(Increment, 3).refinement = 9,
        |s| s.payload(Increment, 3).clear(),
        |s| s.damage(Increment, 3),
    ];
    for change in behind {
        let mut script = scene.script();
        change(&mut script);
        let lost = losses(&script);
        assert_eq!(
            lost.iter().map(|(number, code, _)| (*number, *code)).collect::<Vec<_>>(),
            [(1, "DIGEST")]
        );
        // Without the digest the unit behind is at fault.
        let mut alone = small().script();
        change(&mut alone);
        assert_ne!(decoded(&alone).verdict().map(|error| error.kind.code()), Some("DIGEST"));
        assert!(decoded(&alone).verdict().is_some());
    }
}

// covers: SS-ER-007, SS-DG-007
#[test]
fn a_wrong_carried_digest_is_reported_beside_what_was_lost_first() {
    let mut scene = small();
    unit(&mut scene).edit = |h| h.carried_digest ^= 1;
    let mut script = scene.script();
    assert_eq!(losses(&script), []);
    script.damage(Increment, 3);
    let stands = at(&script, Increment, 2) + 20;
    let lost = losses(&script);
    let codes: Vec<_> = lost.iter().map(|(number, code, _)| (*number, *code)).collect();
    assert_eq!(codes, [(1, "CHECK_SUM"), (1, "DIGEST")]);
    assert!((stands..at(&script, Increment, 3)).contains(&lost[1].2));
    // What ends the frame comes before it, at an operating point where it is the last.
    let bytes = &scene.bytes()[..at(&scene.script(), Increment, 3) as usize];
    let operating_point = crate::stream::expect::point(3, 3, 0);
    for tolerant in [true, false] {
        let cut = decode_with(bytes, &Options { operating_point, tolerant, ..Options::default() });
        assert_eq!(cut.verdict().unwrap().kind.code(), "TRUNCATED");
        assert_eq!(cut.frames.last().is_some_and(|frame| frame.carried_fault.is_some()), tolerant);
    }
}

// covers: SS-LO-005, SS-LO-003, SS-LO-004, SS-BS-006
#[test]
fn a_frozen_frame_reports_its_own_error_or_that_there_is_no_reference() {
    let mut script = large().script();
    script.damage(Increment, 3);
    let ends = |n| at(&script, FrameHeader, n);
    let damage = at(&script, Increment, 3) + 16;
    let frozen = [(1, "UNDEFINED", ends(2)), (2, "UNDEFINED", ends(3)), (4, "UNDEFINED", ends(4))];
    let last = (5, "UNDEFINED", at(&script, GopHeader, 1));
    let expected = [&[(0, "CHECK_SUM", damage)], &frozen[..], &[last]].concat();
    assert_eq!(losses(&script), expected);
    // Increments that could not be decoded are passed over, damaged or not; one of no refinement is looked at.
    let mut other = script.clone();
    other.damage(Increment, 6);
    other.payload(Increment, 9).clear();
    assert_eq!(
        losses(&other).iter().map(|lost| lost.1).collect::<Vec<_>>(),
        expected.iter().map(|lost| lost.1).collect::<Vec<_>>()
    );
    other = script.clone();
    other.id(Increment, 8).refinement = 7;
    assert_eq!(losses(&other)[1].1, "UNEXPECTED_UNIT");
    // A codebook unit ends a frame too.
    let book = Part::unit(Codebook, 0, codebooks(2)[0].1.to_bytes().unwrap());
    script.insert_before(FrameHeader, 2, book);
    assert_eq!(losses(&script)[1], (1, "UNDEFINED", at(&script, Codebook, 2)));
}

// covers: SS-BS-006, SS-LO-005
#[test]
fn a_frame_without_increments_is_reported_at_the_unit_that_ends_it() {
    // First increment, how many, and the unit that then ends the frame.
    for (first, count, number, end) in [
        (0, 6, 0, (FrameHeader, 1)),
        (6, 3, 1, (FrameHeader, 2)),
        (15, 3, 5, (GopHeader, 1)),
        (18, 6, 6, (Index, 0)),
    ] {
        let mut script = large().script();
        (0..count).for_each(|_| _ = script.remove(Increment, first));
        let lost = losses(&script)[0];
        assert_eq!(lost, (number, "CONSTRAINT", at(&script, end.0, end.1)));
    }
    // What is passed over did stand: units above the operating point, of the frame alone.
    let mut script = large().script();
    (0..3).for_each(|_| _ = script.remove(Increment, 6));
    let id = UnitId { refinement: 2, ..UnitId::of_frame(Increment, 1).on_layers(1, 2) };
    let code_at = |script: &Script, refinement| {
        let operating_point = crate::stream::expect::point(3, 3, refinement);
        let options = Options { operating_point, tolerant: true, ..Options::default() };
        decode_with(&script.bytes(), &options).frames[1].lost.unwrap().kind.code()
    };
    assert_eq!(code_at(&script, 1), "CONSTRAINT");
    script.insert_before(FrameHeader, 2, Part::Unit(id, Vec::new()));
    assert_eq!((code_at(&script, 1), code_at(&script, 9)), ("UNDEFINED", "UNEXPECTED_UNIT"));
}

// covers: SS-BS-006, SS-ER-007, SS-ER-008
#[test]
fn a_fatal_error_behind_a_frame_leaves_the_frame_and_its_error_comes_first() {
    let fatal: [fn(&mut Script); 3] = [
        |s| s.damage(FrameHeader, 2),
        |s| s.put(FrameHeader, 2, 0, [0]),
        |s| s.insert_before(FrameHeader, 2, Part::unit(UnitType::Transform, 0, Vec::new())),
    ];
    for (change, code) in fatal.into_iter().zip(["CHECK_SUM", "MISMATCH", "UNEXPECTED_UNIT"]) {
        let mut script = large().script();
        change(&mut script);
        let whole = decoded(&script);
        assert_eq!((whole.end.unwrap().kind.code(), whole.frames.len()), (code, 2));
        assert!(whole.frames.iter().all(|frame| frame.lost.is_none()));
        // A value that is wrong in frame 1 is found before, whatever comes behind the frame.
        script.damage(Increment, 8);
        let lossy = decoded(&script);
        assert_eq!(lossy.verdict().unwrap().kind.code(), "CHECK_SUM");
        assert_eq!((lossy.frames[1].refinements, lossy.end.unwrap().kind.code()), (2, code));
        let strict = decode_with(&script.bytes(), &Options::default());
        assert_eq!(strict.verdict(), lossy.verdict());
    }
}

// covers: SS-SP-005, SS-EN-001, SS-IX-001, SS-GH-001
#[test]
fn counts_of_the_stream_are_those_of_gops_and_of_frame_headers() {
    let mut scene = large();
    scene.sequence.frame_count = 6;
    let code = |script: &Script| decoded(script).verdict().map(|error| error.kind.code());
    // Frame 3 is absent: seven display indices, six frame_header units.
    assert_eq!(code(&scene.script()), Some("MISMATCH"));
    let mut script = large().script();
    let end = script.payload(End, 0).clone();
    assert_eq!(end[..4], [6, 0, 0, 0]);
    for byte in [0, 4, 8] {
        let mut script = script.clone();
        script.payload(End, 0)[byte] ^= 1;
        assert_eq!(code(&script), Some("MISMATCH"));
    }
    for place in [0, 4, 4 + 16, 4 + 24] {
        let mut script = large().script();
        script.payload(Index, 0)[place] ^= 1;
        assert_eq!(code(&script), Some("MISMATCH"));
    }
    // The second GOP begins where the first ends, whichever frames were there.
    script.id(GopHeader, 1).frame = 5;
    assert_eq!(code(&script), Some("MISMATCH"));
}
