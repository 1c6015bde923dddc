//! Where prediction might fail: each case by name, with what comes of it.

use crate::common::closeness::{Bounds, assert_close, namings, renamed};
use crate::common::dynamic::{Whole, coded, predicted, quick, scene};
use crate::common::{encoded, frame_of};
use splatstream_encoder::{
    Error, PredictorChoice, Predictors, Quality, Report, Settings, ShChoice, Steps, Tools, encode,
};
use splatstream_files::builtin::Tracking;
use splatstream_format::syntax::FrameType;
use splatstream_gaussians::{GaussianFrame, Planes, sh_coefficients};

/// Encodes with one temporal layer and looks at every decoded frame.
fn close(frames: &[GaussianFrame], what: &str) -> Report {
    let predictor_choice = PredictorChoice::Difference;
    let tools = Tools::default();
    close_with(frames, &Settings { predictor_choice, tools, ..predicted(1) }, what)
}

fn close_with(frames: &[GaussianFrame], settings: &Settings, what: &str) -> Report {
    let (bytes, report) = coded(frames, settings, what);
    let whole = Whole::new(&bytes);
    for (frame, source) in whole.all().iter().zip(frames) {
        let what = format!("{what}: frame {}", frame.index);
        assert_close(source, &frame.planes, &whole.sequence, Bounds::PREDICTED, &what);
    }
    report
}

fn types(report: &Report) -> Vec<FrameType> {
    report.coded.iter().map(|frame| frame.frame_type).collect()
}

/// The frame with some of its planes changed.
fn changed(frame: &GaussianFrame, change: impl FnOnce(&mut Planes)) -> GaussianFrame {
    let mut planes = frame.clone().into_planes();
    change(&mut planes);
    GaussianFrame::from_planes(frame.sh_degree(), planes).unwrap()
}

fn still(gaussians: u32, sh_degree: u8) -> GaussianFrame {
    scene(gaussians, 1, sh_degree, Tracking::Tracked).remove(0)
}

#[test]
fn an_empty_frame_is_shown_empty_and_others_are_not() {
    let (full, empty) = (still(100, 1), still(100, 1).select(&[]));
    for order in [vec![&full, &empty, &full, &full], vec![&empty, &empty, &full], vec![&full, &full, &empty]]
    {
        let frames: Vec<GaussianFrame> = order.into_iter().cloned().collect();
        close(&frames, "an empty frame");
    }
}

#[test]
fn values_too_far_out_are_named_whatever_their_frame_and_others_are_carried_in_every_layer() {
    let calm = still(60, 1);
    let loud = |opacity: f32, scale: f32| {
        changed(&calm, |planes| {
            planes.opacity_logit[7] = opacity;
            planes.log_scale.iter_mut().zip([scale, 0.0, -scale]).for_each(|(plane, value)| plane[7] = value);
        })
    };
    let settings = Settings { spatial_layers: 4, ..predicted(2) };
    let Steps { log_scale, opacity, .. } = settings.steps;
    for frames in [[&calm, &loud(32_100.0 * opacity, 1.0)], [&loud(1.0, 16_100.0 * log_scale), &calm]] {
        let mut frames: Vec<GaussianFrame> = frames.into_iter().cloned().collect();
        let number = u32::from(frames[0] == calm);
        let error = encode(&mut frames, &settings, &mut Vec::new(), &mut |_, _| {}).unwrap_err();
        let Error::OutOfGrid { frame, attribute, row, .. } = error else { panic!("{error}") };
        assert_eq!((frame, attribute, row), (number, ["log_scale", "opacity"][number as usize], 7));
    }
    let loudest = loud(-31_990.0 * opacity, 15_990.0 * log_scale);
    for frames in [[loudest.clone(), calm.clone()], [calm, loudest]] {
        coded(&frames, &settings, "far out");
    }
}

#[test]
fn one_gaussian_goes_on_and_costs_little() {
    let one = scene(1, 5, 3, Tracking::Tracked);
    let report = close(&one, "one Gaussian");
    assert_eq!(types(&report)[1..], [FrameType::Predicted; 4]);
    assert!(report.coded.iter().all(|frame| frame.gaussians == 1 && frame.removed == 0));
}

#[test]
fn fewer_references_than_neighbours_still_predict() {
    let all = still(100, 0);
    for known in 1..=8 {
        let few = all.select(&(0..known).collect::<Vec<_>>());
        let more = all.select(&(0..2 * known).collect::<Vec<_>>());
        let report = close(&[few, more.clone(), more], &format!("{known} references"));
        assert_eq!(types(&report)[1], FrameType::Predicted, "{known} references");
        assert_eq!((report.coded[1].new, report.coded[1].removed), (known, 0));
    }
}

#[test]
fn all_at_one_point_stay_at_one_grid_point() {
    let point = |t: f32| {
        changed(&still(120, 1), |planes| planes.position = [1.0, 2.0 + t, -3.0].map(|value| vec![value; 120]))
    };
    close(&[point(0.0), point(0.0), point(0.0)], "one point");
}

/// All steps of a grid that holds one point in each frame and its way in 20 bits.
#[test]
fn one_point_that_moves_across_the_grid_is_found_again() {
    let point = |t: f32| {
        changed(&still(120, 1), |planes| planes.position = [1.0, 2.0 + t, -3.0].map(|value| vec![value; 120]))
    };
    close(&[point(0.0), point(1.0), point(1.5)], "one point that moves");
}

#[test]
fn a_scene_that_jumps_further_than_its_size_is_found_again() {
    let frame = still(300, 0);
    let at = |t: f32| changed(&frame, |planes| planes.position[0].iter_mut().for_each(|x| *x += 15.0 * t));
    let tools = Tools::default();
    let settings = Settings { steps: Quality::High.steps(), tools, ..predicted(1) };
    close_with(&[at(0.0), at(1.0), at(0.0)], &settings, "a jump");
}

#[test]
fn ties_are_broken_the_same_way_by_both_sides() {
    let twice = |frame: &GaussianFrame| {
        let count = frame.len() as u32;
        frame.select(&(0..count).chain(0..count).collect::<Vec<_>>())
    };
    for tracking in [Tracking::Tracked, Tracking::Untracked] {
        let frames: Vec<GaussianFrame> = scene(100, 4, 0, tracking).iter().map(twice).collect();
        close(&frames, "every Gaussian twice");
    }
}

#[test]
fn quaternions_that_change_sign_between_frames_change_no_byte() {
    let frames = scene(150, 5, 1, Tracking::Tracked);
    let flip = |(t, frame): (usize, &GaussianFrame)| {
        let sign = |row: usize| if (row + t).is_multiple_of(2) { -1.0 } else { 1.0 };
        changed(frame, |planes| {
            for part in &mut planes.rotation {
                part.iter_mut().enumerate().for_each(|(row, value)| *value *= sign(row));
            }
        })
    };
    let flipped: Vec<GaussianFrame> = frames.iter().enumerate().map(flip).collect();
    let settings = predicted(1);
    assert!(encoded(frames, &settings).0 == encoded(flipped, &settings).0);
}

#[test]
fn axes_named_otherwise_in_every_frame_update_nothing() {
    let frame = still(150, 0);
    let namings = namings();
    let rename = |t: usize| {
        changed(&frame, |planes| {
            for row in 0..150 {
                let scales = [0, 1, 2].map(|axis: usize| planes.log_scale[axis][row]);
                let turn = [0, 1, 2, 3].map(|part: usize| planes.rotation[part][row]);
                let (scales, turn) = renamed(scales, turn, namings[(row * 5 + t * 7) % 24]);
                (0..3).for_each(|axis| planes.log_scale[axis][row] = scales[axis]);
                (0..4).for_each(|part| planes.rotation[part][row] = turn[part]);
            }
        })
    };
    let tools = Tools::default();
    let settings = Settings { predictors: Predictors::NONE, tools, ..predicted(1) };
    let report = close_with(&[rename(0), rename(1), rename(2)], &settings, "renamed");
    for frame in &report.coded[1..] {
        assert_eq!((frame.new, frame.removed, frame.moved, frame.updated), (0, 0, 0, 0));
    }
}

#[test]
fn axes_that_swap_order_update_scales_and_turn_nothing() {
    let frame = still(120, 0);
    let at = |t: u8| {
        changed(&frame, |planes| {
            let [first, second, _] = &mut planes.log_scale;
            first.iter_mut().for_each(|value| *value = -2.0 - 0.1 * f32::from(t));
            second.iter_mut().for_each(|value| *value = -2.6 + 0.1 * f32::from(t));
        })
    };
    let frames: Vec<GaussianFrame> = (0..7).map(at).collect();
    let report = close(&frames, "swap");
    assert!(report.coded[1..].iter().all(|frame| frame.new == 0 && frame.removed == 0));
    // Quarter turns of 120 Gaussians would cost 3 bytes each.
    assert!(report.coded[1..].iter().all(|frame| frame.bytes < 400), "{:?}", report.coded);
}

#[test]
fn log_scales_at_their_extremes_keep_their_error() {
    let frame = still(120, 0);
    let at = |t: usize| {
        changed(&frame, |planes| {
            let extreme = [-30.0, 10.0, -4.0];
            for row in 0..60 {
                planes.log_scale[row % 3][row] = extreme[(row + t) % 3];
            }
        })
    };
    close(&[at(0), at(0), at(1), at(2), at(2)], "extremes");
}

#[test]
fn a_scene_cut_starts_a_gop() {
    let other = |t: f32| {
        let numbers: Vec<f32> = (0..997).map(|k| (k * 71 % 997) as f32 / 500.0 - 1.0 + t).collect();
        frame_of(&numbers, 300, 0)
    };
    let mut frames = scene(300, 3, 0, Tracking::Tracked);
    frames.extend([other(0.0), other(0.001)]);
    let (bytes, report) = coded(&frames, &predicted(2), "a cut");
    let starts: Vec<u32> = Whole::new(&bytes).gops.iter().map(|(first, _)| *first).collect();
    assert_eq!(starts, [0, 3]);
    let intra = |frame: &FrameType| *frame == FrameType::Intra;
    assert_eq!(types(&report).iter().map(intra).collect::<Vec<_>>(), [true, false, false, true, false]);
}

#[test]
fn a_frame_that_shares_nothing_with_its_reference_is_all_new() {
    let tools = Tools { survivors: false, ..Tools::default() };
    let frames = scene(200, 4, 1, Tracking::Tracked);
    let none = (Predictors::NONE, PredictorChoice::Bits);
    let choices =
        [none, (Predictors::ALL, PredictorChoice::Bits), (Predictors::ALL, PredictorChoice::Difference)];
    for (predictors, predictor_choice) in choices {
        let report = close_with(
            &frames,
            &Settings { tools, predictors, predictor_choice, ..predicted(1) },
            "nothing is shared",
        );
        for frame in &report.coded[1..] {
            assert_eq!(frame.frame_type, FrameType::Predicted);
            assert_eq!((frame.parents, frame.removed, frame.new), (200, 200, 200));
        }
    }
}

#[test]
fn a_hundred_times_more_and_fewer_gaussians_start_gops() {
    let many = still(1000, 0);
    let few = many.select(&(0..10).collect::<Vec<_>>());
    let report = close(&[few.clone(), many.clone(), many, few.clone(), few], "10, 1000, 10");
    let [intra, predicted] = [FrameType::Intra, FrameType::Predicted];
    assert_eq!(types(&report), [intra, intra, predicted, intra, predicted]);
}

#[test]
fn twice_and_half_as_many_gaussians_go_on_in_the_gop() {
    let many = still(200, 0);
    let few = many.select(&(0..100).collect::<Vec<_>>());
    let report = close(&[few.clone(), many, few], "100, 200, 100");
    assert_eq!((report.coded[1].new, report.coded[1].removed), (100, 0));
    assert_eq!((report.coded[2].new, report.coded[2].removed), (0, 100));
}

/// The components that the first frame of a GOP needs are those that its other frames have.
#[test]
fn harmonics_that_the_first_frame_lacks_are_kept() {
    changing_degrees(&[[0, 3, 2, 0], [1, 2, 3, 3]]);
}

#[test]
fn a_change_of_sh_degree_between_frames_keeps_every_harmonic() {
    changing_degrees(&[[3, 0, 3, 1], [3, 2, 1, 0]]);
}

fn changing_degrees(cases: &[[u8; 4]]) {
    let full = still(150, 3);
    let of_degree = |degree: u8| {
        let mut planes = full.clone().into_planes();
        planes.sh.truncate(3 * sh_coefficients(degree));
        GaussianFrame::from_planes(degree, planes).unwrap()
    };
    let steps = Steps { sh: 0.02, ..quick().steps };
    let tools = Tools::default();
    let settings = Settings { steps, sh: ShChoice::Coefficients, tools, ..predicted(1) };
    for degrees in cases {
        close_with(&degrees.map(of_degree), &settings, &format!("degrees {degrees:?}"));
    }
}

#[test]
fn percentages_of_counts_that_they_do_not_divide_round_up() {
    let all = scene(100, 3, 0, Tracking::Tracked);
    for count in 1..=12_u32 {
        let refinements = vec![1, 33, 66, 99, 100];
        let kept: Vec<u32> = (0..count).collect();
        let frames: Vec<GaussianFrame> = all.iter().map(|frame| frame.select(&kept)).collect();
        let (bytes, _) =
            coded(&frames, &Settings { refinements: refinements.clone(), ..predicted(1) }, "percentages");
        let whole = Whole::new(&bytes);
        for (refinement, percent) in (0..).zip(refinements) {
            for frame in &whole.at(0, 0, refinement)[1..] {
                let exact = frame.planes.len() - frame.carried;
                assert_eq!(
                    exact,
                    (usize::from(percent) * count as usize).div_ceil(100),
                    "{count} Gaussians, {percent} %"
                );
            }
        }
    }
}

#[test]
fn frames_of_which_pruning_leaves_nothing_are_empty() {
    let seen = still(100, 0);
    let unseen = changed(&seen, |planes| planes.opacity_logit.fill(-20.0));
    let settings = Settings { keep_invisible: false, ..predicted(2) };
    for order in [[&seen, &unseen, &seen], [&unseen, &unseen, &unseen], [&unseen, &seen, &unseen]] {
        let (bytes, report) = encoded(order.map(Clone::clone).to_vec(), &settings);
        let whole = Whole::new(&bytes);
        for (frame, source) in whole.all().iter().zip(order) {
            assert_eq!(frame.planes.is_empty(), core::ptr::eq(source, &unseen));
        }
        assert_eq!(report.gaussians + report.invisible, 300);
    }
}

#[test]
fn what_stands_alone_is_in_the_lowest_spatial_layer() {
    let seeds = (0..3_u64).map(|seed| splatstream_files::builtin::BuiltinScene {
        gaussians: 300,
        seed,
        ..Default::default()
    });
    let frames: Vec<GaussianFrame> = seeds.map(|scene| scene.frame(0)).collect();
    let layered = Settings { spatial_layers: 3, ..predicted(1) };
    let (bytes, report) = coded(&frames, &layered, "strangers");
    assert_eq!(types(&report), [FrameType::Intra; 3]);
    let intra = Settings { structure: splatstream_encoder::Structure::Intra, spatial_layers: 1, ..layered };
    let (alone, _) = encoded(frames, &intra);
    // Units that add nothing have a header: three refinements in two more layers of three frames.
    let headers = 3 * 3 * 2 * 100;
    assert!(bytes.len() <= alone.len() + headers, "{} and {}", bytes.len(), alone.len());
}
