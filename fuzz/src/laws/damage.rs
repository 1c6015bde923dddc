//! Damage in one GOP: the frames of all other GOPs come out as they were.

use super::{Decoded, PLAIN};
use core::ops::Range;
use splatstream_decoder::process::DecodedFrame;
use splatstream_format::syntax::{FrameHeader, GopHeader, UnitHeader, UnitType};
use splatstream_format::unit::{Landmark, Stream, Unit};

/// A GOP of a valid stream.
pub(super) struct Gop {
    /// The bytes from its header on up to the next unit that is not of a GOP.
    pub(super) bytes: Range<usize>,
    /// Its display indices.
    pub(super) frames: Range<u32>,
    /// Offsets of its units.
    units: Vec<usize>,
}

/// The GOPs of a valid stream.
pub(super) fn gops(bytes: &[u8]) -> Vec<Gop> {
    let mut gops: Vec<Gop> = Vec::new();
    let Ok(stream) = Stream::open(bytes, &PLAIN.limits) else { return gops };
    let mut is_open = false;
    for unit in stream.units().map_while(Result::ok) {
        let Unit { header, at, .. } = unit;
        let start = at as usize;
        if header.unit_type() == UnitType::GopHeader {
            let gop = GopHeader::parse_payload(unit.payload, unit.payload_at, stream.header().profile());
            let count = gop.map_or(0, |gop| gop.gop_frame_count);
            let frames = header.frame..header.frame.saturating_add(count);
            gops.push(Gop { bytes: start..start, frames, units: Vec::new() });
            is_open = true;
        }
        is_open &= !is_of_stream(header.unit_type());
        if let (Some(gop), true) = (gops.last_mut(), is_open) {
            gop.bytes.end = start + UnitHeader::SIZE + unit.payload.len();
            gop.units.push(start);
        }
    }
    gops
}

/// Whether units of a type are not of a GOP.
fn is_of_stream(unit_type: UnitType) -> bool {
    matches!(
        unit_type,
        UnitType::SequenceParameters | UnitType::OperatingPoints | UnitType::Index | UnitType::End
    )
}

/// `whole` is what the valid stream decodes to; `choice` chooses the GOP and the damage.
pub fn holds(bytes: &[u8], whole: &Decoded, choice: u32) {
    let gops = gops(bytes);
    let index = choice as usize % gops.len().max(1);
    let Some(gop) = gops.get(index) else { return };
    let next = gops.get(index + 1).map(|gop| bytes.len() - gop.bytes.start);
    let Some(damaged) = damaged(bytes, gop, next, choice >> 4) else { return };
    let decoded = Decoded::of(&damaged, &PLAIN);
    // A unit that cannot be read may have been of the frame before it, which shows the same but may be said to be reduced.
    let told = |mut frame: DecodedFrame| {
        frame.is_reduced &= frame.index >= gop.frames.end;
        frame
    };
    let others = |decoded: &Decoded| {
        let frames = decoded.frames.iter().filter(|frame| !gop.frames.contains(&frame.index));
        frames.cloned().map(told).collect::<Vec<_>>()
    };
    assert!(others(&decoded) == others(whole), "damage in one GOP changes frames of another");
}

/// The stream with damage in a GOP, after which the next one starts so many bytes before the end; none where damage cannot
/// be told from what is intact, since a build for fuzzing does not compare checksums.
fn damaged(bytes: &[u8], gop: &Gop, next: Option<usize>, choice: u32) -> Option<Vec<u8>> {
    let mut out = bytes.to_vec();
    let unit = *gop.units.get((choice >> 2) as usize % gop.units.len().max(1))?;
    let is_checked = !cfg!(fuzzing);
    match choice % 4 {
        // The unit has no type, but an end.
        0 => {
            *out.get_mut(unit)? = 0;
            return Some(crate::seal::sealed(&out).into_owned());
        }
        // Nobody knows where the unit ends.
        1 => out.get_mut(unit + PAYLOAD_LENGTH..unit + PAYLOAD_LENGTH + 4)?.fill(u8::MAX),
        // Bytes are lost.
        2 if is_checked => drop(out.drain(part(&gop.bytes, choice))),
        // Bytes are something else.
        3 if is_checked => out.get_mut(part(&gop.bytes, choice))?.iter_mut().for_each(|byte| *byte ^= 0x5a),
        _ => return None,
    }
    let found = Landmark::GopHeader.find(&out, unit + 1).map(|at| out.len() - at);
    (is_checked || found == next).then_some(out)
}

/// Offset of `payload_length` in a unit header.
const PAYLOAD_LENGTH: usize = 12;

/// A part of a range, not more than a few bytes over a frame header.
fn part(range: &Range<usize>, choice: u32) -> Range<usize> {
    let start = range.start + (choice.wrapping_mul(0x9e37_79b9) >> 8) as usize % range.len();
    let length = 1 + (choice >> 20) as usize % (2 * (UnitHeader::SIZE + FrameHeader::SIZE));
    start..(start + length).min(range.end)
}
