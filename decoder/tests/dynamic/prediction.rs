//! 7.17: neighbours and means, with numbers found by hand.

use crate::crafted::expect::{decode, planes};
use crate::crafted::scene::Gaussian;
use crate::stream::draw::morton;
use crate::stream::expect::assert_decodes;
use crate::stream::prediction::EXP;
use crate::stream::sample::{frame, gop, predicting, unit};
use crate::stream::scene::{Scene, Unit};
use splatstream_format::syntax::IncrementHeader;

/// Gaussians along x, each with its opacity and nothing else.
pub(crate) fn line(points: &[(i64, i64)]) -> Vec<Gaussian> {
    let mut before = 0;
    let mut one = |&(x, opacity): &(i64, i64)| {
        let code = morton([x, 0, 0], 10);
        let delta = code - before;
        before = code;
        Gaussian { delta, opacity, dc: vec![0; 3], ..Gaussian::default() }
    };
    points.iter().map(&mut one).collect()
}

/// A line, to which a frame adds Gaussians without residuals, one predictor for each.
pub(crate) fn scene(known: &[(i64, i64)], new: &[i64], predictor: i64, header: IncrementHeader) -> Scene {
    let new: Vec<(i64, i64)> = new.iter().map(|&x| (x, 0)).collect();
    let first = Unit { new: line(known), ..Unit::default() };
    let second = Unit {
        header,
        modes: vec![0; known.len()],
        predictors: vec![predictor; new.len()],
        new: line(&new),
        ..Unit::default()
    };
    gop(&[100], vec![frame(0, vec![first]), frame(1, vec![second])])
}

/// The opacities of the last Gaussians that are shown.
fn opacities(scene: &Scene, count: usize) -> Vec<i32> {
    assert_decodes("by hand", scene);
    let planes = planes(&decode(&scene.bytes()).frames.last().unwrap().planes);
    planes[6][planes[6].len() - count..].to_vec()
}

// covers: SS-PR-004, SS-PR-005
#[test]
fn knn_takes_the_nearest_of_equals_the_first_and_weighs_by_distance() {
    type Line<'a> = &'a [(i64, i64)];
    let cases: [(Line<'_>, u8, i32); 9] = [
        // The nearest alone.
        (&[(5, 10), (12, 20), (30, 30)], 1, 20),
        // At the same distance, the one of smaller index.
        (&[(8, 10), (12, 20)], 1, 10),
        // Weights 2^16 and 2^16: halves go up, of negative numbers too.
        (&[(8, 10), (12, 21)], 2, 16),
        (&[(8, -10), (12, -21)], 2, -15),
        // D2 is 4 and 9: weights 65536 and 65536 * 5 / 10.
        (&[(8, 30), (13, 60)], 2, 40),
        // A neighbour in the place itself decides alone, the first of two.
        (&[(9, 77), (10, 5), (10, 6)], 16, 5),
        // Fewer than K: all of them.
        (&[(8, 7), (12, 9)], 16, 8),
        // D2 is 1 and 1000000: weights 131072 and 1.
        (&[(9, 0), (1010, 32_767)], 2, 0),
        (&[(0, -32_768), (20, -32_768)], 2, -32_768),
    ];
    for (known, neighbours, expected) in cases {
        let scene = scene(known, &[10], 1, predicting(neighbours));
        assert_eq!(opacities(&scene, 1), [expected], "{known:?}");
    }
}

// covers: SS-PR-006, SS-PR-004
#[test]
fn bilateral_weighs_every_neighbour_even_one_in_the_place_itself() {
    let header = |spatial, feature| IncrementHeader {
        bilateral_spatial: spatial,
        bilateral_feature: feature,
        ..predicting(2)
    };
    let two = [(10, 100), (14, 200)];
    assert_eq!(opacities(&scene(&two, &[10], 2, header(0, 0)), 1), [150]);
    // D2 is 0 and 16: 16 * 34 / 17 is 32, so the weights are 4096 and 1507.
    assert_eq!(opacities(&scene(&two, &[10], 2, header(34, 0)), 1), [127]);
    // With the largest weights the far one still counts 1 in 4097: 16 * 255 / 17 is 240, EXP is 2.
    assert_eq!(EXP[240], 2);
    assert_eq!(opacities(&scene(&[(10, 0), (14, 32_767)], &[10], 2, header(255, 0)), 1), [16]);
    // What differs in log-scale counts less: (16 * 16) * 8 / 64 is 32.
    let mut unlike = scene(&two, &[12], 2, header(0, 8));
    unlike.gops[0].frames[0].units[0].new[1].log_scale = [16, 16, 0];
    unit(&mut unlike).new[0].log_scale = [-8, -8, 0];
    assert_eq!(opacities(&unlike, 1), [127]);
}

// covers: SS-PR-007
#[test]
fn the_table_of_the_reference_is_that_of_the_text() {
    assert_eq!((EXP.len(), EXP[0], EXP[32], EXP[255]), (256, 4096, 1507, 1));
    let same = |(here, text): (&u16, &i64)| i64::from(*here) == *text;
    assert!(splatstream_decoder::predictor::EXP.iter().zip(EXP.iter()).all(same));
}

// covers: SS-PR-001, SS-PR-004
#[test]
fn the_reference_set_of_a_predicted_frame_has_parents_the_intra_frame_and_what_units_before_added() {
    let one = |refinement, x, opacity| Unit { refinement, new: line(&[(x, opacity)]), ..Unit::default() };
    let intra = vec![one(0, 100, 1), one(1, 200, 2), one(2, 300, 3)];
    let add = |refinement, mode, places: &[i64]| Unit {
        refinement,
        header: predicting(1),
        modes: vec![mode],
        predictors: vec![1; places.len()],
        new: line(&places.iter().map(|&x| (x, 0)).collect::<Vec<_>>()),
        ..Unit::default()
    };
    // Unit 0 finds its parent, which it removes, and homes 1 and 2 of the intra frame.
    let first = frame(1, vec![add(0, 4, &[90, 210, 290]), add(1, 0, &[]), add(2, 0, &[])]);
    // Unit 1 of the frame after finds the parents of home 0 and what unit 0 of its own frame added, at 500.
    let mut second = frame(2, vec![add(0, 0, &[500]), add(1, 4, &[95, 490]), add(2, 0, &[])]);
    second.units[0].modes = vec![0; 3];
    second.units[0].predictors = vec![0];
    second.units[0].new[0].opacity = 50;
    let mut scene = gop(&[33, 66, 100], vec![frame(0, intra), first, second]);
    assert_decodes("reference sets", &scene);
    let shown = |scene: &Scene, at: usize| planes(&decode(&scene.bytes()).frames[at].planes)[6].clone();
    assert_eq!(shown(&scene, 1), [1, 2, 3, 2, 3]);
    assert_eq!(shown(&scene, 2), [1, 2, 3, 50, 1, 50, 3]);
    // The parents take part as the cells displace them, before moves and updates.
    let moved = &mut scene.gops[0].frames[1].units[0];
    moved.cells = vec![crate::stream::cells::Cell { translation: [-400, 0, 0], ..Default::default() }];
    moved.header.cell_log2 = 7;
    moved.new = line(&[(50, 0), (110, 0)]);
    moved.predictors = vec![1; 2];
    scene.gops[0].frames.truncate(2);
    (scene.gops[0].header.gop_frame_count, scene.sequence.frame_count) = (2, 2);
    assert_decodes("displaced", &scene);
    assert_eq!(shown(&scene, 1), [1, 1, 2, 3]);
}

// covers: SS-PR-001, SS-PR-003
#[test]
fn the_reference_set_of_an_intra_frame_has_lower_homes_and_parents_as_they_are_changed() {
    let mut first = Unit { header: predicting(3), new: line(&[(10, 30), (20, 7)]), ..Unit::default() };
    // There is nothing to predict from: predictors of unit (0, 0) are read and not used.
    first.predictors = vec![2, 1];
    let second = Unit {
        header: predicting(1),
        refinement: 1,
        new: line(&[(11, 0), (21, 0)]),
        predictors: vec![1, 1],
        ..Unit::default()
    };
    let mut upper = Unit { spatial: 1, modes: vec![3, 0], moves: vec![[5, 0, 0]], ..first.clone() };
    upper.updates = vec![Gaussian { opacity: 100, dc: vec![0; 3], ..Gaussian::default() }];
    (upper.header, upper.predictors, upper.new) = (predicting(1), vec![1], line(&[(15, 0)]));
    let last = Unit {
        spatial: 1,
        refinement: 1,
        modes: vec![0; 2],
        header: predicting(1),
        predictors: vec![1],
        new: line(&[(14, 0)]),
        ..Unit::default()
    };
    let mut scene = gop(&[50, 100], vec![frame(0, vec![first, second, upper, last])]);
    scene.sequence.spatial_layer_count = 2;
    assert_decodes("intra", &scene);
    let shown = planes(&decode(&scene.bytes()).frames[0].planes)[6].clone();
    assert_eq!(shown, [130, 7, 130, 30, 7, 130]);
}

// covers: SS-PR-003, SS-PR-002
#[test]
fn a_run_of_new_gaussians_shares_a_predictor_and_255_is_none() {
    let mut scene = scene(&[(0, 40)], &[10, 20, 30, 40, 50], 1, predicting(1));
    for (log2, predictors, expected) in [
        (0, vec![1, 0, 2, 0, 1], [40, 0, 40, 0, 40]),
        (1, vec![1, 0, 2], [40, 40, 0, 0, 40]),
        (2, vec![0, 1], [0, 0, 0, 0, 40]),
        (16, vec![2], [40; 5]),
        (255, vec![], [0; 5]),
    ] {
        unit(&mut scene).header.predictor_block_log2 = log2;
        unit(&mut scene).predictors = predictors;
        assert_eq!(opacities(&scene, 5), expected, "{log2}");
    }
}
