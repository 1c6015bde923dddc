//! What streams cost: the memory and time of decoding, inspecting and extracting are bounded by the bytes of the stream and
//! the limits of whoever does it.

use crate::allowance::{Allowance, within};
use crate::decode::{choice, stream_of};
use crate::edits;
use crate::seal::sealed;
use splatstream::{Decoder, Limits};
use splatstream_decoder::operating_point::{OperatingPoint, extract, operating_points};
use splatstream_format::Limits as FormatLimits;
use splatstream_format::inspect::inspect;
use splatstream_format::unit::Stream;
use std::time::Duration;

/// What the decoder is given: the counts are those of a server, so that a small stream can claim millions.
pub const LIMITS: Limits = Limits {
    max_memory: 56 << 20,
    max_total_gaussians: 1 << 20,
    max_output: 64 << 20,
    max_work: 1 << 24,
    max_gaussians: 1 << 22,
    max_unit: 64 << 20,
};

/// Most bytes of payloads that make a stream longer. Units without a payload may come [`MAX_TIMES`] times: what takes the
/// square of their number then shows.
const MAX_PAYLOAD: usize = 1 << 18;
const MAX_TIMES: u8 = 15;

/// A stream as for `decode` after two bytes, which say a unit and how often it comes again: a power of two.
pub fn run(data: &[u8]) {
    let Some((&[unit, times], input)) = data.split_first_chunk() else { return };
    let stream = edits::repeated(&stream_of(input), unit.into(), 1 << (times % (MAX_TIMES + 1)), MAX_PAYLOAD);
    holds(&sealed(&stream), choice(data));
}

/// Every way through a stream keeps its bounds.
pub fn holds(bytes: &[u8], choice: u32) {
    let (length, time) = (bytes.len() as u64, reading_time(bytes));
    let limits = FormatLimits::default();
    let read = Allowance { peak: FIXED + length * INSPECTED, time };
    within("the inspector", &read, || inspect(bytes, &limits, &mut |_| ()));
    within("the table of operating points", &read, || operating_points(bytes, &limits).map(drop).ok());
    let point = OperatingPoint {
        spatial: choice as u8 % 4,
        temporal: (choice >> 8) as u8 % 4,
        refinement: (choice >> 16) as u8 % 10,
    };
    let copied = Allowance { peak: FIXED + length * EXTRACTED, ..read };
    within("extraction", &copied, || extract(bytes, point, &limits).map(|part| part.len()).ok());
    let decoded = Allowance {
        peak: LIMITS.max_memory + FIXED + length * DECODED,
        time: time + Duration::from_nanos(LIMITS.max_work * WORK_TIME),
    };
    match choice % 2 {
        0 => within("decoding", &decoded, || whole(bytes)),
        _ => within("decoding what is pushed", &decoded, || pushed(bytes, 1 + choice as usize % 4096)),
    };
}

/// What reading each element of a stream may take.
fn reading_time(bytes: &[u8]) -> Duration {
    let units = Stream::open(bytes, &FormatLimits::default()).map(|stream| stream.units());
    let payloads = units.into_iter().flatten().map_while(Result::ok).map(|unit| unit.payload.len() as u64);
    // What cannot be told apart may be scanned, which takes less.
    let payload: u64 = payloads.sum();
    let header = bytes.len() as u64 - payload;
    FIXED_TIME + Duration::from_nanos(header * HEADER_TIME + payload * PAYLOAD_TIME)
}

/// Frames of a stream that is there.
fn whole(bytes: &[u8]) -> usize {
    Decoder::from_bytes(bytes).with_limits(LIMITS).map_while(Result::ok).count()
}

/// Frames of a stream that comes in pieces.
fn pushed(bytes: &[u8], piece: usize) -> usize {
    let mut decoder = Decoder::new().with_limits(LIMITS);
    let mut frames = 0;
    for piece in bytes.chunks(piece) {
        if decoder.push(piece).is_err() {
            return frames;
        }
        frames += (&mut decoder).map_while(Result::ok).count();
    }
    decoder.end();
    frames + decoder.map_while(Result::ok).count()
}

/// Tables and models, which do not grow with a stream.
const FIXED: u64 = 2 << 20;
/// What is held for each byte of a stream by who inspects, extracts and decodes it.
const INSPECTED: u64 = 16;
const EXTRACTED: u64 = 24;
const DECODED: u64 = 24;
/// Time of any stream, here and below on a machine of [slowness](crate::yardstick::slowness) 1.
const FIXED_TIME: Duration = Duration::from_millis(50);
/// Time for each byte of a unit header and of a payload, in nanoseconds.
const HEADER_TIME: u64 = 600;
const PAYLOAD_TIME: u64 = 600;
/// Time for each value that [`Limits::max_work`] counts, in nanoseconds.
const WORK_TIME: u64 = 30;
