//! 7.1.2: which unit may stand where.

use crate::crafted::expect::{assert_refused, decode, decode_tolerant, fatal};
use crate::crafted::{Part, Script, sample};
use splatstream_format::syntax::{GopHeader, Profile, UnitId, UnitType};

const TYPES: [UnitType; 9] = [
    UnitType::SequenceParameters,
    UnitType::GopHeader,
    UnitType::Transform,
    UnitType::Codebook,
    UnitType::FrameHeader,
    UnitType::Refinement,
    UnitType::Index,
    UnitType::End,
    UnitType::User(200),
];

/// The units up to a phase, and whether each type may follow: `None`, or the code of the error.
type Phase = (&'static str, usize, u32, [Option<&'static str>; 9]);

const U: Option<&str> = Some("UNEXPECTED_UNIT");
const M: Option<&str> = Some("MISMATCH");
const OK: Option<&str> = None;

/// Rows are phases of 7.1.2, columns the types of [`TYPES`]. Units taken: of the sequence, the GOP with five tools,
/// the frame with one refinement, the index.
const PHASES: [Phase; 7] = [
    ("START", 0, 1, [OK, U, U, U, U, U, U, U, OK]),
    ("SEQUENCE", 1, 1, [OK, OK, U, U, U, U, OK, OK, OK]),
    ("GOP", 2, 1, [OK, M, OK, OK, OK, U, M, M, OK]),
    ("GOP, tools defined", 7, 1, [OK, M, OK, OK, OK, U, M, M, OK]),
    ("FRAME, frames left", 9, 2, [OK, M, U, U, OK, OK, M, M, OK]),
    ("FRAME, no frames left", 9, 1, [OK, OK, U, U, U, OK, OK, OK, OK]),
    ("INDEXED", 10, 1, [OK, U, U, U, U, U, U, OK, OK]),
];

/// The units of a stream up to a phase.
fn prefix(units: usize, frames: u32) -> Vec<Part> {
    let mut scene = sample::scene();
    scene.sequence.frame_count = 0;
    let mut parts = scene.script().parts;
    parts.truncate(9);
    if let Some(header) = parts.get_mut(1) {
        *header = Part::unit(UnitType::GopHeader, 0, GopHeader::intra(0, frames).to_bytes().unwrap());
    }
    parts.push(Part::Index);
    parts.truncate(units);
    parts
}

/// A unit that is right in all but its place.
fn next(unit_type: UnitType, before: &[Part]) -> Part {
    let mut scene = sample::scene();
    scene.sequence.frame_count = 0;
    let mut script = scene.script();
    let has = |kind: UnitType| {
        before.iter().filter(|part| matches!(part, Part::Unit(id, _) if id.unit_type == kind)).count() as u32
    };
    let gops = has(UnitType::GopHeader);
    let frames = has(UnitType::FrameHeader);
    match unit_type {
        UnitType::Index => Part::Index,
        UnitType::End => Part::End,
        UnitType::GopHeader => Part::unit(unit_type, frames, GopHeader::intra(gops, 1).to_bytes().unwrap()),
        UnitType::User(_) => Part::private(b"private"),
        UnitType::FrameHeader => {
            *script.id(unit_type, 0) = UnitId::of_frame(unit_type, frames);
            // In a GOP without tools, UNDEFINED would hide what is asked here.
            script.remove(unit_type, 0)
        }
        // Identifiers that are still free.
        UnitType::Transform | UnitType::Codebook => {
            script.payload(unit_type, 0)[0] = 9;
            script.remove(unit_type, 0)
        }
        UnitType::Refinement => script.remove(unit_type, 1),
        _ => script.remove(unit_type, 0),
    }
}

// covers: SS-BS-001, SS-BS-003, SS-UH-004
#[test]
fn a_unit_may_stand_where_the_table_of_phases_allows_it_and_nowhere_else() {
    for (phase, units, frames, allowed) in PHASES {
        for (unit_type, expected) in TYPES.into_iter().zip(allowed) {
            let name = format!("{} in phase {phase}", unit_type.name());
            let mut parts = prefix(units, frames);
            let unit = next(unit_type, &parts);
            // Without transforms a frame header is in its place and refers to nothing.
            let expected = if (phase, unit_type) == ("GOP", UnitType::FrameHeader) {
                Some("UNDEFINED")
            } else {
                expected
            };
            let place = parts.len();
            parts.push(unit);
            let script = Script { profile: Profile::Intra, level: 1, parts };
            let bytes = script.bytes();
            let error = decode(&bytes).verdict();
            let found = error.map(|error| error.kind.code());
            match expected {
                None if unit_type == UnitType::End => assert_eq!(error, None, "{name}"),
                None => {
                    assert_eq!(found, Some("TRUNCATED"), "{name}: {error:?}");
                    assert_eq!(error.unwrap().at, bytes.len() as u64, "{name}");
                }
                Some(_) => {
                    assert_eq!(found, expected, "{name}: {error:?}");
                    assert!(error.unwrap().at >= script.at(place), "{name}");
                }
            }
            assert_eq!(decode_tolerant(&bytes).verdict(), error, "{name}");
        }
    }
}

// covers: SS-EN-002, SS-BS-001
#[test]
fn nothing_stands_after_the_end_unit() {
    for unit_type in TYPES {
        let mut parts = prefix(10, 1);
        let unit = next(unit_type, &parts);
        parts.extend([Part::End, unit]);
        let script = Script { profile: Profile::Intra, level: 1, parts };
        let error = decode(&script.bytes()).verdict().unwrap();
        assert_eq!((error.kind.code(), error.at), ("TRAILING_BYTES", script.at(11)), "{unit_type:?}");
    }
}

// covers: SS-BS-002, SS-BS-003, SS-BS-004, SS-GH-001, SS-GH-003, SS-ER-005
#[test]
fn display_indices_and_counts_follow_from_the_units_before() {
    use UnitType::{Codebook, End, FrameHeader, GopHeader as Gop, Index, Refinement, Transform};
    assert_refused(&[
        fatal("frame of the first GOP", "MISMATCH", "6.5", (Gop, 0, 8)).script(|s| s.id(Gop, 0).frame = 1),
        fatal("frame of the second GOP", "MISMATCH", "6.5", (Gop, 1, 8)).script(|s| s.id(Gop, 1).frame = 3),
        fatal("gop_index", "MISMATCH", "6.5", (Gop, 0, 20)).script(|s| s.payload(Gop, 0)[0] = 1),
        fatal("second gop_index", "MISMATCH", "6.5", (Gop, 1, 20)).script(|s| s.payload(Gop, 1)[0] = 0),
        fatal("frame of a transform", "MISMATCH", "6.3", (Transform, 3, 8))
            .script(|s| s.id(Transform, 3).frame = 0),
        fatal("frame of a codebook", "MISMATCH", "6.3", (Codebook, 2, 8))
            .script(|s| s.id(Codebook, 2).frame = 3),
        fatal("frame of a frame header", "MISMATCH", "6.6", (FrameHeader, 1, 8))
            .script(|s| s.id(FrameHeader, 1).frame = 2),
        fatal("frame of a refinement", "MISMATCH", "6.9", (Refinement, 1, 8))
            .script(|s| s.id(Refinement, 1).frame = 1),
        // The place counts before the number.
        fatal("a transform in a frame", "UNEXPECTED_UNIT", "7.1", (Transform, 5, 0)).script(|s| {
            let transform = s.remove(Transform, 5);
            s.insert_before(Refinement, 8, transform);
            s.id(Transform, 5).frame = 7;
        }),
        fatal("a frame too few before a GOP", "MISMATCH", "6.5", (Gop, 1, 0))
            .script(|s| s.payload(Gop, 0)[4] = 3),
        fatal("a frame too few before the index", "MISMATCH", "6.5", (Index, 0, 0))
            .script(|s| s.payload(Gop, 1)[4] = 2),
        fatal("a frame too few before the end", "MISMATCH", "6.5", (End, 0, 0)).script(|s| {
            s.payload(Gop, 1)[4] = 2;
            s.remove(Index, 0);
        }),
        fatal("a frame too many", "UNEXPECTED_UNIT", "7.1", (FrameHeader, 1, 0))
            .script(|s| s.payload(Gop, 0)[4] = 1),
        fatal("display indices beyond 2^32", "OUT_OF_RANGE", "6.5", (Gop, 1, 24))
            .script(|s| s.put(Gop, 1, 4, u32::MAX.to_le_bytes())),
        fatal("gop_index counts before the display indices", "MISMATCH", "6.5", (Gop, 1, 20)).script(|s| {
            s.payload(Gop, 1)[0] = 0;
            s.put(Gop, 1, 4, u32::MAX.to_le_bytes());
        }),
    ]);
}

// covers: SS-BS-007, SS-BS-003
#[test]
fn a_stream_may_have_no_frame_at_all() {
    let mut scene = sample::scene();
    scene.gops.clear();
    scene.sequence.frame_count = 0;
    for index in [true, false] {
        scene.index = index;
        let decoded = decode(&scene.bytes());
        assert_eq!((decoded.frames.len(), decoded.end), (0, None));
    }
}

// covers: SS-UH-004
#[test]
fn a_private_unit_anywhere_changes_nothing_but_the_count_of_units() {
    let script = sample::scene().script();
    let whole = decode(&script.bytes());
    for place in 0..script.parts.len() {
        let mut longer = script.clone();
        longer.parts.insert(place, Part::private(&[1, 2, 3]));
        let decoded = decode(&longer.bytes());
        assert_eq!((decoded.end, decoded.frames), (None, whole.frames.clone()), "before unit {place}");
    }
}

// covers: SS-SP-004
#[test]
fn sequence_parameters_may_be_repeated_and_not_changed() {
    use UnitType::SequenceParameters as Sequence;
    let script = sample::scene().script();
    let whole = decode(&script.bytes());
    let copy = script.parts[0].clone();
    for place in 1..script.parts.len() {
        let mut longer = script.clone();
        longer.parts.insert(place, copy.clone());
        let decoded = decode(&longer.bytes());
        assert_eq!((decoded.end, decoded.frames), (None, whole.frames.clone()), "before unit {place}");
        // Another value, within its range.
        longer.put(Sequence, 1, 24, 60_u32.to_le_bytes());
        let error = decode(&longer.bytes()).verdict().unwrap();
        assert_eq!((error.kind.code(), error.clause), ("CONSTRAINT", "6.4"), "before unit {place}");
        assert_eq!(error.at, longer.at(longer.find(Sequence, 1)) + 20);
    }
    // Ranges come before relations, and the presence of the elements before both.
    let payload = |edit: fn(&mut Vec<u8>)| {
        let mut longer = script.clone();
        longer.parts.insert(3, copy.clone());
        edit(longer.payload(Sequence, 1));
        decode(&longer.bytes()).verdict().unwrap().kind.code()
    };
    assert_eq!(payload(|p| p.truncate(70)), "SHORT_SECTION");
    assert_eq!(payload(|p| p[0] = 4), "OUT_OF_RANGE");
    assert_eq!(payload(|p| p.push(0)), "TRAILING_BYTES");
}

// covers: SS-EN-001, SS-IX-001, SS-SP-005
#[test]
fn index_and_end_have_the_numbers_of_the_stream() {
    use UnitType::{End, Index};
    assert_refused(&[
        fatal("an entry too many", "MISMATCH", "6.10", (Index, 0, 20)).script(|s| {
            s.payload(Index, 0)[0] = 3;
            s.payload(Index, 0).extend([0; 16]);
        }),
        fatal("a count without entries", "MISMATCH", "6.10", (Index, 0, 20))
            .script(|s| s.payload(Index, 0)[0] = 200),
        fatal("an entry too few", "MISMATCH", "6.10", (Index, 0, 20)).script(|s| {
            s.payload(Index, 0)[0] = 1;
            s.payload(Index, 0).truncate(20);
        }),
        fatal("frame of an entry", "MISMATCH", "6.10", (Index, 0, 40))
            .script(|s| s.payload(Index, 0)[20] = 1),
        fatal("offset of an entry", "MISMATCH", "6.10", (Index, 0, 32))
            .script(|s| s.payload(Index, 0)[12] += 1),
        fatal("offset of the second entry", "MISMATCH", "6.10", (Index, 0, 48))
            .script(|s| s.payload(Index, 0)[35] = 1),
        fatal(
            "reserved_zero of any entry before the frame of the first",
            "RESERVED_BITS",
            "6.10",
            (Index, 0, 44),
        )
        .script(|s| {
            s.payload(Index, 0)[4] = 9;
            s.payload(Index, 0)[24] = 1;
        }),
        fatal("bytes left over before reserved_zero", "TRAILING_BYTES", "5.10", (Index, 0, 56)).script(|s| {
            s.payload(Index, 0)[24] = 1;
            s.payload(Index, 0).push(0);
        }),
        fatal("unit_count before the frame_count of the sequence", "MISMATCH", "6.11", (End, 0, 24))
            .scene(|s| s.sequence.frame_count = 4)
            .script(|s| s.payload(End, 0)[4] += 1),
        fatal("frame_count", "MISMATCH", "6.11", (End, 0, 20)).script(|s| s.payload(End, 0)[0] = 2),
        fatal("unit_count", "MISMATCH", "6.11", (End, 0, 24)).script(|s| s.payload(End, 0)[4] += 1),
        fatal("index_offset", "MISMATCH", "6.11", (End, 0, 28)).script(|s| s.payload(End, 0)[8] += 1),
        fatal("index_offset without an index", "MISMATCH", "6.11", (End, 0, 28))
            .scene(|s| s.index = false)
            .script(|s| s.payload(End, 0)[8] = 16),
        fatal("frame_count of the sequence", "MISMATCH", "6.4", (End, 0, 20))
            .scene(|s| s.sequence.frame_count = 4),
    ]);
    let mut scene = sample::scene();
    scene.sequence.frame_count = 0;
    assert_eq!(decode(&scene.bytes()).end, None, "a count that is not known in advance");
}

// covers: SS-IX-002
#[test]
fn the_output_does_not_depend_on_an_index() {
    let mut scene = sample::scene();
    let with = decode(&scene.bytes());
    scene.index = false;
    let without = decode(&scene.bytes());
    assert_eq!((with.end, without.end), (None, None));
    assert_eq!(with.frames, without.frames);
}
