//! Every coded Gaussian is its source, canonicalised, within half a step: matched by the coded order itself.

use crate::common::{Random, decoded, encoded, strict};
use proptest::prelude::*;
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::position::morton;
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::decode_stream;
use splatstream_encoder::canonical::canonicalise;
use splatstream_encoder::{Importance, Preset, Quality, Settings, ShChoice};
use splatstream_format::syntax::SequenceParameters;
use splatstream_scene::{GaussianFrame, Planes, importance, sh_coefficients};
use std::ops::ControlFlow;

/// What is special about the Gaussians of a frame.
#[derive(Debug, Clone, Copy)]
enum Kind {
    Plain,
    /// Every second one is the one before it.
    Duplicates,
    OnePoint,
    /// Log-scales from -30 to 8, opacities from -60 to 60.
    Extremes,
    Spheres,
    /// Quaternions whose w is near 0, or whose two largest parts are nearly alike, of either sign.
    DoubleCover,
}

fn frame(kind: Kind, count: usize, sh_degree: u8, seed: u64) -> GaussianFrame {
    let mut random = Random(seed);
    let mut unit = || (random.next() >> 40) as f32 / (1 << 24) as f32;
    let mut plane =
        |low: f32, high: f32| -> Vec<f32> { (0..count).map(|_| low + (high - low) * unit()).collect() };
    let (scales, opacities) = match kind {
        Kind::Extremes => ((-30.0, 8.0), (-60.0, 60.0)),
        _ => ((-7.0, -1.0), (-5.0, 6.0)),
    };
    let mut planes = Planes {
        position: [plane(-3.0, 5.0), plane(0.0, 1.0), plane(100.0, 101.0)],
        log_scale: [(); 3].map(|()| plane(scales.0, scales.1)),
        rotation: [(); 4].map(|()| plane(-1.0, 1.0)),
        opacity_logit: plane(opacities.0, opacities.1),
        dc: [(); 3].map(|()| plane(-2.0, 2.0)),
        sh: (0..3 * sh_coefficients(sh_degree)).map(|_| plane(-0.3, 0.3)).collect(),
    };
    for i in 0..count {
        match kind {
            Kind::Spheres => {
                planes.log_scale[1][i] = planes.log_scale[0][i];
                planes.log_scale[2][i] = planes.log_scale[0][i];
            }
            Kind::DoubleCover => {
                let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
                planes.rotation[0][i] *= 1.0e-6;
                planes.rotation[1][i] = sign;
                planes.rotation[2][i] = sign * (1.0 - 1.0e-6 * (i % 5) as f32);
            }
            Kind::OnePoint => (0..3).for_each(|axis| planes.position[axis][i] = 1.25),
            _ => {}
        }
        // A direction is what a quaternion needs.
        planes.rotation[3][i] += 0.01;
    }
    let frame = GaussianFrame::from_planes(sh_degree, planes).unwrap();
    let picks: Vec<u32> =
        (0..count as u32).map(|i| if matches!(kind, Kind::Duplicates) { i / 2 * 2 } else { i }).collect();
    frame.select(&picks)
}

fn grid_point(frame: &GaussianFrame, row: usize, sequence: &SequenceParameters) -> [u32; 3] {
    let last = ((1_u32 << sequence.position_bits) - 1) as f32;
    [0, 1, 2].map(|axis| {
        let value =
            (frame.position()[axis][row] - sequence.position_offset()[axis]) / sequence.position_step();
        value.clamp(0.0, last).round_ties_even() as u32
    })
}

/// The Gaussians of the source in coded order: by importance in refinements, by Morton code in each.
fn coded_order(frame: &GaussianFrame, sequence: &SequenceParameters) -> Vec<usize> {
    let order = importance::order(&importance::opacity_volume(frame));
    let mut start = 0;
    let mut coded = Vec::new();
    for r in 0..sequence.refinement_count {
        let end = sequence.prefix_length(r, frame.len() as u32) as usize;
        let code = |&row: &u32| {
            let [x, y, z] = grid_point(frame, row as usize, sequence);
            (morton(x, y, z), row)
        };
        let mut unit: Vec<(u64, u32)> = order[start..end].iter().map(code).collect();
        unit.sort_unstable();
        coded.extend(unit.into_iter().map(|(_, row)| row as usize));
        start = end;
    }
    coded
}

fn check(
    kind: Kind,
    count: usize,
    sh_degree: u8,
    settings: &Settings,
    seed: u64,
) -> Result<(), TestCaseError> {
    let source = frame(kind, count, sh_degree, seed);
    let (bytes, report) = encoded(vec![source.clone()], settings);
    let mut output = None;
    let summary = decode_stream(&bytes, &strict(), |sequence, frame| {
        output = Some((*sequence, frame.digest, to_gaussians(frame.planes, sequence)));
        ControlFlow::Continue(())
    });
    prop_assert_eq!(summary.verdict(), None);
    let (sequence, digest, output) = output.unwrap();
    prop_assert_eq!(digest, report.digests.first().copied());
    let all: Vec<u32> = (0..count as u32).collect();
    let canonical = canonicalise(&source, &all, sequence.canonical_axes());
    prop_assert_eq!(output.len(), count);
    for (i, row) in coded_order(&canonical, &sequence).into_iter().enumerate() {
        let within = |what: &str, before: f32, after: f32, step: f32| {
            // Half a step, and the rounding of two sums and a quotient in f32.
            let bound = 0.5 * step + 4.0 * f32::EPSILON * (before.abs() + after.abs() + step);
            prop_assert!((before - after).abs() <= bound, "{:?} {}: {} became {}", kind, what, before, after);
            Ok(())
        };
        for axis in 0..3 {
            let offset = sequence.position_offset()[axis].abs();
            let slack = 4.0 * f32::EPSILON * offset;
            within(
                "position",
                canonical.position()[axis][row],
                output.position()[axis][i],
                sequence.position_step() + slack,
            )?;
            within(
                "log_scale",
                canonical.log_scale()[axis][row],
                output.log_scale()[axis][i],
                sequence.log_scale_step(),
            )?;
        }
        within(
            "opacity",
            canonical.opacity_logit()[row],
            output.opacity_logit()[i],
            sequence.opacity_step(),
        )?;
        let scales = [0, 1, 2].map(|axis| output.log_scale()[axis][i]);
        let is_sphere = scales[0] == scales[1] && scales[1] == scales[2];
        for part in 1..4 {
            let (before, after) = (canonical.rotation()[part][row], output.rotation()[part][i]);
            if is_sphere {
                prop_assert_eq!(after, 0.0, "a sphere needs no rotation");
            } else {
                within("rotation", before, after, sequence.rotation_step())?;
            }
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    // covers: SS-PO-002, SS-DG-002
    #[test]
    fn a_coded_gaussian_is_its_source_within_half_a_step(
        kind in prop_oneof![
            Just(Kind::Plain), Just(Kind::Duplicates), Just(Kind::OnePoint), Just(Kind::Extremes),
            Just(Kind::Spheres), Just(Kind::DoubleCover),
        ],
        count in prop_oneof![Just(0_usize), Just(1), Just(2), Just(3), Just(10), Just(101), Just(1000)],
        sh_degree in 0_u8..=3,
        preset in prop_oneof![Just(Preset::Fast), Just(Preset::Balanced)],
        quality in prop_oneof![Just(Quality::Low), Just(Quality::High), Just(Quality::VisuallyLossless)],
        sh in prop_oneof![Just(ShChoice::Coefficients), Just(ShChoice::VectorQuantised)],
        seed: u64,
    ) {
        let settings = Settings {
            preset,
            sh,
            steps: quality.steps(),
            importance: Some(Importance::Volume),
            keep_invisible: true,
            block_log2: 7,
            ..Settings::default()
        };
        check(kind, count, sh_degree, &settings, seed)?;
    }
}

#[test]
fn what_pictures_hardly_show_takes_every_second_point_of_its_grids() {
    let settings = Settings {
        refinements: vec![50, 100],
        importance: Some(Importance::Contribution),
        keep_invisible: true,
        ..Settings::default()
    };
    let (bytes, _) = encoded(vec![frame(Kind::Plain, 400, 0, 3)], &settings);
    let (frames, _) = decoded(&bytes, &strict());
    let planes = &frames[0].planes;
    for plane in planes.log_scale.iter().chain(&planes.rotation) {
        let odd = |values: &[i32]| values.iter().filter(|value| *value % 2 != 0).count();
        assert!(odd(&plane[..200]) > 20, "the first half takes every point");
        assert_eq!(odd(&plane[200..]), 0);
    }
}

// covers: SS-OP-004
#[test]
fn prefixes_of_every_kind_of_frame_are_nested_exactly() {
    for kind in
        [Kind::Plain, Kind::Duplicates, Kind::OnePoint, Kind::Extremes, Kind::Spheres, Kind::DoubleCover]
    {
        let settings =
            Settings { refinements: vec![1, 7, 50, 99, 100], block_log2: 6, ..Settings::default() };
        let frames = vec![frame(kind, 333, 1, 5), frame(kind, 334, 1, 6)];
        let (bytes, _) = encoded(frames, &settings);
        let (whole, summary) = decoded(&bytes, &strict());
        assert_eq!(summary.verdict(), None);
        for refinement in 0..5 {
            let mut options: Options = strict();
            options.operating_point.refinement = refinement;
            let (few, summary) = decoded(&bytes, &options);
            assert_eq!((summary.verdict(), few.len()), (None, 2));
            for (few, whole) in few.iter().zip(&whole) {
                let mut prefix = whole.planes.clone();
                prefix.truncate(few.planes.len());
                assert_eq!(few.planes, prefix, "{kind:?} at r{refinement}");
            }
        }
    }
}
