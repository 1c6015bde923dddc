//! What a sequence is in parts: nested prefixes, lower layers, beginnings that are lost, the scene that is described.

use crate::common::dynamic::{Whole, decoded_at, predicted, quick, range, scene};
use crate::common::{decoded, encoded, strict};
use splatstream_decoder::operating_point::{OperatingPoint, operating_points};
use splatstream_decoder::process::Options;
use splatstream_encoder::{Anchor, Preset, Quality, Settings};
use splatstream_files::builtin::Tracking;
use splatstream_format::Limits;
use splatstream_format::payload::{SceneDescription, UpAxis};
use splatstream_format::syntax::{Camera, UnitType};
use splatstream_gaussians::GaussianFrame;

/// The first refinement of a predicted sequence has 10 % of its Gaussians and at most a quarter of its bytes.
#[test]
fn the_first_refinement_of_a_predicted_sequence_takes_a_quarter_of_the_bytes_at_most() {
    for tracking in [Tracking::Tracked, Tracking::Untracked] {
        for (spatial_layers, layers) in [(1, 1), (3, 2)] {
            let frames = scene(4000, 8, 1, tracking);
            let settings = Settings {
                steps: Quality::High.steps(),
                refinements: vec![10, 20, 30, 50, 100],
                block_log2: 14,
                spatial_layers,
                ..predicted(layers)
            };
            let (bytes, _) = encoded(frames, &settings);
            let points = operating_points(&bytes, &Limits::default()).unwrap();
            let all = points.last().unwrap();
            let is_first = |point: &OperatingPoint| *point == OperatingPoint { refinement: 0, ..all.point };
            let first = points.iter().find(|info| is_first(&info.point)).unwrap();
            let share = first.bytes as f64 / all.bytes as f64;
            assert!(share <= 0.25, "{tracking:?}, {spatial_layers} layers: {share} of the bytes");
        }
    }
}

/// Who takes lower layers plays every frame: the I frame, moved by the cells.
#[test]
fn lower_spatial_layers_play_every_frame() {
    let still = scene(400, 1, 0, Tracking::Tracked).remove(0);
    let at = |t: u8| {
        let mut planes = still.clone().into_planes();
        planes.position[0].iter_mut().for_each(|x| *x += 0.2 * f32::from(t));
        GaussianFrame::from_planes(0, planes).unwrap()
    };
    let frames: Vec<GaussianFrame> = (0..6).map(at).collect();
    let steps = Quality::High.steps();
    for anchor in [Anchor::Nested, Anchor::Whole] {
        let (bytes, _) =
            encoded(frames.clone(), &Settings { spatial_layers: 2, anchor, steps, ..predicted(2) });
        for refinement in 0..3 {
            let point = OperatingPoint { spatial: 0, temporal: 1, refinement };
            let (shown, summary) = decoded_at(&bytes, point);
            assert_eq!(summary.verdict(), None);
            assert_eq!(shown.len(), frames.len());
            let counts: Vec<usize> = shown.iter().map(|frame| frame.planes.len()).collect();
            assert!(counts[0] > 0 && counts.iter().all(|&count| count == counts[0]), "{counts:?}");
            assert!(shown[1..].iter().all(|frame| frame.carried == frame.planes.len()));
            assert!(shown[5].planes != shown[0].planes, "the scene moves");
        }
    }
}

/// Prefixes of predicted frames are compensated as those of their I frame: what fills a hole does not flicker.
#[test]
fn all_frames_of_a_gop_are_compensated_alike() {
    let settings = Settings { preset: Preset::Balanced, ..predicted(1) };
    let (bytes, _) = encoded(scene(2000, 3, 0, Tracking::Tracked), &settings);
    let (shown, summary) = decoded_at(&bytes, OperatingPoint { spatial: 0, temporal: 0, refinement: 0 });
    assert_eq!(summary.verdict(), None);
    assert!(!shown[0].compensation.exact.is_zero(), "a fifth of the Gaussians leaves holes");
    assert!(shown.iter().all(|frame| frame.compensation == shown[0].compensation && frame.carried == 0));
}

#[test]
fn a_stream_without_its_beginning_is_decoded_from_the_second_gop_on() {
    let settings = Settings { gop: 3, ..predicted(2) };
    let (bytes, _) = encoded(scene(200, 9, 0, Tracking::Tracked), &settings);
    let whole = Whole::new(&bytes);
    let parameters = |units: &Whole<'_>| {
        let of_type = |unit: &&splatstream_format::unit::Unit<'_>| {
            unit.header.unit_type() == UnitType::SequenceParameters
        };
        units.units.iter().filter(of_type).map(|unit| range(unit)).collect::<Vec<_>>()
    };
    let copies = parameters(&whole);
    assert_eq!(copies.len(), 3, "before each GOP");
    let mut damaged = bytes.clone();
    damaged[copies[0].end - 1] ^= 1;
    let (shown, summary) = decoded(&damaged, &Options { stop_at_first_error: false, ..strict() });
    assert_eq!((shown.as_slice(), summary.errors.len()), (&whole.all()[3..], 1));
}

#[test]
fn a_stream_describes_its_scene() {
    let camera =
        Camera { position: [1.0, 2.0, -3.0], rotation: [1.0, 0.0, 0.0, 0.0], vertical_field_of_view: 0.8 };
    let described = SceneDescription {
        title: Some("a scene".to_owned()),
        up_axis: UpAxis::PlusY,
        metres_per_unit: Some(0.5),
        background: Some([0.0, 0.5, 1.0]),
        cameras: vec![camera],
        ..SceneDescription::default()
    };
    let frames = scene(100, 3, 0, Tracking::Tracked);
    let (bytes, _) = encoded(frames.clone(), &Settings { description: described.clone(), ..quick() });
    let whole = Whole::new(&bytes);
    let of_type =
        |unit: &&splatstream_format::unit::Unit<'_>| unit.header.unit_type() == UnitType::SceneDescription;
    let unit = whole.units.iter().find(of_type).unwrap();
    let found = SceneDescription::parse(unit.payload, 0).unwrap();
    let bounds = found.bounds.unwrap();
    assert_eq!(SceneDescription { bounds: None, ..found }, described);
    for (axis, (low, high)) in bounds[0].into_iter().zip(bounds[1]).enumerate() {
        let all = || frames.iter().flat_map(|frame| &frame.position()[axis]).copied();
        assert_eq!(
            (low, high),
            (all().fold(f32::INFINITY, f32::min), all().fold(f32::NEG_INFINITY, f32::max))
        );
    }
}
