//! What fitting I frames to pictures may do, and what it must not.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "a panic is a failed test")]

#[path = "common/mod.rs"]
mod common;

use common::{builtin, decoded, encoded, sequence, strict};
use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::process::Options;
use splatstream_encoder::{
    Attribute, Error, Finetune, FinetuneLoss, FinetuneProgress, FinetuneWatch, Photograph, Plan, PointReport,
    PointWeight, Preset, Report, Settings, Structure, encode, plan,
};
use splatstream_files::builtin::BuiltinScene;
use splatstream_format::payload::SceneDescription;
use splatstream_gaussians::GaussianFrame;
use splatstream_gaussians::random::SplitMix64;
use splatstream_render::camera::{Up, held_out, ring};
use splatstream_render::metrics::ssim;
use splatstream_render::{Image, ReferencePictures, render};
use std::sync::{Arc, Mutex};
use std::time::Duration;

const ALL: [Attribute; 6] = [
    Attribute::Position,
    Attribute::LogScale,
    Attribute::Rotation,
    Attribute::Opacity,
    Attribute::Dc,
    Attribute::Sh,
];

/// In pictures of a few lines: small scenes do not need more, and tests are done soon.
fn quick(iterations: u32) -> Finetune {
    Finetune { iterations, lines: vec![108], ..Finetune::default() }
}

fn settings(iterations: u32) -> Settings {
    let finetune = Some(quick(iterations));
    Settings { preset: Preset::Fast, verify: true, finetune, ..Settings::default() }
}

fn plain() -> Settings {
    Settings { finetune: None, ..settings(1) }
}

fn scene() -> Vec<GaussianFrame> {
    vec![builtin(1_500, 1)]
}

/// PSNR in the views that decide how fine all steps together are, dB.
fn fitted_psnr(report: &Report) -> f64 {
    report.pictures.as_ref().and_then(|pictures| pictures.fitted_psnr()).unwrap()
}

fn planes(bytes: &[u8]) -> QuantizedFrame {
    decoded(bytes, &strict()).0.remove(0).into_shown()
}

#[test]
fn pictures_from_elsewhere_gain_and_the_stream_stays_as_small() {
    let (before, plain) = encoded(scene(), &plain());
    let (after, tuned) = encoded(scene(), &settings(40));
    // In views of as many lines as it was fitted to: of five times as many, other things show.
    let (without, with) = (ring_psnr(&before, &OperatingPoint::ALL), ring_psnr(&after, &OperatingPoint::ALL));
    assert!(with > without, "{without} {with}; {:?}", (plain.pictures, tuned.pictures));
    assert!(after.len() as f64 <= 1.03 * before.len() as f64, "{} {}", before.len(), after.len());
    let [report] = tuned.finetuned.as_slice() else { panic!("{:?}", tuned.finetuned) };
    assert_eq!((report.frame, report.iterations), (0, 40));
    assert!(report.psnr[1] > report.psnr[0]);
}

#[test]
fn judges_never_see_less_than_without() {
    for iterations in [1, 2, 26] {
        let (_, report) = encoded(scene(), &settings(iterations));
        let [before, after] = report.finetuned[0].psnr;
        assert!(after >= before, "{iterations}: {before} {after}");
    }
}

#[test]
fn the_bytes_are_the_same_for_any_number_of_threads() {
    let of = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| encoded(scene(), &settings(6)).0)
    };
    let one = of(1);
    assert_eq!(one, of(3));
    assert_ne!(one, encoded(scene(), &plain()).0);
}

/// PSNR and bytes both gain, the more the longer it goes on, and by no chance of when it ends.
#[test]
fn fits_of_any_length_gain_and_longer_ones_more() {
    let scene = || vec![builtin(3_000, 1)];
    let (before, _) = encoded(scene(), &plain());
    let before = (before.len(), ring_psnr_of(&before, &OperatingPoint::ALL, &scene()[0]));
    let lengths = [20, 40, 80, 160];
    let after = lengths.map(|iterations| {
        let (bytes, _) = encoded(scene(), &settings(iterations));
        (bytes.len(), ring_psnr_of(&bytes, &OperatingPoint::ALL, &scene()[0]))
    });
    for (iterations, (bytes, psnr)) in lengths.iter().zip(after) {
        assert!(bytes < before.0 && psnr > before.1, "{iterations}: {before:?} {after:?}");
    }
    assert!(after.is_sorted_by(|shorter, longer| longer.0 < shorter.0), "{after:?}");
}

/// As [`settings`], by L1 and SSIM.
fn by_l1_ssim(iterations: u32) -> Settings {
    let finetune = Some(Finetune { loss: FinetuneLoss::l1_ssim(), ..quick(iterations) });
    Settings { finetune, ..plain() }
}

/// Mean of what SSIM misses of what is decoded, in five views of 108 lines that nothing was fitted to.
fn ring_dissimilarity(bytes: &[u8], source: &GaussianFrame) -> f64 {
    let frame = decoded(bytes, &strict()).0.remove(0).into_shown();
    let frame = to_gaussians(frame, &sequence(bytes)).unwrap();
    let picture = |frame, camera| render(frame, camera, [0.0; 3]).colour;
    let cameras = ring(source, Up::default(), 5, 108);
    let missed = cameras.iter().map(|at| 1.0 - ssim(&picture(source, at), &picture(&frame, at)).unwrap());
    missed.sum::<f64>() / 5.0
}

#[test]
fn l1_and_ssim_bring_pictures_from_elsewhere_nearer_in_ssim() {
    let scene = || vec![builtin(6_000, 1)];
    let (before, _) = encoded(scene(), &plain());
    let (squared, _) = encoded(scene(), &settings(40));
    let (after, report) = encoded(scene(), &by_l1_ssim(40));
    assert_ne!(after, squared);
    let [without, with] = [&before, &after].map(|bytes| ring_dissimilarity(bytes, &scene()[0]));
    assert!(with < 0.9 * without, "{without} {with}; {:?}", report.finetuned);
    assert!(after.len() < before.len(), "{} {}", before.len(), after.len());
}

#[test]
fn l1_and_ssim_give_the_same_bytes_for_any_number_of_threads() {
    let of = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| encoded(scene(), &by_l1_ssim(6)).0)
    };
    assert_eq!(of(1), of(3));
}

#[test]
fn each_iteration_is_told_and_nothing_depends_on_who_listens() {
    let told = Arc::new(Mutex::new(Vec::new()));
    let list = Arc::clone(&told);
    let watch = FinetuneWatch::new(move |progress: FinetuneProgress| {
        list.lock().unwrap().push((progress.spatial_layer, progress.done, progress.iterations));
    });
    let finetune = Some(Finetune { watch, lines: vec![60, 108], ..quick(3) });
    let layered = |finetune| Settings { finetune, spatial_layers: 2, ..plain() };
    let (bytes, _) = encoded(scene(), &layered(finetune));
    assert_eq!(bytes, encoded(scene(), &layered(Some(Finetune { lines: vec![60, 108], ..quick(3) }))).0);
    let of_layer = |spatial_layer| (1..=3).map(move |done| (spatial_layer, done, 3));
    assert_eq!(*told.lock().unwrap(), [0, 1].into_iter().flat_map(of_layer).collect::<Vec<_>>());
}

#[test]
fn every_attribute_is_reached_and_the_others_are_held() {
    let before = planes(&encoded(scene(), &plain()).0);
    for own in ALL {
        let held = ALL.into_iter().filter(|&attribute| attribute != own).collect();
        let finetune = Some(Finetune { held, ..quick(40) });
        let after = planes(&encoded(scene(), &Settings { finetune, ..plain() }).0);
        // Other steps follow from log-scales and opacities, and the order of coding from positions.
        let sorted = |planes: &[Vec<i32>]| planes.iter().map(|plane| sorted(plane)).collect::<Vec<_>>();
        let same = [
            (Attribute::LogScale, sorted(&before.log_scale) == sorted(&after.log_scale)),
            (Attribute::Opacity, self::sorted(&before.opacity) == self::sorted(&after.opacity)),
            (Attribute::Rotation, sorted(&before.rotation) == sorted(&after.rotation)),
            (Attribute::Dc, sorted(&before.dc) == sorted(&after.dc)),
            (Attribute::Sh, sorted(&before.sh) == sorted(&after.sh)),
        ];
        let follows = |attribute| match own {
            Attribute::LogScale => true,
            Attribute::Opacity => attribute != Attribute::LogScale,
            _ => attribute == own,
        };
        for (attribute, is_same) in same {
            assert!(attribute != own || !is_same, "{own:?} changes nothing");
            assert!(follows(attribute) || is_same, "{own:?} changes {attribute:?}");
        }
        let position = |frame: &QuantizedFrame| frame.position.each_ref().map(|plane| sorted_of(plane));
        assert_eq!(position(&before) == position(&after), own != Attribute::Position, "{own:?}");
    }
}

fn sorted(plane: &[i32]) -> Vec<i32> {
    sorted_of(plane)
}

fn sorted_of<T: Ord + Copy>(plane: &[T]) -> Vec<T> {
    let mut plane = plane.to_vec();
    plane.sort_unstable();
    plane
}

/// Photographs of a scene that is brighter than the one that is encoded.
fn photographs(count: u32) -> Vec<Photograph> {
    let mut bright = scene().remove(0);
    bright.planes_mut().dc.into_iter().flatten().for_each(|value| *value += 0.3);
    let cameras = ring(&bright, Up::default(), count, 90);
    let photograph = |camera: splatstream_render::Camera| Photograph {
        picture: render(&bright, &camera, [0.0; 3]).colour,
        camera,
    };
    cameras.into_iter().map(photograph).collect()
}

#[test]
fn photographs_are_what_the_stream_comes_to_look_like() {
    let finetune = Some(Finetune { photographs: photographs(16), ..quick(60) });
    let (_, report) = encoded(scene(), &Settings { finetune, ..plain() });
    let [before, after] = report.finetuned[0].psnr;
    assert!(after > before + 2.0, "{before} {after}");
}

#[test]
fn the_background_of_the_scene_is_that_of_its_photographs() {
    let background = [1.0, 0.8, 0.2];
    let source = scene().remove(0);
    let photograph = |camera: splatstream_render::Camera| Photograph {
        picture: render(&source, &camera, background).colour,
        camera,
    };
    let photographs = ring(&source, Up::default(), 16, 90).into_iter().map(photograph).collect();
    let description = SceneDescription { background: Some(background), ..SceneDescription::default() };
    let finetune = Some(Finetune { photographs, ..quick(2) });
    let (_, report) = encoded(scene(), &Settings { finetune, description, ..plain() });
    // Photographs of the source show it.
    assert!(report.finetuned[0].psnr[0] > 35.0, "{:?}", report.finetuned);
}

#[test]
fn steps_for_a_quality_are_those_without_photographs() {
    let finetune = Some(Finetune { photographs: photographs(16), ..quick(20) });
    let settings = Settings { psnr: Some(44.0), ..plain() };
    let (_, plain) = encoded(scene(), &settings);
    let (_, report) = encoded(scene(), &Settings { finetune, ..settings });
    assert_eq!(report.steps, plain.steps);
    let [before, after] = report.finetuned[0].psnr;
    assert!(after > before + 0.5, "{before} {after}");
}

#[test]
fn fitting_is_given_up_where_it_makes_nothing_smaller() {
    let few = || vec![scene().remove(0).select(&(0..30).collect::<Vec<_>>())];
    let wanted = |settings: Settings| Settings { psnr: Some(44.0), ..settings };
    let (before, _) = encoded(few(), &wanted(plain()));
    let (after, report) = encoded(few(), &wanted(settings(1)));
    assert!(report.target.unwrap().without_finetune, "{:?}", report.finetuned);
    assert!(report.finetuned.is_empty());
    assert_eq!(before, after);
}

#[test]
fn streams_and_frames_of_any_degree_are_fitted() {
    for (of_frame, of_stream) in [(3, Some(1)), (2, Some(0)), (1, Some(3)), (0, None)] {
        let settings = Settings { sh_degree: of_stream, ..settings(2) };
        let (bytes, report) = encoded(vec![builtin(200, of_frame)], &settings);
        assert_eq!(report.finetuned.len(), 1);
        assert_eq!(sequence(&bytes).sh_degree, of_stream.unwrap_or(of_frame).min(of_frame));
    }
    // Frames of a sequence have the highest degree of all.
    let (_, report) = encoded(vec![builtin(200, 0), builtin(200, 2), builtin(200, 1)], &settings(2));
    assert_eq!(report.finetuned.len(), 3);
}

/// Some frames in which things move, and settings that predict all but the first.
fn moving(count: u32) -> Vec<GaussianFrame> {
    let scene = BuiltinScene { gaussians: 3_000, frames: count, sh_degree: 1, ..BuiltinScene::default() };
    (0..count).map(|number| scene.frame(number)).collect()
}

fn predicted(settings: Settings) -> Settings {
    Settings { structure: Structure::Predicted { layers: 1 }, spatial_layers: 1, ..settings }
}

/// PSNR of each frame that is decoded, in five views of 108 lines that nothing was fitted to.
fn psnr_of_frames(bytes: &[u8], source: &[GaussianFrame]) -> Vec<f64> {
    let cameras = ring(&source[0], Up::default(), 5, 108);
    let frames = decoded(bytes, &strict()).0.into_iter().zip(source);
    let psnr = |(frame, source): (splatstream_decoder::process::DecodedFrame, &GaussianFrame)| {
        let frame = to_gaussians(frame.into_shown(), &sequence(bytes)).unwrap();
        ReferencePictures::new(source, cameras.clone()).psnr(&frame).sum::<f64>() / 5.0
    };
    frames.map(psnr).collect()
}

#[test]
fn predicted_frames_follow_the_values_that_an_i_frame_was_fitted_to() {
    let (before, plain) = encoded(moving(4), &predicted(plain()));
    let (after, tuned) = encoded(moving(4), &predicted(settings(60)));
    assert_eq!(tuned.finetuned.iter().map(|report| report.frame).collect::<Vec<_>>(), [0]);
    let [start, end] = tuned.finetuned[0].psnr;
    assert!(end > start + 0.5, "there is nothing to follow: {start} {end}");
    let kinds = |report: &Report| report.coded.iter().map(|frame| frame.frame_type).collect::<Vec<_>>();
    assert_eq!(kinds(&plain), kinds(&tuned));
    assert!(after.len() as f64 <= 1.03 * before.len() as f64, "{} {}", before.len(), after.len());
    let [without, with] = [&before, &after].map(|bytes| psnr_of_frames(bytes, &moving(4)));
    assert!(with.iter().zip(&without).all(|(with, without)| with > without), "{without:?} {with:?}");
    let (_, intra) = encoded(moving(2), &settings(2));
    assert_eq!(intra.finetuned.iter().map(|report| report.frame).collect::<Vec<_>>(), [0, 1]);
}

/// Frames of which each has errors of its own, as from training apart.
fn apart(count: u32, spread: f32) -> Vec<GaussianFrame> {
    let mut random = SplitMix64::new(7);
    let mut shift = |plane: &mut [f32], most: f32| {
        plane.iter_mut().for_each(|value| *value += spread * most * random.signed());
    };
    let mut apart = |mut frame: GaussianFrame| {
        let planes = frame.planes_mut();
        planes.log_scale.into_iter().for_each(|plane| shift(plane, 0.15));
        shift(planes.opacity_logit, 0.5);
        planes.dc.into_iter().chain(planes.rotation).for_each(|plane| shift(plane, 0.15));
        planes.sh.into_iter().for_each(|plane| shift(plane, 0.05));
        frame
    };
    moving(count).into_iter().map(&mut apart).collect()
}

#[test]
fn fitting_is_given_up_where_predicted_frames_lose_by_it() {
    let wanted = |settings: Settings| Settings { psnr: Some(44.0), ..predicted(settings) };
    let (before, _) = encoded(apart(3, 1.0), &wanted(plain()));
    let (after, report) = encoded(apart(3, 1.0), &wanted(settings(20)));
    assert!(report.target.unwrap().without_finetune, "{:?}", report.finetuned);
    assert_eq!(before, after);
}

#[test]
fn every_frame_is_fitted_where_predicting_saves_little() {
    let wanted = |settings: Settings| Settings { psnr: Some(44.0), ..predicted(settings) };
    let (before, plain) = encoded(apart(3, 4.0), &wanted(plain()));
    let (after, report) = encoded(apart(3, 4.0), &wanted(settings(20)));
    assert!(!plain.stands_alone && report.stands_alone, "predicting frames saves more or nothing");
    assert_eq!(report.finetuned.iter().map(|report| report.frame).collect::<Vec<_>>(), [0, 1, 2]);
    // More than what coarser steps with as many decibels less would save.
    let lost = fitted_psnr(&plain) - fitted_psnr(&report);
    let share = after.len() as f64 / before.len() as f64;
    assert!(share < (-0.045 * lost).exp(), "{share} of the bytes, {lost} dB less");
}

#[test]
fn a_plan_of_frames_that_stand_for_themselves_when_fitted_is_read_as_it_was_made() {
    let asked = Settings { psnr: Some(44.0), ..predicted(settings(20)) };
    let made = plan(&mut apart(3, 4.0), &asked).unwrap();
    let read = Plan::from_record(&made.record().unwrap(), &asked).unwrap();
    let shard = |plan: &Plan| {
        let mut bytes = Vec::new();
        let report = plan.encode_shard(&mut apart(3, 4.0), (1, 1), &mut bytes, &mut |_, _| ()).unwrap();
        (bytes, report.stands_alone)
    };
    let (bytes, stands_alone) = shard(&made);
    assert!(stands_alone);
    assert!(shard(&read) == (bytes, stands_alone));
}

#[test]
fn what_stands_still_takes_no_bits_after_fitting() {
    let still = || vec![builtin(1_500, 1); 3];
    let sizes = |report: &Report| report.coded.iter().map(|frame| frame.bytes).collect::<Vec<_>>();
    // With prefixes that are compensated in any case.
    let balanced = |settings| predicted(Settings { preset: Preset::Balanced, ..settings });
    let [plain, tuned] = [plain(), settings(20)].map(|settings| encoded(still(), &balanced(settings)).1);
    assert_eq!(sizes(&plain)[1..], sizes(&tuned)[1..], "{:?} {:?}", sizes(&plain), sizes(&tuned));
}

#[test]
fn predicted_frames_are_the_same_for_any_number_of_threads_after_fitting() {
    let of = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| encoded(moving(3), &predicted(settings(4))).0)
    };
    assert_eq!(of(1), of(3));
}

#[test]
fn a_quality_is_reached_after_fitting_with_fewer_bytes() {
    let wanted = |settings: Settings| Settings { psnr: Some(44.0), ..settings };
    let (before, _) = encoded(scene(), &wanted(plain()));
    let (after, report) = encoded(scene(), &wanted(settings(50)));
    assert!((fitted_psnr(&report) - 44.0).abs() <= 0.5, "{}", fitted_psnr(&report));
    assert!(after.len() < before.len(), "{} {}", before.len(), after.len());
}

#[test]
fn the_lowest_layer_is_fitted_to_pictures_of_its_own_lines() {
    let layered = |settings: Settings| Settings { spatial_layers: 2, ..settings };
    let lowest = |bytes: &[u8]| ring_psnr(bytes, &OperatingPoint { spatial: 0, ..OperatingPoint::ALL });
    let (before, _) = encoded(scene(), &layered(plain()));
    let finetune = Some(Finetune { lines: vec![108, 216], ..quick(40) });
    let (after, report) = encoded(scene(), &layered(Settings { finetune, ..plain() }));
    assert_eq!(report.finetuned.iter().map(|fitted| fitted.spatial_layer).collect::<Vec<_>>(), [0, 1]);
    assert!(lowest(&after) > lowest(&before), "{} {}", lowest(&before), lowest(&after));
}

fn point(spatial: u8, refinement: u8) -> OperatingPoint {
    OperatingPoint { spatial, temporal: 0, refinement }
}

/// Two lists, and points that count.
fn for_points(optimise_for: Vec<PointWeight>, iterations: u32) -> Settings {
    let finetune = Some(Finetune { optimise_for, ..quick(iterations) });
    Settings { finetune, refinements: vec![30, 100], ..plain() }
}

#[test]
fn a_point_gains_by_its_weight_and_the_others_pay_for_it() {
    let weights = |prefix: f64, all: f64| {
        let weight = |refinement, weight| PointWeight { point: point(0, refinement), weight };
        let bytes = encoded(scene(), &for_points(vec![weight(0, prefix), weight(1, all)], 60)).0;
        [0, 1].map(|refinement| ring_psnr(&bytes, &point(0, refinement)))
    };
    let [of_prefix, of_all] = [weights(200.0, 1.0), weights(1.0, 200.0)];
    assert!(of_prefix[0] > of_all[0] && of_prefix[1] < of_all[1], "{of_prefix:?} {of_all:?}");
}

#[test]
fn what_no_point_shows_stays_the_nearest() {
    let only = PointWeight { point: point(0, 0), weight: 2.0 };
    let after = planes(&encoded(scene(), &for_points(vec![only], 20)).0);
    let before = planes(&encoded(scene(), &Settings { finetune: None, ..for_points(Vec::new(), 1) }).0);
    let list = before.len() * 30 / 100;
    let same = |plane: usize, rows: core::ops::Range<usize>| {
        before.dc[plane][rows.clone()] == after.dc[plane][rows.clone()]
            && before.log_scale[plane][rows.clone()] == after.log_scale[plane][rows]
    };
    assert!((0..3).all(|plane| same(plane, list..before.len())));
    assert!((0..3).any(|plane| !same(plane, 0..list)));
}

#[test]
fn reports_are_of_what_receivers_of_the_stream_see() {
    let points = [(0, 0, 1.0), (0, 1, 2.0), (1, 0, 1.0), (1, 1, 4.0), (2, 1, 1.0)];
    let optimise_for = points
        .map(|(spatial, refinement, weight)| PointWeight { point: point(spatial, refinement), weight })
        .to_vec();
    let settings = for_points(optimise_for, 8);
    let finetune = settings.finetune.map(|finetune| Finetune { lines: vec![60, 80, 108], ..finetune });
    let settings = Settings { finetune, spatial_layers: 3, refinements: vec![20, 50, 100], ..plain() };
    let (bytes, report) = encoded(scene(), &settings);
    let reports: Vec<PointReport> =
        report.finetuned.iter().flat_map(|fitted| fitted.points.clone()).collect();
    assert_eq!(reports.len(), points.len());
    let source = scene().remove(0);
    for PointReport { point, psnr: [_, after], .. } in reports {
        let lines = [60, 80, 108][usize::from(point.spatial)];
        let cameras = held_out(&source, Up::default(), &[], 5, 540);
        let cameras = cameras.iter().map(|camera| camera.scaled_to_height(lines)).collect();
        let frame = decoded(&bytes, &Options { operating_point: point, ..strict() }).0.remove(0);
        let frame = to_gaussians(frame.into_shown(), &sequence(&bytes)).unwrap();
        let seen = ReferencePictures::new(&source, cameras).psnr(&frame).sum::<f64>() / 5.0;
        assert!((seen - after).abs() < 0.02, "{point}: {seen} where {after} is reported");
    }
}

/// Mean PSNR of what is decoded, in five views of 108 lines that nothing was fitted to.
fn ring_psnr(bytes: &[u8], operating_point: &OperatingPoint) -> f64 {
    ring_psnr_of(bytes, operating_point, &scene()[0])
}

/// The same of another scene.
fn ring_psnr_of(bytes: &[u8], &operating_point: &OperatingPoint, source: &GaussianFrame) -> f64 {
    let frame = decoded(bytes, &Options { operating_point, ..strict() }).0.remove(0).into_shown();
    let frame = to_gaussians(frame, &sequence(bytes)).unwrap();
    let views = ReferencePictures::new(source, ring(source, Up::default(), 5, 108));
    views.psnr(&frame).sum::<f64>() / 5.0
}

#[test]
fn nothing_is_fitted_where_there_is_nothing() {
    let empty = builtin(100, 0).select(&[]);
    let (_, report) = encoded(vec![empty], &settings(3));
    assert!(report.finetuned.is_empty());
    let one = builtin(100, 0).select(&[0]);
    let (_, report) = encoded(vec![one], &settings(3));
    assert_eq!(report.finetuned.len(), 1);
}

#[test]
fn what_cannot_be_done_is_refused() {
    let refused = |finetune: Finetune| {
        let settings = Settings { finetune: Some(finetune), ..plain() };
        match encode(&mut scene(), &settings, &mut Vec::new(), &mut |_, _| ()) {
            Err(Error::Setting { name, .. }) => name,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(refused(Finetune { iterations: 0, ..Finetune::default() }), "finetune iterations");
    let time_budget = Some(Duration::ZERO);
    assert_eq!(refused(Finetune { time_budget, ..Finetune::default() }), "finetune time budget");
    assert_eq!(refused(Finetune { lines: vec![540, 0], ..Finetune::default() }), "finetune lines");
    assert_eq!(refused(Finetune { resolutions: vec![0], ..Finetune::default() }), "finetune lines");
    for similarity in [-0.1, 1.1, f32::NAN] {
        let loss = FinetuneLoss::L1Ssim { similarity };
        assert_eq!(refused(Finetune { loss, ..Finetune::default() }), "finetune similarity");
    }
    let for_point = |point, weight| {
        let optimise_for = vec![PointWeight { point, weight }];
        refused(Finetune { optimise_for, ..Finetune::default() })
    };
    assert_eq!(for_point(point(1, 0), 1.0), "operating point to optimise for");
    assert_eq!(for_point(point(0, 5), 1.0), "operating point to optimise for");
    assert_eq!(for_point(point(0, 4), 0.0), "weight of an operating point");
    assert_eq!(for_point(point(0, 4), f64::NAN), "weight of an operating point");
    let few = photographs(3);
    assert_eq!(refused(Finetune { photographs: few, ..Finetune::default() }), "finetune photographs");
    let mut other = photographs(8);
    other[2].picture = Image::new(2, vec![[0.0; 3]; 4]);
    assert_eq!(refused(Finetune { photographs: other, ..Finetune::default() }), "finetune photograph");
}
