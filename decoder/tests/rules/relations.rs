//! Clause 6: what units say of each other.

use crate::crafted::expect::{assert_decodes, assert_refused, assert_refused_in, confined, fatal};
use crate::crafted::sample;
use crate::crafted::scene::{Frame, Unit, codebook, diagonal};
use splatstream_format::syntax::NO_TRANSFORM;
use splatstream_format::syntax::UnitType::{Codebook, FrameHeader, Refinement, Transform};

// covers: SS-FR-002, SS-GH-004, SS-TF-003, SS-CB-001, SS-ER-008
#[test]
fn identifiers_are_defined_once_in_a_gop_and_before_they_are_used() {
    assert_refused(&[
        fatal("undefined dc transform", "UNDEFINED", "6.6", (FrameHeader, 0, 21))
            .script(|s| s.payload(FrameHeader, 0)[1] = 15),
        fatal("a dc transform that is defined as sh", "UNDEFINED", "6.6", (FrameHeader, 0, 21))
            .script(|s| s.payload(FrameHeader, 0)[1] = 4),
        fatal("undefined sh transform", "UNDEFINED", "6.6", (FrameHeader, 1, 22))
            .script(|s| s.payload(FrameHeader, 1)[2] = 15),
        fatal("a range before an undefined identifier", "OUT_OF_RANGE", "6.6", (FrameHeader, 0, 22))
            .script(|s| s.put(FrameHeader, 0, 1, [15, 16])),
        fatal("a transform of the GOP before", "UNDEFINED", "6.6", (FrameHeader, 2, 21)).script(|s| {
            s.remove(Transform, 3);
        }),
        fatal("an sh transform of the GOP before", "UNDEFINED", "6.6", (FrameHeader, 2, 22)).script(|s| {
            s.remove(Transform, 4);
        }),
        confined("a codebook of the GOP before", "UNDEFINED", "6.9", (Refinement, 7, 36)).script(|s| {
            s.remove(Codebook, 2);
        }),
        confined("undefined second codebook", "UNDEFINED", "6.9", (Refinement, 1, 37))
            .script(|s| s.payload(Refinement, 1)[17] = 0),
        fatal("dc transform defined twice", "CONSTRAINT", "6.7", (Transform, 1, 20))
            .script(|s| s.insert_before(Transform, 0, s.parts[2].clone())),
        fatal("sh transform defined twice", "CONSTRAINT", "6.7", (Transform, 2, 20))
            .script(|s| s.payload(Transform, 2)[0] = 4),
        fatal("codebook defined twice", "CONSTRAINT", "6.8", (Codebook, 1, 20))
            .script(|s| s.payload(Codebook, 1)[0] = 7),
        // The fixed part and its relations come before the rest of the payload is asked for.
        fatal("a second transform without its matrix", "CONSTRAINT", "6.7", (Transform, 2, 20)).script(|s| {
            s.payload(Transform, 2)[0] = 4;
            s.payload(Transform, 2).truncate(4);
        }),
        fatal("a second codebook without its entries", "CONSTRAINT", "6.8", (Codebook, 1, 20)).script(|s| {
            s.payload(Codebook, 1)[0] = 7;
            s.payload(Codebook, 1).truncate(5);
        }),
    ]);
}

// covers: SS-TF-003, SS-CB-001
#[test]
fn identifiers_of_transforms_of_a_kind_and_of_codebooks_do_not_meet() {
    let mut scene = sample::scene();
    for gop in &mut scene.gops {
        gop.codebooks.push(codebook(3, 1, 1, vec![0]));
        gop.codebooks.push(codebook(4, 45, 2, vec![0; 45]));
        gop.transforms.push(diagonal(4, 0, 3, 1, 17, 0));
    }
    assert_decodes("3 and 4 three times", &scene);
}

// covers: SS-FR-002, SS-RU-001, SS-RU-003, SS-RU-004, SS-DG-003
#[test]
fn frames_and_units_without_gaussians_obey_the_same_rules() {
    let mut scene = sample::scene();
    for frame in &mut scene.gops[0].frames {
        frame.units.iter_mut().for_each(|unit| unit.gaussians.clear());
    }
    assert_decodes("empty frames", &scene);
    assert_refused_in(
        &scene,
        &[
            fatal("undefined dc transform", "UNDEFINED", "6.6", (FrameHeader, 0, 21))
                .script(|s| s.payload(FrameHeader, 0)[1] = 15),
            confined("sh_mode without an sh transform", "OUT_OF_RANGE", "6.9", (Refinement, 0, 34))
                .script(|s| s.payload(FrameHeader, 0)[2] = NO_TRANSFORM),
            confined("undefined codebook", "UNDEFINED", "6.9", (Refinement, 1, 36))
                .script(|s| s.payload(Refinement, 1)[16] = 15),
            confined("models of nothing", "MISMATCH", "6.9", (Refinement, 0, 40)).script(|s| {
                s.payload(Refinement, 0).truncate(20);
                s.payload(Refinement, 0).extend([1, 0]);
            }),
            confined("a Gaussian where none is", "MISMATCH", "6.9", (Refinement, 2, 28))
                .script(|s| s.payload(Refinement, 2)[8] = 1),
            confined("digest of nothing", "DIGEST", "7.9", (Refinement, 2, 20))
                .script(|s| s.payload(Refinement, 2)[7] ^= 0x80),
            confined("bytes after nothing", "TRAILING_BYTES", "5.9", (Refinement, 2, 41))
                .script(|s| s.payload(Refinement, 2).push(0)),
        ],
    );
}

// covers: SS-RU-001, SS-RU-003, SS-RU-004, SS-RU-005, SS-ER-008
#[test]
fn a_refinement_fits_its_frame() {
    assert_refused(&[
        confined("a Gaussian too many", "MISMATCH", "6.9", (Refinement, 0, 28))
            .script(|s| s.payload(Refinement, 0)[8] = 3),
        confined("a Gaussian too few in the last", "MISMATCH", "6.9", (Refinement, 2, 28))
            .script(|s| s.payload(Refinement, 2)[8] = 4),
        confined("more Gaussians than a frame may have", "MISMATCH", "6.9", (Refinement, 1, 28))
            .script(|s| s.put(Refinement, 1, 8, u32::MAX.to_le_bytes())),
        confined("the share of another refinement", "MISMATCH", "6.9", (Refinement, 0, 28))
            .scene(|s| s.gops[0].frames[0].count = Some(11)),
        confined("sh_mode 1 without an sh transform", "OUT_OF_RANGE", "6.9", (Refinement, 0, 34))
            .script(|s| s.payload(FrameHeader, 0)[2] = NO_TRANSFORM),
        confined("codebook of another rank", "MISMATCH", "6.9", (Refinement, 1, 36))
            .scene(|s| {
                s.unit(0).sh_mode = 0;
                s.unit(0).gaussians.iter_mut().for_each(|gaussian| gaussian.sh.clear());
            })
            .script(|s| s.payload(FrameHeader, 0)[2] = 3),
        confined("reserved sh_mode", "RESERVED", "6.9", (Refinement, 0, 34))
            .script(|s| s.payload(Refinement, 0)[14] = 3),
        confined("digest", "DIGEST", "7.9", (Refinement, 0, 20)).script(|s| s.payload(Refinement, 0)[0] ^= 1),
        confined("digest of another unit", "DIGEST", "7.9", (Refinement, 1, 20)).script(|s| {
            let digest = s.payload(Refinement, 0)[..8].to_vec();
            s.put(Refinement, 1, 0, digest);
        }),
        // Ranges and reserved values, then relations, then the sections.
        confined("a reserved value before a wrong count", "RESERVED", "6.9", (Refinement, 0, 34)).script(
            |s| {
                s.payload(Refinement, 0)[8] = 3;
                s.payload(Refinement, 0)[14] = 3;
            },
        ),
        confined("a wrong count before bytes left over", "MISMATCH", "6.9", (Refinement, 0, 28)).script(
            |s| {
                s.payload(Refinement, 0)[8] = 3;
                s.payload(Refinement, 0).push(0);
            },
        ),
        confined("an undefined codebook before a missing section", "UNDEFINED", "6.9", (Refinement, 1, 36))
            .script(|s| {
                s.payload(Refinement, 1)[16] = 14;
                s.payload(Refinement, 1).truncate(20);
            }),
        confined("bytes left over before broken models", "TRAILING_BYTES", "5.9", (Refinement, 0, 20))
            .scene(|s| s.unit(0).section = Some(vec![0xFF]))
            .script(|s| s.payload(Refinement, 0).push(0))
            .or_later(),
        confined("broken models before a wrong digest", "CONSTRAINT", "6.12", (Refinement, 0, 20))
            .scene(|s| {
                s.unit(0).section = Some(vec![0xFF]);
                s.unit(0).digest = Some(0);
            })
            .or_later(),
    ]);
}

// covers: SS-RU-004
#[test]
fn one_codebook_may_be_used_in_several_stages() {
    let mut scene = sample::scene();
    let unit = scene.unit(1);
    unit.codebook_ids = vec![7, 7, 1, 7];
    unit.gaussians.iter_mut().for_each(|gaussian| gaussian.sh = vec![2, 1, 1, 0]);
    assert_decodes("one codebook three times", &scene);
}

// covers: SS-TF-002
#[test]
fn there_is_no_sh_transform_in_a_stream_of_degree_0() {
    let scene = sample::plain(sample::gaussians(4, 1, 3, 0));
    assert_refused_in(
        &scene,
        &[fatal("kind 1", "MISMATCH", "6.7", (Transform, 0, 22)).script(|s| s.payload(Transform, 0)[1] = 1)],
    );
}

// covers: SS-RU-006, SS-RU-001, SS-RU-002, SS-DG-003
#[test]
fn a_prefix_has_the_ceiling_of_its_share() {
    for (gaussians, expected) in [
        (101, [11, 10, 10, 20, 50]),
        (0, [0; 5]),
        (1, [1, 0, 0, 0, 0]),
        (2, [1, 0, 0, 0, 1]),
        (3, [1, 0, 0, 1, 1]),
    ] {
        let mut scene = sample::plain(Vec::new());
        scene.sequence.refinement_count = 5;
        scene.sequence.refinement_percent = [10, 20, 30, 50, 100, 0, 0, 0, 0, 0];
        let all = sample::gaussians(gaussians, 7, 3, 0);
        let frame = scene.divided(&all, &Unit::default());
        let counts: Vec<usize> = frame.units.iter().map(|unit| unit.gaussians.len()).collect();
        assert_eq!(counts, expected);
        scene.gops[0].frames = vec![frame];
        assert_decodes(&format!("N = {gaussians}"), &scene);
    }
}

// covers: SS-RU-006
#[test]
fn ten_refinements_of_one_percent_steps_are_a_stream() {
    let mut scene = sample::plain(Vec::new());
    scene.sequence.refinement_count = 10;
    scene.sequence.refinement_percent = [1, 2, 3, 4, 5, 6, 7, 98, 99, 100];
    let frame: Frame =
        scene.divided(&sample::gaussians(150, 3, 3, 0), &Unit { reuse: true, ..Unit::default() });
    scene.gops[0].frames = vec![frame];
    // A model that can code every unit, so that all units but the first reuse it.
    for unit in 0..10 {
        let shapes = super::models::any_value_shapes(11);
        scene.unit(unit).shapes = shapes;
    }
    assert_decodes("ten refinements", &scene);
}
