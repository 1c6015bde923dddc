//! 5.13, 6.13, 8.4 and 8.6: blocks byte by byte.

use super::models::any_value_shapes;
use crate::crafted::expect::{assert_decodes, decode, decode_tolerant, planes};
use crate::crafted::sample;
use crate::crafted::scene::{Gaussian, Scene, Shape, Unit};
use splatstream_format::entropy::frequencies::Frequencies;
use splatstream_format::syntax::UnitType::Refinement;

const OPACITY: usize = 4;

/// Gaussians of which every value is 0, so that a block needs no word and no bit.
fn zeros(count: usize) -> Scene {
    sample::plain(vec![Gaussian { dc: vec![0; 3], ..Gaussian::default() }; count])
}

fn block(words: &[u8], states: &[u32], rest: &[u8]) -> Vec<u8> {
    let states: Vec<u8> = states.iter().flat_map(|state| state.to_le_bytes()).collect();
    [words, &states, rest].concat()
}

/// Code, clause and whether the error stands inside the payload; none if the blocks are accepted.
fn verdict(scene: &Scene) -> Option<(&'static str, &'static str)> {
    let script = scene.script();
    let bytes = script.bytes();
    let error = decode(&bytes).verdict();
    assert_eq!(decode_tolerant(&bytes).verdict(), error);
    let part = script.find(Refinement, 0);
    error.map(|error| {
        assert!((script.at(part) + 20..=script.at(part + 1)).contains(&error.at), "{error}");
        (error.kind.code(), error.clause)
    })
}

/// What is wrong with a block, its lanes and bytes, and the error.
type BlockCase = (&'static str, u8, Vec<u8>, Option<(&'static str, &'static str)>);

// covers: SS-BL-001, SS-BL-002, SS-BL-003, SS-EC-003
#[test]
fn a_block_holds_its_words_states_and_bits_and_nothing_more() {
    const S: u32 = 65536;
    let short = Some(("SHORT_SECTION", "5.13"));
    let state = Some(("ENTROPY_FINAL_STATE", "8.4"));
    let cases: [BlockCase; 15] = [
        ("as it should be", 0, block(&[0], &[S], &[]), None),
        ("no byte at all", 0, vec![], short),
        ("no state", 0, block(&[0], &[], &[]), short),
        ("half a state", 0, vec![0, 0, 0, 1], short),
        ("a state too few", 2, block(&[0], &[S; 3], &[]), short),
        ("words that are not there", 0, block(&[1], &[S], &[]), short),
        ("half a word", 0, block(&[1], &[S], &[7]), short),
        ("very many words", 0, block(&[0xFF, 0xFF, 0xFF, 0xFF, 0x0F], &[S], &[]), short),
        ("a long word_count", 0, block(&[0x80, 0], &[S], &[]), Some(("NUMBER", "5.13"))),
        ("a state below its bound", 0, block(&[0], &[S - 1], &[]), state),
        ("words that do not fit before a low state", 0, block(&[1], &[0], &[]), short),
        ("a wrong final state", 0, block(&[0], &[S + 1], &[]), state),
        (
            "a wrong state of a lane without symbols",
            3,
            block(&[0], &[S, S, S, S, S, S, S, S + 7], &[]),
            state,
        ),
        ("a word that is not taken", 0, block(&[1], &[S], &[0, 0]), state),
        ("a byte where no bits are", 0, block(&[0], &[S], &[0]), Some(("TRAILING_BYTES", "8.4"))),
    ];
    for (name, lanes_log2, bytes, expected) in cases {
        let mut scene = zeros(4);
        scene.unit(0).lanes_log2 = lanes_log2;
        scene.unit(0).blocks = Some(vec![bytes]);
        assert_eq!(verdict(&scene), expected, "{name}");
    }
}

/// The table of the example of 8.4, for the opacity.
fn example() -> Scene {
    let mut scene = zeros(4);
    for (gaussian, opacity) in scene.unit(0).gaussians.iter_mut().zip([0, 0, -1, 0]) {
        gaussian.opacity = opacity;
    }
    let table = Frequencies::with_implied(vec![8, 0, 2048], 1);
    let table = table.unwrap_or_else(|| panic!("8 + 2040 + 2048 is 4096"));
    let shape = Shape { tables: Some((vec![table], vec![0])), ..Shape::default() };
    scene.unit(0).shapes.insert(OPACITY, shape);
    scene
}

// covers: SS-EC-003, SS-EC-004
#[test]
fn the_example_of_8_4_decodes_as_it_is_written_there() {
    let mut scene = example();
    scene.unit(0).blocks = Some(vec![block(&[1], &[0x1000_0004], &[0x08, 0x02])]);
    assert_decodes("the example", &scene);
    // Without its word the process goes on with 0 and ends elsewhere.
    scene.unit(0).blocks = Some(vec![block(&[0], &[0x1000_0004], &[])]);
    assert_eq!(verdict(&scene), Some(("ENTROPY_FINAL_STATE", "8.4")));
    // Two bytes are no word if word_count does not say so.
    scene.unit(0).blocks = Some(vec![block(&[0], &[0x1000_0004], &[0x08, 0x02])]);
    assert_eq!(verdict(&scene), Some(("ENTROPY_FINAL_STATE", "8.4")));
}

/// One Gaussian whose opacity has the token 8 + 4 * 2, of values 32 to 39: three raw bits.
fn with_raw_bits(rest: &[u8]) -> Scene {
    let mut scene = zeros(1);
    // u = 32 + 5: e = -19.
    scene.unit(0).gaussians[0].opacity = -19;
    let shape = Shape { tables: Some((vec![Frequencies::single(16)], vec![0])), ..Shape::default() };
    scene.unit(0).shapes.insert(OPACITY, shape);
    scene.unit(0).blocks = Some(vec![block(&[0], &[65536], rest)]);
    scene
}

// covers: SS-BL-003, SS-EC-001, SS-EC-004
#[test]
fn raw_bits_end_with_the_last_byte_that_holds_one() {
    assert_decodes("three bits", &with_raw_bits(&[5]));
    assert_eq!(verdict(&with_raw_bits(&[5, 0])), Some(("TRAILING_BYTES", "8.4")));
    assert_eq!(verdict(&with_raw_bits(&[5 | 8])), Some(("PADDING", "8.4")));
    assert_eq!(verdict(&with_raw_bits(&[5 | 128])), Some(("PADDING", "8.4")));
    assert_eq!(verdict(&with_raw_bits(&[])), Some(("SHORT_SECTION", "8.4")));
    assert_eq!(verdict(&with_raw_bits(&[7])), Some(("DIGEST", "7.9")));
    // Bits that are missing come before a final state that is wrong.
    let mut both = with_raw_bits(&[]);
    both.unit(0).blocks = Some(vec![block(&[0], &[65537], &[])]);
    assert_eq!(verdict(&both), Some(("SHORT_SECTION", "8.4")));
}

// covers: SS-EC-006
#[test]
fn a_block_is_parsed_to_its_end_before_its_values_are_checked() {
    let out_of_range = |last_state: u32| {
        let mut scene = zeros(3);
        scene.unit(0).gaussians[1].opacity = 40_000;
        scene.unit(0).shapes = any_value_shapes(11);
        let script = scene.script();
        let payload = script.clone().payload(Refinement, 0).clone();
        (scene, payload, last_state)
    };
    let (scene, payload, _) = out_of_range(0);
    assert_eq!(verdict(&scene), Some(("OUT_OF_RANGE", "7.5")));
    // A state of the same block that is wrong is found first.
    let mut script = scene.script();
    let section =
        usize::from(payload[20]) + if payload[20] > 127 { 128 * usize::from(payload[21] - 1) + 1 } else { 0 };
    let state = 21 + section + 1 + 1;
    script.payload(Refinement, 0)[state] ^= 1;
    let error = decode(&script.bytes()).verdict().unwrap();
    assert_eq!(error.class().name(), "malformed", "{error}");
}

// covers: SS-EC-006
#[test]
fn the_error_of_the_first_wrong_block_is_reported() {
    let scene = |wrong: [bool; 3]| {
        let mut scene = sample::plain(sample::gaussians(150, 4, 3, 0));
        let mut blocks = scene.unit(0).clone();
        if wrong[0] {
            scene.unit(0).gaussians[63].opacity = 33_000;
        }
        if wrong[2] {
            scene.unit(0).gaussians[128].rotation[2] = 40_000;
        }
        let planes = splatstream_format::entropy::layout::Layout::new(
            3,
            blocks.sh_coding(&scene.gops[0].tools(&scene.gops[0].frames[0]).unwrap()),
        );
        blocks = scene.unit(0).clone();
        let models = blocks.models(planes.planes(), 6);
        let mut coded = blocks.coded_blocks(planes.planes(), &models, 6);
        if wrong[1] {
            coded[1].pop();
            coded[1].push(0xFF);
            coded[1].push(0xFF);
        }
        scene.unit(0).blocks = Some(coded);
        scene
    };
    assert_eq!(verdict(&scene([false; 3])), None);
    assert_eq!(verdict(&scene([true, true, true])), Some(("OUT_OF_RANGE", "7.5")));
    assert_eq!(verdict(&scene([false, true, true])).unwrap().1, "8.4");
    assert_eq!(verdict(&scene([false, false, true])), Some(("OUT_OF_RANGE", "7.6")));
}

// covers: SS-EC-003, SS-EC-004, SS-EC-005, SS-PO-002, SS-DG-002
#[test]
fn blocks_of_64_with_any_number_of_lanes_decode() {
    for lanes_log2 in 0..=5 {
        for count in [1, 31, 63, 64, 65, 128, 300] {
            let mut scene = sample::plain(sample::gaussians(count, count as u64, 3, 0));
            scene.unit(0).lanes_log2 = lanes_log2;
            assert_decodes(&format!("{count} Gaussians, {lanes_log2}"), &scene);
        }
    }
}

// covers: SS-PO-002
#[test]
fn codes_start_anew_in_each_block() {
    let mut scene = sample::plain(vec![Gaussian { delta: 0b100, dc: vec![0; 3], ..Gaussian::default() }; 65]);
    scene.unit(0).gaussians[1..].iter_mut().for_each(|gaussian| gaussian.delta = 0);
    let decoded = decode(&scene.bytes());
    assert_eq!(decoded.end, None);
    let z: &[i32] = &planes(&decoded.frames[0].planes)[2];
    assert_eq!((z[0], z[63], z[64]), (1, 1, 0));
    let unit: &Unit = scene.unit(0);
    assert_eq!(unit.gaussians.len().div_ceil(64), 2);
}
