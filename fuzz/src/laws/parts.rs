//! Parts of a valid stream: with losses, as subsets, from a GOP on.

use super::{Decoded, STRICT, TOLERANT, exact, is_less};
use crate::LIMITS;
use splatstream_decoder::process::{DecodedFrame, Decoder, Options};
use splatstream_format::syntax::UnitType;
use splatstream_format::unit::{Damaged, Stream, Unit};
use splatstream_format::{Error, ErrorKind, Result};

/// `strict` is what the whole stream decodes to; `choice` chooses what is lost, and where to start.
pub fn hold(bytes: &[u8], strict: &Decoded, choice: u32) {
    with_losses(bytes, strict, choice);
    subsets(bytes, strict);
    from_inside(bytes, strict, choice).expect("decoding can start at any GOP header");
}

/// Units are lost on the way: every frame still comes, and is a part of the whole one or frozen.
fn with_losses(bytes: &[u8], strict: &Decoded, losses: u32) {
    let frames = lossy(bytes, losses).expect("losing refinements is no fault");
    assert_eq!(frames.len(), strict.frames.len(), "there are as many frames");
    is_less(&frames, &strict.frames);
}

/// What a frame shows as a subset is what of it is exact.
fn subsets(bytes: &[u8], strict: &Decoded) {
    let subsets = Decoded::of(bytes, &Options { subset: true, ..STRICT });
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
            let error = Error::new(unit.at, "5.3", kind);
            decoder.damaged(&Damaged { unit, error, passed_over: false })?;
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
