//! 4.3: unsigned LEB128, the shortest form, below 2^32.

use super::{Fault, Parsed, fault};
use crate::syntax::after;
use crate::{Error, ErrorKind, Result};
use nom::Offset;

/// Bytes of the longest number.
const MAX_BYTES: usize = 5;
/// The most that the last of five bytes may hold: bits 28 to 31.
const MAX_LAST: u8 = 0x0F;
/// Another byte follows.
const MORE: u8 = 0x80;

/// Reads the number at the start of `bytes`, which stand at offset `at`; gives the bytes after it. The element
/// and the clause of its table go into the error.
pub fn leb128<'a>(
    bytes: &'a [u8],
    at: u64,
    element: &'static str,
    clause: &'static str,
) -> Result<(u32, &'a [u8])> {
    match number(element)(bytes) {
        Ok((rest, value)) => Ok((value, rest)),
        Err(nom::Err::Error(Fault { rest, kind: Some(kind) }))
        | Err(nom::Err::Failure(Fault { rest, kind: Some(kind) })) => {
            Err(Error::new(after(at, bytes.offset(rest)), clause, kind))
        }
        Err(_) => Err(Error::new(at, clause, ErrorKind::ShortSection { element })),
    }
}

/// Appends a number in its shortest form.
pub fn write_leb128(value: u32, out: &mut Vec<u8>) {
    let mut left = value;
    loop {
        let [low, ..] = left.to_le_bytes();
        left = left.wrapping_shr(7);
        if left == 0 {
            return out.push(low);
        }
        out.push(low | MORE);
    }
}

/// The number as a nom parser. An error stands at its first byte.
pub(super) fn number<'a>(element: &'static str) -> impl Fn(&'a [u8]) -> Parsed<'a, u32> {
    move |input| {
        let mut value: u32 = 0;
        let mut rest = input;
        for (place, shift) in (0..MAX_BYTES).zip((0_u32..).step_by(7)) {
            let Some((byte, after)) = rest.split_first() else {
                return fault(input, ErrorKind::ShortSection { element });
            };
            rest = after;
            value |= u32::from(byte & !MORE).wrapping_shl(shift);
            let last = byte & MORE == 0;
            let too_large = place.saturating_add(1) == MAX_BYTES && *byte > MAX_LAST;
            let not_shortest = place > 0 && *byte == 0;
            if too_large || not_shortest {
                return fault(input, ErrorKind::Number { element });
            }
            if last {
                return Ok((rest, value));
            }
        }
        fault(input, ErrorKind::Number { element })
    }
}
