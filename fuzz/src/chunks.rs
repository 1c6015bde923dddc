//! Streams that arrive in pieces.

use crate::decode::{choice, stream_of};
use crate::laws::{STRICT, TOLERANT, arrival};
use crate::seal::sealed;

/// More pieces add time, not depth.
const MOST_PIECES: u32 = 6;

/// An input is a stream, or edits of one, as for `decode`; its bytes choose the pieces too.
pub fn run(data: &[u8]) {
    let stream = stream_of(data);
    let stream = sealed(&stream);
    let choice = choice(data);
    let options = if choice & 1 == 0 { STRICT } else { TOLERANT };
    arrival::holds(&stream, &options, &ends(stream.len(), choice >> 1));
}

/// Where the pieces end, in order.
fn ends(length: usize, choice: u32) -> Vec<usize> {
    // The fractional part of multiples of the golden ratio: spread over the stream, others for each choice.
    let end = |piece: u32| {
        let share = choice.wrapping_add(piece).wrapping_mul(0x9e37_79b9);
        ((u64::from(share) * (length as u64 + 1)) >> 32) as usize
    };
    let mut ends: Vec<usize> = (0..choice % (MOST_PIECES + 1)).map(end).collect();
    ends.sort_unstable();
    ends
}
