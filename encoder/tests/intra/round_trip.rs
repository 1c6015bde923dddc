//! What the encoder reconstructs is what the decoder reconstructs, for any frame and any setting.

use crate::common::{builtin, decoded, encoded, frame_of, planes, strict};
use proptest::prelude::*;
use splatstream_decoder::operating_point::{OperatingPoint, extract, operating_points};
use splatstream_decoder::output::{Companding, to_gaussians};
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::decode_stream;
use splatstream_encoder::{Importance, Preset, Quality, Settings, ShChoice, Steps, Tools};
use splatstream_format::Limits;
use splatstream_format::syntax::UnitHeader;
use splatstream_format::unit::Stream;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::camera::Up;
use std::ops::ControlFlow;

fn settings() -> impl Strategy<Value = Settings> {
    let preset = prop_oneof![Just(Preset::Fast), Just(Preset::Balanced), Just(Preset::Small)];
    let quality = prop_oneof![Just(Quality::Low), Just(Quality::High), Just(Quality::VisuallyLossless)];
    let sh = prop_oneof![Just(ShChoice::Auto), Just(ShChoice::Coefficients), Just(ShChoice::VectorQuantised)];
    let refinements = prop_oneof![Just(vec![100]), Just(vec![10, 20, 30, 50, 100]), Just(vec![1, 99, 100])];
    let tools =
        any::<[bool; 5]>().prop_map(|[contexts, axis_sort, sh_transform, table_reuse, adaptive_steps]| {
            Tools { contexts, axis_sort, sh_transform, table_reuse, adaptive_steps, ..Tools::default() }
        });
    let importance = prop_oneof![
        Just(None),
        Just(Some(Importance::Removal)),
        Just(Some(Importance::Contribution)),
        Just(Some(Importance::Footprint)),
        Just(Some(Importance::Volume))
    ];
    // Two small pictures: what they show does not matter here.
    let cameras = splatstream_render::camera::ring(&frame_of(&[1.0, -1.0, 0.5], 20, 0), Up::default(), 2, 32);
    (preset, quality, sh, refinements, tools, importance, 1_u32..4, 6_u8..=8).prop_map(
        move |(preset, quality, sh, refinements, tools, importance, gop, block_log2)| Settings {
            preset,
            steps: quality.steps(),
            sh,
            refinements,
            gop,
            block_log2,
            keep_invisible: true,
            tools,
            importance,
            cameras: cameras.clone(),
            ..Settings::default()
        },
    )
}

fn frames() -> impl Strategy<Value = Vec<GaussianFrame>> {
    let count = prop_oneof![Just(0_usize), Just(1), Just(2), Just(3), Just(10), Just(101), 100..300_usize];
    let number = prop_oneof![Just(0.0_f32), Just(1.0), Just(-1.0), -1.0..1.0_f32, -8.0..8.0_f32];
    let frame = (prop::collection::vec(number, 1..400), count);
    (prop::collection::vec(frame, 1..4), 0_u8..=3).prop_map(|(frames, sh_degree)| {
        frames.iter().map(|(numbers, count)| frame_of(numbers, *count, sh_degree)).collect()
    })
}

/// Bytes of the units that an operating point is made of, headers included: not what a stream has once.
fn bytes_of_frames(stream: &[u8]) -> u64 {
    let units = Stream::open(stream, &Limits::default()).unwrap().units().map(Result::unwrap);
    let of_frames = units.filter(|unit| matches!(unit.header.unit_type().code(), 2..=6));
    of_frames.map(|unit| (UnitHeader::SIZE + unit.payload.len()) as u64).sum()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, ..ProptestConfig::default() })]

    // covers: SS-DG-003, SS-DG-004
    #[test]
    fn the_decoder_finds_the_digests_of_the_encoder(frames in frames(), settings in settings()) {
        let counts: Vec<usize> = frames.iter().map(GaussianFrame::len).collect();
        let (bytes, report) = encoded(frames, &settings);
        prop_assert_eq!(report.bytes, bytes.len() as u64);
        let (decoded, summary) = decoded(&bytes, &strict());
        prop_assert_eq!(summary.verdict(), None);
        prop_assert_eq!(decoded.iter().map(|frame| frame.planes.len()).collect::<Vec<_>>(), counts);
        let digests: Vec<u64> = decoded.iter().filter_map(|frame| frame.digest).collect();
        prop_assert_eq!(digests, report.digests);
    }

    // covers: SS-OP-002, SS-OP-004, SS-OP-005, SS-OP-006
    #[test]
    fn an_extracted_stream_decodes_as_the_stream_at_that_point(frames in frames(), settings in settings()) {
        let (bytes, _) = encoded(frames, &settings);
        let full = planes(&bytes);
        let limits = Limits::default();
        for info in operating_points(&bytes, &limits).unwrap() {
            let small = extract(&bytes, info.point, &limits).unwrap();
            prop_assert_eq!(bytes_of_frames(&small), info.bytes);
            prop_assert_eq!(&extract(&small, info.point, &limits).unwrap(), &small);
            let options = Options { operating_point: info.point, ..strict() };
            let (at_point, summary) = decoded(&bytes, &options);
            prop_assert_eq!(summary.verdict(), None);
            let extracted = planes(&small);
            for ((at_point, extracted), full) in at_point.iter().zip(&extracted).zip(&full) {
                prop_assert_eq!(&at_point.planes, extracted);
                let mut prefix = full.clone();
                prefix.truncate(extracted.len());
                prop_assert_eq!(&prefix, extracted);
            }
        }
        prop_assert_eq!(extract(&bytes, OperatingPoint::ALL, &limits).unwrap(), bytes);
    }
}

#[test]
fn the_same_bytes_and_frames_with_any_number_of_threads() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let (bytes, _) = encoded(vec![builtin(5000, 3), builtin(4000, 3)], &Settings::default());
            let decoded = planes(&bytes);
            (bytes, decoded)
        })
    };
    let one = run(1);
    assert!(one == run(2) && one == run(5));
}

/// Each decoded Gaussian has a source Gaussian within half a step, and none is used twice.
#[test]
fn every_attribute_is_within_half_a_step_of_the_source() {
    let source = builtin(2000, 0);
    let tools = Tools::default();
    let settings = Settings { keep_invisible: true, tools, ..Settings::default() };
    let (bytes, report) = encoded(vec![source.clone()], &settings);
    let mut output = None;
    let summary = decode_stream(&bytes, &strict(), |sequence, frame| {
        let codes = frame.planes.position.clone();
        output = Some((codes, Companding::new(sequence), to_gaussians(frame.planes, sequence).unwrap()));
        ControlFlow::Continue(())
    });
    assert_eq!(summary.verdict(), None);
    let (codes, companding, output) = output.unwrap();
    let step_at = |code: u32| (companding.expand(code + 1) - companding.expand(code)) as f32;
    let sorted = |frame: &GaussianFrame, i: usize| {
        let mut scales = [0, 1, 2].map(|axis| frame.log_scale()[axis][i]);
        scales.sort_by(f32::total_cmp);
        scales
    };
    // Half a step, and what f32 rounds at this place.
    let half = |value: f32, code: u32| {
        0.5001 * report.position_step * step_at(code) + 2.0 * f32::EPSILON * value.abs()
    };
    let mut used = vec![false; source.len()];
    let row_codes = |i: usize| [0, 1, 2].map(|axis: usize| codes[axis][i]);
    for i in 0..output.len() {
        let codes = row_codes(i);
        let close = |j: &usize| {
            let position = (0..3).all(|a| {
                let value = source.position()[a][*j];
                (output.position()[a][i] - value).abs() <= half(value, codes[a])
            });
            let scales =
                sorted(&output, i).iter().zip(sorted(&source, *j)).all(|(a, b)| (a - b).abs() <= 0.1005);
            let opacity = (output.opacity_logit()[i] - source.opacity_logit()[*j]).abs() <= 0.1305;
            position && scales && opacity && !used[*j]
        };
        let found = (0..source.len()).find(close);
        used[found.expect("a source Gaussian within half a step")] = true;
    }
}

#[test]
fn extremes_of_scale_and_opacity_are_coded() {
    let mut planes = builtin(100, 0).into_planes();
    planes.log_scale[0][3] = -30.0;
    planes.log_scale[1][4] = 10.0;
    planes.opacity_logit[5] = 80.0;
    planes.opacity_logit[6] = -80.0;
    for axis in 0..3 {
        planes.log_scale[axis][7] = -4.0;
        planes.position[axis].fill(2.5);
    }
    planes.rotation = [0, 1, 2, 3].map(|part| planes.rotation[part].iter().map(|v| v * 1.0e-3).collect());
    let frame = GaussianFrame::from_planes(0, planes).unwrap();
    let steps = Steps { opacity: 0.4, ..Settings::default().steps };
    let settings = Settings { steps, keep_invisible: true, ..Settings::default() };
    let (bytes, _) = encoded(vec![frame], &settings);
    let decoded = &crate::common::planes(&bytes)[0];
    let range = decoded.opacity.iter().max().unwrap() - decoded.opacity.iter().min().unwrap();
    // Steps that are asked for are eight of the finest.
    assert!((range - 8 * 400).abs() <= 8, "{range}");
    assert!(
        decoded.position.iter().all(|plane| plane.iter().all(|&q| q == 0)),
        "one point is one grid point"
    );
}

fn refusal(frames: Vec<GaussianFrame>, settings: &Settings) -> String {
    let mut frames = frames;
    let error = splatstream_encoder::encode(&mut frames, settings, &mut Vec::new(), &mut |_, _| {});
    error.unwrap_err().to_string()
}

#[test]
fn values_beyond_every_grid_are_named_with_frame_gaussian_and_property() {
    for (attribute, value) in [("log_scale", 1.0e9), ("log_scale", -1.0e9), ("position", 1.0e30)] {
        let mut planes = builtin(100, 0).into_planes();
        let plane = if attribute == "position" { &mut planes.position[1] } else { &mut planes.log_scale[1] };
        plane[42] = value;
        let frames = vec![builtin(100, 0), GaussianFrame::from_planes(0, planes).unwrap()];
        for keep_invisible in [true, false] {
            let settings = Settings { keep_invisible, ..Settings::default() };
            let message = refusal(frames.clone(), &settings);
            assert!(message.contains(&format!("frame 1: {attribute} of Gaussian 42 is")), "{message}");
        }
    }
}

/// A.2: no payload may stand for more than 16 Gaussians in a byte.
#[test]
fn gaussians_that_are_all_alike_take_as_many_bytes_as_they_must() {
    let same = builtin(100, 1).select(&[5; 20_000]);
    for sh in [ShChoice::Coefficients, ShChoice::VectorQuantised] {
        let settings = Settings { sh, preset: Preset::Fast, keep_invisible: true, ..Settings::default() };
        let (bytes, report) = encoded(vec![same.clone(); 2], &settings);
        let (frames, summary) = decoded(&bytes, &strict());
        assert_eq!(summary.verdict(), None);
        assert!(frames.iter().all(|frame| frame.planes.len() == 20_000));
        assert!((2 * 20_000 / 16..10_000).contains(&bytes.len()), "{} bytes", bytes.len());
        assert_eq!(report.gaussians, 40_000);
    }
}

#[test]
fn a_frame_rate_that_no_level_allows_is_refused() {
    let settings = Settings { ticks: (u32::MAX, 1), ..Settings::default() };
    assert!(refusal(vec![builtin(1000, 0)], &settings).contains("frame rate"));
}

#[test]
fn settings_that_no_stream_can_carry_are_refused_with_a_reason() {
    let refused = |settings: Settings| refusal(vec![builtin(100, 0)], &settings);
    let refinements =
        |refinements: &[u8]| Settings { refinements: refinements.to_vec(), ..Settings::default() };
    for wrong in
        [&[][..], &[50], &[100, 100], &[0, 100], &[60, 50, 100], &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 100]]
    {
        assert!(refused(refinements(wrong)).contains("increasing percentages"));
        // Where a quality is asked for, before anything is ranked for it.
        let fitted = Settings { psnr: Some(50.0), ..refinements(wrong) };
        assert!(refused(fitted).contains("increasing percentages"));
    }
    assert!(refused(Settings { gop: 0, ..Settings::default() }).contains("gop is 0"));
    assert!(refused(Settings { sh_degree: Some(4), ..Settings::default() }).contains("0 to 3"));
    assert!(refusal(Vec::new(), &Settings::default()).contains("no frame"));
}
