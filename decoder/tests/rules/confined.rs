//! 7.1.3, 7.1.4 and 9.3: what is lost with a unit, and which error is the verdict.

use crate::crafted::expect::{
    Decoded, assert_refused, confined, decode, decode_at, decode_tolerant, fatal, planes,
};
use crate::crafted::scene::Scene;
use crate::crafted::{Part, Script, UNIT_HEADER, sample, seal_header};
use splatstream_format::Class;
use splatstream_format::syntax::UnitType::{Codebook, End, FrameHeader, GopHeader, Refinement, Transform};
use splatstream_format::syntax::{UnitId, UnitType};

/// Checks that a frame is that of the sample at a number of refinements.
fn assert_shown(name: &str, scene: &Scene, decoded: &Decoded, refinements: [u8; 3]) {
    let expected: Vec<(u32, u8)> = (0..).zip(refinements).collect();
    assert_eq!(decoded.shown(), expected, "{name}");
    for (frame, count) in decoded.frames.iter().zip(refinements) {
        let (gop, place) = (frame.number as usize / 2, frame.number as usize % 2);
        match usize::from(count).checked_sub(1) {
            None => assert!(frame.planes.is_empty(), "{name}: a lost frame has no Gaussians"),
            Some(r) => assert_eq!(planes(&frame.planes), scene.planes(gop, place, r), "{name}"),
        }
    }
}

/// What is done to the sample, refinements of the three frames shown, code and the refinement unit at fault.
type Loss = (&'static str, fn(&mut Script), [u8; 3], &'static str, usize);

// covers: SS-BS-004, SS-BS-005, SS-ER-007, SS-ER-008
#[test]
fn a_frame_is_shown_at_the_refinement_before_the_one_that_is_damaged_missing_or_wrong() {
    let scene = sample::scene();
    let losses: [Loss; 10] = [
        ("payload of r0", |s| s.damage(Refinement, 0), [0, 3, 3], "CHECK_SUM", 0),
        ("payload of r1", |s| s.damage(Refinement, 4), [3, 1, 3], "CHECK_SUM", 4),
        ("payload of the last", |s| s.damage(Refinement, 8), [3, 3, 2], "CHECK_SUM", 8),
        ("r1 missing", |s| drop(s.remove(Refinement, 1)), [1, 3, 3], "UNEXPECTED_UNIT", 1),
        ("r0 missing", |s| drop(s.remove(Refinement, 3)), [3, 0, 3], "UNEXPECTED_UNIT", 3),
        ("r0 twice", |s| s.insert_before(Refinement, 0, s.parts[8].clone()), [1, 3, 3], "UNEXPECTED_UNIT", 1),
        ("r1 and r2 exchanged", |s| s.parts.swap(9, 10), [1, 3, 3], "UNEXPECTED_UNIT", 1),
        (
            "a refinement too many",
            |s| {
                let payload = s.payload(Refinement, 2).clone();
                s.insert_before(FrameHeader, 1, Part::Unit(UnitId::of_refinement(0, 3), payload));
            },
            [3, 3, 3],
            "UNEXPECTED_UNIT",
            3,
        ),
        ("wrong digest", |s| s.payload(Refinement, 7)[3] ^= 1, [3, 3, 1], "DIGEST", 7),
        (
            "a block cut",
            |s| {
                s.payload(Refinement, 1).pop();
            },
            [1, 3, 3],
            "SHORT_SECTION",
            1,
        ),
    ];
    for (name, edit, shown, code, unit) in losses {
        let mut script = scene.script();
        edit(&mut script);
        let bytes = script.bytes();
        let decoded = decode_tolerant(&bytes);
        assert_eq!(decoded.end, None, "{name}: decoding goes on to the end");
        assert_shown(name, &scene, &decoded, shown);
        let lost: Vec<_> = decoded.frames.iter().filter_map(|frame| frame.lost).collect();
        let part = script.find(Refinement, unit);
        let places = script.at(part)..=script.at(part + 1);
        assert_eq!(lost.len(), 1, "{name}: one error is reported");
        assert_eq!(lost[0].kind.code(), code, "{name}");
        assert!(places.contains(&lost[0].at), "{name}: {}", lost[0]);
        assert_eq!(decode(&bytes).verdict(), Some(lost[0]), "{name}: the verdict of a strict decoder");
    }
}

// covers: SS-BS-002, SS-BS-005, SS-ER-007
#[test]
fn units_after_a_lost_one_are_passed_over_whatever_they_hold() {
    let scene = sample::scene();
    let first_errors: [fn(&mut Script); 4] = [
        |s| s.damage(Refinement, 0),
        |s| s.payload(Refinement, 0)[14] = 3,
        |s| s.payload(Refinement, 0)[1] ^= 1,
        // Found when the blocks are decoded.
        |s| *s.payload(Refinement, 0).last_mut().unwrap() ^= 0x55,
    ];
    let later: [fn(&mut Script); 3] = [
        |s| s.damage(Refinement, 1),
        |s| s.payload(Refinement, 1).truncate(3),
        |s| s.id(Refinement, 1).refinement = 9,
    ];
    for (a, spoil) in first_errors.iter().enumerate() {
        for (b, more) in later.iter().enumerate() {
            let name = format!("first error {a}, then {b}");
            let mut script = scene.script();
            more(&mut script);
            spoil(&mut script);
            let decoded = decode_tolerant(&script.bytes());
            assert_eq!(decoded.end, None, "{name}");
            assert_shown(&name, &scene, &decoded, [0, 3, 3]);
            let part = script.find(Refinement, 0);
            let error = decoded.verdict().unwrap();
            assert!((script.at(part)..=script.at(part + 1)).contains(&error.at), "{name}: {error}");
            assert_eq!(decode(&script.bytes()).verdict(), Some(error), "{name}");
        }
        // But a unit of another frame says that a frame_header is missing.
        let mut script = scene.script();
        script.id(Refinement, 1).frame = 77;
        spoil(&mut script);
        let decoded = decode_tolerant(&script.bytes());
        assert_eq!(decoded.end.unwrap().kind.code(), "MISMATCH", "first error {a}");
        assert_eq!(decoded.shown(), [(0, 0)]);
        assert_eq!(decode(&script.bytes()).verdict(), decoded.verdict());
    }
}

// covers: SS-BS-004, SS-OP-001
#[test]
fn a_frame_may_stop_before_the_last_refinement() {
    let mut scene = sample::scene();
    scene.gops[0].frames[1].units.truncate(1);
    scene.gops[0].frames[1].count = Some(10);
    scene.gops[1].frames[0].units.truncate(2);
    scene.gops[1].frames[0].count = Some(10);
    let decoded = decode(&scene.bytes());
    assert_eq!(decoded.verdict(), None);
    assert_shown("k = 2, 0, 1", &scene, &decoded, [3, 1, 2]);
    assert_eq!(decode_at(&scene.bytes(), 1).shown(), [(0, 2), (1, 1), (2, 2)]);
}

// covers: SS-BS-006
#[test]
fn a_frame_without_refinement_units_is_lost_and_reported_where_it_ends() {
    let drop_frame = |s: &mut Script, frame: usize| {
        for _ in 0..3 {
            s.remove(Refinement, 3 * frame);
        }
    };
    let ends = [(0, FrameHeader, 1), (1, GopHeader, 1), (2, UnitType::Index, 0)];
    for (frame, kind, n) in ends {
        let scene = sample::scene();
        let mut script = scene.script();
        drop_frame(&mut script, frame);
        let decoded = decode_tolerant(&script.bytes());
        let mut shown = [3; 3];
        shown[frame] = 0;
        assert_shown("no units", &scene, &decoded, shown);
        let error = decoded.verdict().unwrap();
        let place = script.at(script.find(kind, n));
        assert_eq!((error.kind.code(), error.at, decoded.end), ("CONSTRAINT", place, None));
        assert_eq!(decode(&script.bytes()).verdict(), Some(error));
    }
    // A unit that is passed over has stood there.
    let scene = sample::scene();
    let mut script = scene.script();
    script.remove(Refinement, 0);
    let decoded = decode_at(&script.bytes(), 0);
    assert_eq!(decoded.end, None);
    assert_shown("only units above the operating point", &scene, &decoded, [0, 1, 1]);
}

// covers: SS-BS-006, SS-ER-008
#[test]
fn what_arrived_before_a_fatal_error_or_the_end_of_the_data_is_output() {
    let scene = sample::scene();
    let script = scene.script();
    let bytes = script.bytes();
    for part in 0..=script.parts.len() {
        let cut = script.at(part) as usize;
        let count = |kind| {
            let of_kind = |part: &&Part| matches!(part, Part::Unit(id, _) if id.unit_type == kind);
            script.parts[..part].iter().filter(of_kind).count() as u8
        };
        let (frames, units) = (count(FrameHeader), count(Refinement));
        let expected: Vec<(u32, u8)> =
            (0..frames).map(|frame| (frame.into(), units.saturating_sub(3 * frame).min(3))).collect();
        let name = format!("cut before unit {part}");
        let decoded = decode_tolerant(&bytes[..cut]);
        assert_eq!(decoded.shown(), expected, "{name}");
        let class = decoded.end.map(|error| error.class());
        assert_eq!(class, (part < script.parts.len()).then_some(Class::Truncated), "{name}");
        // A unit header that cannot be trusted in the same place.
        if part < script.parts.len() {
            let mut broken = bytes.clone();
            broken[cut + 6] ^= 1;
            let decoded = decode_tolerant(&broken);
            assert_eq!(decoded.shown(), expected, "{name}");
            assert_eq!(
                decoded.end.map(|error| (error.kind.code(), error.at)),
                Some(("CHECK_SUM", cut as u64 + 6))
            );
        }
    }
}

// covers: SS-ER-008, SS-ER-006
#[test]
fn damage_outside_refinements_ends_decoding() {
    let script = sample::scene().script();
    for (part, unit) in script.parts.iter().enumerate() {
        if matches!(unit, Part::Unit(id, _) if id.unit_type == Refinement) {
            continue;
        }
        let mut bytes = script.bytes();
        let at = script.at(part);
        bytes[at as usize + UNIT_HEADER] ^= 0x40;
        for decoded in [decode(&bytes), decode_tolerant(&bytes)] {
            let end = decoded.end.unwrap();
            assert_eq!((end.kind.code(), end.at), ("CHECK_SUM", at + 16), "unit {part}");
        }
    }
}

// covers: SS-ER-006, SS-ER-007, SS-UH-002
#[test]
fn the_verdict_is_the_first_error_in_the_order_of_9_3() {
    assert_refused(&[
        fatal("place before payload", "UNEXPECTED_UNIT", "7.1", (Transform, 0, 0)).script(|s| {
            let mut transform = s.remove(Transform, 0);
            if let Part::Unit(_, payload) = &mut transform {
                payload.clear();
            }
            s.insert_before(GopHeader, 0, transform);
        }),
        fatal("check sum before place", "CHECK_SUM", "5.3", (Transform, 0, 16)).script(|s| {
            s.damage(Transform, 0);
            let transform = s.remove(Transform, 0);
            s.insert_before(GopHeader, 0, transform);
        }),
        fatal("a surplus frame before the empty one", "UNEXPECTED_UNIT", "7.1", (FrameHeader, 2, 0)).script(
            |s| {
                for _ in 0..3 {
                    s.remove(Refinement, 3);
                }
                s.remove(GopHeader, 1);
                s.parts.retain(
                    |part| !matches!(part, Part::Unit(id, _) if id.frame == 2 && id.unit_type == Transform),
                );
                s.parts.retain(
                    |part| !matches!(part, Part::Unit(id, _) if id.frame == 2 && id.unit_type == Codebook),
                );
            },
        ),
        confined("an empty frame before frames left", "CONSTRAINT", "7.1", (FrameHeader, 1, 0)).script(|s| {
            for _ in 0..3 {
                s.remove(Refinement, 0);
            }
        }),
        confined(
            "the block of a unit before the header of the next frame",
            "DIGEST",
            "7.9",
            (Refinement, 2, 20),
        )
        .script(|s| {
            s.payload(Refinement, 2)[0] ^= 1;
            s.damage(Refinement, 4);
        }),
        confined("a refinement before its payload", "UNEXPECTED_UNIT", "7.1", (Refinement, 1, 0)).script(
            |s| {
                s.id(Refinement, 1).refinement = 2;
                s.payload(Refinement, 1).clear();
            },
        ),
        fatal("the frame of a refinement before its number", "MISMATCH", "6.9", (Refinement, 1, 8)).script(
            |s| {
                s.id(Refinement, 1).refinement = 2;
                s.id(Refinement, 1).frame = 1;
            },
        ),
        fatal("frame of a refinement before the check sum", "MISMATCH", "6.9", (Refinement, 1, 8)).script(
            |s| {
                s.id(Refinement, 1).frame = 1;
                s.damage(Refinement, 1);
            },
        ),
        fatal("frames left before the numbers of the end", "MISMATCH", "6.5", (End, 0, 0)).script(|s| {
            s.payload(End, 0)[0] = 99;
            s.remove(UnitType::Index, 0);
            s.payload(GopHeader, 1)[4] = 9;
        }),
    ]);
    // Two errors in different frames: the verdict is the first, and both are reported.
    let mut script = sample::scene().script();
    script.damage(Refinement, 1);
    script.payload(Refinement, 7)[0] ^= 1;
    let decoded = decode_tolerant(&script.bytes());
    let codes: Vec<_> =
        decoded.frames.iter().map(|frame| frame.lost.map(|error| error.kind.code())).collect();
    assert_eq!(codes, [Some("CHECK_SUM"), None, Some("DIGEST")]);
    // A confined error and then a fatal one.
    script.parts.pop();
    let decoded = decode_tolerant(&script.bytes());
    assert_eq!(decoded.verdict().unwrap().kind.code(), "CHECK_SUM");
    assert_eq!(decoded.end.unwrap().class(), Class::Truncated);
    assert_eq!(decode(&script.bytes()).verdict(), decoded.verdict());
}

// covers: SS-OP-001, SS-UH-002, SS-ER-007
#[test]
fn units_above_the_operating_point_are_passed_over_in_a_frame_and_nowhere_else() {
    let scene = sample::scene();
    let edits: [fn(&mut Script); 5] = [
        |s| s.damage(Refinement, 2),
        |s| s.id(Refinement, 2).frame = 9,
        |s| s.id(Refinement, 2).refinement = 9,
        |s| s.payload(Refinement, 2).clear(),
        |s| drop(s.remove(Refinement, 2)),
    ];
    for (place, edit) in edits.iter().enumerate() {
        let mut script = scene.script();
        edit(&mut script);
        let decoded = decode_at(&script.bytes(), 1);
        assert_eq!(decoded.verdict(), None, "edit {place}");
        assert_shown("at r1", &scene, &decoded, [2, 2, 2]);
    }
    // Header and length are read nevertheless.
    let script = scene.script();
    let at = script.at(script.find(Refinement, 2)) as usize;
    let mut bytes = script.bytes();
    bytes[at + 1] = 3;
    seal_header(&mut bytes[at..]);
    assert_eq!(decode_at(&bytes, 0).verdict().unwrap().kind.code(), "RESERVED_BITS");
    assert_eq!(decode_at(&script.bytes()[..at + 30], 0).verdict().unwrap().class(), Class::Truncated);
    // Before the first frame there is nothing to pass over: the check sum counts, then the place.
    for (damaged, code) in [(false, "UNEXPECTED_UNIT"), (true, "CHECK_SUM")] {
        let mut script = scene.script();
        if damaged {
            script.damage(Refinement, 2);
        }
        let unit = script.remove(Refinement, 2);
        script.insert_before(FrameHeader, 0, unit);
        assert_eq!(decode_at(&script.bytes(), 0).verdict().unwrap().kind.code(), code);
    }
}
