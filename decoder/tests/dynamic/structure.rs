//! 7.13, 6.3 to 6.8: GOPs and frames of profile 1, the layers of their units, codebooks between frames.

use crate::crafted::expect::decode_with;
use crate::crafted::scene::codebook;
use crate::crafted::{Part, Script, seal_header};
use crate::stream::draw::codebooks;
use crate::stream::expect::{Case, assert_decodes, assert_refused, confined, fatal, point};
use crate::stream::sample::{frame, gop, large, small};
use crate::stream::scene::{Gop, Scene, Unit};
use splatstream_decoder::process::Options;
use splatstream_format::syntax::UnitType::{
    Codebook, End, FrameHeader, GopHeader as Header, Increment, Index, OperatingPoints, Refinement,
    SequenceParameters, Transform,
};
use splatstream_format::syntax::{GopHeader, UnitId, UnitType};

/// A frame without Gaussians at a place.
fn empty(place: u32, layers: &[(u8, u8)]) -> crate::stream::scene::Frame {
    let unit = |&(spatial, refinement): &(u8, u8)| Unit { spatial, refinement, ..Unit::default() };
    frame(place, layers.iter().map(unit).collect())
}

// covers: SS-BS-009, SS-FR-004, SS-BS-010
#[test]
fn types_layers_and_references_are_those_of_the_table_of_7_13_1() {
    // Type and temporal layer, then the reference, of the places 0 to 8.
    let table: [([&str; 9], [u32; 8]); 4] = [
        (["I0", "P0", "P0", "P0", "P0", "P0", "P0", "P0", "P0"], [0, 1, 2, 3, 4, 5, 6, 7]),
        (["I0", "B1", "P0", "B1", "P0", "B1", "P0", "B1", "P0"], [0, 0, 2, 2, 4, 4, 6, 6]),
        (["I0", "B2", "B1", "B2", "P0", "B2", "B1", "B2", "P0"], [0, 0, 2, 0, 4, 4, 6, 4]),
        (["I0", "B3", "B2", "B3", "B1", "B3", "B2", "B3", "P0"], [0, 0, 2, 0, 4, 4, 6, 0]),
    ];
    for (depth, (types, references)) in (0..).zip(table) {
        let header = GopHeader::predicted(0, 9, depth);
        let gop_of = |frames| Gop { header, transforms: Vec::new(), network: None, frames };
        let mut scene = gop(&[100], (0..9).map(|place| empty(place, &[(0, 0)])).collect());
        scene.gops[0].header = header;
        scene.sequence.temporal_layer_count = depth + 1;
        assert_decodes(&format!("depth {depth}"), &scene);
        let script = scene.script();
        for (place, name) in (0_u32..9).zip(types) {
            let mut wrong = script.clone();
            let (_, layer) = name.split_at(1);
            assert_eq!(wrong.id(FrameHeader, place as usize).temporal_layer.to_string(), layer);
            let code = ["I", "P", "B"].into_iter().position(|letter| name.starts_with(letter)).unwrap() as u8;
            assert_eq!(wrong.payload(FrameHeader, place as usize)[0], code);
            for other in [0, 1, 2].into_iter().filter(|&other| other != code) {
                wrong.put(FrameHeader, place as usize, 0, [other]);
                assert_eq!(verdict(&wrong), Some("MISMATCH"), "{depth} {place}");
            }
            let known = place.checked_sub(1).map(|before| references[before as usize]);
            assert_eq!(gop_of(Vec::new()).reference(place), known, "{depth} {place}");
        }
    }
}

fn verdict(script: &Script) -> Option<&'static str> {
    let options = Options { tolerant: true, ..Options::default() };
    decode_with(&script.bytes(), &options).verdict().map(|error| error.kind.code())
}

const fn of_gop(name: &'static str, code: &'static str) -> Case {
    fatal(name, code, (Header, 0))
}

// covers: SS-GH-002, SS-GH-005, SS-GH-006
#[test]
fn a_gop_header_fits_the_layers_and_is_checked_in_order() {
    let base = large();
    assert_refused(
        &base,
        &[
            of_gop("structure", "RESERVED").script(|s| s.put(Header, 0, 8, [2])),
            of_gop("depth of an all-intra GOP", "OUT_OF_RANGE").script(|s| s.put(Header, 0, 8, [0, 1])),
            of_gop("depth", "OUT_OF_RANGE").script(|s| s.put(Header, 0, 9, [4])),
            of_gop("depth of four layers", "OUT_OF_RANGE").script(|s| s.put(Header, 0, 9, [3])),
            of_gop("1025 frames", "OUT_OF_RANGE").script(|s| s.put(Header, 0, 4, [1, 4])),
            of_gop("reserved bytes", "RESERVED_BITS").script(|s| s.put(Header, 0, 10, [0, 1])),
            // SS-GH-005 and then the layers come before gop_index; ranges before both.
            of_gop("1025 frames and gop_index", "OUT_OF_RANGE")
                .script(|s| s.put(Header, 0, 0, [9, 0, 0, 0, 1, 4])),
            of_gop("depth and gop_index", "OUT_OF_RANGE").script(|s| {
                s.put(Header, 0, 0, [9]);
                s.put(Header, 0, 9, [3]);
            }),
            of_gop("reserved bytes and 1025 frames", "RESERVED_BITS").script(|s| {
                s.put(Header, 0, 4, [1, 4]);
                s.put(Header, 0, 10, [1]);
            }),
            of_gop("gop_index", "MISMATCH").script(|s| s.put(Header, 0, 0, [9])),
        ],
    );
    // 1024 frames, of which the first is there.
    let mut scene = small();
    scene.gops[0].frames.truncate(1);
    (scene.gops[0].header.gop_frame_count, scene.sequence.frame_count) = (1024, 1024);
    assert_decodes("1024 frames", &scene);
}

// covers: SS-BS-002, SS-BS-009, SS-BS-010, SS-UH-007, SS-FR-004
#[test]
fn frame_headers_stand_in_the_layers_and_in_the_order_of_the_structure() {
    let of = |name, code, n| fatal(name, code, (FrameHeader, n));
    assert_refused(
        &large(),
        &[
            // Against the sequence, then `frame`, then the structure.
            of("temporal layer of no layer", "OUT_OF_RANGE", 1)
                .script(|s| s.id(FrameHeader, 1).temporal_layer = 3),
            of("spatial layer of no layer", "OUT_OF_RANGE", 1)
                .script(|s| s.id(FrameHeader, 1).spatial_layer = 2),
            of("temporal layer", "MISMATCH", 1).script(|s| s.id(FrameHeader, 1).temporal_layer = 1),
            of("spatial layer of an intra frame", "MISMATCH", 0)
                .script(|s| s.id(FrameHeader, 0).spatial_layer = 1),
            of("spatial layer", "MISMATCH", 3).script(|s| s.id(FrameHeader, 3).spatial_layer = 0),
            of("the first frame is absent", "MISMATCH", 0).script(|s| s.id(FrameHeader, 0).frame = 1),
            of("a frame that was there", "MISMATCH", 2).script(|s| s.id(FrameHeader, 2).frame = 1),
            of("behind the GOP", "MISMATCH", 4).script(|s| s.id(FrameHeader, 4).frame = 6),
            of("a frame too many", "UNEXPECTED_UNIT", 6)
                .script(|s| s.insert_before(Index, 0, Part::unit(FrameHeader, 7, vec![0; 8]))),
            of("B as P", "MISMATCH", 1).script(|s| s.put(FrameHeader, 1, 0, [1])),
            of("reserved type", "RESERVED", 1).script(|s| s.put(FrameHeader, 1, 0, [3])),
            of("type, then transform", "MISMATCH", 1).script(|s| s.put(FrameHeader, 1, 0, [1, 9])),
            of("transform", "UNDEFINED", 1).script(|s| s.put(FrameHeader, 1, 1, [9])),
        ],
    );
}

// covers: SS-BS-010
#[test]
fn a_first_frame_that_is_absent_is_missed_at_the_unit_in_its_place() {
    for (unit_type, n) in [(Header, 1), (Index, 0), (End, 0)] {
        let mut script = large().script();
        let (from, to) = (script.find(FrameHeader, 0), script.find(Header, 1));
        script.parts.drain(from..to);
        if unit_type != Header {
            let (from, to) = (script.find(Header, 1), script.find(Index, 0));
            script.parts.drain(from..to);
        }
        if unit_type == End {
            script.remove(Index, 0);
        }
        let error = decode_with(&script.bytes(), &Options::default()).verdict().unwrap();
        assert_eq!((error.kind.code(), error.at), ("MISMATCH", script.at(script.find(unit_type, n))));
    }
}

// covers: SS-BS-002, SS-BS-009, SS-BS-012, SS-UH-007
#[test]
fn increments_stand_in_their_frame_and_in_order() {
    let lost = |name, code, n| confined(name, code, (Increment, n));
    let stop = |name, code, n| fatal(name, code, (Increment, n));
    assert_refused(
        &large(),
        &[
            stop("spatial layer of no layer", "OUT_OF_RANGE", 2)
                .script(|s| s.id(Increment, 2).spatial_layer = 2),
            stop("temporal layer of no layer", "OUT_OF_RANGE", 7)
                .script(|s| s.id(Increment, 7).temporal_layer = 3),
            stop("another frame", "MISMATCH", 1).script(|s| s.id(Increment, 1).frame = 1),
            stop("temporal layer", "MISMATCH", 1).script(|s| s.id(Increment, 1).temporal_layer = 1),
            stop("temporal layer of a B frame", "MISMATCH", 7)
                .script(|s| s.id(Increment, 7).temporal_layer = 1),
            stop("spatial layer of a predicted frame", "MISMATCH", 7)
                .script(|s| s.id(Increment, 7).spatial_layer = 0),
            lost("not the first", "UNEXPECTED_UNIT", 0).script(|s| s.id(Increment, 0).refinement = 1),
            lost("not in layer 0", "UNEXPECTED_UNIT", 0).script(|s| s.id(Increment, 0).spatial_layer = 1),
            lost("twice", "UNEXPECTED_UNIT", 1).script(|s| s.id(Increment, 1).refinement = 0),
            lost("a gap", "UNEXPECTED_UNIT", 1).script(|s| _ = s.remove(Increment, 1)),
            lost("back to layer 0", "UNEXPECTED_UNIT", 4).script(|s| s.id(Increment, 4).spatial_layer = 0),
            lost("no such refinement", "UNEXPECTED_UNIT", 2).script(|s| s.id(Increment, 2).refinement = 9),
            lost("no such refinement of a frame", "UNEXPECTED_UNIT", 8)
                .script(|s| s.id(Increment, 8).refinement = 3),
            lost("a layer without parents", "UNEXPECTED_UNIT", 2).script(|s| {
                _ = s.remove(Increment, 2);
                _ = s.remove(Increment, 1);
            }),
            lost("damage", "CHECK_SUM", 7).script(|s| s.damage(Increment, 7)),
            // Damage does not hide whose a unit is, but which.
            stop("damage of another frame", "MISMATCH", 7).script(|s| {
                s.id(Increment, 7).frame = 4;
                s.damage(Increment, 7);
            }),
            lost("damage of a unit out of order", "CHECK_SUM", 7).script(|s| {
                s.id(Increment, 7).refinement = 2;
                s.damage(Increment, 7);
            }),
        ],
    );
}

// covers: SS-BS-001, SS-BS-006, SS-ER-008
#[test]
fn units_stand_where_the_table_of_phases_lets_them() {
    let book = || codebook(2, 2, 1, vec![0; 4]).to_bytes().unwrap();
    let stray = |unit_type: UnitType| Part::unit(unit_type, 0, Vec::new());
    // Which unit, before which, and what is said; none where it is at home.
    let cases: [(Part, (UnitType, usize), Option<&str>); 14] = [
        (stray(Refinement), (Header, 0), Some("UNEXPECTED_UNIT")),
        (stray(Refinement), (Increment, 1), Some("UNEXPECTED_UNIT")),
        (stray(Increment), (Header, 0), Some("UNEXPECTED_UNIT")),
        (stray(Increment), (Transform, 0), Some("UNEXPECTED_UNIT")),
        (stray(Increment), (Index, 0), Some("MISMATCH")),
        (stray(Increment), (End, 0), Some("UNEXPECTED_UNIT")),
        (stray(Transform), (Increment, 1), Some("UNEXPECTED_UNIT")),
        (stray(Codebook), (Header, 0), Some("UNEXPECTED_UNIT")),
        (stray(Codebook), (End, 0), Some("UNEXPECTED_UNIT")),
        (Part::unit(Codebook, 0, book()), (FrameHeader, 1), None),
        (Part::unit(Codebook, 6, book()), (Index, 0), None),
        (Part::unit(Codebook, 1, book()), (FrameHeader, 2), Some("MISMATCH")),
        (Part::unit(OperatingPoints, 0, vec![0; 4]), (Index, 0), None),
        (Part::unit(OperatingPoints, 0, vec![0; 4]), (End, 0), Some("UNEXPECTED_UNIT")),
    ];
    for (part, (kind, n), expected) in cases {
        let mut script = large().script();
        let name = format!("{part:?} before {} {n}", kind.name());
        script.insert_before(kind, n, part);
        assert_eq!(verdict(&script), expected, "{name}");
    }
    // Behind a codebook unit no increment and no transform may follow.
    for (unit_type, frame) in [(Increment, 0), (Transform, 0)] {
        let mut script = large().script();
        script.insert_before(Increment, 1, Part::unit(Codebook, 0, book()));
        script.insert_before(Increment, 1, Part::unit(unit_type, frame, Vec::new()));
        assert_eq!(verdict(&script), Some("UNEXPECTED_UNIT"), "{unit_type:?}");
    }
    // The layers of a unit are looked at after its place.
    let mut script = large().script();
    let id = UnitId::of_frame(Codebook, 0).on_layers(0, 3);
    script.insert_before(Header, 0, Part::Unit(id, book()));
    assert_eq!(verdict(&script), Some("UNEXPECTED_UNIT"));
}

// covers: SS-UH-006, SS-UH-007
#[test]
fn layers_are_0_where_a_unit_has_none_and_below_4_elsewhere() {
    let types = [SequenceParameters, Header, Transform, Codebook, FrameHeader, Increment, Index, End];
    for unit_type in types {
        // Of spatial_layer and temporal_layer, the most that the header itself allows.
        let most = match unit_type {
            FrameHeader | Increment => [3, 3],
            Codebook => [0, 3],
            _ => [0, 0],
        };
        for (byte, most) in [2, 3].into_iter().zip(most) {
            let mut script = large().script();
            let at = script.at(script.find(unit_type, 0)) as usize;
            script.level = 2;
            let mut bytes = script.bytes();
            bytes[at + byte] = most + 1;
            seal_header(&mut bytes[at..]);
            let error = decode_with(&bytes, &Options::default()).verdict().unwrap();
            assert_eq!((error.kind.code(), error.at), ("OUT_OF_RANGE", (at + byte) as u64), "{unit_type:?}");
        }
    }
}

/// A frame whose parents take their SH from codebook 7, as it is then.
fn updated(place: u32) -> crate::stream::scene::Frame {
    let mut frame = small().gops[0].frames[1].clone();
    let unit = &mut frame.units[0];
    (unit.header.sh_mode, unit.header.vq_stage_count) = (2, 1);
    unit.header.codebook_ids = [7, 255, 255, 255];
    (unit.cells, unit.moves, unit.new, unit.predictors) = Default::default();
    (unit.modes, frame.place) = (vec![2; 4], place);
    let one = |number| crate::crafted::scene::Gaussian {
        sh: vec![number % 3],
        ..crate::stream::sample::gaussian(0, number)
    };
    unit.updates = (0..4).map(one).collect();
    frame
}

/// I, B, P, B, P: codebook 7 of layer 0 changes before frame 2, codebook 9 of layer 1 before the frames 1 and 3.
fn with_codebooks() -> Scene {
    let mut scene = small();
    scene.gops[0].frames.truncate(1);
    scene.gops[0].frames.extend((1..5).map(updated));
    scene.gops[0].header = GopHeader::predicted(0, 5, 1);
    (scene.sequence.temporal_layer_count, scene.sequence.frame_count) = (2, 5);
    let frames = &mut scene.gops[0].frames;
    for (place, value) in [(1, 70), (3, -9)] {
        frames[place].codebooks = vec![(1, codebook(9, 2, 1, vec![value; 6]))];
        frames[place].units[0].header.codebook_ids[0] = 9;
    }
    frames[2].codebooks = codebooks(99)[..1].to_vec();
    scene
}

// covers: SS-CB-003, SS-IN-006, SS-BS-010, SS-BS-011
#[test]
fn codebooks_are_defined_again_between_frames_in_the_temporal_layer_of_before() {
    let scene = with_codebooks();
    assert_decodes("codebooks between frames", &scene);
    let units = |name, code, n| confined(name, code, (Increment, n));
    assert_refused(
        &scene,
        &[
            units("of a higher temporal layer", "CONSTRAINT", 4)
                .scene(|s| s.gops[0].frames[2].units[0].header.codebook_ids[0] = 9),
            units("not yet defined", "UNDEFINED", 2).scene(|s| s.gops[0].frames[1].codebooks.clear()),
            units("another rank", "MISMATCH", 4)
                .scene(|s| s.gops[0].frames[2].codebooks[0].1 = codebook(7, 3, 1, vec![0; 9]))
                .script(|_| ()),
            fatal("another temporal layer", "CONSTRAINT", (Codebook, 3))
                .scene(|s| s.gops[0].frames[2].codebooks[0].0 = 1),
            fatal("another temporal layer in phase GOP", "CONSTRAINT", (Codebook, 2))
                .scene(|s| s.gops[0].frames[0].codebooks.push((1, codebooks(5)[0].1.clone()))),
            fatal("temporal layer of no layer", "OUT_OF_RANGE", (Codebook, 3))
                .scene(|s| s.gops[0].frames[2].codebooks[0].0 = 2),
        ],
    );
    // At temporal layer 0 the codebooks of layer 1 are passed over, whatever they hold.
    let mut script = scene.script();
    script.damage(Codebook, 2);
    script.payload(Codebook, 4).clear();
    let options = |temporal| Options { operating_point: point(3, temporal, 9), ..Options::default() };
    assert_eq!(decode_with(&script.bytes(), &options(0)).verdict(), None);
    assert_eq!(decode_with(&script.bytes(), &options(1)).verdict().unwrap().kind.code(), "CHECK_SUM");
}

// covers: SS-CB-002, SS-CB-003, SS-LM-001
#[test]
fn what_a_codebook_replaces_does_not_count() {
    let scene = with_codebooks();
    let verdict = |max_codebook_values| {
        let limits = splatstream_format::Limits { max_codebook_values, ..Default::default() };
        let options = Options { limits, ..Options::default() };
        decode_with(&scene.bytes(), &options).verdict().map(|error| error.kind.code())
    };
    // 6 and 4 values, then 6 of codebook 9.
    assert_eq!([verdict(16), verdict(15)], [None, Some("OVER_LIMIT")]);
}

// covers: SS-BS-011, SS-ER-007, SS-EN-001, SS-IX-001
#[test]
fn units_that_do_not_belong_are_passed_over_where_frames_are() {
    let verdict = |script: &Script, at| {
        let options = Options { operating_point: at, tolerant: true, ..Options::default() };
        decode_with(&script.bytes(), &options).verdict().map(|error| error.kind.code())
    };
    let mut script = large().script();
    // Frame 1 is of temporal layer 2: header, units and their order are not looked at.
    script.damage(FrameHeader, 1);
    script.payload(Increment, 6).clear();
    script.id(Increment, 7).frame = 77;
    script.id(Increment, 8).refinement = 8;
    assert_eq!(verdict(&script, point(3, 1, 9)), None);
    assert_eq!(verdict(&script, point(3, 2, 9)), Some("CHECK_SUM"));
    // In other phases a unit has to stand in its place first.
    for (kind, n) in [(Header, 0), (End, 0)] {
        for unit_type in [FrameHeader, Increment, Codebook] {
            let mut script = large().script();
            let id = UnitId::of_frame(unit_type, 0).on_layers(0, 2);
            script.insert_before(kind, n, Part::Unit(id, Vec::new()));
            assert_eq!(verdict(&script, point(3, 1, 9)), Some("UNEXPECTED_UNIT"), "{unit_type:?} {kind:?}");
        }
    }
    // A refinement unit is never passed over.
    let mut script = large().script();
    let id = UnitId { refinement: 5, ..UnitId::of_frame(Refinement, 0) };
    script.insert_before(Increment, 1, Part::Unit(id, Vec::new()));
    assert_eq!(verdict(&script, point(3, 3, 0)), Some("UNEXPECTED_UNIT"));
    // Units of the intra frame of a predicted GOP belong whatever their refinement, wherever they stand.
    let mut script = large().script();
    let id = UnitId { refinement: 2, ..UnitId::of_frame(Increment, 0) };
    script.insert_before(FrameHeader, 0, Part::Unit(id, Vec::new()));
    assert_eq!(verdict(&script, point(3, 3, 0)), Some("UNEXPECTED_UNIT"));
    script.id(Increment, 0).refinement = 0;
    assert_eq!(verdict(&script, point(3, 3, 0)), Some("UNEXPECTED_UNIT"));
}
