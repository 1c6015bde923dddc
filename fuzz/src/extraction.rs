//! Extraction: every operating point of a stream, and points of points.

use crate::LIMITS;
use crate::decode::{choice, stream_of};
use crate::laws::extraction::{chosen, holds_at};
use crate::laws::{Decoded, STRICT};
use crate::seal::{seal, sealed};
use splatstream_decoder::operating_point::{OperatingPoint, all_points, extract, operating_points};
use splatstream_decoder::process::Options;

/// An input is a stream, or edits of one, as for `decode`; what is refused is of no interest here.
pub fn run(data: &[u8]) {
    let stream = stream_of(data);
    let stream = sealed(&stream);
    let strict = Decoded::of(&stream, &STRICT);
    let (Some(sequence), None) = (&strict.sequence, strict.end) else { return };
    let all = extract(&stream, OperatingPoint::ALL, &LIMITS);
    assert!(all.is_ok_and(|all| seal(all) == seal(stream.to_vec())), "everything is not the stream itself");
    let other = chosen(sequence, choice(data));
    for point in all_points(sequence) {
        let part = holds_at(&stream, &strict, point);
        // Only with the highest spatial layer intra frames come in all their refinements (7.19).
        let is_top = |point: OperatingPoint| point.spatial + 1 == sequence.spatial_layer_count;
        if is_top(point) == is_top(other) {
            let (of_part, of_all) =
                (extract(&part, other, &LIMITS), extract(&stream, both(point, other), &LIMITS));
            assert!(of_part == of_all, "{other} of {point} is not what both have");
        }
    }
    costs(&stream);
}

/// The units that belong to both points.
fn both(one: OperatingPoint, other: OperatingPoint) -> OperatingPoint {
    OperatingPoint {
        spatial: one.spatial.min(other.spatial),
        temporal: one.temporal.min(other.temporal),
        refinement: one.refinement.min(other.refinement),
    }
}

/// What operating points are said to cost and to show is what they do.
fn costs(stream: &[u8]) {
    for info in operating_points(stream, &LIMITS).expect("what decodes has operating points") {
        let options = Options { operating_point: info.point, ..STRICT };
        let frames = Decoded::of(stream, &options).frames;
        let gaussians: usize = frames.iter().map(|frame| frame.planes.len() - frame.carried).sum();
        assert_eq!(
            (info.frames as usize, info.gaussians),
            (frames.len(), gaussians as u64),
            "{}",
            info.point
        );
    }
}
