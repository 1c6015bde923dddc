//! A stream that arrives in pieces: each frame comes as soon as its units are there, and what is there has no error of
//! its own.

use super::{Decoded, PLAIN, STRICT};
use splatstream_decoder::process::Decoder;
use splatstream_format::syntax::{FileHeader, UnitHeader};
use splatstream_format::unit::{Stream, Unit};
use splatstream_format::{Class, Error};

/// More pieces add time, not depth.
const MAX_PIECES: u32 = 3;

/// `whole` is what the whole stream decodes to; `choice` chooses the pieces.
pub fn holds(bytes: &[u8], whole: &Decoded, choice: u32) {
    let frames_after = frames_after(bytes);
    for piece in 0..=choice % MAX_PIECES {
        // The fractional part of multiples of the golden ratio: spread over the stream, others for each choice.
        let share = choice.wrapping_add(piece).wrapping_mul(0x9e37_79b9);
        let end = ((u64::from(share) * (bytes.len() as u64 + 1)) >> 32) as usize;
        let there = Decoded::of(&bytes[..end], &STRICT);
        let is_cut = there.errors.first().is_some_and(is_truncation);
        // Which fault of a unit is reported may depend on what comes after it.
        let unit_of = |error: &Error| ends(bytes).take_while(|end| (*end as u64) < error.at).count();
        // Bytes after the end unit are an error only where some have come.
        let is_there = |error: &&Error| error.at < end as u64;
        let [part, all] = [&there, whole].map(|decoded| decoded.errors.first().filter(is_there).map(unit_of));
        assert!(is_cut || part == all, "a part has an error of its own");
        let expected = frames_after.iter().take_while(|(unit_end, _)| *unit_end <= end).last();
        let expected = expected.map_or(0, |(_, frames)| *frames);
        assert!(there.frames == whole.frames[..expected], "{end} bytes give other frames");
    }
}

/// Whether an error is that the stream ends too soon.
pub(super) fn is_truncation(error: &Error) -> bool {
    error.class() == Class::Truncated
}

/// The units from the first on whose ends are known.
fn units(bytes: &[u8]) -> impl Iterator<Item = Unit<'_>> {
    let units = Stream::open(bytes, &PLAIN.limits).map(|stream| stream.units());
    units.into_iter().flat_map(|mut units| std::iter::from_fn(move || units.next_unit()?.ok()))
}

/// Where the file header and each of these units ends.
pub(crate) fn ends(bytes: &[u8]) -> impl Iterator<Item = usize> {
    let of_units = units(bytes).map(|unit| unit.at as usize + UnitHeader::SIZE + unit.payload.len());
    core::iter::once(FileHeader::SIZE).chain(of_units)
}

/// The end of each unit up to the first error, and the frames that have come out then.
fn frames_after(bytes: &[u8]) -> Vec<(usize, usize)> {
    let Ok(stream) = Stream::open(bytes, &PLAIN.limits) else { return Vec::new() };
    let mut decoder = Decoder::new(stream.header(), STRICT);
    let mut frames = 0;
    let mut after = Vec::new();
    for (unit, end) in units(bytes).zip(ends(bytes).skip(1)) {
        frames += usize::from(decoder.unit(&unit).is_some());
        after.push((end, frames));
        if decoder.has_stopped() {
            break;
        }
    }
    after
}
