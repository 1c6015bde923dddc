//! Finite values of any size are coded or refused by name; the encoder does not panic.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

use proptest::prelude::*;
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::decode_stream;
use splatstream_encoder::{Error, Preset, Quality, Settings, Steps, Structure, encode};
use splatstream_files::builtin::BuiltinScene;
use splatstream_gaussians::{GaussianFrame, Planes};
use std::ops::ControlFlow;

/// Gaussians of a frame.
const COUNT: usize = 12;
/// Planes of a frame of degree 1.
const PLANES: usize = 14 + 9;

/// A value as scenes have it, or one at an end of what is finite.
fn value() -> impl Strategy<Value = f32> {
    const ENDS: &[f32] =
        &[1e9, -1e9, f32::MAX, f32::MIN, f32::MIN_POSITIVE, 1e-45, 0.0, -0.0, 1e20, 88.0, -104.0];
    prop_oneof![12 => -2.0..2.0_f32, 1 => prop::sample::select(ENDS)]
}

fn frame_of(values: &[f32]) -> GaussianFrame {
    let mut planes = values.chunks_exact(COUNT).map(<[f32]>::to_vec);
    let mut next = || planes.next().unwrap();
    let planes = Planes {
        position: [(); 3].map(|()| next()),
        log_scale: [(); 3].map(|()| next()),
        // A rotation has a direction.
        rotation: [vec![1.0; COUNT], next(), next(), next()],
        opacity_logit: next(),
        dc: [(); 3].map(|()| next()),
        sh: (0..9).map(|_| next()).collect(),
    };
    GaussianFrame::from_planes(1, planes).unwrap().with_unit_rotations()
}

/// Encodes frames; what comes out decodes, what is refused is refused for what is in a frame.
fn check(mut frames: Vec<GaussianFrame>, settings: &Settings) {
    let mut stream = Vec::new();
    match encode(&mut frames, settings, &mut stream, &mut |_, _| {}) {
        Ok(_) => {
            let summary = decode_stream(&stream, &Options::default(), |_, _| ControlFlow::Continue(()));
            assert_eq!(summary.verdict(), None);
        }
        Err(error) => {
            let is_named = matches!(error, Error::OutOfGrid { .. } | Error::Invalid { .. });
            assert!(is_named, "{error}");
        }
    }
}

fn settings() -> Settings {
    Settings { preset: Preset::Fast, steps: Quality::Medium.steps(), block_log2: 6, ..Settings::default() }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, ..ProptestConfig::default() })]

    #[test]
    fn one_frame_of_any_finite_values(values in prop::collection::vec(value(), PLANES * COUNT)) {
        check(vec![frame_of(&values)], &settings());
    }

    #[test]
    fn a_sequence_of_any_finite_values(
        values in prop::collection::vec(value(), PLANES * COUNT),
        changes in prop::collection::vec((0..PLANES * COUNT, value()), 0..6),
    ) {
        let mut later = values.clone();
        changes.into_iter().for_each(|(at, value)| later[at] = value);
        let structure = Structure::Predicted { layers: 1 };
        let settings = Settings { structure, spatial_layers: 2, gop: 2, ..settings() };
        check(vec![frame_of(&values), frame_of(&later)], &settings);
    }
}

#[test]
fn the_largest_and_the_smallest_log_scale_stand_together() {
    let mut values = vec![0.25; PLANES * COUNT];
    values[3 * COUNT..6 * COUNT].iter_mut().step_by(2).for_each(|log| *log = 1e9);
    values[3 * COUNT + 1..6 * COUNT].iter_mut().step_by(2).for_each(|log| *log = -1e9);
    check(vec![frame_of(&values)], &settings());
}

/// What is coded of a value that is predicted is a difference, and may be twice as large as the value.
#[test]
fn opposite_rotations_and_opacities_are_coded_with_the_finest_steps() {
    let frame = |sign: f32| {
        let mut values: Vec<f32> = (0..PLANES * COUNT).map(|at| (at * 7 % 11) as f32 / 11.0).collect();
        for row in 0..COUNT {
            let sign = if row % 2 == 0 { sign } else { -sign };
            values[6 * COUNT + row] = 40.0 * sign;
            values[9 * COUNT + row] = 6.0 * sign;
        }
        frame_of(&values)
    };
    let steps = Quality::VisuallyLossless.steps();
    for step in [0.0004, 0.00004, 1e-6] {
        let steps = Steps { rotation: step, opacity: 25.0 * step.max(0.0001), ..steps };
        let structure = Structure::Predicted { layers: 1 };
        let settings = Settings { steps, structure, spatial_layers: 2, gop: 2, ..settings() };
        let mut stream = Vec::new();
        encode(&mut vec![frame(1.0), frame(-1.0)], &settings, &mut stream, &mut |_, _| {}).unwrap();
        let summary = decode_stream(&stream, &Options::default(), |_, _| ControlFlow::Continue(()));
        assert_eq!(summary.verdict(), None);
    }
}

/// A PSNR that needs finer steps than values of 16 bits have is missed, and reported as it is.
#[test]
fn a_quality_out_of_reach_is_no_error() {
    for (preset, gaussians) in [(Preset::Fast, 100), (Preset::Balanced, 100), (Preset::Fast, 5_000)] {
        let scene = BuiltinScene { gaussians, frames: 1, ..BuiltinScene::default() };
        let settings = Settings { psnr: Some(90.0), verify: true, ..Settings::of(preset) };
        let mut stream = Vec::new();
        let report = encode(&mut vec![scene.frame(0)], &settings, &mut stream, &mut |_, _| {}).unwrap();
        let reached = report.pictures.and_then(|pictures| pictures.fitted_psnr()).unwrap();
        assert!((60.0..92.0).contains(&reached), "{reached}");
        let summary = decode_stream(&stream, &Options::default(), |_, _| ControlFlow::Continue(()));
        assert_eq!(summary.verdict(), None);
    }
}

/// Components of colour have 14 bits: with steps that would need more they keep those that they have.
#[test]
fn colours_are_not_cut_off_by_steps_that_are_too_fine() {
    let quality = |dc: f32, sh: f32| {
        let scene = BuiltinScene { gaussians: 1_000, frames: 1, ..BuiltinScene::default() };
        let fine = Steps { position_bits: 16.0, log_scale: 0.001, rotation: 0.001, opacity: 0.001, dc, sh };
        let settings = Settings { steps: fine, verify: true, ..Settings::of(Preset::Fast) };
        let mut stream = Vec::new();
        let report = encode(&mut vec![scene.frame(0)], &settings, &mut stream, &mut |_, _| {}).unwrap();
        report.pictures.unwrap().frames[0].psnr.unwrap()
    };
    let usual = quality(0.001, 0.002);
    let finest = quality(1e-6, 1e-6);
    assert!(usual > 60.0 && finest > usual - 1.0, "{usual} {finest}");
}
