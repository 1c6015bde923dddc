//! 6.14 and 6.15: counts, ranges and sections of an increment, and the order in which they are checked.

use crate::crafted::Script;
use crate::crafted::expect::decode_with;
use crate::stream::expect::{assert_refused, confined};
use crate::stream::sample::{large, small, unit};
use crate::stream::scene::{Scene, Unit};
use splatstream_decoder::process::Options;
use splatstream_format::Limits;
use splatstream_format::syntax::IncrementHeader;
use splatstream_format::syntax::UnitType::{FrameHeader, Increment};

/// Bytes of the fixed part.
const FIXED: usize = 59;

type Edit = fn(&mut IncrementHeader);

/// Element, code and change, in the order in which 9.3 has them checked; in a unit with four parents of a frame of
/// level 2 with 11 Gaussians, refinement 1.
const LADDER: [(&str, &str, Edit); 25] = [
    ("position_shift", "OUT_OF_RANGE", |h| h.position_shift = 10),
    ("attribute_shift", "OUT_OF_RANGE", |h| h.attribute_shift[0] = 8),
    ("cell_log2", "OUT_OF_RANGE", |h| h.cell_log2 = 11),
    ("predictor_block_log2", "OUT_OF_RANGE", |h| h.predictor_block_log2 = 17),
    ("predictor_block_log2", "OUT_OF_RANGE", |h| h.predictor_block_log2 = 254),
    ("neighbour_count", "OUT_OF_RANGE", |h| h.neighbour_count = 0),
    ("neighbour_count", "OUT_OF_RANGE", |h| h.neighbour_count = 17),
    ("sh_mode", "RESERVED", |h| h.sh_mode = 3),
    ("vq_stage_count", "OUT_OF_RANGE", |h| (h.sh_mode, h.vq_stage_count) = (2, 5)),
    ("vq_stage_count", "OUT_OF_RANGE", |h| (h.sh_mode, h.vq_stage_count) = (2, 0)),
    ("vq_stage_count", "OUT_OF_RANGE", |h| (h.sh_mode, h.vq_stage_count) = (1, 1)),
    ("codebook_ids", "OUT_OF_RANGE", |h| (h.vq_stage_count, h.codebook_ids) = (1, [16, 255, 255, 255])),
    ("parent_count", "OVER_LIMIT", |h| h.parent_count = (1 << 20) + 1),
    ("cell_count", "OVER_LIMIT", |h| h.cell_count = (1 << 20) + 1),
    ("new_count", "OVER_LIMIT", |h| h.new_count = (1 << 20) + 1),
    ("parent_count", "MISMATCH", |h| h.parent_count = 3),
    ("cell_count", "MISMATCH", |h| h.cell_count = 1 << 20),
    ("move_count", "MISMATCH", |h| h.move_count = 5),
    ("update_count", "MISMATCH", |h| h.update_count = 5),
    ("remove_count", "MISMATCH", |h| h.remove_count = 5),
    ("new_count", "MISMATCH", |h| h.new_count = 12),
    ("codebook_ids", "UNDEFINED", |h| h.codebook_ids = [5, 255, 255, 255]),
    ("codebook_ids", "CONSTRAINT", |h| h.codebook_ids = [6, 255, 255, 255]),
    ("codebook_ids", "MISMATCH", |h| h.codebook_ids = [4, 255, 255, 255]),
    ("", "", |h| (h.sh_mode, h.vq_stage_count) = (2, 1)),
];

/// The small scene with a codebook 6 of temporal layer 1 and a codebook 4 of three components.
fn base() -> Scene {
    let mut scene = small();
    scene.sequence.temporal_layer_count = 2;
    let book = |id| crate::crafted::scene::codebook(id, 3, 1, vec![0; 3]);
    scene.gops[0].frames[0].codebooks.extend([(1, book(6)), (0, book(4))]);
    scene
}

// covers: SS-IN-001, SS-IN-002, SS-IN-003, SS-IN-004, SS-IN-005, SS-IN-006, SS-ER-006
#[test]
fn the_first_wrong_element_in_the_order_of_9_3_is_the_one_reported() {
    let script = base().script();
    let at = script.find(Increment, 3);
    let (start, end) = (script.at(at) + 20, script.at(at + 1));
    let parsed = &script.bytes()[start as usize..end as usize];
    let (header, rest) = IncrementHeader::parse(parsed, 0, &base().sequence).unwrap();
    assert_eq!(header.parent_count, 4);
    for (rung, (element, code, _)) in LADDER.iter().enumerate().take(24) {
        // Everything from here on is wrong; what comes earlier has the last word on an element.
        let mut wrong = header;
        LADDER[rung..].iter().rev().for_each(|(.., edit)| edit(&mut wrong));
        let mut script = script.clone();
        *script.payload(Increment, 3) = [crate::stream::scene::header_bytes(&wrong), rest.to_vec()].concat();
        let error = decode_with(&script.bytes(), &Options::default()).verdict().unwrap();
        assert_eq!(error.kind.code(), *code, "{rung}: {error}");
        let expected = start + IncrementHeader::TABLE.offset(element) as u64;
        assert!((expected..expected + 5).contains(&error.at), "{rung}: {error}");
        let tolerant = decode_with(&script.bytes(), &Options { tolerant: true, ..Options::default() });
        assert_eq!((tolerant.end, tolerant.frames.len()), (None, 2), "{rung}");
    }
}

// covers: SS-IN-005, SS-LM-001
#[test]
fn counts_stay_within_the_level_and_within_what_the_decoder_was_told() {
    for (level, most) in [(1, 1_u32 << 18), (2, 1 << 20), (3, 1 << 22), (4, 1 << 24)] {
        for (place, limited) in [(16, true), (36, true), (24, false)] {
            let mut script = Script { level, ..small().script() };
            script.put(Increment, 3, place, (most + 1).to_le_bytes());
            let limits = Limits { max_gaussians: u32::MAX, ..Limits::default() };
            let options = Options { limits, ..Options::default() };
            let code = |script: &Script, options: &Options| {
                decode_with(&script.bytes(), options).verdict().unwrap().kind.code()
            };
            assert_eq!(
                code(&script, &options),
                if limited { "OVER_LIMIT" } else { "MISMATCH" },
                "{level} {place}"
            );
            script.put(Increment, 3, place, most.to_le_bytes());
            assert_eq!(code(&script, &options), "MISMATCH", "{level} {place}");
        }
    }
    let limits = |limits| Options { limits, ..Options::default() };
    let verdict =
        |options: &Options| decode_with(&small().bytes(), options).verdict().map(|it| it.kind.code());
    assert_eq!(verdict(&limits(Limits { max_cells: 2, ..Limits::default() })), None);
    assert_eq!(verdict(&limits(Limits { max_cells: 1, ..Limits::default() })), Some("OVER_LIMIT"));
}

// covers: SS-IN-002, SS-IN-006, SS-PA-003, SS-PA-006, SS-IN-008, SS-DG-005
#[test]
fn counts_and_digests_are_those_of_the_values() {
    assert_refused(
        &small(),
        &[
            confined("no sh transform", "OUT_OF_RANGE", (Increment, 2))
                .scene(|s| (s.gops[0].frames[1].sh_transform, unit(s).header.sh_mode) = (255, 1)),
            confined("cells in an intra frame", "MISMATCH", (Increment, 0))
                .scene(|s| s.gops[0].frames[0].units[0].edit = |h| h.cell_count = 1),
            confined("a move less", "MISMATCH", (Increment, 2)).scene(|s| unit(s).modes[0] = 0),
            confined("a move more", "MISMATCH", (Increment, 2)).scene(|s| unit(s).modes[1] = 3),
            confined("an update less", "MISMATCH", (Increment, 2)).scene(|s| unit(s).modes[1] = 0),
            confined("an update more", "MISMATCH", (Increment, 2)).scene(|s| unit(s).modes[0] = 3),
            confined("a removal less", "MISMATCH", (Increment, 2))
                .scene(|s| unit(s).edit = |h| h.remove_count = 0),
            confined("a removal more", "MISMATCH", (Increment, 2))
                .scene(|s| unit(s).edit = |h| h.remove_count = 2),
            confined("larger than the frame", "MISMATCH", (Increment, 2))
                .scene(|s| s.gops[0].frames[1].count = Some(5)),
            confined("smaller than the frame", "MISMATCH", (Increment, 3))
                .scene(|s| s.gops[0].frames[1].count = Some(11)),
            confined("home of an intra frame", "MISMATCH", (Increment, 0))
                .scene(|s| s.gops[0].frames[0].count = Some(10)),
            confined("digest", "DIGEST", (Increment, 1))
                .scene(|s| s.gops[0].frames[0].units[1].edit = |h| h.refinement_digest ^= 1),
            confined("digest of a predicted frame", "DIGEST", (Increment, 2))
                .scene(|s| unit(s).edit = |h| h.refinement_digest ^= 1 << 63),
            confined("carried digest of an intra frame", "DIGEST", (Increment, 1))
                .scene(|s| s.gops[0].frames[0].units[1].edit = |h| h.carried_digest ^= 1),
            confined("carried digest", "DIGEST", (Increment, 3))
                .scene(|s| s.gops[0].frames[1].units[1].edit = |h| h.carried_digest ^= 1),
        ],
    );
}

// covers: SS-DG-006, SS-DG-007
#[test]
fn the_carried_digest_is_compared_where_the_frame_is_shown_and_nowhere_else() {
    let mut scene = small();
    let mut after = scene.gops[0].frames[1].clone();
    (after.place, after.units) = (2, vec![Unit { modes: vec![0; 6], ..Unit::default() }]);
    scene.gops[0].frames.push(after);
    (scene.gops[0].header.gop_frame_count, scene.sequence.frame_count) = (3, 3);
    unit(&mut scene).edit = |h| h.carried_digest ^= 1;
    let bytes = scene.bytes();
    let verdict = |refinement, subset| {
        let operating_point = crate::stream::expect::point(3, 3, refinement);
        let options = Options { operating_point, subset, tolerant: true, ..Options::default() };
        let decoded = decode_with(&bytes, &options);
        let shown: Vec<_> = decoded.frames.iter().map(|frame| frame.refinements).collect();
        (decoded.verdict().map(|error| error.kind.code()), shown)
    };
    assert_eq!(verdict(9, false), (None, vec![2, 2, 1]));
    // The frame is output as it is, and others refer to it.
    assert_eq!(verdict(0, false), (Some("DIGEST"), vec![2, 1, 1]));
    assert_eq!(verdict(0, true), (None, vec![2, 1, 1]));
}

// covers: SS-IN-007, SS-SE-001, SS-ER-003, SS-PM-008
#[test]
fn a_payload_has_the_sections_of_its_counts_and_nothing_more() {
    let at = (Increment, 2);
    assert_refused(
        &small(),
        &[
            confined("no payload", "SHORT_SECTION", at).script(|s| s.payload(Increment, 2).clear()),
            confined("cut header", "SHORT_SECTION", at)
                .script(|s| s.payload(Increment, 2).truncate(FIXED - 1)),
            confined("no lanes_log2", "SHORT_SECTION", at)
                .script(|s| s.payload(Increment, 2).truncate(FIXED)),
            confined("lanes_log2", "OUT_OF_RANGE", at).script(|s| s.put(Increment, 2, FIXED, [6])),
            confined("no model_length", "SHORT_SECTION", at)
                .script(|s| s.payload(Increment, 2).truncate(FIXED + 1)),
            confined("long model_length", "SHORT_SECTION", at)
                .script(|s| s.put(Increment, 2, FIXED + 1, [0xFF, 0x7F])),
            confined("model_length", "NUMBER", at).script(|s| s.put(Increment, 2, FIXED + 1, [0x80, 0])),
            // Three blocks of which the first length is wrong, where nothing is left for the others.
            confined("block_length", "NUMBER", at)
                .scene(|s| {
                    let cell = |code| crate::stream::cells::Cell { code, ..Default::default() };
                    unit(s).cells = (0..130).map(cell).collect();
                })
                .script(|s| {
                    let payload = s.payload(Increment, 2);
                    let models = usize::from(payload[FIXED + 1]);
                    payload.truncate(FIXED + 2 + models);
                    payload.extend([0x80, 0]);
                }),
            confined("cut block", "SHORT_SECTION", at).script(|s| _ = s.payload(Increment, 2).pop()),
            confined("a byte more", "TRAILING_BYTES", at).script(|s| s.payload(Increment, 2).push(0)),
            confined("a section without a count", "TRAILING_BYTES", at)
                .scene(|s| unit(s).edit = |h| h.new_count = 0),
            confined("a section less", "SHORT_SECTION", at).scene(|s| {
                (unit(s).new, unit(s).edit) = (Vec::new(), |h: &mut IncrementHeader| h.new_count = 3)
            }),
            confined("predictors that the header denies", "TRAILING_BYTES", at)
                .scene(|s| unit(s).edit = |h| h.predictor_block_log2 = 255),
        ],
    );
}

// covers: SS-IN-006, SS-IN-007
#[test]
fn ranges_hold_for_units_without_sections_too() {
    let mut scene = large();
    scene.index = false;
    for (edit, code) in [
        ((|h| h.cell_log2 = 11) as Edit, "OUT_OF_RANGE"),
        (|h| h.neighbour_count = 0, "OUT_OF_RANGE"),
        (|h| (h.sh_mode, h.vq_stage_count, h.codebook_ids) = (2, 1, [9, 255, 255, 255]), "UNDEFINED"),
    ] {
        let scene = without_sections(scene.clone(), edit);
        let script = scene.script();
        let error = decode_with(&script.bytes(), &Options::default()).verdict().unwrap();
        assert_eq!(error.kind.code(), code, "{error}");
        assert!(error.at > script.at(script.find(FrameHeader, 5)));
    }
    let mut script = without_sections(scene, |_| ()).script();
    assert_eq!(decode_with(&script.bytes(), &Options::default()).verdict(), None);
    script.payload(Increment, 18).push(0);
    let error = decode_with(&script.bytes(), &Options::default()).verdict().unwrap();
    assert_eq!(error.kind.code(), "TRAILING_BYTES");
}

/// The scene with a last frame that is empty.
fn without_sections(mut scene: Scene, edit: Edit) -> Scene {
    let frame = &mut scene.gops[1].frames[0];
    frame.units.truncate(1);
    frame.units[0] = Unit { edit, ..Unit::default() };
    frame.count = Some(0);
    scene
}
