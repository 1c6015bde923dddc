//! 7.20: every unit lost in turn, by damage or for good, at several operating points.

use crate::random::plans;
use crate::stream::draw::Plan;
use crate::stream::expect::{ALL, point, points};
use crate::stream::scene::{Gop, Scene};
use crate::stream::shown::{Place, Receiver};
use splatstream_format::syntax::GopHeader;
use std::collections::BTreeSet;

/// Every increment of a scene.
fn places(scene: &Scene) -> Vec<Place> {
    let mut first = 0;
    let mut all = Vec::new();
    for gop in &scene.gops {
        for frame in &gop.frames {
            let number = first + frame.place;
            all.extend(frame.units.iter().map(|unit| (number, unit.spatial, unit.refinement)));
        }
        first += gop.header.gop_frame_count;
    }
    all
}

fn damaged(places: &[Place]) -> Receiver {
    Receiver { damaged: places.iter().copied().collect(), ..Receiver::at(ALL) }
}

fn missing(places: &[Place]) -> Receiver {
    Receiver { missing: places.iter().copied().collect(), ..Receiver::at(ALL) }
}

fn lossy_plans() -> Vec<Plan> {
    plans().into_iter().filter(|plan| [3, 4, 5, 7, 11].contains(&plan.seed)).collect()
}

// covers: SS-LO-001, SS-LO-002, SS-LO-003, SS-LO-004, SS-LO-005, SS-BS-006, SS-BS-012, SS-CA-001, SS-CA-002, SS-ER-008
#[test]
fn whichever_unit_is_lost_the_frames_are_those_of_the_reference() {
    for plan in lossy_plans() {
        let scene = plan.scene();
        let script = scene.script();
        let all = places(&scene);
        for &place in &all {
            damaged(&[place]).assert_shows("damaged", &scene, &script);
            missing(&[place]).assert_shows("missing", &scene, &script);
        }
        for pair in all.windows(2).step_by(5) {
            damaged(pair).assert_shows("two damaged", &scene, &script);
            missing(pair).assert_shows("two missing", &scene, &script);
        }
    }
}

// covers: SS-BS-011, SS-OP-007, SS-CA-003
#[test]
fn losses_at_an_operating_point_and_of_subsets_show_what_the_reference_shows() {
    for plan in lossy_plans().into_iter().skip(1) {
        let scene = plan.scene();
        let script = scene.script();
        for place in places(&scene).into_iter().step_by(3) {
            for at in [point(3, 1, 1), point(0, 0, 0), point(3, 0, 9)] {
                let receiver = Receiver { point: at, ..damaged(&[place]) };
                receiver.assert_shows("damaged", &scene, &script);
            }
            let receiver = Receiver { subset: true, ..missing(&[place]) };
            receiver.assert_shows("subset", &scene, &script);
        }
    }
}

/// One GOP of two layers and three refinements: I, then predicted frames.
fn scene(seed: u64, header: GopHeader) -> Scene {
    let plan = Plan {
        seed,
        layers: (2, 2),
        percents: vec![20, 50, 100],
        sh: false,
        gaussians: 30,
        gops: vec![(header, (0..header.gop_frame_count).collect())],
        short: false,
        learned: false,
    };
    plan.scene()
}

/// Refinements shown of each frame.
fn levels(receiver: &Receiver, scene: &Scene) -> Vec<u8> {
    receiver.assert_shows("levels", scene, &scene.script());
    receiver.shown(scene).iter().map(|frame| frame.refinements).collect()
}

// covers: SS-LO-002, SS-LO-003
#[test]
fn the_example_of_7_20_2_falls_to_the_level_of_the_lost_unit_until_the_next_gop() {
    let header = GopHeader::predicted(0, 4, 0);
    let mut scene = scene(11, header);
    let second = Gop { header: GopHeader { gop_index: 1, ..header }, ..scene.gops[0].clone() };
    scene.gops.push(second);
    scene.sequence.frame_count = 8;
    assert_eq!(levels(&damaged(&[(1, 1, 2)]), &scene), [3, 2, 2, 2, 3, 3, 3, 3]);
    assert_eq!(levels(&damaged(&[(1, 1, 2), (3, 1, 1)]), &scene), [3, 2, 2, 1, 3, 3, 3, 3]);
    // What is above the level of the reference is not looked at: damage there is nothing new.
    let receiver = damaged(&[(1, 1, 2), (2, 1, 2)]);
    assert_eq!(levels(&receiver, &scene), [3, 2, 2, 2, 3, 3, 3, 3]);
    let lost: Vec<bool> = receiver.shown(&scene).iter().map(|frame| frame.lost).collect();
    assert_eq!(lost, [false, true, false, false, false, false, false, false]);
    // An intra frame that is not complete freezes its GOP and nothing else.
    assert_eq!(levels(&damaged(&[(0, 1, 2)]), &scene), [3, 0, 0, 0, 3, 3, 3, 3]);
    assert_eq!(levels(&damaged(&[(0, 0, 1)]), &scene), [1, 0, 0, 0, 3, 3, 3, 3]);
    assert_eq!(levels(&missing(&[(1, 1, 0)]), &scene), [3, 0, 0, 0, 3, 3, 3, 3]);
}

// covers: SS-LO-004, SS-LO-005
#[test]
fn a_frozen_frame_shows_its_reference_with_the_compensation_that_stood_there() {
    let mut scene = scene(12, GopHeader::predicted(0, 5, 1));
    for unit in scene.gops[0].frames.iter_mut().flat_map(|frame| &mut frame.units) {
        unit.header.compensation_log_scale = 7;
        unit.header.compensation_opacity = -128;
    }
    // Frame 0 is shown at refinement 1; 1 and 2 refer to it, 3 and 4 to 2.
    let receiver = damaged(&[(0, 0, 2)]);
    assert_eq!(levels(&receiver, &scene), [2, 0, 0, 0, 0]);
    let shown = receiver.shown(&scene);
    assert!(shown.iter().all(|frame| frame.output == shown[0].output && frame.output != frame.planes));
    // A frame that is absent has nothing to show.
    let mut gap = scene.clone();
    gap.gops[0].frames.remove(2);
    assert_eq!(levels(&damaged(&[]), &gap), [3, 3, 0, 0]);
    assert!(damaged(&[]).shown(&gap)[2].planes.iter().all(Vec::is_empty));
}

// covers: SS-LO-001, SS-BS-012
#[test]
fn a_layer_that_is_not_complete_leaves_the_lower_one() {
    let mut scene = crate::stream::draw::Plan {
        seed: 13,
        layers: (4, 1),
        percents: vec![20, 50, 100],
        sh: false,
        gaussians: 40,
        gops: vec![(GopHeader::intra(0, 1), vec![0])],
        short: false,
        learned: false,
    }
    .scene();
    scene.gops[0].frames[0].count = Some(40);
    let full = scene.gops[0].frames[0].units.clone();
    // Units of each layer; they do not grow from layer to layer.
    for counts in [
        [3, 2, 2, 1],
        [3, 3, 2, 2],
        [3, 1, 1, 1],
        [2, 2, 2, 1],
        [3, 3, 3, 0],
        [2, 2, 1, 0],
        [1, 1, 1, 1],
        [3, 2, 1, 0],
    ] {
        let is_there = |unit: &&_| {
            let unit: &crate::stream::scene::Unit = unit;
            unit.refinement < counts[usize::from(unit.spatial)]
        };
        scene.gops[0].frames[0].units = full.iter().filter(is_there).cloned().collect();
        scene.points = Some(points(&scene));
        let receiver = damaged(&[]);
        let shown = receiver.shown(&scene);
        assert_eq!((shown[0].refinements, shown[0].lost), (counts[0], false), "{counts:?}");
        receiver.assert_shows(&format!("{counts:?}"), &scene, &scene.script());
    }
}

// covers: SS-BS-006, SS-ER-008, SS-LO-005
#[test]
fn the_end_of_the_data_and_fatal_errors_end_a_frame_without_an_error_of_its_own() {
    let scene = scene(14, GopHeader::predicted(0, 3, 0));
    let bytes = scene.bytes();
    let script = scene.script();
    let receiver = Receiver { damaged: BTreeSet::from([(0, 1, 1)]), ..Receiver::at(ALL) };
    for part in 9..script.parts.len() - 1 {
        let decoded =
            crate::crafted::expect::decode_with(&bytes[..script.at(part) as usize], &receiver.options());
        assert_eq!(decoded.end.unwrap().kind.code(), "TRUNCATED");
        assert!(decoded.frames.iter().all(|frame| frame.lost.is_none()), "part {part}");
    }
}
