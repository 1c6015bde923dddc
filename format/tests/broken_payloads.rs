//! Every broken rule of clauses 6.4 to 6.11 that one unit shows is refused with its class, its code, the clause
//! and the offset.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "a panic is a failed test")]

mod sample;

use sample::case::{Case, assert_refused, case, put};
use sample::{CODEBOOK, DC, END, FRAME, GOP, INCREMENT, INDEX, P_FRAME, SCENE, SEQUENCE, SH, Units, WEIGHTS};
use splatstream_format::Limits;
use splatstream_format::syntax::Profile;

fn assert_payloads_refused(cases: &[Case]) {
    assert_refused_of(Profile::Intra, &sample::units(), cases);
}

fn assert_refused_of(profile: Profile, units: &Units, cases: &[Case]) {
    assert_eq!(sample::verdict(&sample::stream_of(profile, units)), None);
    for (number, case) in cases.iter().enumerate() {
        let mut units = units.clone();
        (case.edit)(&mut units[case.unit].1);
        let at = sample::unit_at(&units, case.unit) + 20 + case.fault;
        let what = format!("case {number}, unit {}", case.unit);
        assert_refused(&what, sample::verdict(&sample::stream_of(profile, &units)), case, at);
    }
}

// covers: SS-ER-001, SS-SP-001, SS-SP-003, SS-SP-004
#[test]
fn broken_sequence_parameters_are_refused() {
    const NAN: [u8; 4] = f32::NAN.to_le_bytes();
    const INFINITE: [u8; 4] = f32::INFINITY.to_le_bytes();
    assert_payloads_refused(&[
        case(SEQUENCE, |p| p[0] = 4, "OUT_OF_RANGE", "6.4", 0),
        case(SEQUENCE, |p| p[1] = 0, "OUT_OF_RANGE", "6.4", 1),
        case(SEQUENCE, |p| p[1] = 2, "OUT_OF_RANGE", "6.4", 1),
        case(SEQUENCE, |p| p[2] = 2, "OUT_OF_RANGE", "6.4", 2),
        case(SEQUENCE, |p| p[3] = 0, "OUT_OF_RANGE", "6.4", 3),
        case(SEQUENCE, |p| p[3] = 11, "OUT_OF_RANGE", "6.4", 3),
        case(SEQUENCE, |p| p[4] = 0, "OUT_OF_RANGE", "6.4", 4),
        case(SEQUENCE, |p| p[5] = 20, "OUT_OF_RANGE", "6.4", 5),
        case(SEQUENCE, |p| p[5] = 100, "OUT_OF_RANGE", "6.4", 5),
        case(SEQUENCE, |p| p[6] = 99, "OUT_OF_RANGE", "6.4", 6),
        case(SEQUENCE, |p| p[6] = 101, "OUT_OF_RANGE", "6.4", 6),
        case(SEQUENCE, |p| p[7] = 100, "OUT_OF_RANGE", "6.4", 7),
        case(SEQUENCE, |p| p[13] = 1, "OUT_OF_RANGE", "6.4", 13),
        case(SEQUENCE, |p| p[14] = 0, "OUT_OF_RANGE", "6.4", 14),
        case(SEQUENCE, |p| p[14] = 21, "OUT_OF_RANGE", "6.4", 14),
        case(SEQUENCE, |p| p[15] = 5, "OUT_OF_RANGE", "6.4", 15),
        case(SEQUENCE, |p| p[15] = 17, "OUT_OF_RANGE", "6.4", 15),
        // whole_anchor, in profile Intra.
        case(SEQUENCE, |p| p[16] = 4, "RESERVED_BITS", "6.4", 16),
        case(SEQUENCE, |p| p[16] = 8, "RESERVED_BITS", "6.4", 16),
        case(SEQUENCE, |p| p[17] = 21, "OUT_OF_RANGE", "6.4", 17),
        case(SEQUENCE, |p| p[18] = 15, "OUT_OF_RANGE", "6.4", 18),
        // 32 segments on a side.
        case(SEQUENCE, |p| p[18] = 9, "CONSTRAINT", "6.4", 18),
        case(SEQUENCE, |p| p[19] = 8, "OUT_OF_RANGE", "6.4", 19),
        case(SEQUENCE, |p| put(p, 28, [0, 32]), "OUT_OF_RANGE", "6.4", 28),
        case(SEQUENCE, |p| put(p, 34, [0, 32]), "OUT_OF_RANGE", "6.4", 34),
        case(SEQUENCE, |p| put(p, 36, [0, 32]), "OUT_OF_RANGE", "6.4", 36),
        case(SEQUENCE, |p| put(p, 38, 65_536_i32.to_le_bytes()), "OUT_OF_RANGE", "6.4", 38),
        case(SEQUENCE, |p| put(p, 42, 32_768_i32.to_le_bytes()), "OUT_OF_RANGE", "6.4", 42),
        case(SEQUENCE, |p| put(p, 46, (-1_i32).to_le_bytes()), "OUT_OF_RANGE", "6.4", 46),
        case(SEQUENCE, |p| put(p, 54, [0; 4]), "OUT_OF_RANGE", "6.4", 54),
        case(SEQUENCE, |p| put(p, 62, NAN), "CONSTRAINT", "6.4", 62),
        case(SEQUENCE, |p| put(p, 66, INFINITE), "CONSTRAINT", "6.4", 66),
        case(SEQUENCE, |p| put(p, 70, (-1.1e12_f32).to_le_bytes()), "CONSTRAINT", "6.4", 70),
        case(SEQUENCE, |p| put(p, 74, [0; 4]), "CONSTRAINT", "6.4", 74),
        case(SEQUENCE, |p| put(p, 78, NAN), "CONSTRAINT", "6.4", 78),
        case(SEQUENCE, |p| put(p, 82, (-0.5_f32).to_le_bytes()), "CONSTRAINT", "6.4", 82),
        case(SEQUENCE, |p| put(p, 86, 1.01_f32.to_le_bytes()), "CONSTRAINT", "6.4", 86),
        case(SEQUENCE, |p| put(p, 90, INFINITE), "CONSTRAINT", "6.4", 90),
        case(SEQUENCE, |p| put(p, 94, 1.1e6_f32.to_le_bytes()), "CONSTRAINT", "6.4", 94),
        case(SEQUENCE, |p| put(p, 98, 9e-13_f32.to_le_bytes()), "CONSTRAINT", "6.4", 98),
        case(SEQUENCE, |p| put(p, 102, NAN), "CONSTRAINT", "6.4", 102),
        // The first broken element in the order of the table counts.
        case(SEQUENCE, |p| put(p, 14, [0, 0]), "OUT_OF_RANGE", "6.4", 14),
    ]);
}

// covers: SS-SP-003
#[test]
fn the_ends_of_the_ranges_are_accepted() {
    let mut units = sample::units();
    let payload = &mut units[SEQUENCE].1;
    let (smallest, largest) = (2_f32.powi(-40).to_le_bytes(), 2_f32.powi(20).to_le_bytes());
    put(payload, 62, 2_f32.powi(40).to_le_bytes());
    put(payload, 66, (-2_f32.powi(40)).to_le_bytes());
    put(payload, 70, (-0.0_f32).to_le_bytes());
    put(payload, 74, smallest);
    put(payload, 82, largest);
    put(payload, 86, 1_f32.to_le_bytes());
    assert_eq!(sample::verdict(&sample::stream(&units)), None);
}

// covers: SS-GH-002, SS-GH-003, SS-FR-001, SS-FR-004
#[test]
fn broken_gop_and_frame_headers_are_refused() {
    assert_payloads_refused(&[
        case(GOP, |p| put(p, 4, [0; 4]), "OUT_OF_RANGE", "6.5", 4),
        case(GOP, |p| p[8] = 1, "RESERVED", "6.5", 8),
        case(GOP, |p| p[9] = 1, "OUT_OF_RANGE", "6.5", 9),
        case(GOP, |p| p[11] = 1, "RESERVED_BITS", "6.5", 11),
        case(FRAME, |p| p[0] = 3, "RESERVED", "6.6", 0),
        case(FRAME, |p| p[1] = 16, "OUT_OF_RANGE", "6.6", 1),
        case(FRAME, |p| p[1] = 255, "OUT_OF_RANGE", "6.6", 1),
        case(FRAME, |p| p[2] = 16, "OUT_OF_RANGE", "6.6", 2),
        case(FRAME, |p| p[3] = 1, "MISMATCH", "6.6", 3),
        case(FRAME, |p| p[3] = 4, "RESERVED_BITS", "6.6", 3),
        case(FRAME, |p| put(p, 4, u32::MAX.to_le_bytes()), "OVER_LIMIT", "A.2", 4),
    ]);
    let mut units = sample::units();
    units[GOP].0.frame = u32::MAX;
    assert_eq!(sample::verdict(&sample::stream(&units)), None);
    put(&mut units[GOP].1, 4, 2_u32.to_le_bytes());
    let expected = case(GOP, |_| (), "OUT_OF_RANGE", "6.5", 4);
    let at = sample::unit_at(&units, GOP) + 24;
    assert_refused("last display index", sample::verdict(&sample::stream(&units)), &expected, at);
}

// covers: SS-TF-001, SS-TF-002, SS-TF-004
#[test]
fn broken_transforms_are_refused() {
    assert_payloads_refused(&[
        case(DC, |p| p[0] = 16, "OUT_OF_RANGE", "6.7", 0),
        case(DC, |p| p[1] = 2, "RESERVED", "6.7", 1),
        case(DC, |p| p[2] = 9, "MISMATCH", "6.7", 2),
        case(SH, |p| p[2] = 24, "MISMATCH", "6.7", 2),
        case(SH, |p| p[2] = 0, "MISMATCH", "6.7", 2),
        case(DC, |p| p[3] = 0, "OUT_OF_RANGE", "6.7", 3),
        case(DC, |p| p[3] = 4, "OUT_OF_RANGE", "6.7", 3),
        case(SH, |p| p[3] = 10, "OUT_OF_RANGE", "6.7", 3),
        case(DC, |p| put(p, 8, (1_i32 << 30).wrapping_add(1).to_le_bytes()), "OUT_OF_RANGE", "6.7", 8),
        case(DC, |p| put(p, 12, i32::MIN.to_le_bytes()), "OUT_OF_RANGE", "6.7", 12),
        case(DC, |p| put(p, 16, 4097_i16.to_le_bytes()), "OUT_OF_RANGE", "6.7", 16),
        case(DC, |p| put(p, 32, (-4097_i16).to_le_bytes()), "OUT_OF_RANGE", "6.7", 32),
        // Bytes left over come before values.
        case(
            DC,
            |p| {
                put(p, 16, 4097_i16.to_le_bytes());
                p.push(0);
            },
            "TRAILING_BYTES",
            "5.7",
            34,
        ),
    ]);
}

// covers: SS-IX-002; SS-IN-010 as far as one unit shows it
#[test]
fn broken_codebooks_and_indexes_are_refused() {
    assert_payloads_refused(&[
        case(CODEBOOK, |p| p[0] = 16, "OUT_OF_RANGE", "6.8", 0),
        case(CODEBOOK, |p| p[1] = 0, "OUT_OF_RANGE", "6.8", 1),
        case(CODEBOOK, |p| p[1] = 46, "OUT_OF_RANGE", "6.8", 1),
        case(CODEBOOK, |p| p[4] = 0, "OUT_OF_RANGE", "6.8", 4),
        case(CODEBOOK, |p| p[4] = 3, "OUT_OF_RANGE", "6.8", 4),
        case(INDEX, |p| p[8] = 1, "RESERVED_BITS", "6.10", 8),
        case(INDEX, |p| put(p, 0, u32::MAX.to_le_bytes()), "SHORT_SECTION", "5.10", 4),
        // A second entry that does not come after the first.
        case(INDEX, |p| double(p, |entry| entry[8] += 1), "MISMATCH", "6.10", 20),
        case(INDEX, |p| double(p, |entry| entry[0] += 1), "MISMATCH", "6.10", 28),
    ]);
}

/// An increment that changes one of 2^21 parents, with nothing after the models of its section of modes.
fn many_parents() -> Vec<u8> {
    [&[3, 0][..], &[0; 8], &[0x80, 0x80, 0x80, 1], &[1], &[0], &[0]].concat()
}

/// Adds a changed copy of the only entry to an index.
fn double(index: &mut Vec<u8>, change: fn(&mut [u8])) {
    let mut entry = index[4..].to_vec();
    change(&mut entry);
    index.extend(entry);
    index[0] = 2;
}

// covers: SS-IN-008, SS-IN-010, SS-IN-002, SS-IN-001, SS-IN-003, SS-IN-004, SS-IN-009
#[test]
fn broken_increments_are_refused() {
    // Flags, digest, new_count at 10, position_shift at 11, steps at 12, sh at 17 to 19, compensation at 20, the section at 22.
    assert_payloads_refused(&[
        case(INCREMENT, |p| p[1] |= 16, "RESERVED_BITS", "6.14", 0),
        case(INCREMENT, |p| p[1] |= 4, "RESERVED", "6.14", 0),
        case(INCREMENT, |p| p[1] |= 8, "RESERVED", "6.14", 0),
        case(INCREMENT, |p| p[1] |= 128, "RESERVED_BITS", "6.14", 0),
        case(INCREMENT, |p| p[0] |= 128, "RESERVED", "6.14", 0),
        case(INCREMENT, |p| p[10] = 0, "OUT_OF_RANGE", "6.14", 10),
        case(INCREMENT, |p| drop(p.splice(10..11, [0xE4, 0])), "NUMBER", "5.14", 10),
        case(INCREMENT, |p| drop(p.splice(10..11, [0x80, 0x80, 0x80, 0x80, 16])), "NUMBER", "5.14", 10),
        case(INCREMENT, |p| p[11] = 16, "OUT_OF_RANGE", "6.14", 11),
        case(INCREMENT, |p| p[16] = 25, "OUT_OF_RANGE", "6.14", 16),
        case(INCREMENT, |p| p[17] = 0, "OUT_OF_RANGE", "6.14", 17),
        case(INCREMENT, |p| p[17] = 3, "RESERVED", "6.14", 17),
        case(INCREMENT, |p| p[18] = 0, "OUT_OF_RANGE", "6.14", 18),
        case(INCREMENT, |p| p[18] = 5, "OUT_OF_RANGE", "6.14", 18),
        case(INCREMENT, |p| p[19] = 16, "OUT_OF_RANGE", "6.14", 19),
        case(INCREMENT, |p| p[22] = 6, "OUT_OF_RANGE", "6.15", 22),
        case(INCREMENT, |p| drop(p.splice(23..24, [0x83, 0])), "NUMBER", "5.15", 23),
        // More blocks than bytes: refused before room is made for them.
        case(INCREMENT, |p| *p = many_parents(), "SHORT_SECTION", "5.15", 17),
        // 16 new Gaussians a byte, of 39 bytes.
        case(INCREMENT, |p| drop(p.splice(10..11, [0xF1, 4])), "OVER_LIMIT", "A.2", 10),
        case(INCREMENT, |p| drop(p.splice(10..11, [0xFF, 0xFF, 0xFF, 0xFF, 15])), "OVER_LIMIT", "A.2", 10),
        // Without the flags of new Gaussians and their section: nothing is left for what follows.
        case(INCREMENT, |p| put(p, 0, [0, 0]), "TRAILING_BYTES", "5.14", 10),
    ]);
    let units = sample::units();
    let predicted = case(INCREMENT, |p| put(p, 0, [128, 0]), "CONSTRAINT", "6.14", 0);
    let moved = case(INCREMENT, |p| put(p, 0, [0, 4]), "CONSTRAINT", "6.14", 0);
    let extrapolated = case(INCREMENT, |p| put(p, 0, [0, 8]), "CONSTRAINT", "6.14", 0);
    assert_refused_of(Profile::Dynamic, &units, &[predicted, moved, extrapolated]);
}

// covers: SS-FR-007
#[test]
fn broken_cells_are_refused() {
    let cells = |edit, code, clause, fault| case(P_FRAME, edit, code, clause, fault);
    assert_refused_of(
        Profile::Dynamic,
        &sample::dynamic_units(),
        &[
            cells(|p| p[3] = 1, "TRAILING_BYTES", "5.6", 16),
            cells(|p| p.truncate(12), "SHORT_SECTION", "5.6", 8),
            cells(|p| p[16] = 0, "OUT_OF_RANGE", "6.6", 16),
            cells(|p| drop(p.splice(16..17, [0x81, 0x80, 0x40])), "OVER_LIMIT", "A.2", 16),
            cells(|p| p[17] = 17, "OUT_OF_RANGE", "6.6", 17),
            cells(|p| p[18] = 6, "OUT_OF_RANGE", "6.15", 18),
            cells(|p| p[19] = 6, "SHORT_SECTION", "5.15", 20),
            cells(|p| p[22] = 2, "SHORT_SECTION", "5.15", 23),
            cells(|p| p.push(0), "TRAILING_BYTES", "5.6", 24),
        ],
    );
}

// covers: SS-SD-002, SS-SD-003, SS-SD-004, SS-SD-005, SS-SD-006
#[test]
fn broken_scene_descriptions_are_refused() {
    // Metres at 6, background at 10, bounds at 22 and 34, the title at 46, cameras at 50.
    const NAN: [u8; 4] = f32::NAN.to_le_bytes();
    let scene = |edit, code, clause, fault| case(SCENE, edit, code, clause, fault);
    assert_payloads_refused(&[
        scene(|p| p[0] = 7, "RESERVED", "6.9", 0),
        scene(|p| p[1] = 1, "RESERVED", "6.9", 1),
        scene(|p| p[2] = 2, "RESERVED", "6.9", 2),
        scene(|p| p[3] = 1, "RESERVED", "6.9", 3),
        scene(|p| p[4] = 2, "RESERVED", "6.9", 4),
        scene(|p| p[5] |= 32, "RESERVED_BITS", "6.9", 5),
        scene(|p| put(p, 6, [0; 4]), "CONSTRAINT", "6.9", 6),
        scene(|p| put(p, 6, 1.2e12_f32.to_le_bytes()), "CONSTRAINT", "6.9", 6),
        scene(|p| put(p, 10, (-0.1_f32).to_le_bytes()), "CONSTRAINT", "6.9", 10),
        scene(|p| put(p, 22, NAN), "CONSTRAINT", "6.9", 22),
        scene(|p| put(p, 34, (-2_f32).to_le_bytes()), "CONSTRAINT", "6.9", 34),
        scene(|p| p[46] = 0, "OUT_OF_RANGE", "6.9", 46),
        scene(|p| drop(p.splice(46..47, [0x81, 8])), "OUT_OF_RANGE", "6.9", 46),
        scene(|p| p[48] = b'x', "CONSTRAINT", "6.9", 47),
        scene(|p| p[50] = 0, "OUT_OF_RANGE", "6.9", 50),
        scene(|p| p[50] = 65, "OUT_OF_RANGE", "6.9", 50),
        scene(|p| p[50] = 2, "SHORT_SECTION", "5.9", 83),
        scene(|p| put(p, 51 + 12, NAN), "CONSTRAINT", "6.9", 51 + 12),
        scene(|p| put(p, 51 + 28, [0; 4]), "CONSTRAINT", "6.9", 51 + 28),
        scene(|p| put(p, 51 + 28, 0x4049_0FDB_u32.to_le_bytes()), "CONSTRAINT", "6.9", 51 + 28),
    ]);
    let mut units = sample::units();
    put(&mut units[SCENE].1, 51 + 28, 0x4049_0FDA_u32.to_le_bytes());
    assert_eq!(sample::verdict(&sample::stream(&units)), None);
}

// covers: SS-WT-001, SS-WT-003, SS-WT-004
#[test]
fn broken_weights_are_refused() {
    let weights = |edit, code, clause, fault| case(WEIGHTS, edit, code, clause, fault);
    let length = u64::try_from(sample::dynamic_units()[WEIGHTS].1.len()).unwrap();
    assert_refused_of(
        Profile::Dynamic,
        &sample::dynamic_units(),
        &[
            weights(|p| p[0] = 2, "RESERVED", "6.17", 0),
            weights(|p| p[0] = 255, "RESERVED", "6.17", 0),
            weights(Vec::clear, "SHORT_SECTION", "5.17", 0),
            // A digest: of nothing that is registered, too short, too long.
            weights(|p| *p = vec![1; 33], "RESERVED", "6.17", 1),
            weights(|p| *p = vec![1; 32], "SHORT_SECTION", "5.17", 1),
            weights(|p| *p = vec![1], "SHORT_SECTION", "5.17", 1),
            weights(|p| p[0] = 1, "TRAILING_BYTES", "5.17", 33),
            weights(|p| p[1] = 16, "RESERVED_BITS", "6.17.1", 1),
            weights(|p| p[1] = 128, "RESERVED_BITS", "6.17.1", 1),
            weights(|p| p[2] = 2, "OUT_OF_RANGE", "6.17.1", 2),
            weights(|p| p[2] = 7, "OUT_OF_RANGE", "6.17.1", 2),
            weights(|p| p[3] = 129, "OUT_OF_RANGE", "6.17.1", 3),
            weights(|p| p[4] = 33, "OUT_OF_RANGE", "6.17.1", 4),
            weights(|p| p[5] = 5, "OUT_OF_RANGE", "6.17.1", 5),
            weights(|p| p[6] = 0, "OUT_OF_RANGE", "6.17.1", 6),
            weights(|p| p[6] = 17, "OUT_OF_RANGE", "6.17.1", 6),
            weights(|p| p[7] = 4, "OUT_OF_RANGE", "6.17.1", 7),
            weights(|p| p[8] = 17, "OUT_OF_RANGE", "6.17.1", 8),
            weights(|p| p[9] = 9, "OUT_OF_RANGE", "6.17.1", 9),
            weights(|p| p[10] = 5, "OUT_OF_RANGE", "6.17.1", 10),
            weights(|p| p[11] = 0, "OUT_OF_RANGE", "6.17.1", 11),
            weights(|p| p[18] = 16, "OUT_OF_RANGE", "6.17.1", 18),
            weights(|p| put(p, 7, [0, 0]), "OUT_OF_RANGE", "6.17.1", 8),
            // In the order of the table, and all before the parameters.
            weights(|p| put(p, 1, [255; 18]), "RESERVED_BITS", "6.17.1", 1),
            weights(|p| put(p, 3, [255; 16]), "OUT_OF_RANGE", "6.17.1", 3),
            weights(|p| put(p, 7, [0, 0, 9]), "OUT_OF_RANGE", "6.17.1", 9),
            weights(
                |p| {
                    put(p, 7, [0, 0]);
                    p.truncate(30);
                },
                "OUT_OF_RANGE",
                "6.17.1",
                8,
            ),
            weights(|p| p.truncate(18), "SHORT_SECTION", "5.17.1", 11),
            weights(|p| p.truncate(1), "SHORT_SECTION", "5.17.1", 1),
            weights(|p| p.truncate(19), "SHORT_SECTION", "5.17.1", 19),
            weights(|p| _ = p.pop(), "SHORT_SECTION", "5.17.1", 19),
            weights(|p| p.push(0), "TRAILING_BYTES", "5.17.1", length),
            // An output less: a column of the embedding, a row of the head and its bias.
            weights(|p| p[8] = 0, "TRAILING_BYTES", "5.17.1", length - 8 - 8 - 2),
        ],
    );
    let mut ends = sample::dynamic_units();
    let largest = [7, 6, 128, 32, 4, 16, 3, 16, 8, 4, 15, 15, 15, 15, 15, 15, 15, 15];
    ends[WEIGHTS].1 = [vec![0], largest.to_vec(), vec![0x80; 32_606]].concat();
    // full_attention leaves out the 64 bytes of query.
    ends[WEIGHTS].1.truncate(1 + 18 + 32_606 - 64);
    assert_eq!(sample::verdict(&sample::stream_of(Profile::Dynamic, &ends)), None);
    put(&mut ends[WEIGHTS].1, 1, [6]);
    ends[WEIGHTS].1.extend([0x7F; 64]);
    assert_eq!(sample::verdict(&sample::stream_of(Profile::Dynamic, &ends)), None);
    put(&mut ends[WEIGHTS].1, 1, [0, 3, 0, 0, 0, 1, 0, 1, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1]);
    // d is 8, f is 9: embedding, rank, query, attention, value, its bias, head and its bias.
    ends[WEIGHTS].1.truncate(1 + 18 + 72 + 16 + 8 + 64 + 64 + 16 + 8 + 2);
    assert_eq!(sample::verdict(&sample::stream_of(Profile::Dynamic, &ends)), None);
    let intra = sample::stream_of(Profile::Intra, &ends);
    assert_eq!(sample::verdict(&intra).unwrap().kind.code(), "RESERVED");
}

// covers: SS-ER-003
#[test]
fn a_payload_that_is_too_long_or_too_short_is_refused() {
    // The last element of each payload: its name is in the error, its first byte is the offset.
    let last = [
        (SEQUENCE, "5.4", 102),
        (SCENE, "5.9", 51),
        (GOP, "5.5", 10),
        (DC, "5.7", 16),
        (SH, "5.7", 40),
        (CODEBOOK, "5.8", 5),
        (FRAME, "5.6", 4),
        (INDEX, "5.10", 4),
        (END, "5.11", 8),
    ];
    for (unit, clause, fault) in last {
        let length = u64::try_from(sample::units()[unit].1.len()).unwrap();
        assert_payloads_refused(&[
            case(unit, |p| p.truncate(p.len() - 1), "SHORT_SECTION", clause, fault),
            case(unit, |p| p.push(0), "TRAILING_BYTES", clause, length),
            case(unit, Vec::clear, "SHORT_SECTION", clause, 0),
        ]);
    }
}

// covers: SS-FR-005, SS-FR-006, SS-LM-003
#[test]
fn limits_of_the_caller_are_kept() {
    let bytes = sample::stream(&sample::units());
    let refused = |limits: Limits| {
        let error = splatstream_format::inspect::inspect(&bytes, &limits, &mut |_| ()).unwrap();
        (error.class().name(), error.at)
    };
    let (all, units) = (Limits::default(), sample::units());
    let spot = |unit, offset| ("over-limit", sample::unit_at(&units, unit) + offset);
    assert_eq!(refused(Limits { max_units: 3, ..all }), spot(3, 0));
    assert_eq!(refused(Limits { max_payload: 75, ..all }), spot(SEQUENCE, 12));
    assert_eq!(refused(Limits { max_codebook_values: 3, ..all }), spot(CODEBOOK, 22));
    assert_eq!(refused(Limits { max_gaussians: 499, ..all }), spot(FRAME, 24));
    // 500 Gaussians, 30 times a second.
    assert_eq!(refused(Limits { max_gaussian_rate: 14_999, ..all }), spot(FRAME, 24));
}
