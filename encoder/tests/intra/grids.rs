//! Every coded Gaussian is its source, canonicalised, within half a step: matched by the coded order itself.

use crate::common::{Random, decoded, encoded, strict};
use proptest::prelude::*;
use splatstream_decoder::output::{Companding, to_gaussians};
use splatstream_decoder::position::morton;
use splatstream_decoder::process::Options;
use splatstream_decoder::steps::{Stage, StepRule, step};
use splatstream_decoder::stream::decode_stream;
use splatstream_encoder::canonical::canonicalise;
use splatstream_encoder::{Importance, Laws, Preset, Quality, Settings, ShChoice};
use splatstream_format::syntax::SequenceParameters;
use splatstream_gaussians::{GaussianFrame, Planes, importance, sh_coefficients};
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
    let mut random = Random::new(seed);
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
    let companding = Companding::new(sequence);
    let last = (1_u32 << sequence.position_bits) - 1;
    [0, 1, 2].map(|axis| {
        let offset = f64::from(sequence.position_offset()[axis]);
        let value = (f64::from(frame.position()[axis][row]) - offset) / f64::from(sequence.position_step());
        // The last point that is not beyond, or the one after it.
        let (mut low, mut high) = (0, last + 1);
        while high - low > 1 {
            let middle = low + (high - low) / 2;
            if companding.expand(middle) as f64 <= value { low = middle } else { high = middle }
        }
        let apart = |code: u32| (companding.expand(code) as f64 - value).abs();
        if low < last && (apart(low + 1), low % 2) < (apart(low), 1) { low + 1 } else { low }
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
        output = Some((*sequence, frame.digest, to_gaussians(frame.planes, sequence).unwrap()));
        ControlFlow::Continue(())
    });
    prop_assert_eq!(summary.verdict(), None);
    let (sequence, digest, output) = output.unwrap();
    prop_assert_eq!(digest, report.digests.first().copied());
    let canonical = canonicalise(source.clone(), sequence.canonical_axes());
    prop_assert_eq!(output.len(), count);
    let companding = Companding::new(&sequence);
    // At the border of two segments the step to one side is larger.
    let gap = |code: u32| companding.expand(code + 1) - companding.expand(code);
    let step_at = |code: u32| gap(code).max(gap(code.max(1) - 1)) as f32;
    for (i, row) in coded_order(&canonical, &sequence).into_iter().enumerate() {
        let within = |what: &str, before: f32, after: f32, step: f32| {
            // Half a step, the fraction of a step to which values are known, and the rounding of two sums and a
            // quotient in f32.
            let bound = 0.502 * step + 4.0 * f32::EPSILON * (before.abs() + after.abs() + step);
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
                sequence.position_step() * step_at(grid_point(&canonical, row, &sequence)[axis]) + slack,
            )?;
            within(
                "log_scale",
                canonical.log_scale()[axis][row],
                output.log_scale()[axis][i],
                settings.steps.log_scale,
            )?;
        }
        within("opacity", canonical.opacity_logit()[row], output.opacity_logit()[i], settings.steps.opacity)?;
        let scales = [0, 1, 2].map(|axis| output.log_scale()[axis][i]);
        let is_sphere = scales[0] == scales[1] && scales[1] == scales[2];
        for part in 1..4 {
            let (before, after) = (canonical.rotation()[part][row], output.rotation()[part][i]);
            if is_sphere {
                prop_assert_eq!(after, 0.0, "a sphere needs no rotation");
            } else {
                within("rotation", before, after, settings.steps.rotation)?;
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
fn steps_follow_from_the_refinement_and_the_size() {
    let mut laws = Laws { area: 0.25, area_reference: -8.0, ..Laws::default() };
    laws.coarser[1] = 4;
    let settings = Settings {
        laws,
        refinements: vec![50, 100],
        importance: Some(Importance::Contribution),
        keep_invisible: true,
        ..Settings::default()
    };
    let (bytes, _) = encoded(vec![frame(Kind::Plain, 400, 0, 3)], &settings);
    let mut found = None;
    let summary = decode_stream(&bytes, &strict(), |sequence, frame| {
        found = Some((*sequence, frame.planes));
        ControlFlow::Continue(())
    });
    assert_eq!(summary.verdict(), None);
    let (sequence, planes) = found.unwrap();
    assert!(sequence.size_weight[0] > 0);
    let rules = [[5; 5], [9; 5]].map(|announced| StepRule::new(&sequence, announced));
    let mut exponents = Vec::new();
    for row in 0..400 {
        let rule = &rules[row / 200];
        let log_scale = planes.log_scale.each_ref().map(|plane| plane[row]);
        let exponent = rule.of(Stage::Rotation, log_scale, planes.opacity[row]);
        assert!(planes.rotation.iter().all(|plane| plane[row] % step(exponent) == 0));
        assert_eq!(log_scale[0] % step(rule.of_largest()), 0);
        exponents.push(exponent);
    }
    exponents.sort_unstable();
    exponents.dedup();
    assert!(exponents.len() > 4, "{exponents:?}");
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
