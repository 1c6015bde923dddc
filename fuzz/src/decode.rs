//! The decoding process, on any stream and on edited valid ones.

use crate::LIMITS;
use crate::edits::edited;
use crate::seal::sealed;
use core::ops::ControlFlow;
use splatstream_decoder::digest::{frame_digest, unit_digest};
use splatstream_decoder::operating_point::{OperatingPoint, extract, operating_points};
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::process::{DecodedFrame, Decoder, Options};
use splatstream_decoder::stream::decode_stream;
use splatstream_format::inspect::inspect;
use splatstream_format::syntax::{Profile, SequenceParameters, UnitType};
use splatstream_format::unit::{Stream, Unit};
use splatstream_format::{Error, ErrorKind, Result};
use std::borrow::Cow;

/// The first bytes of any stream.
const SIGNATURE: &[u8] = b"\x89GSS";

/// Strict: the first fault ends decoding. Digests are not compared, as no edit could make them right again.
const STRICT: Options = Options {
    limits: LIMITS,
    verify: false,
    operating_point: OperatingPoint::ALL,
    tolerant: false,
    subset: false,
};
const TOLERANT: Options = Options { tolerant: true, ..STRICT };
const VERIFIED: Options = Options { verify: true, ..STRICT };

/// What decoding a stream gave.
#[derive(Debug, PartialEq)]
struct Decoded {
    sequence: Option<SequenceParameters>,
    frames: Vec<DecodedFrame>,
    end: Option<Error>,
}

/// Bytes that start like a stream are one; others are edits of a valid one.
pub fn run(data: &[u8]) {
    let stream = stream_of(data);
    let bytes = sealed(&stream);
    let strict = decoded(&bytes, &STRICT);
    let tolerant = decoded(&bytes, &TOLERANT);
    assert!(tolerant.frames.len() >= strict.frames.len(), "a tolerant decoder shows no less");
    assert!(tolerant.frames.starts_with(&strict.frames), "it shows the same where there is no fault");
    // What follows is said of frames that are prefixes of each other, which those of profile Dynamic are not.
    let intra = Stream::open(&bytes, &LIMITS).is_ok_and(|stream| stream.header().profile() == Profile::Intra);
    if intra {
        verified(&bytes, &strict);
    }
    let _ = operating_points(&bytes, &LIMITS);
    if strict.end.is_none() {
        assert_eq!(tolerant.frames, strict.frames, "without a fault there is nothing to tolerate");
        assert_eq!(inspect(&bytes, &LIMITS, &mut |_| ()), None, "the inspector refuses what decodes");
        let choice = data.iter().fold(0_u32, |sum, byte| sum.wrapping_mul(31).wrapping_add((*byte).into()));
        if intra {
            extracted(&bytes, &strict, choice);
            with_losses(&bytes, &strict, choice);
            from_inside(&bytes, &strict, choice).expect("decoding can start at any GOP header");
        }
    }
    shown(tolerant);
}

/// The stream that an input stands for.
pub fn stream_of(data: &[u8]) -> Cow<'_, [u8]> {
    if data.starts_with(SIGNATURE) { Cow::Borrowed(data) } else { Cow::Owned(edited(data)) }
}

fn decoded(bytes: &[u8], options: &Options) -> Decoded {
    let mut result = Decoded { sequence: None, frames: Vec::new(), end: None };
    let summary = decode_stream(bytes, options, |sequence, frame| {
        result.sequence = Some(*sequence);
        result.frames.push(frame);
        ControlFlow::Continue(())
    });
    assert_eq!(summary.frames as usize, result.frames.len());
    Decoded { end: summary.end, ..result }
}

/// What is accepted with digests is what comes without, and has the digests that it is said to have.
fn verified(bytes: &[u8], strict: &Decoded) {
    let verified = decoded(bytes, &VERIFIED);
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

/// The digest of a frame, computed from its planes; a frame that lacks refinements does not say how many Gaussians
/// the others hold.
fn digest_of(sequence: &SequenceParameters, frame: &DecodedFrame) -> Option<u64> {
    if frame.refinements != sequence.refinement_count {
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

/// Extraction and decoding at an operating point give the same frames.
fn extracted(bytes: &[u8], strict: &Decoded, choice: u32) {
    let Some(sequence) = &strict.sequence else { return };
    let refinement = (choice % u32::from(sequence.refinement_count)) as u8;
    let point = OperatingPoint { spatial: 0, temporal: 0, refinement };
    let part = extract(bytes, point, &LIMITS).expect("what decodes can be extracted");
    let from_part = decoded(&part, &STRICT);
    let from_whole = decoded(bytes, &Options { operating_point: point, ..STRICT });
    assert_eq!(from_part.end, None, "what is extracted decodes");
    assert_eq!(from_part.frames, from_whole.frames, "extraction changes a frame");
    is_prefix(&from_part.frames, &strict.frames);
}

/// Refinements are lost on the way: every frame still comes, and is a prefix of the whole one.
fn with_losses(bytes: &[u8], strict: &Decoded, losses: u32) {
    let frames = lossy(bytes, losses).expect("losing refinements is no fault");
    is_prefix(&frames, &strict.frames);
}

fn lossy(bytes: &[u8], losses: u32) -> Result<Vec<DecodedFrame>> {
    let stream = Stream::open(bytes, &LIMITS)?;
    let mut decoder = Decoder::new(stream.header(), TOLERANT);
    let mut frames = Vec::new();
    for (place, unit) in stream.units().enumerate() {
        let unit = unit?;
        let is_lost = losses.rotate_right(place as u32) & 1 == 1;
        if is_lost && unit.header.unit_type() == UnitType::Refinement {
            let kind = ErrorKind::CheckSum { element: "payload_crc", stored: 0, computed: 1 };
            decoder.damaged(&unit.header, Error::new(unit.at, "5.3", kind))?;
        } else {
            frames.extend(decoder.unit(&unit)?);
        }
    }
    Ok(frames)
}

/// Decoding starts at a GOP header, behind the sequence parameters: the frames from there on are the same.
fn from_inside(bytes: &[u8], strict: &Decoded, choice: u32) -> Result<()> {
    let stream = Stream::open(bytes, &LIMITS)?;
    let units: Vec<Unit<'_>> = stream.units().collect::<Result<_>>()?;
    let of_type =
        |unit_type| units.iter().enumerate().filter(move |(_, unit)| unit.header.unit_type() == unit_type);
    let gops: Vec<usize> = of_type(UnitType::GopHeader).map(|(place, _)| place).collect();
    let (Some((_, parameters)), false) = (of_type(UnitType::SequenceParameters).next(), gops.is_empty())
    else {
        return Ok(());
    };
    let start = gops[choice as usize % gops.len()];
    let mut decoder = Decoder::starting_inside(stream.header(), STRICT);
    decoder.unit(parameters)?;
    let mut frames = Vec::new();
    for unit in &units[start..] {
        frames.extend(decoder.unit(unit)?);
    }
    assert!(strict.frames.ends_with(&frames), "frames depend on what is before their GOP");
    let first = units[start].header.frame as usize;
    assert_eq!(frames.len(), strict.frames.len() - first);
    Ok(())
}

fn is_prefix(parts: &[DecodedFrame], wholes: &[DecodedFrame]) {
    assert_eq!(parts.len(), wholes.len(), "there are as many frames");
    for (part, whole) in parts.iter().zip(wholes) {
        assert_eq!(part.number, whole.number);
        let mut planes = whole.planes.clone();
        planes.truncate(part.planes.len());
        assert!(part.planes == planes, "frame {} is not a prefix of the whole one", part.number);
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
