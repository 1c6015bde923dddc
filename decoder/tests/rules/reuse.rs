//! 6.12 and 8.5: sources and thresholds, models of earlier units, and where a model section ends.

use super::models::{
    CONSTRAINT, OPACITY, POSITION, any_value_shapes, assert_models, axis, section, signed, start, table,
    zeros,
};
use crate::crafted::expect::{assert_decodes, decode};
use crate::crafted::sample;
use crate::crafted::scene::Unit;
use splatstream_format::bits::BitWriter;
use splatstream_format::syntax::UnitType::Refinement;

const RESERVED: Option<(&str, &str)> = Some(("RESERVED", "6.12"));

// covers: SS-PM-003, SS-PM-004, SS-PM-005
#[test]
fn sources_thresholds_and_contexts_have_their_ranges() {
    assert_models(&[
        (
            "source 11",
            OPACITY,
            |b| {
                signed(b);
                start(b, 1, 11);
            },
            RESERVED,
        ),
        (
            "source 15",
            POSITION,
            |b| {
                b.bits(0, 1);
                start(b, 1, 15);
            },
            RESERVED,
        ),
        (
            "source 12 on the second axis",
            OPACITY,
            |b| {
                signed(b);
                b.bits(1, 3);
                axis(b, 5, 1, 0, &[]);
                b.bits(12, 4);
            },
            RESERVED,
        ),
        (
            "thresholds at both ends of 32 bits",
            OPACITY,
            |b| {
                signed(b);
                b.bits(1, 3);
                axis(b, 5, 2, -i32::MAX, &[u32::MAX - 2]);
                b.bits(0, 4);
                b.bits(0, 2);
                b.bits(2, 2);
                b.bits(2, 2);
            },
            None,
        ),
        (
            "a threshold of 2^31",
            OPACITY,
            |b| {
                signed(b);
                b.bits(1, 3);
                axis(b, 5, 2, -i32::MAX, &[u32::MAX - 1]);
            },
            CONSTRAINT,
        ),
        (
            "64 contexts",
            OPACITY,
            |b| {
                signed(b);
                b.bits(1, 3);
                axis(b, 5, 15, 0, &[0; 14]);
                axis(b, 8, 3, 0, &[0; 2]);
                b.bits(0, 2);
                (1..64).for_each(|_| b.bits(2, 2));
            },
            None,
        ),
        (
            "68 contexts",
            OPACITY,
            |b| {
                signed(b);
                b.bits(1, 3);
                axis(b, 5, 16, 0, &[0; 15]);
                axis(b, 8, 3, 0, &[0; 2]);
            },
            CONSTRAINT,
        ),
        // Not available: found after all models are read.
        (
            "neighbour_magnitude of positions",
            POSITION,
            |b| {
                b.bits(0, 1);
                b.bits(1, 3);
                axis(b, 2, 1, 0, &[]);
                b.bits(0, 8);
            },
            CONSTRAINT,
        ),
        (
            "the opacity before it is known",
            OPACITY,
            |b| {
                signed(b);
                b.bits(1, 3);
                axis(b, 9, 1, 0, &[]);
                b.bits(0, 8);
            },
            CONSTRAINT,
        ),
    ]);
    // The second model is malformed: this comes before the unavailable source of the first.
    let mut scene = zeros();
    let mut bits = BitWriter::new();
    bits.bits(0, 1);
    bits.bits(1, 3);
    axis(&mut bits, 2, 1, 0, &[]);
    bits.bits(0, 8);
    bits.bits(0, 1);
    bits.bits(1 << 10, 40);
    scene.unit(0).section = Some([bits.into_bytes(), vec![0; 20]].concat());
    assert_eq!(decode(&scene.bytes()).verdict().unwrap().kind.code(), "NUMBER");
}

// covers: SS-EC-005, SS-PM-003
#[test]
fn a_source_is_available_where_the_table_of_8_5_says() {
    // Planes: position, log_scale 0 to 2, opacity, rotation 0 to 2, dc 0 to 2, sh 0 and 1 as indices.
    let planes = 13;
    let available = |source: u64, plane: usize| match source {
        1 => plane < 11,
        2 => plane > 0 && plane < 11,
        3 => plane >= 2 && plane != 11,
        4 => [2, 3, 6, 7, 9, 10, 12].contains(&plane),
        5 => plane >= 2,
        6 => plane >= 3,
        7 | 8 => plane >= 4,
        9 => plane >= 5,
        _ => plane > 0,
    };
    for source in 1..=10 {
        for plane in 0..planes {
            for second in [false, true] {
                let mut scene = zeros();
                scene.unit(0).codebook_ids = vec![7, 1];
                scene.unit(0).gaussians.iter_mut().for_each(|gaussian| gaussian.sh = vec![0, 0]);
                let mut bits = BitWriter::new();
                for place in 0..planes {
                    bits.bits(0, 1);
                    if (1..11).contains(&place) {
                        bits.signed_exp_golomb(0);
                    }
                    bits.bits(1, 3);
                    if place != plane {
                        bits.bits(0, 4 + 2);
                        continue;
                    }
                    if second {
                        // Available to every plane: neighbour_sum or, to index planes, position_spacing.
                        axis(&mut bits, if place < 11 { 1 } else { 10 }, 1, 9, &[]);
                    }
                    axis(&mut bits, source, 1, 9, &[]);
                    if !second {
                        bits.bits(0, 4);
                    }
                    bits.bits(0, 2);
                    (1..if second { 4 } else { 2 }).for_each(|_| bits.bits(2, 2));
                }
                scene.unit(0).section = Some(bits.into_bytes());
                let found = decode(&scene.bytes()).verdict().map(|error| (error.kind.code(), error.clause));
                let expected = if available(source, plane) { None } else { CONSTRAINT };
                assert_eq!(found, expected, "source {source}, plane {plane}, second axis {second}");
            }
        }
    }
}

// covers: SS-PM-008, SS-ER-005
#[test]
fn a_model_section_ends_with_its_last_bit() {
    let whole = section(12, OPACITY, |b| table(b, 0));
    let verdict = |section: &[u8]| {
        let mut scene = zeros();
        scene.unit(0).section = Some(section.to_vec());
        let script = scene.script();
        let start = script.at(script.find(Refinement, 0)) + 41;
        let error = decode(&script.bytes()).verdict();
        error.map(|error| (error.kind.code(), error.clause, error.at - start))
    };
    assert_eq!(verdict(&whole), None);
    let bits = 12 * 10 + 10;
    assert_eq!(whole.len(), 17, "{bits} bits");
    assert_eq!(verdict(&[whole.clone(), vec![0]].concat()), Some(("TRAILING_BYTES", "5.12", 16)));
    for bit in bits % 8..8 {
        let mut padded = whole.clone();
        *padded.last_mut().unwrap() |= 1 << bit;
        assert_eq!(verdict(&padded), Some(("PADDING", "5.12", 16)), "padding bit {bit}");
    }
    for length in 0..whole.len() {
        let (code, clause, at) = verdict(&whole[..length]).unwrap();
        assert_eq!((code, clause), ("SHORT_SECTION", "5.12"), "{length} bytes");
        // Reading goes on in zeros, for the 31 bits of a number at most.
        assert!(at <= length as u64 + 5, "{at}");
    }
}

// covers: SS-PM-001
#[test]
fn a_plane_may_reuse_the_model_of_the_same_plane_in_the_unit_before() {
    let mut scene = sample::plain(Vec::new());
    scene.sequence.refinement_count = 4;
    scene.sequence.refinement_percent = [50, 51, 60, 100, 0, 0, 0, 0, 0, 0];
    let mut frame = scene.divided(&sample::gaussians(10, 3, 3, 0), &Unit { reuse: true, ..Unit::default() });
    frame.units.iter_mut().for_each(|unit| unit.shapes = any_value_shapes(11));
    // A unit without Gaussians leaves the models before it in force.
    assert_eq!(frame.units.iter().map(|unit| unit.gaussians.len()).collect::<Vec<_>>(), [5, 1, 0, 4]);
    frame.units[0].shapes.get_mut(&OPACITY).unwrap().bias = 77;
    scene.gops[0].frames = vec![frame];
    assert_decodes("every plane reused", &scene);
    let mut first = scene.clone();
    first.unit(0).section = Some(vec![0xFF; 2]);
    let error = decode(&first.bytes()).verdict().unwrap();
    assert_eq!(
        (error.kind.code(), error.clause),
        ("CONSTRAINT", "6.12"),
        "nothing to reuse in the first unit"
    );
    // The second frame starts without models.
    let mut frames = scene.clone();
    frames.sequence.frame_count = 2;
    let again = frames.gops[0].frames[0].clone();
    frames.gops[0].frames.push(again);
    assert_decodes("two frames", &frames);
    frames.gops[0].frames[1].units[0].section = Some(vec![0xFF; 2]);
    assert_eq!(decode(&frames.bytes()).verdict().unwrap().kind.code(), "CONSTRAINT");
}

// covers: SS-PM-001
#[test]
fn a_plane_of_another_alphabet_is_not_the_same_plane() {
    let mut scene = sample::scene();
    scene.unit(0).shapes = any_value_shapes(13);
    scene.unit(1).shapes = any_value_shapes(13);
    scene.unit(1).reuse = true;
    assert_decodes("planes up to dc reused, indices of their own", &scene);
    let all_reused = {
        let mut bits = BitWriter::new();
        bits.bits((1 << 11) - 1, 11);
        bits.bits(3, 2);
        bits.into_bytes()
    };
    scene.unit(1).section = Some(all_reused.clone());
    let error = decode(&scene.bytes()).verdict().unwrap();
    assert_eq!((error.kind.code(), error.clause), ("CONSTRAINT", "6.12"));
    // Stage 1 where the unit before has one stage only.
    let mut stages = sample::scene();
    let index = stages.unit(1).gaussians[0].clone();
    let unit = stages.unit(0);
    (unit.sh_mode, unit.codebook_ids) = (2, vec![7]);
    unit.gaussians.iter_mut().for_each(|gaussian| gaussian.sh = index.sh[..1].to_vec());
    stages.unit(1).section = Some(all_reused);
    assert_eq!(decode(&stages.bytes()).verdict().unwrap().kind.code(), "CONSTRAINT");
}
