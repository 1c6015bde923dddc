//! Every broken rule of file_header and unit_header (clauses 6.2 and 6.3) is refused with its class, its code,
//! the clause and the offset.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "a panic is a failed test")]

mod sample;

use sample::case::{Case, assert_refused, case, put};
use sample::{END, FRAME, GOP, INCREMENT, INDEX, SCENE, SEQUENCE};

/// Edits the bytes of a unit from its header on, and makes the checksum of the header fit.
fn assert_headers_refused(cases: &[Case]) {
    for (number, case) in cases.iter().enumerate() {
        let units = sample::units();
        let at = usize::try_from(sample::unit_at(&units, case.unit)).unwrap();
        let mut bytes = sample::stream(&units);
        let mut unit = bytes.split_off(at);
        (case.edit)(&mut unit);
        sample::seal_unit_header(&mut unit, 0);
        bytes.extend(unit);
        let fault = u64::try_from(at).unwrap() + case.fault;
        assert_refused(&format!("header case {number}"), sample::verdict(&bytes), case, fault);
    }
}

#[test]
fn the_sample_is_accepted() {
    assert_eq!(sample::verdict(&sample::stream(&sample::units())), None);
}

// covers: SS-FH-001, SS-FH-002, SS-FH-004, SS-FH-005, SS-FH-003
#[test]
fn a_broken_file_header_is_refused() {
    let seal = |bytes: &mut Vec<u8>| sample::seal_file_header(bytes);
    let cases: [(bool, Case); 12] = [
        (true, case(0, |b| b[0] = 0x88, "SIGNATURE", "5.2", 0)),
        // What a text-mode transfer makes of it.
        (true, case(0, |b| b.retain(|byte| *byte != 0x0D), "SIGNATURE", "5.2", 0)),
        (false, case(0, |b| b[15] ^= 1, "CHECKSUM", "5.2", 12)),
        // The checksum comes before the version.
        (false, case(0, |b| b[8] = 2, "CHECKSUM", "5.2", 12)),
        (true, case(0, |b| b[8] = 2, "RESERVED", "6.2", 8)),
        (true, case(0, |b| b[8] = 1, "RESERVED", "6.2", 8)),
        (true, case(0, |b| put(b, 8, [129, 0, 1, 9]), "RESERVED", "6.2", 8)),
        (true, case(0, |b| b[9] = 1, "RESERVED", "6.2", 9)),
        (true, case(0, |b| put(b, 10, [2, 9]), "RESERVED", "6.2", 10)),
        // Profile 1 is known, so that the level is looked at.
        (true, case(0, |b| put(b, 10, [1, 9]), "RESERVED", "6.2", 11)),
        (true, case(0, |b| b[11] = 0, "RESERVED", "6.2", 11)),
        (true, case(0, |b| b[11] = 5, "RESERVED", "6.2", 11)),
    ];
    for (sealed, case) in cases {
        let mut bytes = sample::stream(&sample::units());
        (case.edit)(&mut bytes);
        if sealed {
            seal(&mut bytes);
        }
        assert_refused("file_header", sample::verdict(&bytes), &case, case.fault);
    }
}

// covers: SS-FH-001
#[test]
fn a_short_file_of_another_format_is_not_called_truncated() {
    assert_eq!(sample::verdict(b"ply\n").unwrap().kind.code(), "SIGNATURE");
    assert_eq!(sample::verdict(&[0x89, 0x47]).unwrap().kind.code(), "TRUNCATED");
}

// covers: SS-UH-002, SS-UH-005, SS-UH-007, SS-UH-006, SS-UH-003, SS-ER-002
#[test]
fn a_broken_unit_header_is_refused() {
    assert_headers_refused(&[
        case(GOP, |b| b[0] = 0, "NUMBER", "5.3", 0),
        case(GOP, |b| b[1] = 3, "RESERVED_BITS", "6.3", 1),
        case(GOP, |b| b[1] = 128, "RESERVED_BITS", "6.3", 1),
        case(GOP, |b| b[5] = 1, "RESERVED_BITS", "6.3", 5),
        // Weights, in profile Intra.
        case(GOP, |b| b[0] = 9, "RESERVED", "6.3", 0),
        case(GOP, |b| b[0] = 12, "RESERVED", "6.3", 0),
        case(FRAME, |b| b[2] = 1, "OUT_OF_RANGE", "6.3", 2),
        case(INCREMENT, |b| b[2] = 4, "OUT_OF_RANGE", "6.3", 2),
        case(SCENE, |b| b[8] = 1, "OUT_OF_RANGE", "6.3", 8),
        case(GOP, |b| b[0] = 127, "RESERVED", "6.3", 0),
        case(GOP, |b| b[0] = 128, "RESERVED", "6.3", 0),
        case(GOP, |b| b[2] = 1, "OUT_OF_RANGE", "6.3", 2),
        case(GOP, |b| b[3] = 1, "OUT_OF_RANGE", "6.3", 3),
        case(GOP, |b| b[4] = 1, "OUT_OF_RANGE", "6.3", 4),
        case(INCREMENT, |b| b[4] = 10, "OUT_OF_RANGE", "6.3", 4),
        case(SEQUENCE, |b| b[8] = 1, "OUT_OF_RANGE", "6.3", 8),
        case(INDEX, |b| b[8] = 1, "OUT_OF_RANGE", "6.3", 8),
        case(END, |b| b[11] = 1, "OUT_OF_RANGE", "6.3", 8),
        case(GOP, |b| put(b, 12, (1_u32 << 31).to_le_bytes()), "OVER_LIMIT", "A.2", 12),
        case(GOP, |b| put(b, 12, (1_u32 << 30).to_le_bytes()), "TRUNCATED", "B.1", 20),
    ]);
}

// covers: SS-UH-001, SS-UH-009
#[test]
fn a_wrong_checksum_of_a_unit_is_found_where_it_stands() {
    let units = sample::units();
    let at = sample::unit_at(&units, FRAME);
    for (byte, fault) in [(0, 6), (6, 6), (8, 6), (16, 6), (20, 16), (27, 16)] {
        let mut bytes = sample::stream(&units);
        bytes[usize::try_from(at + byte).unwrap()] ^= 0x10;
        let expected = case(FRAME, |_| (), "CHECKSUM", "5.3", fault);
        assert_refused("checksum", sample::verdict(&bytes), &expected, at + fault);
    }
}

// covers: SS-UH-005
#[test]
fn the_critical_bit_of_a_known_unit_is_not_examined() {
    for unit in 0..=END {
        let units = sample::units();
        let mut bytes = sample::stream(&units);
        let at = usize::try_from(sample::unit_at(&units, unit)).unwrap();
        bytes[at + 1] ^= 1;
        sample::seal_unit_header(&mut bytes, at);
        assert_eq!(sample::verdict(&bytes), None, "unit {unit}");
    }
}
