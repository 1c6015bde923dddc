//! Extraction and decoding at an operating point give the same frames.

use super::{Decoded, PLAIN, exact};
use crate::LIMITS;
use crate::seal::seal;
use splatstream_decoder::operating_point::{OperatingPoint, extract, operating_points};
use splatstream_decoder::process::{DecodedFrame, Options};
use splatstream_format::syntax::SequenceParameters;

/// `whole` is what the whole stream decodes to; `choice` chooses two operating points.
pub fn holds(bytes: &[u8], whole: &Decoded, sequence: &SequenceParameters, choice: u32) {
    let all = extract(bytes, OperatingPoint::ALL, &LIMITS);
    assert!(all.is_ok_and(|all| seal(all) == seal(bytes.to_vec())), "everything is not the stream itself");
    let (point, other) = (chosen(sequence, choice), chosen(sequence, choice.wrapping_mul(0x9e37_79b9)));
    let part = extract(bytes, point, &LIMITS).expect("what decodes can be extracted");
    let from_part = Decoded::of(&part, &PLAIN);
    let from_whole = Decoded::of(bytes, &Options { operating_point: point, ..PLAIN });
    assert_eq!(from_part.errors, [], "what is extracted decodes");
    assert!(from_part.frames == from_whole.frames, "extraction changes a frame");
    let at_point = Decoded::of(&part, &Options { operating_point: point, ..PLAIN });
    assert!(
        at_point.frames == from_whole.frames,
        "at its own point an extracted stream shows something else"
    );
    let is_top = |point: OperatingPoint| point.spatial + 1 == sequence.spatial_layer_count;
    // With whole anchors, a point of all spatial layers has intra frames in all refinements.
    if !sequence.whole_anchor() || is_top(point) == is_top(other) {
        let (of_part, of_all) = (extract(&part, other, &LIMITS), extract(bytes, both(point, other), &LIMITS));
        assert!(of_part == of_all, "{other} of {point} is not what both have");
    }
    shows_less(&from_part.frames, &whole.frames, is_top(point));
    if sequence.temporal_layer_count == 1 {
        assert_eq!(from_part.frames.len(), whole.frames.len(), "a frame is missing");
    }
    costs(bytes, point, &from_part.frames);
}

/// One of the operating points of a sequence.
fn chosen(sequence: &SequenceParameters, choice: u32) -> OperatingPoint {
    let one_of = |count: u8, shift: u32| (choice.rotate_right(shift) % u32::from(count)) as u8;
    OperatingPoint {
        spatial: one_of(sequence.spatial_layer_count, 8),
        temporal: one_of(sequence.temporal_layer_count, 16),
        refinement: one_of(sequence.refinement_count, 0),
    }
}

/// The units that belong to both points.
fn both(one: OperatingPoint, other: OperatingPoint) -> OperatingPoint {
    OperatingPoint {
        spatial: one.spatial.min(other.spatial),
        temporal: one.temporal.min(other.temporal),
        refinement: one.refinement.min(other.refinement),
    }
}

/// Every frame is one of the whole ones. With all spatial layers, what is decoded of it is a prefix.
fn shows_less(parts: &[DecodedFrame], wholes: &[DecodedFrame], is_top: bool) {
    for part in parts {
        let whole = wholes.iter().find(|whole| whole.index == part.index).expect("no frame appears");
        if is_top {
            let (part, mut planes) = (exact(part), exact(whole));
            planes.truncate(part.len());
            assert!(part == planes, "frame {} is not a prefix of the whole one", whole.index);
        }
    }
}

/// What an operating point is said to show is what it does.
fn costs(stream: &[u8], point: OperatingPoint, frames: &[DecodedFrame]) {
    let infos = operating_points(stream, &LIMITS).expect("what decodes has operating points");
    let info = infos.into_iter().find(|info| info.point == point).expect("every point is listed");
    let gaussians: usize = frames.iter().map(|frame| frame.planes.len() - frame.carried).sum();
    assert_eq!((info.frames as usize, info.gaussians), (frames.len(), gaussians as u64), "{point}");
}
