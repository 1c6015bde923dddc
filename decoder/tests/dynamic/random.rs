//! Scenes by dice: every mode, shift, layer, predictor and structure, at every operating point.

use crate::crafted::expect::decode_with;
use crate::stream::draw::Plan;
use crate::stream::expect::assert_decodes;
use crate::stream::scene::Scene;
use splatstream_decoder::process::{DecodedFrame, Options};
use splatstream_format::syntax::GopHeader;
use std::collections::BTreeSet;

pub(crate) fn plans() -> Vec<Plan> {
    let plan = |seed, layers, percents: &[u8], sh, gaussians, gops: &[(GopHeader, &[u32])]| Plan {
        seed,
        layers,
        percents: percents.to_vec(),
        sh,
        gaussians,
        gops: gops.iter().map(|(header, places)| (*header, places.to_vec())).collect(),
        short: seed % 2 == 1,
        learned: false,
    };
    let learned = |plan| Plan { learned: true, ..plan };
    let all = |count: u32, depth: u8| (GopHeader::predicted(0, count, depth), (0..count).collect::<Vec<_>>());
    let (p3, places3) = all(4, 0);
    let (b1, places5) = all(5, 1);
    let ((b2, places6), (b3, places9)) = (all(6, 2), all(9, 3));
    let second = |header: GopHeader| GopHeader { gop_index: 1, ..header };
    let (i2, one) = (GopHeader::intra(0, 2), all(1, 0).0);
    vec![
        plan(2, (1, 1), &[20, 50, 100], true, 20, &[(p3, &places3)]),
        plan(3, (2, 2), &[30, 100], false, 40, &[(b1, &places5), (second(p3), &places3)]),
        plan(4, (2, 3), &[10, 40, 70, 100], true, 30, &[(b2, &places6)]),
        plan(5, (3, 4), &[50, 60, 100], true, 90, &[(b3, &places9)]),
        plan(6, (1, 4), &[100], true, 200, &[(b3, &[0, 1, 4, 6, 8])]),
        plan(7, (4, 1), &[1, 2, 100], false, 150, &[(i2, &[0, 1]), (second(p3), &[0, 1])]),
        plan(8, (2, 2), &[50, 100], true, 0, &[(b1, &places5)]),
        plan(9, (1, 1), &[40, 100], true, 5, &[(one, &[0]), (second(p3), &places3)]),
        learned(plan(10, (1, 1), &[20, 50, 100], true, 25, &[(p3, &places3)])),
        learned(plan(11, (2, 2), &[30, 100], true, 20, &[(b1, &places5), (second(p3), &places3)])),
        learned(plan(12, (3, 1), &[40, 100], false, 40, &[(i2, &[0, 1]), (second(p3), &[0, 1])])),
    ]
}

// covers: SS-PA-001, SS-PA-004, SS-DG-004, SS-DG-005, SS-DG-006, SS-PR-001, SS-PR-004, SS-CA-001, SS-CA-002, SS-CA-003
// covers: SS-PM-010, SS-OP-006, SS-OP-007, SS-BS-009, SS-BS-010, SS-BS-012, SS-LO-002
#[test]
fn scenes_by_dice_decode_to_the_frames_of_the_reference_at_every_operating_point() {
    for plan in plans() {
        assert_decodes(&format!("seed {}", plan.seed), &plan.scene());
    }
}

// covers: SS-TR-001, SS-TR-002, SS-TR-003, SS-TR-004, SS-TR-005, SS-TR-006, SS-TR-007, SS-TR-008, SS-TR-009, SS-WT-004
#[test]
fn whatever_the_network_the_frames_are_those_of_the_reference() {
    for seed in 100..160 {
        let plan = Plan {
            seed,
            layers: (1, 1),
            percents: vec![50, 100],
            sh: seed % 4 > 0,
            gaussians: 16,
            gops: vec![(GopHeader::predicted(0, 3, 0), vec![0, 1, 2])],
            short: false,
            learned: true,
        };
        assert_decodes(&format!("seed {seed}"), &plan.scene());
    }
}

#[test]
fn digests_change_nothing_but_what_is_refused() {
    let scene = plans()[3].scene();
    let shown = |verify, subset| {
        let options = Options { verify, subset, ..Options::default() };
        let frames = decode_with(&scene.bytes(), &options).frames;
        frames.into_iter().map(DecodedFrame::into_shown).collect::<Vec<_>>()
    };
    assert_eq!(shown(true, false), shown(false, false));
    assert_eq!(shown(true, true), shown(false, true));
}

/// Modes of a scene, and predictors.
fn used(scene: &Scene) -> [BTreeSet<i64>; 2] {
    let units = || scene.gops.iter().flat_map(|gop| &gop.frames).flat_map(|frame| &frame.units);
    [
        units().flat_map(|unit| unit.modes.clone()).collect(),
        units().flat_map(|unit| unit.predictors.clone()).collect(),
    ]
}

#[test]
fn the_dice_fall_on_every_mode_predictor_and_on_sections_of_several_blocks() {
    let scenes: Vec<Scene> = plans().iter().map(Plan::scene).collect();
    let all =
        |which: usize| scenes.iter().flat_map(|scene| used(scene)[which].clone()).collect::<BTreeSet<_>>();
    assert_eq!((all(0), all(1)), ((0..5).collect(), (0..4).collect()));
    let units = || {
        scenes.iter().flat_map(|scene| &scene.gops).flat_map(|gop| &gop.frames).flat_map(|frame| &frame.units)
    };
    assert!(units().any(|unit| unit.moves.len() > 64 && unit.updates.len() > 64 && unit.new.len() < 64));
    assert!(units().any(|unit| unit.new.len() > 128));
    assert!(units().any(|unit| unit.modes.is_empty() && unit.new.is_empty()));
    let shifts: BTreeSet<u8> = units().flat_map(|unit| unit.header.attribute_shift).collect();
    assert_eq!(shifts, (0..4).collect());
    assert_eq!(units().map(|unit| unit.header.sh_mode).collect::<BTreeSet<_>>(), (0..3).collect());
}
