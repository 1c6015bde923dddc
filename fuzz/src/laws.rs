//! What holds for every stream, valid or not, and for every valid one.

use crate::LIMITS;
use core::ops::{ControlFlow, RangeInclusive};
use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::operating_point::{OperatingPoint, operating_points};
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::process::{Budget, DecodedFrame, Options};
use splatstream_decoder::stream::{decode_stream, decode_stream_inside};
use splatstream_format::Error;
use splatstream_format::inspect::inspect;
use splatstream_format::syntax::SequenceParameters;

pub mod arrival;
pub mod damage;
pub mod extraction;
pub mod losses;

/// The decoder goes on after errors. Digests are not compared, as no edit could make them right again.
pub const PLAIN: Options = Options {
    limits: LIMITS,
    verify: false,
    operating_point: OperatingPoint::ALL,
    stop_at_first_error: false,
    subset: false,
    entropy: false,
    identities: false,
    budget: Budget::UNLIMITED,
    ahead: false,
};
/// The first error ends decoding.
pub const STRICT: Options = Options { stop_at_first_error: true, ..PLAIN };
/// Digests are compared.
pub const VERIFIED: Options = Options { verify: true, ..PLAIN };

/// What decoding a stream gave.
#[derive(Debug, PartialEq, Default)]
pub struct Decoded {
    /// What holds for all frames, once one came out.
    pub sequence: Option<SequenceParameters>,
    /// The frames in the order in which they came out.
    pub frames: Vec<DecodedFrame>,
    /// Every error, in stream order.
    pub errors: Vec<Error>,
    /// Display indices of frames that never came out.
    pub lost: Vec<RangeInclusive<u32>>,
}

/// Decodes a stream in every way; `choice` chooses an operating point, what is lost or damaged, and where to start.
pub fn hold(bytes: &[u8], choice: u32) {
    let plain = decodes(bytes);
    arrival::holds(bytes, &plain, choice);
    if !plain.errors.is_empty() {
        return;
    }
    subsets(bytes, &plain);
    from_inside(bytes, &plain, choice);
    losses::hold(bytes, &plain, choice).expect("a valid stream has valid units");
    damage::holds(bytes, &plain, choice);
    if let Some(sequence) = &plain.sequence {
        extraction::holds(bytes, &plain, sequence, choice);
    }
}

/// A stream decodes or is refused, the same however careful the decoder is; what it gives without digests.
pub fn decodes(bytes: &[u8]) -> Decoded {
    let plain = Decoded::of(bytes, &PLAIN);
    let strict = Decoded::of(bytes, &STRICT);
    assert!(plain.frames.starts_with(&strict.frames), "what comes before the first error is the same");
    assert_eq!(plain.errors.first(), strict.errors.first(), "the first error is the verdict");
    verified(bytes, &plain);
    let _ = operating_points(bytes, &LIMITS);
    match plain.errors.first() {
        None => assert_eq!(inspect(bytes, &LIMITS, &mut |_| ()), None, "the inspector refuses what decodes"),
        Some(error) => is_of_first_faulty_unit(bytes, error),
    }
    lies_in_order(&plain);
    shown(&plain);
    plain
}

impl Decoded {
    /// Decodes a stream as far as it goes.
    pub fn of(bytes: &[u8], options: &Options) -> Self {
        let mut result = Self::default();
        let summary = decode_stream(bytes, options, |sequence, frame| result.take(*sequence, frame));
        Self { errors: summary.errors, lost: summary.lost, ..result }
    }

    /// Decodes a stream from the GOP on whose header stands at an offset.
    fn inside(bytes: &[u8], gop: u64, options: &Options) -> Self {
        let mut result = Self::default();
        let summary =
            decode_stream_inside(bytes, gop, options, |sequence, frame| result.take(*sequence, frame));
        Self { errors: summary.errors, lost: summary.lost, ..result }
    }

    fn take(&mut self, sequence: SequenceParameters, frame: DecodedFrame) -> ControlFlow<()> {
        self.sequence = Some(sequence);
        self.frames.push(frame);
        ControlFlow::Continue(())
    }
}

/// What is accepted with digests is what comes without.
fn verified(bytes: &[u8], plain: &Decoded) {
    let verified = Decoded::of(bytes, &VERIFIED);
    if !verified.errors.is_empty() {
        return;
    }
    assert!(plain.errors.is_empty(), "comparing digests forgives nothing");
    assert_eq!(verified.frames.len(), plain.frames.len());
    for (with, without) in verified.frames.iter().zip(&plain.frames) {
        assert!(with.planes == without.planes, "frame {} depends on digests", with.index);
    }
}

/// The units before that of the first error have none: cut there, a stream lacks its end and nothing else.
fn is_of_first_faulty_unit(bytes: &[u8], error: &Error) {
    let mut start = 0;
    for end in arrival::ends(bytes) {
        // An error of what is missing stands at the end of its unit.
        if end as u64 >= error.at {
            break;
        }
        start = end;
    }
    // An error of the file header has no unit.
    if let (Some(before), 1..) = (bytes.get(..start), start) {
        let errors = Decoded::of(before, &PLAIN).errors;
        assert!(errors.iter().all(arrival::is_truncation), "{errors:?} come before {error}");
    }
}

/// Frames come in display order, and none of them is lost.
fn lies_in_order(decoded: &Decoded) {
    assert!(decoded.frames.is_sorted_by_key(|frame| frame.index), "frames come in display order");
    let starts_and_ends = decoded.lost.iter().flat_map(|range| [*range.start(), *range.end()]);
    assert!(starts_and_ends.is_sorted(), "ranges of lost frames are in order");
    for frame in &decoded.frames {
        assert!(
            decoded.lost.iter().all(|range| !range.contains(&frame.index)),
            "{} is lost and came",
            frame.index
        );
        assert_eq!(frame.is_lost, frame.level == 0 && frame.carried_lists == 0);
    }
}

/// The Gaussians of a frame that were decoded, not carried over.
pub fn exact(frame: &DecodedFrame) -> QuantizedFrame {
    let mut planes = frame.planes.clone();
    planes.truncate(frame.planes.len() - frame.carried);
    planes
}

/// What a P or B frame shows as a subset is what of it is exact, if there is something.
fn subsets(bytes: &[u8], plain: &Decoded) {
    let subsets = Decoded::of(bytes, &Options { subset: true, ..PLAIN });
    assert_eq!((&subsets.errors, subsets.frames.len()), (&Vec::new(), plain.frames.len()));
    for (subset, frame) in subsets.frames.iter().zip(&plain.frames) {
        let expected = if frame.level > 0 { exact(frame) } else { frame.planes.clone() };
        assert!(subset.planes == expected, "frame {} as a subset is not what is exact", frame.index);
    }
}

/// Decoding starts at a GOP header: the frames from there on are the same.
fn from_inside(bytes: &[u8], plain: &Decoded, choice: u32) {
    let gops = damage::gops(bytes);
    let Some(gop) = gops.get(choice as usize % gops.len().max(1)) else { return };
    let inside = Decoded::inside(bytes, gop.bytes.start as u64, &PLAIN);
    assert_eq!(inside.errors, [], "a decoder can start at any GOP header");
    assert!(plain.frames.ends_with(&inside.frames), "frames depend on what is before their GOP");
    let expected = plain.frames.iter().filter(|frame| frame.index >= gop.frames.start).count();
    assert_eq!(inside.frames.len(), expected);
}

/// Every frame can be shown.
fn shown(decoded: &Decoded) {
    let Some(sequence) = &decoded.sequence else { return };
    for frame in &decoded.frames {
        let count = frame.planes.len();
        let gaussians = to_gaussians(frame.clone().into_shown(), sequence).unwrap();
        assert_eq!(gaussians.len(), count);
        assert_eq!(gaussians.validate(), Ok(()));
    }
}
