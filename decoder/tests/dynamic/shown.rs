//! 7.18: what a frame shows at each refinement, with numbers found by hand.

use crate::crafted::expect::{decode_with, planes};
use crate::crafted::scene::Gaussian;
use crate::stream::draw::{codebooks, morton};
use crate::stream::expect::{assert_decodes, point};
use crate::stream::sample::{frame, gop};
use crate::stream::scene::{Scene, Unit};
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::decode_stream_inside;
use splatstream_format::syntax::{GopHeader, IncrementHeader, UnitType};
use std::ops::ControlFlow;

/// A Gaussian at x with this opacity and log-scale.
fn one(x: i64, value: i64) -> Gaussian {
    Gaussian {
        delta: morton([x, 0, 0], 10),
        log_scale: [value, 0, 0],
        opacity: value,
        dc: vec![0; 3],
        ..Gaussian::default()
    }
}

fn compensated(log_scale: i8, opacity: i8) -> IncrementHeader {
    IncrementHeader {
        compensation_log_scale: log_scale,
        compensation_opacity: opacity,
        ..IncrementHeader::PLAIN
    }
}

/// Three homes of one Gaussian; a frame that adds one to each of its homes.
fn scene() -> Scene {
    let intra = (0..3).map(|r| Unit {
        refinement: r,
        header: compensated(-128, 127),
        new: vec![one(10 * i64::from(r), 32_700 - 65_400 * i64::from(r % 2))],
        ..Unit::default()
    });
    let predicted = (0..3).map(|r| Unit {
        refinement: r,
        header: compensated(100 - 50 * r as i8, -3),
        modes: vec![0],
        new: vec![one(500, 32_760)],
        ..Unit::default()
    });
    gop(&[33, 66, 100], vec![frame(0, intra.collect()), frame(1, predicted.collect())])
}

/// Opacities and log-scales of a frame at a refinement, as they are output.
fn output(scene: &Scene, place: usize, refinement: u8, subset: bool) -> [Vec<i32>; 2] {
    let operating_point = point(3, 3, refinement);
    let decoded = decode_with(&scene.bytes(), &Options { operating_point, subset, ..Options::default() });
    let shown = planes(&decoded.frames[place].clone().into_shown());
    [shown[6].clone(), shown[3].clone()]
}

// covers: SS-CA-002, SS-CA-003
#[test]
fn compensation_is_for_what_is_exact_and_was_not_in_the_intra_frame() {
    let scene = scene();
    assert_decodes("compensation", &scene);
    // Exact: the parent as it is, the new one less 3 and up to the largest value; then the carried ones.
    assert_eq!(
        output(&scene, 1, 0, false),
        [[32_700, 32_757, -32_700, 32_700], [32_700, 32_767, -32_700, 32_700]]
    );
    assert_eq!(output(&scene, 1, 0, true), [[32_697, 32_757], [32_767, 32_767]]);
    let second =
        [vec![32_700, 32_757, -32_700, 32_757, 32_700], vec![32_700, 32_767, -32_700, 32_767, 32_700]];
    assert_eq!(output(&scene, 1, 1, false), second);
    // Nothing is missing at the last refinement.
    let all = vec![32_700, 32_760, -32_700, 32_760, 32_700, 32_760];
    assert_eq!(output(&scene, 1, 2, false), [all.clone(), all]);
    // The intra frame of a predicted GOP is complete at any refinement.
    assert_eq!(output(&scene, 0, 0, false), [[32_700, -32_700, 32_700]; 2]);
}

// covers: SS-CA-003
#[test]
fn an_intra_frame_that_is_not_complete_is_compensated_as_a_whole() {
    let mut scene = scene();
    scene.gops[0].frames.truncate(1);
    scene.gops[0].header = GopHeader::intra(0, 1);
    scene.sequence.frame_count = 1;
    assert_decodes("intra", &scene);
    assert_eq!(output(&scene, 0, 0, false), [[32_767], [32_572]]);
    assert_eq!(output(&scene, 0, 1, false), [[32_767, -32_573], [32_572, -32_768]]);
    assert_eq!(output(&scene, 0, 2, false), [[32_700, -32_700, 32_700]; 2]);
}

// covers: SS-BS-008, SS-GH-001, SS-GH-004
#[test]
fn decoding_can_start_at_any_gop_which_defines_all_it_needs() {
    let mut scene = scene();
    let again = |index: u32, frames: usize| {
        let mut gop = scene.gops[0].clone();
        gop.header = GopHeader { gop_index: index, ..GopHeader::predicted(0, frames as u32, 0) };
        gop.frames.truncate(frames);
        gop
    };
    let (second, third) = (again(1, 1), again(2, 2));
    scene.gops.extend([second, third]);
    scene.sequence.frame_count = 5;
    assert_decodes("three GOPs", &scene);
    let script = scene.script();
    let bytes = script.bytes();
    let whole = decode_with(&bytes, &Options::default()).frames;
    for (n, first) in [(0, 0), (1, 2), (2, 3)] {
        let mut frames = Vec::new();
        let at = script.at(script.find(UnitType::GopHeader, n));
        let summary = decode_stream_inside(&bytes, at, &Options::default(), |_, frame| {
            frames.push(frame);
            ControlFlow::Continue(())
        });
        assert_eq!((summary.end, &frames[..]), (None, &whole[first..]));
    }
    // Definitions of the GOP before are gone.
    scene.gops[1].frames[0].codebooks.clear();
    let header = &mut scene.gops[1].frames[0].units[0].header;
    (header.sh_mode, header.vq_stage_count, header.codebook_ids) = (2, 1, [7, 255, 255, 255]);
    scene.gops[1].frames[0].units[0].new[0].sh = vec![0];
    let error = decode_with(&scene.bytes(), &Options::default()).verdict().unwrap();
    assert_eq!(error.kind.code(), "UNDEFINED");
    scene.gops[1].frames[0].codebooks = codebooks(2);
    assert_eq!(decode_with(&scene.bytes(), &Options::default()).verdict(), None);
}
