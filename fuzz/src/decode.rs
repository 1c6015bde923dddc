//! The decoding process, on any stream and on edited valid ones.

use crate::edits::edited;
use crate::laws;
use crate::seal::sealed;
use std::borrow::Cow;

/// The first bytes of any stream.
const SIGNATURE: &[u8] = b"\x89GSS";

/// Bytes that start like a stream are one; others are edits of a valid one.
pub fn run(data: &[u8]) {
    let stream = stream_of(data);
    laws::hold(&sealed(&stream), choice(data));
}

/// A number that every byte of an input has a part in.
pub(crate) fn choice(data: &[u8]) -> u32 {
    data.iter().fold(0, |sum, byte| sum.wrapping_mul(31).wrapping_add((*byte).into()))
}

/// The stream that an input stands for.
pub fn stream_of(data: &[u8]) -> Cow<'_, [u8]> {
    if data.starts_with(SIGNATURE) { Cow::Borrowed(data) } else { Cow::Owned(edited(data)) }
}
