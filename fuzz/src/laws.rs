//! What holds for every stream, valid or not, and for every valid one.

use crate::LIMITS;
use core::ops::ControlFlow;
use splatstream_decoder::digest::{frame_digest, unit_digest};
use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::operating_point::{OperatingPoint, operating_points};
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::process::{DecodedFrame, Options};
use splatstream_decoder::stream::decode_stream;
use splatstream_format::Error;
use splatstream_format::inspect::inspect;
use splatstream_format::syntax::{FrameType, SequenceParameters};

pub mod arrival;
pub mod extraction;
pub mod parts;

/// Strict: the first fault ends decoding. Digests are not compared, as no edit could make them right again.
pub const STRICT: Options = Options {
    limits: LIMITS,
    verify: false,
    operating_point: OperatingPoint::ALL,
    tolerant: false,
    subset: false,
    entropy: false,
};
/// A damaged refinement ends its frame only.
pub const TOLERANT: Options = Options { tolerant: true, ..STRICT };
/// Strict, and digests are compared.
pub const VERIFIED: Options = Options { verify: true, ..STRICT };

/// What decoding a stream gave.
#[derive(Debug, PartialEq)]
pub struct Decoded {
    /// What holds for all frames, once one came out.
    pub sequence: Option<SequenceParameters>,
    /// The frames in the order in which they came out.
    pub frames: Vec<DecodedFrame>,
    /// What ended decoding before the end of the stream.
    pub end: Option<Error>,
}

/// Decodes a stream in every way; `choice` chooses an operating point, what is lost, and where to start.
pub fn hold(bytes: &[u8], choice: u32) {
    let strict = decodes(bytes);
    if strict.end.is_none() {
        parts::hold(bytes, &strict, choice);
        if let Some(sequence) = &strict.sequence {
            extraction::holds_at(bytes, &strict, extraction::chosen(sequence, choice));
        }
    }
}

/// A stream decodes or is refused, the same however careful the decoder is; what a strict one gives.
pub fn decodes(bytes: &[u8]) -> Decoded {
    let strict = Decoded::of(bytes, &STRICT);
    let tolerant = Decoded::of(bytes, &TOLERANT);
    assert!(tolerant.frames.len() >= strict.frames.len(), "a tolerant decoder shows no less");
    assert!(tolerant.frames.starts_with(&strict.frames), "it shows the same where there is no fault");
    verified(bytes, &strict);
    let _ = operating_points(bytes, &LIMITS);
    if strict.end.is_none() {
        assert_eq!(tolerant.frames, strict.frames, "without a fault there is nothing to tolerate");
        assert_eq!(inspect(bytes, &LIMITS, &mut |_| ()), None, "the inspector refuses what decodes");
    }
    shown(tolerant);
    strict
}

impl Decoded {
    /// Decodes a stream as far as it goes.
    pub fn of(bytes: &[u8], options: &Options) -> Self {
        let mut result = Self { sequence: None, frames: Vec::new(), end: None };
        let summary = decode_stream(bytes, options, |sequence, frame| {
            result.sequence = Some(*sequence);
            result.frames.push(frame);
            ControlFlow::Continue(())
        });
        assert_eq!(summary.frames as usize, result.frames.len());
        Self { end: summary.end, ..result }
    }
}

/// What is accepted with digests is what comes without, and has the digests that it is said to have.
fn verified(bytes: &[u8], strict: &Decoded) {
    let verified = Decoded::of(bytes, &VERIFIED);
    if verified.end.is_some() {
        return;
    }
    assert_eq!(strict.end, None, "comparing digests forgives nothing");
    for (with, without) in verified.frames.iter().zip(&strict.frames) {
        assert_eq!(with.planes, without.planes);
        let digest = verified.sequence.as_ref().and_then(|sequence| digest_of(sequence, with));
        assert!(digest.is_none() || digest == with.digest, "the digest is not that of the planes");
    }
}

/// The digest of a frame, computed from its planes. How many Gaussians each refinement holds is known of whole intra
/// frames only.
fn digest_of(sequence: &SequenceParameters, frame: &DecodedFrame) -> Option<u64> {
    let is_top = frame.spatial_layer + 1 == sequence.spatial_layer_count;
    let is_whole = frame.refinements == sequence.refinement_count && is_top;
    if !is_whole || frame.frame_type != FrameType::Intra {
        return None;
    }
    let count = frame.planes.len();
    let end = |refinement| sequence.prefix_length(refinement, count as u32) as usize;
    let ranges = (0..sequence.refinement_count).scan(0, |start, refinement| {
        let from = core::mem::replace(start, end(refinement));
        Some(from..*start)
    });
    let digests: Vec<_> = ranges.map(|range| unit_digest(&frame.planes, range)).collect();
    Some(frame_digest(&digests))
}

/// The Gaussians of a frame that were decoded, not carried over.
fn exact(frame: &DecodedFrame) -> QuantizedFrame {
    let mut planes = frame.planes.clone();
    planes.truncate(frame.planes.len() - frame.carried);
    planes
}

/// Every frame is one of the whole ones. What is decoded of it, unless on another spatial layer or frozen, is a prefix.
fn is_less(parts: &[DecodedFrame], wholes: &[DecodedFrame]) {
    for part in parts {
        let whole = wholes.iter().find(|whole| whole.number == part.number).expect("no frame appears");
        if part.frozen.is_some() || part.spatial_layer != whole.spatial_layer {
            continue;
        }
        let (part, mut planes) = (exact(part), exact(whole));
        planes.truncate(part.len());
        assert!(part == planes, "frame {} is not a prefix of the whole one", whole.number);
    }
}

/// Every frame can be shown.
fn shown(decoded: Decoded) {
    let Some(sequence) = decoded.sequence else { return };
    for frame in decoded.frames {
        let count = frame.planes.len();
        let gaussians = to_gaussians(frame.planes, &sequence);
        assert_eq!(gaussians.len(), count);
        assert_eq!(gaussians.validate(), Ok(()));
    }
}
