//! 8.7: the values of an increment, what is reported of them, and in which order.

use crate::crafted::expect::decode_with;
use crate::stream::cells::Cell;
use crate::stream::draw::transforms;
use crate::stream::expect::{assert_decodes, assert_refused, confined};
use crate::stream::sample::{frame, gaussian, gop, small, unit};
use crate::stream::scene::{Scene, Unit};
use splatstream_decoder::process::Options;
use splatstream_format::ErrorKind;
use splatstream_format::entropy::layout::Section;
use splatstream_format::syntax::{IncrementHeader, UnitType::Increment};

/// What is found wrong: the value of OUT_OF_RANGE tells one case from another.
#[derive(Debug, PartialEq)]
enum Found {
    Range(i64),
    Code(&'static str),
}

use Found::{Code, Range};

type Edit = fn(&mut Scene);

/// The order of 8.7, from models to digests; each entry makes one thing wrong in the last unit of [`wide`].
const LADDER: [(Found, Edit); 40] = [
    // Models and blocks of every section come before any value.
    (Code("SHORT_SECTION"), |s| _ = unit(s).models.insert(Section::Cells, Vec::new())),
    (Code("PADDING"), |s| _ = unit(s).models.insert(Section::Predictors, vec![2, 128])),
    (Code("CONSTRAINT"), |s| _ = unit(s).models.insert(Section::New, vec![255; 2])),
    (Code("SHORT_SECTION"), |s| _ = unit(s).blocks.insert(Section::Cells, vec![Vec::new()])),
    (Code("ENTROPY_FINAL_STATE"), |s| _ = unit(s).blocks.insert(Section::New, vec![vec![0; 5]])),
    // Cells, entry by entry.
    (Code("CONSTRAINT"), |s| unit(s).cells[1..].iter_mut().for_each(|cell| cell.code += 1 << 24)),
    (Range(-7), |s| unit(s).cells[2].stale = -7),
    (Range(8193), |s| unit(s).cells[3].turn[2] = 8193),
    (Code("CONSTRAINT"), |s| unit(s).cells[5].code = unit(s).cells[4].code),
    (Range(2), |s| unit(s).cells[6].stale = 2),
    // All modes, then their counts.
    (Range(-1), |s| unit(s).modes[8] = -1),
    (Range(5), |s| unit(s).modes[9] = 5),
    (Code("MISMATCH"), |s| unit(s).modes[0] = 0),
    // Moves, axis by axis.
    (Code("CONSTRAINT"), |s| unit(s).moves[1][0] = -2000),
    (Code("CONSTRAINT"), |s| unit(s).moves[0][2] = 2000),
    // Updates, plane by plane.
    (Range(40_001), |s| unit(s).updates[1].log_scale[0] = 40_001),
    (Range(-40_002), |s| unit(s).updates[0].log_scale[2] = -40_002),
    (Range(32_772), |s| unit(s).updates[2].log_scale[0] = 32_767),
    (Code("CONSTRAINT"), |s| unit(s).updates[0].log_scale[1] = -500),
    (Range(33_012), |s| unit(s).updates[1].opacity = 33_000),
    (Range(40_004), |s| unit(s).updates[2].rotation[0] = 40_004),
    (Range(8_190_976), |s| unit(s).updates[1].rotation[1] = 32_000),
    (Range(40_005), |s| unit(s).updates[0].rotation[2] = 40_005),
    (Range(8192), |s| unit(s).updates[1].dc[0] = 8192),
    (Range(-8193), |s| unit(s).updates[0].dc[2] = -8193),
    (Range(8194), |s| unit(s).updates[1].sh[0] = 8194),
    (Range(-8195), |s| unit(s).updates[0].sh[1] = -8195),
    // Predictors, entry by entry.
    (Code("UNDEFINED"), |s| unit(s).predictors[0] = 3),
    (Range(4), |s| unit(s).predictors[1] = 4),
    (Range(-3), |s| unit(s).predictors[2] = -3),
    // New Gaussians, plane by plane.
    (Code("CONSTRAINT"), |s| unit(s).new[2].delta = 1 << 30),
    (Range(-40_006), |s| unit(s).new[0].log_scale[0] = -40_006),
    (Range(40_007), |s| unit(s).new[0].log_scale[1] = 40_007),
    (Code("CONSTRAINT"), |s| unit(s).new[2].log_scale[2] = -500),
    (Range(40_008), |s| unit(s).new[1].opacity = 40_008),
    (Range(40_009), |s| unit(s).new[1].rotation[1] = 40_009),
    (Range(-8196), |s| unit(s).new[2].dc[1] = -8196),
    (Range(8197), |s| unit(s).new[1].sh[1] = 8197),
    // The homes, then the digest.
    (Code("MISMATCH"), |s| s.gops[0].frames[1].count = Some(7)),
    (Code("DIGEST"), |s| unit(s).edit = |h| h.refinement_digest ^= 1),
];

/// Ten Gaussians in one home, and a unit with several entries in every section.
fn wide() -> Scene {
    let intra = Unit { new: (1..11).map(|number| gaussian(40, number)).collect(), ..Unit::default() };
    let cell = |code| Cell { code, translation: [3, -1, 2], ..Cell::default() };
    let coloured = |number| crate::crafted::scene::Gaussian { sh: vec![1, 2], ..gaussian(30, number) };
    let unit = Unit {
        header: IncrementHeader {
            cell_log2: 2,
            predictor_block_log2: 0,
            sh_mode: 1,
            ..IncrementHeader::PLAIN
        },
        cells: (0..8).map(cell).collect(),
        modes: vec![1, 1, 2, 2, 2, 4, 0, 0, 0, 0],
        moves: vec![[1, 0, 0]; 2],
        updates: vec![coloured(1); 3],
        predictors: vec![0; 3],
        new: (1..4).map(coloured).collect(),
        ..Unit::default()
    };
    gop(&[100], vec![frame(0, vec![intra]), frame(1, vec![unit])])
}

// covers: SS-EC-008, SS-MO-001, SS-MO-002, SS-PA-002, SS-PA-003, SS-PA-005, SS-PA-006, SS-RC-001, SS-RC-002, SS-RC-003
// covers: SS-RC-004, SS-PR-002, SS-DG-005
#[test]
fn the_first_error_in_the_order_of_8_7_is_the_one_reported() {
    assert_decodes("the ladder's foot", &wide());
    for (rung, (expected, _)) in LADDER.iter().enumerate() {
        let mut scene = wide();
        // Everything from here on is wrong; what comes earlier has the last word.
        LADDER[rung..].iter().rev().for_each(|(_, edit)| edit(&mut scene));
        let bytes = scene.bytes();
        let error = decode_with(&bytes, &Options::default()).verdict().unwrap();
        let found = match error.kind {
            ErrorKind::OutOfRange { value, .. } => Range(value),
            kind => Code(kind.code()),
        };
        assert_eq!(found, *expected, "{rung}: {error}");
        let tolerant = decode_with(&bytes, &Options { tolerant: true, ..Options::default() });
        assert_eq!(
            (tolerant.verdict(), tolerant.end, tolerant.frames.len()),
            (Some(error), None, 2),
            "{rung}"
        );
    }
}

// covers: SS-PA-002, SS-PA-005, SS-MO-001, SS-MO-002
#[test]
fn modes_moves_and_cells_stay_in_their_ranges() {
    let at = (Increment, 1);
    assert_refused(
        &wide(),
        &[
            confined("below the lattice", "CONSTRAINT", at).scene(|s| unit(s).moves[0][1] = -1024),
            confined("above the lattice", "CONSTRAINT", at).scene(|s| unit(s).moves[1][1] = 1024),
            confined("far above the lattice", "CONSTRAINT", at).scene(|s| {
                unit(s).header.position_shift = 9;
                unit(s).moves = vec![[-1, 0, 0], [65_535, 0, 0]];
            }),
            confined("code of a coarse cell", "CONSTRAINT", at).scene(|s| {
                unit(s).header.cell_log2 = 10;
                unit(s).cells = (1..9).map(|code| Cell { code, ..Cell::default() }).collect();
            }),
            confined("the same cell twice", "CONSTRAINT", at).scene(|s| unit(s).cells[7].code = 6),
            confined("turn", "OUT_OF_RANGE", at).scene(|s| unit(s).cells[7].turn[0] = -8193),
            confined("translation, by a sum", "OUT_OF_RANGE", at).scene(|s| long_way(unit(s), 1)),
            confined("translation, the other way", "OUT_OF_RANGE", at).scene(|s| long_way(unit(s), -1)),
        ],
    );
    let mut scene = wide();
    long_way(unit(&mut scene), 1);
    unit(&mut scene).cells.pop();
    assert_decodes("translation of 2^20", &scene);
    // Modes of a layer of an intra frame.
    let mut layers = small();
    layers.sequence.spatial_layer_count = 2;
    layers.gops[0].frames.truncate(1);
    (layers.sequence.frame_count, layers.gops[0].header.gop_frame_count) = (1, 1);
    let upper =
        [0, 1].map(|refinement| Unit { spatial: 1, refinement, modes: vec![0; 4], ..Unit::default() });
    layers.gops[0].frames[0].units.extend(upper);
    layers.gops[0].frames[0].count = Some(8);
    let removed = confined("removal in an intra frame", "CONSTRAINT", (Increment, 2))
        .scene(|s| s.gops[0].frames[0].units[2].modes[3] = 4);
    assert_refused(&layers, &[removed]);
}

/// 17 cells whose translation grows by 2^16 less 1 and then to 2^20; an 18th goes on.
fn long_way(unit: &mut Unit, sign: i64) {
    let translation = |step: i64| [0, (step * 65_535).min((1 << 20) + (step - 17)) * sign, 0];
    let cell = |step: i64| Cell { code: step as u64, translation: translation(step), ..Cell::default() };
    unit.cells = (1..19).map(cell).collect();
}

// covers: SS-MO-001
#[test]
fn the_order_of_cells_goes_on_from_block_to_block() {
    let cells = |count: u64| (0..count).map(|code| Cell { code, ..Cell::default() }).collect::<Vec<_>>();
    let mut scene = wide();
    unit(&mut scene).cells = cells(130);
    assert_decodes("three blocks of cells", &scene);
    let case = |name, edit| confined(name, "CONSTRAINT", (Increment, 1)).scene(edit);
    assert_refused(
        &scene,
        &[
            case("first of a block as the last before", |s| unit(s).cells[64].code = 63),
            case("first of a block below the last before", |s| unit(s).cells[128].code = 5),
        ],
    );
}

// covers: SS-RC-005, SS-RC-004
#[test]
fn colours_stay_within_two_to_the_30() {
    let with_mean = |mean: i32, component: i64| {
        let mut scene = wide();
        scene.gops[0].transforms = transforms(true);
        scene.gops[0].transforms[0].mean = vec![-70, mean, 0];
        scene.gops[0].transforms[1].mean[1] = mean;
        for frame in &mut scene.gops[0].frames {
            for new in frame.units.iter_mut().flat_map(|unit| &mut unit.new) {
                (new.dc[1], new.sh) = (0, vec![0; usize::from(frame.place > 0) * 2]);
            }
        }
        unit(&mut scene).updates.iter_mut().for_each(|update| update.dc[1] = 0);
        unit(&mut scene).new[1].dc[1] = component;
        scene
    };
    for mean in [1 << 30, -(1 << 30)] {
        assert_decodes("at the edge", &with_mean(mean, 0));
        let over = with_mean(mean, i64::from(mean.signum()));
        let mut of_sh = with_mean(mean, 0);
        unit(&mut of_sh).new[0].sh[1] = i64::from(mean.signum());
        for scene in [over, of_sh] {
            let error = decode_with(&scene.bytes(), &Options::default()).verdict().unwrap();
            let ErrorKind::OutOfRange { value, .. } = error.kind else { panic!("{error}") };
            assert!(value.abs() > 1 << 30, "{error}");
        }
    }
}

// covers: SS-RC-001, SS-RC-003, SS-RC-004
#[test]
fn shifts_come_before_the_ranges() {
    let at = (Increment, 1);
    let base = {
        let mut scene = wide();
        unit(&mut scene).header.attribute_shift = [7; 5];
        scene
    };
    assert_decodes("all shifts", &base);
    assert_refused(
        &base,
        &[
            confined("log_scale", "OUT_OF_RANGE", at).scene(|s| unit(s).new[0].log_scale[0] = 256),
            confined("difference", "OUT_OF_RANGE", at).scene(|s| unit(s).updates[0].log_scale[1] = -257),
            confined("opacity", "OUT_OF_RANGE", at).scene(|s| unit(s).new[0].opacity = 256),
            // 2097088 is 64 * 32767; a step is 2^13 and more.
            confined("rotation", "OUT_OF_RANGE", at).scene(|s| unit(s).new[0].rotation[0] = 256),
            confined("dc", "OUT_OF_RANGE", at).scene(|s| unit(s).updates[2].dc[0] = 64),
            confined("sh", "OUT_OF_RANGE", at).scene(|s| unit(s).updates[2].sh[0] = -64),
            confined("entries", "OUT_OF_RANGE", at).scene(|s| vector_quantised(s, 0, 3)),
            confined("first stage", "OUT_OF_RANGE", at).scene(|s| vector_quantised(s, 3, 0)),
            confined("second stage", "OUT_OF_RANGE", at).scene(|s| vector_quantised(s, 0, 2)),
        ],
    );
}

/// SH by the codebooks 7 and 1, whose last entries reach 8191.
fn vector_quantised(scene: &mut Scene, first: i64, second: i64) {
    let unit = unit(scene);
    (unit.header.sh_mode, unit.header.vq_stage_count) = (2, 2);
    unit.header.codebook_ids = [7, 1, 255, 255];
    let wanted = [first, second];
    // 3 asks for the last entry, shifted out of its range.
    let index = if second == 3 { [0, 1] } else { wanted };
    unit.header.attribute_shift[4] = if second == 3 { 1 } else { 0 };
    for (place, gaussian) in unit.updates.iter_mut().chain(&mut unit.new).enumerate() {
        gaussian.sh = if place == 4 { index.to_vec() } else { vec![0, 0] };
    }
}
