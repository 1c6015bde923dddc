//! Sequences whose frames were trained apart: what pictures do not need is carried over.

use crate::common::dynamic::{predicted, scene};
use crate::common::{decoded, encoded, frame_of, strict};
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::stream::decode_stream;
use splatstream_encoder::{Fidelity, Importance, Quality, Report, Settings, Steps, Structure};
use splatstream_files::builtin::{BuiltinScene, Tracking};
use splatstream_format::syntax::FrameType;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::camera::{Up, ring, spiral};
use splatstream_render::metrics::{psnr, psnr_masked, still};
use splatstream_render::{Camera, Rendering, render};
use std::ops::ControlFlow;

/// Views and their lines: few, so that tests are quick.
const VIEWS: u32 = 6;
const LINES: u32 = 90;

/// True to pictures in given views, one temporal layer.
fn by_pictures(frames: &[GaussianFrame]) -> Settings {
    Settings {
        steps: Quality::Medium.steps(),
        cameras: spiral(&frames[0], Up::default(), VIEWS, LINES),
        fidelity: Some(Fidelity::Pictures),
        importance: Some(Importance::Contribution),
        ..predicted(1)
    }
}

fn untracked(gaussians: u32, frames: u32) -> Vec<GaussianFrame> {
    scene(gaussians, frames, 0, Tracking::Untracked)
}

/// The decoded frames, as Gaussians.
fn shown(bytes: &[u8]) -> Vec<GaussianFrame> {
    let mut frames = Vec::new();
    let summary = decode_stream(bytes, &strict(), |sequence, frame| {
        frames.push(to_gaussians(frame.into_shown(), sequence).unwrap());
        ControlFlow::Continue(())
    });
    assert_eq!(summary.verdict(), None);
    frames
}

/// The stream, which every decoder must find what the encoder has found in, and the frames in it.
fn coded(frames: &[GaussianFrame], settings: &Settings) -> (Vec<u8>, Report, Vec<GaussianFrame>) {
    let (bytes, report) = encoded(frames.to_vec(), settings);
    let digests: Vec<u64> = decoded(&bytes, &strict()).0.iter().filter_map(|frame| frame.digest).collect();
    assert_eq!(digests, report.digests);
    let shown = shown(&bytes);
    let counts: Vec<usize> = report.coded.iter().map(|frame| frame.gaussians as usize).collect();
    assert_eq!(shown.iter().map(GaussianFrame::len).collect::<Vec<_>>(), counts);
    (bytes, report, shown)
}

fn pictures(frame: &GaussianFrame, cameras: &[Camera]) -> Vec<Rendering> {
    cameras.iter().map(|camera| render(frame, camera, [0.0; 3])).collect()
}

/// PSNR of a decoded frame against its source, mean of the views, dB.
fn quality(source: &GaussianFrame, shown: &GaussianFrame, cameras: &[Camera]) -> f64 {
    let pairs = pictures(source, cameras).into_iter().zip(pictures(shown, cameras));
    pairs.map(|(a, b)| psnr(&a.colour, &b.colour)).sum::<f64>() / cameras.len() as f64
}

/// PSNR from frame to frame where nothing moves in the clean scene, mean of the views, dB: of the source and of what is
/// decoded.
fn flicker(clean: &[GaussianFrame], sequences: [&[GaussianFrame]; 2], cameras: &[Camera]) -> [f64; 2] {
    let drawn = |frames: &[GaussianFrame]| -> Vec<Vec<Rendering>> {
        frames.iter().map(|frame| pictures(frame, cameras)).collect()
    };
    let clean = drawn(clean);
    sequences.map(|frames| {
        let drawn = drawn(frames);
        let mut all = Vec::new();
        for ((clean, clean_after), (before, after)) in
            clean.iter().zip(&clean[1..]).zip(drawn.iter().zip(&drawn[1..]))
        {
            for view in 0..cameras.len() {
                let mask = still(&clean[view], &clean_after[view]);
                all.push(psnr_masked(&before[view].colour, &after[view].colour, &mask).unwrap());
            }
        }
        all.iter().sum::<f64>() / all.len() as f64
    })
}

#[test]
fn what_is_true_to_attributes_knows_no_pictures() {
    let frames = untracked(300, 3);
    let attributes = Settings { fidelity: Some(Fidelity::Attributes), ..by_pictures(&frames) };
    // The fast preset draws no picture unless it is asked to.
    let fast = Settings { fidelity: None, tolerance: 6.0, ..attributes.clone() };
    let (bytes, report) = encoded(frames.clone(), &attributes);
    assert!(encoded(frames.clone(), &fast).0 == bytes);
    let counts: Vec<usize> = frames.iter().map(GaussianFrame::len).collect();
    assert_eq!(report.coded.iter().map(|frame| frame.gaussians as usize).collect::<Vec<_>>(), counts);
    assert!(report.coded.iter().all(|frame| !frame.by_pictures));
}

#[test]
fn frames_with_rows_that_keep_their_meaning_are_true_to_attributes_whatever_is_asked() {
    let same = |frames: &[GaussianFrame], steps: Quality| {
        let settings = Settings { steps: steps.steps(), ..by_pictures(frames) };
        let attributes = Settings { fidelity: Some(Fidelity::Attributes), ..settings.clone() };
        encoded(frames.to_vec(), &settings).0 == encoded(frames.to_vec(), &attributes).0
    };
    let tracked = scene(600, 4, 1, Tracking::Tracked);
    // With steps as fine as the last, colours that the light changes differ by more than a step.
    assert!([Quality::Low, Quality::High, Quality::VisuallyLossless].into_iter().all(|q| same(&tracked, q)));
    // Half of the rows are there in every frame, the others in another order.
    let shuffled = |t: usize| {
        let rest = (300..600).map(|row| 300 + (row * 7 + 11 * t as u32) % 300);
        tracked[t].select(&(0..300).chain(rest).collect::<Vec<_>>())
    };
    assert!(same(&[shuffled(0), shuffled(1), shuffled(2)], Quality::High));
}

/// A difference that nearly every difference is sent for, decibels, and by how much later frames may be below earlier ones.
const HARDLY_ANY: f32 = 0.02;
const CHANCE: f64 = 0.2;
/// Prices are a factor of the square root of two apart, by which errors differ by 1.5 dB at most: a quarter of the largest
/// tolerance that is tried.
const LEVEL: f64 = 0.25;

#[test]
fn pictures_are_as_good_as_the_tolerance_says_and_no_better_than_they_need_be() {
    let frames = untracked(2000, 6);
    let settings = by_pictures(&frames);
    let of_all = |shown: &[GaussianFrame]| -> Vec<f64> {
        frames.iter().zip(shown).map(|(a, b)| quality(a, b, &settings.cameras)).collect()
    };
    let exact = of_all(&coded(&frames, &Settings { tolerance: HARDLY_ANY, ..settings.clone() }).2);
    let mut sizes = Vec::new();
    for tolerance in [1.0, 3.0, 6.0] {
        let (bytes, report, shown) = coded(&frames, &Settings { tolerance, ..settings.clone() });
        assert!(report.coded.iter().skip(1).all(|frame| frame.by_pictures));
        // A frame is judged against what would be shown if all of its own differences were sent. In another stream that is
        // more or less by chance, since other frames came before, but not on average.
        let below: Vec<f64> =
            exact.iter().zip(of_all(&shown)).skip(1).map(|(exact, psnr)| exact - psnr).collect();
        let mean = |frames: &[f64]| frames.iter().sum::<f64>() / frames.len() as f64;
        let allowed = f64::from(tolerance);
        assert!(mean(&below) <= allowed, "{below:?} dB, allowed {tolerance}");
        assert!(mean(&below) >= allowed - LEVEL.max(LEVEL * allowed), "{below:?} dB, allowed {tolerance}");
        // Errors do not add up: the last frames are as near to their sources as the first predicted ones.
        let [first, last] = [mean(&below[..2]), mean(&below[3..])];
        assert!(last <= first.max(allowed) + CHANCE, "{below:?} dB, allowed {tolerance}");
        sizes.push(bytes.len());
    }
    assert!(sizes.is_sorted_by(|a, b| a > b), "{sizes:?}");
}

#[test]
fn threads_change_no_byte() {
    let frames = untracked(800, 4);
    let settings = Settings { tolerance: 1.0, ..by_pictures(&frames) };
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| encoded(frames.clone(), &settings).0)
    };
    assert!(with(1) == with(3));
}

#[test]
fn a_cut_begins_a_group_and_empty_frames_stay_empty() {
    let frames = untracked(400, 2);
    let empty = frames[0].select(&[]);
    let other = |t: f32| {
        let numbers: Vec<f32> = (0..997).map(|k| (k * 71 % 997) as f32 / 500.0 - 1.0 + t).collect();
        frame_of(&numbers, 400, 0)
    };
    // In another order, as if trained again.
    let again = other(0.001).select(&(0..400).rev().collect::<Vec<_>>());
    let cut = [frames[0].clone(), frames[1].clone(), other(0.0), again];
    let settings = Settings { tolerance: 1.0, ..by_pictures(&frames) };
    let (_, report, shown) = coded(&cut, &settings);
    let types: Vec<FrameType> = report.coded.iter().map(|frame| frame.frame_type).collect();
    use FrameType::{Intra, Predicted};
    assert_eq!(types, [Intra, Predicted, Intra, Predicted]);
    let below =
        quality(&cut[2], &shown[2], &settings.cameras) - quality(&cut[3], &shown[3], &settings.cameras);
    assert!(below <= 1.0 + 1e-6, "{below} dB");
    let gap = [frames[0].clone(), empty.clone(), empty, frames[1].clone()];
    let (.., shown) = coded(&gap, &settings);
    let counts: Vec<bool> = shown.iter().map(GaussianFrame::is_empty).collect();
    assert_eq!(counts, [false, true, true, false]);
}

/// What the built-in untracked sequence is there for, in views that the encoder has not seen.
#[test]
fn untracked_frames_take_sixty_per_cent_of_intra_bytes_lose_half_a_decibel_and_flicker_no_more_than_their_source()
 {
    let scene = BuiltinScene {
        gaussians: 6000,
        frames: 8,
        tracking: Tracking::Untracked,
        sh_degree: 1,
        ..BuiltinScene::default()
    };
    let frames: Vec<GaussianFrame> = (0..8).map(|t| scene.frame(t)).collect();
    let settings = Settings {
        steps: Steps {
            position_bits: 13.4,
            log_scale: 0.12,
            rotation: 0.02,
            opacity: 0.14,
            dc: 0.074,
            sh: 0.08,
        },
        cameras: spiral(&frames[0], Up::default(), 10, 180),
        spatial_layers: 1,
        structure: Structure::Predicted { layers: 2 },
        ..Settings::default()
    };
    let intra = Settings { structure: Structure::Intra, ..settings.clone() };
    let ((bytes, _, shown), (intra_bytes, _)) = (coded(&frames, &settings), encoded(frames.clone(), &intra));
    let share = bytes.len() as f64 / intra_bytes.len() as f64;
    let cameras = ring(&frames[0], Up::default(), 6, 180);
    let mean = |shown: &[GaussianFrame]| {
        let all = frames.iter().zip(shown).map(|(a, b)| quality(a, b, &cameras));
        all.sum::<f64>() / frames.len() as f64
    };
    let below = mean(&self::shown(&intra_bytes)) - mean(&shown);
    let clean = BuiltinScene { tracking: Tracking::Tracked, ..scene };
    let clean: Vec<GaussianFrame> = (0..8).map(|t| clean.frame(t)).collect();
    let [of_source, of_stream] = flicker(&clean, [&frames, &shown], &cameras);
    let [_, of_intra] = flicker(&clean, [&frames, &self::shown(&intra_bytes)], &cameras);
    let figures = format!(
        "{share} of the bytes, {below} dB below, flicker {of_source} and {of_stream} dB ({of_intra})"
    );
    assert!(share <= 0.6 && below <= 0.5 && of_stream >= of_source - 0.15, "{figures}");
}
