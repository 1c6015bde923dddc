//! 5.12, 6.12 and 8.3: plane models bit by bit.

use crate::crafted::expect::{class_of, decode};
use crate::crafted::sample;
use crate::crafted::scene::{Gaussian, Scene, Shape, Unit};
use splatstream_format::bits::BitWriter;
use splatstream_format::entropy::frequencies::Frequencies;
use splatstream_format::syntax::UnitType::Refinement;
use std::collections::BTreeMap;

/// Places of planes in the unit of [`zeros`].
pub(super) const POSITION: usize = 0;
const LOG_SCALE: usize = 1;
pub(super) const OPACITY: usize = 4;
const DC_2: usize = 10;
const INDEX: usize = 11;

/// Shapes whose tables give every token of every plane the same chance.
pub(super) fn any_value_shapes(planes: usize) -> BTreeMap<usize, Shape> {
    let shape = |plane: usize| {
        let last: usize = match plane {
            POSITION => 235,
            // Indices end where signed values of the same length do not.
            INDEX.. => 59,
            _ => 63,
        };
        let table = Frequencies::from_counts(&vec![1; last + 1]);
        (plane, Shape { tables: Some((vec![table], vec![0])), ..Shape::default() })
    };
    (0..planes).map(shape).collect()
}

/// Three Gaussians of which every value is 0, vector-quantised: 12 planes, the last of the index alphabet. Blocks
/// without words fit every model whose first token is certain.
pub(super) fn zeros() -> Scene {
    let mut scene = sample::scene();
    scene.sequence.frame_count = 1;
    scene.sequence.refinement_count = 1;
    scene.sequence.refinement_percent = [100, 0, 0, 0, 0, 0, 0, 0, 0, 0];
    scene.gops.truncate(1);
    scene.gops[0].frames.truncate(1);
    let gaussian = Gaussian { dc: vec![0; 3], sh: vec![0], ..Gaussian::default() };
    let unit = Unit { gaussians: vec![gaussian; 3], sh_mode: 2, codebook_ids: vec![7], ..Unit::default() };
    scene.gops[0].frames[0].units = vec![unit];
    scene
}

/// A model section in which one plane is written by `edit` and the others have one table for the token 0.
pub(super) fn section(planes: usize, plane: usize, edit: fn(&mut BitWriter)) -> Vec<u8> {
    let mut bits = BitWriter::new();
    for place in 0..planes {
        if place == plane {
            edit(&mut bits);
            continue;
        }
        bits.bits(0, 1);
        if place != POSITION && place != INDEX {
            bits.signed_exp_golomb(0);
        }
        start(&mut bits, 1, 0);
        bits.bits(0, 2);
    }
    bits.into_bytes()
}

/// direct_log2_minus2 and source_a.
pub(super) fn start(bits: &mut BitWriter, direct: u64, source: u64) {
    bits.bits(direct, 3);
    bits.bits(source, 4);
}

/// reuse 0 and bias 0, as in a signed plane.
pub(super) fn signed(bits: &mut BitWriter) {
    bits.bits(0, 1);
    bits.signed_exp_golomb(0);
}

/// reuse 0, bias 0, direct_log2 3, no contexts, and the table kind.
pub(super) fn table(bits: &mut BitWriter, kind: u64) {
    signed(bits);
    start(bits, 1, 0);
    bits.bits(kind, 2);
}

/// An explicit table: last, mode, then length and mantissa of the others.
fn explicit(bits: &mut BitWriter, last: u64, mode: u64, others: &[(i32, u64, u32)]) {
    bits.bits(last, 8);
    bits.bits(mode, 8);
    for &(delta, mantissa, width) in others {
        bits.signed_exp_golomb(delta);
        bits.bits(mantissa, width);
    }
}

pub(super) fn axis(bits: &mut BitWriter, source: u64, count: u64, first: i32, steps: &[u32]) {
    bits.bits(source, 4);
    thresholds(bits, count, first, steps);
}

fn thresholds(bits: &mut BitWriter, count: u64, first: i32, steps: &[u32]) {
    bits.bits(count - 1, 4);
    bits.signed_exp_golomb(first);
    steps.iter().for_each(|&step| bits.exp_golomb(step));
}

/// What is wrong with the model of a plane, what is written, and the error: none if it is accepted.
pub(super) type Case = (&'static str, usize, fn(&mut BitWriter), Option<(&'static str, &'static str)>);

pub(super) const CONSTRAINT: Option<(&str, &str)> = Some(("CONSTRAINT", "6.12"));
pub(super) const NUMBER: Option<(&str, &str)> = Some(("NUMBER", "5.12"));

pub(super) fn assert_models(cases: &[Case]) {
    for &(name, plane, edit, expected) in cases {
        let mut scene = zeros();
        scene.unit(0).section = Some(section(12, plane, edit));
        let script = scene.script();
        let error = decode(&script.bytes()).verdict();
        let found = error.map(|error| (error.kind.code(), error.clause));
        assert_eq!(found, expected, "{name}: {error:?}");
        let Some(error) = error.filter(|error| error.clause.ends_with(".12")) else { continue };
        assert_eq!(error.class().name(), class_of(error.kind.code()), "{name}");
        // Somewhere in the section, behind the fixed part and model_length.
        let at = script.at(script.find(Refinement, 0)) + 41;
        let end = at + scene.unit(0).section.as_ref().unwrap().len() as u64;
        assert!((at..=end).contains(&error.at), "{name}: {error} is not in {at}..={end}");
    }
}

// covers: SS-PM-002, SS-EC-001, SS-PM-006, SS-ER-005
#[test]
fn bias_direct_values_and_tokens_have_their_ranges() {
    assert_models(&[
        (
            "largest bias, and all values out of range",
            OPACITY,
            |b| {
                b.bits(0, 1);
                b.signed_exp_golomb(32767);
                start(b, 1, 0);
                b.bits(0, 2);
            },
            Some(("DIGEST", "7.9")),
        ),
        (
            "bias 32768",
            OPACITY,
            |b| {
                b.bits(0, 1);
                b.signed_exp_golomb(32768);
                start(b, 1, 0);
                b.bits(0, 2);
            },
            CONSTRAINT,
        ),
        (
            "bias -32769",
            OPACITY,
            |b| {
                b.bits(0, 1);
                b.signed_exp_golomb(-32769);
            },
            CONSTRAINT,
        ),
        (
            "direct_log2 7 of a signed plane",
            LOG_SCALE,
            |b| {
                signed(b);
                start(b, 5, 0);
                b.bits(0, 2);
            },
            None,
        ),
        (
            "direct_log2 8",
            LOG_SCALE,
            |b| {
                signed(b);
                start(b, 6, 0);
                b.bits(0, 2);
            },
            CONSTRAINT,
        ),
        (
            "direct_log2 9",
            INDEX,
            |b| {
                b.bits(0, 1);
                start(b, 7, 0);
                b.bits(0, 2);
            },
            CONSTRAINT,
        ),
        (
            "direct_log2 5 of the position plane",
            POSITION,
            |b| {
                b.bits(0, 1);
                start(b, 3, 0);
                b.bits(0, 2);
            },
            None,
        ),
        (
            "direct_log2 6 of the position plane",
            POSITION,
            |b| {
                b.bits(0, 1);
                start(b, 4, 0);
                b.bits(0, 2);
            },
            CONSTRAINT,
        ),
        (
            "last token of a signed plane",
            OPACITY,
            |b| {
                table(b, 1);
                b.bits(0, 1);
                b.bits(8 + 4 * 13 + 3, 8);
            },
            Some(("SHORT_SECTION", "8.4")),
        ),
        (
            "a token beyond it",
            OPACITY,
            |b| {
                table(b, 1);
                b.bits(0, 1);
                b.bits(8 + 4 * 13 + 4, 8);
            },
            CONSTRAINT,
        ),
        (
            "a token beyond the last of an index plane",
            INDEX,
            |b| {
                b.bits(0, 1);
                start(b, 5, 0);
                b.bits(1, 3);
                b.bits(128 + 4 * 8 + 4, 8);
            },
            CONSTRAINT,
        ),
        (
            "the last token of an index plane",
            INDEX,
            |b| {
                b.bits(0, 1);
                start(b, 5, 0);
                b.bits(1, 3);
                b.bits(128 + 4 * 8 + 3, 8);
            },
            Some(("SHORT_SECTION", "8.4")),
        ),
        (
            "a token beyond the last of the position plane",
            POSITION,
            |b| {
                b.bits(0, 1);
                start(b, 3, 0);
                b.bits(1, 3);
                b.bits(32 + 4 * 54 + 4, 8);
            },
            CONSTRAINT,
        ),
        (
            "last beyond the last token",
            OPACITY,
            |b| {
                table(b, 3);
                b.bits(64, 8);
            },
            CONSTRAINT,
        ),
        (
            "mode beyond last",
            OPACITY,
            |b| {
                table(b, 3);
                b.bits(3, 8);
                b.bits(4, 8);
            },
            CONSTRAINT,
        ),
    ]);
}

// covers: SS-PM-007, SS-EC-002, SS-PM-009
#[test]
fn tables_have_4096_slots() {
    assert_models(&[
        (
            "two tokens",
            DC_2,
            |b| {
                table(b, 3);
                explicit(b, 1, 0, &[(1, 0, 0)]);
            },
            Some(("ENTROPY_FINAL_STATE", "8.4")),
        ),
        (
            "the mode has nothing left",
            DC_2,
            |b| {
                table(b, 3);
                explicit(b, 2, 0, &[(12, 0, 3), (0, 0, 3)]);
            },
            CONSTRAINT,
        ),
        (
            "the mode has less than nothing",
            DC_2,
            |b| {
                table(b, 3);
                explicit(b, 2, 0, &[(12, 7, 3), (0, 7, 3)]);
            },
            CONSTRAINT,
        ),
        (
            "the mode has all",
            DC_2,
            |b| {
                table(b, 3);
                explicit(b, 1, 1, &[(0, 0, 0)]);
            },
            CONSTRAINT,
        ),
        (
            "last has nothing",
            DC_2,
            |b| {
                table(b, 3);
                explicit(b, 2, 0, &[(1, 0, 0), (-1, 0, 0)]);
            },
            CONSTRAINT,
        ),
        (
            "length 13",
            DC_2,
            |b| {
                table(b, 3);
                explicit(b, 1, 0, &[(13, 0, 3)]);
            },
            CONSTRAINT,
        ),
        (
            "length -1",
            DC_2,
            |b| {
                table(b, 3);
                explicit(b, 1, 0, &[(-1, 0, 3)]);
            },
            CONSTRAINT,
        ),
        (
            "a length beyond 32 bits",
            DC_2,
            |b| {
                table(b, 3);
                explicit(b, 1, 0, &[]);
                b.bits(0, 40);
            },
            NUMBER,
        ),
        ("the context before the first", DC_2, |b| table(b, 2), CONSTRAINT),
        (
            "a reference to the first table in the first context",
            DC_2,
            |b| {
                table(b, 1);
                b.bits(1, 1);
                b.bits(0, 6);
            },
            CONSTRAINT,
        ),
        (
            "a reference to a table of this context",
            DC_2,
            |b| {
                signed(b);
                b.bits(1, 3);
                axis(b, 1, 1, 1, &[]);
                b.bits(0, 4);
                b.bits(0, 2);
                b.bits(1, 2);
                b.bits(1, 1);
                b.bits(1, 6);
            },
            CONSTRAINT,
        ),
        (
            "references, tables before and tables of their own",
            DC_2,
            |b| {
                signed(b);
                b.bits(1, 3);
                axis(b, 1, 4, 1, &[0, 3, 1000]);
                b.bits(0, 4);
                b.bits(1, 3); // context 0: the single token 0
                b.bits(0, 8);
                b.bits(2, 2); // 1: as before
                b.bits(3, 2); // 2: explicit
                explicit(b, 1, 0, &[(5, 7, 3)]);
                b.bits(1 | 1 << 2, 3); // 3: table 1
                b.bits(1, 6);
                b.bits(1 | 1 << 2, 3); // 4: table 0
                b.bits(0, 6);
            },
            None,
        ),
    ]);
}
