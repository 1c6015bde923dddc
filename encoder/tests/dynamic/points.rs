//! Operating points of profile Dynamic: extraction and decoding at a point agree, prefixes are nested, the list of
//! points in the stream says what they cost.

use crate::common::dynamic::{Whole, decoded_at, predicted, scene, units_of_frames};
use crate::common::encoded;
use splatstream_decoder::operating_point::{OperatingPoint, extract};
use splatstream_decoder::process::DecodedFrame;
use splatstream_encoder::{Anchor, Settings, Structure};
use splatstream_files::builtin::Tracking;
use splatstream_format::Limits;
use splatstream_format::payload::OperatingPoints;
use splatstream_format::syntax::UnitType;

/// Streams of every structure, in GOPs of five frames.
fn streams() -> Vec<(String, Vec<u8>)> {
    let intra = Structure::Intra;
    let temporal = |layers| Structure::Predicted { layers };
    let structures = [
        (1, temporal(1)),
        (1, temporal(2)),
        (2, temporal(3)),
        (3, intra),
        (4, temporal(4)),
        (2, temporal(1)),
    ];
    let encode = |((spatial_layers, structure), anchor): ((u8, Structure), Anchor)| {
        let settings = Settings { gop: 5, spatial_layers, structure, anchor, ..predicted(1) };
        let frames = scene(120, 7, 1, Tracking::Untracked);
        (format!("S {spatial_layers}, {structure:?}, {anchor:?}"), encoded(frames, &settings).0)
    };
    let nested = structures.map(|structure| (structure, Anchor::Nested));
    let whole = [(1, temporal(2)), (2, temporal(3))].map(|structure| (structure, Anchor::Whole));
    nested.into_iter().chain(whole).map(encode).collect()
}

/// What of a frame must agree; the rest depends on what else is in the stream.
fn essence(frame: &DecodedFrame) -> impl PartialEq + core::fmt::Debug {
    (frame.index, frame.frame_type, frame.planes.clone(), frame.carried, frame.digest)
}

// covers: SS-OP-002, SS-OP-003, SS-OP-007
#[test]
fn what_is_extracted_at_a_point_decodes_as_the_stream_at_that_point() {
    let limits = Limits::default();
    for (what, bytes) in streams() {
        let whole = Whole::new(&bytes);
        for (&point, frames) in &whole.points {
            let small = extract(&bytes, point, &limits).unwrap();
            for at in [point, OperatingPoint::ALL] {
                let (extracted, summary) = decoded_at(&small, at);
                assert_eq!(summary.verdict(), None, "{what}: extracted at {point}, decoded at {at}");
                assert!(
                    extracted.iter().map(essence).eq(frames.iter().map(essence)),
                    "{what}: extracted at {point}, decoded at {at}"
                );
            }
        }
        assert_eq!(extract(&bytes, OperatingPoint::ALL, &limits).unwrap(), bytes);
    }
}

// covers: SS-OP-008
#[test]
fn extracting_twice_is_extracting_at_the_smaller_point() {
    let limits = Limits::default();
    for (what, bytes) in streams() {
        let points: Vec<OperatingPoint> = Whole::new(&bytes).points.into_keys().collect();
        let at = |bytes: &[u8], point| extract(bytes, point, &limits).unwrap();
        for &small in &points {
            let once = at(&bytes, small);
            let holds = |point: &&OperatingPoint| {
                point.spatial >= small.spatial
                    && point.temporal >= small.temporal
                    && point.refinement >= small.refinement
            };
            for &large in points.iter().filter(holds) {
                assert!(at(&at(&bytes, large), small) == once, "{what}: {large}, then {small}");
                assert!(at(&once, large) == once, "{what}: {small}, then {large}");
            }
        }
    }
}

// covers: SS-CA-001, SS-CA-003, SS-PA-001
#[test]
fn what_is_exact_at_a_refinement_is_a_prefix_of_what_is_exact_at_the_next() {
    for (what, bytes) in streams() {
        let whole = Whole::new(&bytes);
        for (point, frames) in &whole.points {
            let more = OperatingPoint { refinement: point.refinement + 1, ..*point };
            let Some(more) = whole.points.get(&more) else { continue };
            assert_eq!(frames.len(), more.len());
            for (less, more) in frames.iter().zip(more) {
                let exact = |frame: &DecodedFrame, count: usize| {
                    let mut planes = frame.planes.clone();
                    planes.truncate(count);
                    planes
                };
                let count = less.planes.len() - less.carried;
                assert!(count <= more.planes.len() - more.carried, "{what}: {point}, frame {}", less.index);
                assert!(exact(less, count) == exact(more, count), "{what}: {point}, frame {}", less.index);
            }
        }
        let complete = whole.all().iter().all(|frame| frame.carried == 0);
        assert!(complete, "{what}: with all refinements nothing is carried");
    }
}

#[test]
fn a_temporal_layer_adds_frames_and_changes_none() {
    for (what, bytes) in streams() {
        let whole = Whole::new(&bytes);
        for (point, frames) in &whole.points {
            let more = OperatingPoint { temporal: point.temporal + 1, ..*point };
            let Some(more) = whole.points.get(&more) else { continue };
            assert!(frames.len() < more.len(), "{what}: {point}");
            let common: Vec<&DecodedFrame> =
                more.iter().filter(|frame| frames.iter().any(|few| few.index == frame.index)).collect();
            assert!(frames.iter().eq(common), "{what}: {point}");
        }
    }
}

// covers: SS-PL-001, SS-PL-002
#[test]
fn the_operating_points_unit_says_what_is_decoded_at_each_point() {
    let limits = Limits::default();
    for (what, bytes) in streams() {
        let whole = Whole::new(&bytes);
        let of_type =
            |kind: UnitType| whole.units.iter().find(|unit| unit.header.unit_type() == kind).unwrap();
        let unit = of_type(UnitType::OperatingPoints);
        let list = OperatingPoints::parse(unit.payload, unit.payload_at).unwrap();
        assert_eq!(list.entries.len(), whole.points.len(), "{what}");
        for (entry, (point, frames)) in list.entries.iter().zip(&whole.points) {
            assert_eq!(entry.key(), (point.spatial, point.temporal, point.refinement), "{what}");
            assert_eq!(entry.frame_count as usize, frames.len(), "{what}: {point}");
            let exact: usize = frames.iter().map(|frame| frame.planes.len() - frame.carried).sum();
            assert_eq!(entry.gaussian_count, exact as u64, "{what}: {point}");
            let small = extract(&bytes, *point, &limits).unwrap();
            assert_eq!(entry.byte_count, units_of_frames(&small), "{what}: {point}");
        }
    }
}

/// With whole anchors most Gaussians are carried at the first refinement, so that nothing is missing from a picture.
#[test]
fn a_still_scene_shows_every_gaussian_at_the_first_refinement_of_whole_anchors() {
    let still = scene(150, 1, 0, Tracking::Tracked)[0].clone();
    let (bytes, _) = encoded(vec![still; 4], &Settings { anchor: Anchor::Whole, ..predicted(1) });
    let whole = Whole::new(&bytes);
    for frame in whole.at(0, 0, 0) {
        assert_eq!(frame.planes, whole.all()[0].planes, "frame {}", frame.index);
    }
}
