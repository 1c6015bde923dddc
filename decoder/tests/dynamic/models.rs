//! 6.12: the models in force for an increment.

use crate::stream::expect::{assert_decodes, assert_refused, confined};
use crate::stream::sample::{frame, gaussian, gop};
use crate::stream::scene::{Scene, Unit};
use splatstream_format::entropy::layout::Section;
use splatstream_format::syntax::UnitType::Increment;

/// A unit with four new Gaussians, always the same.
fn new(refinement: u8) -> Unit {
    Unit { refinement, new: (1..5).map(|number| gaussian(9, number)).collect(), ..Unit::default() }
}

/// A unit whose planes of a section all say `reuse`.
fn reusing(unit: Unit, section: Section, planes: usize) -> Unit {
    let mut unit = Unit { reuse: true, ..unit };
    let bits = (0..planes).fold(vec![0; planes.div_ceil(8)], |mut bytes: Vec<u8>, plane| {
        bytes[plane / 8] |= 1 << (plane % 8);
        bytes
    });
    unit.models.insert(section, bits);
    unit
}

/// Planes of section new with three dc components and no SH.
const NEW: usize = 11;

fn parents(unit: Unit, count: usize) -> Unit {
    Unit { modes: vec![0; count], ..unit }
}

/// Two refinements of an intra frame in two layers, then a GOP of depth 1.
fn chain() -> Scene {
    let intra = vec![
        new(0),
        reusing(new(1), Section::New, NEW),
        reusing(Unit { spatial: 1, ..parents(new(0), 4) }, Section::New, NEW),
        reusing(Unit { spatial: 1, ..parents(new(1), 4) }, Section::New, NEW),
    ];
    let top = |unit: Unit| Unit { spatial: 1, ..unit };
    // Frame 1 adds nothing in unit 0: the models of section new stay in force. Frame 2 refers to frame 0.
    let first =
        frame(1, vec![top(parents(Unit::default(), 8)), top(parents(reusing(new(1), Section::New, NEW), 8))]);
    let second = frame(2, vec![top(parents(reusing(new(0), Section::New, NEW), 8)), top(parents(new(1), 8))]);
    // Frame 3 refers to frame 2, whose unit 0 has modes.
    let modes = reusing(top(parents(Unit::default(), 12)), Section::Modes, 1);
    let third = frame(3, vec![modes, top(parents(reusing(new(1), Section::New, NEW), 12))]);
    let mut scene = gop(&[50, 100], vec![frame(0, intra), first, second, third]);
    (scene.sequence.spatial_layer_count, scene.sequence.temporal_layer_count) = (2, 2);
    scene.gops[0].header.temporal_depth = 1;
    scene
}

// covers: SS-PM-010, SS-SE-001
#[test]
fn models_in_force_come_from_the_unit_below_the_layer_below_and_the_reference() {
    assert_decodes("chain", &chain());
}

// covers: SS-PM-010, SS-SE-001
#[test]
fn what_is_not_in_force_cannot_be_reused() {
    let at = |n| (Increment, n);
    assert_refused(
        &chain(),
        &[
            confined("in the first unit", "CONSTRAINT", at(0))
                .scene(|s| s.gops[0].frames[0].units[0] = reusing(new(0), Section::New, NEW)),
            confined("modes of another section", "CONSTRAINT", at(2)).scene(|s| {
                let unit = &mut s.gops[0].frames[0].units[2];
                *unit = reusing(unit.clone(), Section::Modes, 1);
            }),
            confined("a plane that was not there", "CONSTRAINT", at(1)).scene(|s| {
                let unit = &mut s.gops[0].frames[0].units[1];
                unit.header.sh_mode = 1;
                unit.new.iter_mut().for_each(|new| new.sh = vec![0, 0]);
                *unit = reusing(unit.clone(), Section::New, NEW + 2);
            }),
            // Predicted frames begin with what is after the unit 0 of their reference, not after its last unit.
            confined("updates of unit 1 of the reference", "CONSTRAINT", at(6)).scene(|s| {
                let updated = |unit: &mut Unit| {
                    unit.modes[0] = 2;
                    unit.updates = vec![gaussian(0, 1)];
                };
                let frames = &mut s.gops[0].frames;
                updated(&mut frames[0].units[3]);
                let unit = &mut frames[2].units[0];
                updated(unit);
                *unit = reusing(unit.clone(), Section::Updates, NEW - 1);
            }),
        ],
    );
}

// covers: SS-PM-010
#[test]
fn a_later_gop_begins_without_models() {
    let mut scene = chain();
    scene.gops.push(scene.gops[0].clone());
    scene.gops[1].header.gop_index = 1;
    scene.sequence.frame_count = 8;
    assert_decodes("two GOPs", &scene);
    let case = confined("in the second GOP", "CONSTRAINT", (Increment, 10))
        .scene(|s| s.gops[1].frames[0].units[0] = reusing(new(0), Section::New, NEW));
    assert_refused(&scene, &[case]);
}
