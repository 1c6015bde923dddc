//! What holds for every stream, valid or not, and for every valid one.

use crate::LIMITS;
use core::ops::ControlFlow;
use splatstream_decoder::digest::{frame_digest, unit_digest};
use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::operating_point::{OperatingPoint, extract, operating_points};
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::process::{DecodedFrame, Decoder, Options};
use splatstream_decoder::stream::decode_stream;
use splatstream_format::inspect::inspect;
use splatstream_format::syntax::{FrameType, SequenceParameters, UnitType};
use splatstream_format::unit::{Stream, Unit};
use splatstream_format::{Error, ErrorKind, Result};

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

/// Decodes a stream in every way; `choice` chooses an operating point, what is lost, and where to start.
pub fn hold(bytes: &[u8], choice: u32) {
    let strict = decoded(bytes, &STRICT);
    let tolerant = decoded(bytes, &TOLERANT);
    assert!(tolerant.frames.len() >= strict.frames.len(), "a tolerant decoder shows no less");
    assert!(tolerant.frames.starts_with(&strict.frames), "it shows the same where there is no fault");
    verified(bytes, &strict);
    let _ = operating_points(bytes, &LIMITS);
    if strict.end.is_none() {
        assert_eq!(tolerant.frames, strict.frames, "without a fault there is nothing to tolerate");
        assert_eq!(inspect(bytes, &LIMITS, &mut |_| ()), None, "the inspector refuses what decodes");
        extracted(bytes, &strict, choice);
        with_losses(bytes, &strict, choice);
        subsets(bytes, &strict);
        from_inside(bytes, &strict, choice).expect("decoding can start at any GOP header");
    }
    shown(tolerant);
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

/// Extraction and decoding at an operating point give the same frames.
fn extracted(bytes: &[u8], strict: &Decoded, choice: u32) {
    let Some(sequence) = &strict.sequence else { return };
    let one_of = |count: u8, shift: u32| (choice.rotate_right(shift) % u32::from(count)) as u8;
    let point = OperatingPoint {
        spatial: one_of(sequence.spatial_layer_count, 8),
        temporal: one_of(sequence.temporal_layer_count, 16),
        refinement: one_of(sequence.refinement_count, 0),
    };
    let part = extract(bytes, point, &LIMITS).expect("what decodes can be extracted");
    let from_part = decoded(&part, &STRICT);
    let from_whole = decoded(bytes, &Options { operating_point: point, ..STRICT });
    assert_eq!(from_part.end, None, "what is extracted decodes");
    assert_eq!(from_part.frames, from_whole.frames, "extraction changes a frame");
    let at_point = decoded(&part, &Options { operating_point: point, ..STRICT });
    assert_eq!(
        at_point.frames, from_whole.frames,
        "at its own point an extracted stream shows something else"
    );
    is_less(&from_part.frames, &strict.frames);
    let belongs = |frame: &&DecodedFrame| from_part.frames.iter().any(|part| part.number == frame.number);
    let expected = strict
        .frames
        .iter()
        .filter(|frame| point.spatial + 1 == sequence.spatial_layer_count || belongs(frame));
    assert!(
        sequence.temporal_layer_count > 1 || expected.count() == from_part.frames.len(),
        "a frame is missing"
    );
}

/// Units are lost on the way: every frame still comes, and is a part of the whole one or frozen.
fn with_losses(bytes: &[u8], strict: &Decoded, losses: u32) {
    let frames = lossy(bytes, losses).expect("losing refinements is no fault");
    assert_eq!(frames.len(), strict.frames.len(), "there are as many frames");
    is_less(&frames, &strict.frames);
}

/// What a frame shows as a subset is what of it is exact.
fn subsets(bytes: &[u8], strict: &Decoded) {
    let subsets = decoded(bytes, &Options { subset: true, ..STRICT });
    assert_eq!((subsets.end, subsets.frames.len()), (None, strict.frames.len()));
    for (subset, frame) in subsets.frames.iter().zip(&strict.frames) {
        assert_eq!(subset.carried, 0);
        assert!(subset.planes == exact(frame), "frame {} as a subset is not what is exact", frame.number);
    }
}

fn lossy(bytes: &[u8], losses: u32) -> Result<Vec<DecodedFrame>> {
    let stream = Stream::open(bytes, &LIMITS)?;
    let mut decoder = Decoder::new(stream.header(), TOLERANT);
    let mut frames = Vec::new();
    for (place, unit) in stream.units().enumerate() {
        let unit = unit?;
        let is_lost = losses.rotate_right(place as u32) & 1 == 1;
        if is_lost && matches!(unit.header.unit_type(), UnitType::Refinement | UnitType::Increment) {
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
    let first = units[start].header.frame;
    assert_eq!(frames.len(), strict.frames.iter().filter(|frame| frame.number >= first).count());
    Ok(())
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
