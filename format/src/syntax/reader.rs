//! 4.3: the elements of a payload, read one after the other.

use super::after;
use crate::{Error, ErrorKind, Result};

/// Bytes of the longest number.
const MAX_BYTES: usize = 5;
/// The most that the last of five bytes may hold: bits 28 to 31.
const MAX_LAST: u8 = 0x0F;
/// Another byte follows.
const MORE: u8 = 0x80;

/// An element as it was read.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Traced<'a> {
    /// The record, as the specification spells it.
    pub(crate) record: &'static str,
    /// The element, as the specification spells it.
    pub(crate) element: &'static str,
    /// The index of an element that is repeated.
    pub(crate) index: Option<usize>,
    /// Absolute offset.
    pub(crate) at: u64,
    /// Its bytes.
    pub(crate) bytes: &'a [u8],
}

/// Reads elements in order. An element that does not fit is an error at its first byte.
#[derive(Debug)]
pub(crate) struct Reader<'a, 't> {
    rest: &'a [u8],
    at: u64,
    record: &'static str,
    clause: &'static str,
    trace: Option<&'t mut Vec<Traced<'a>>>,
}

impl<'a, 't> Reader<'a, 't> {
    /// Reads `bytes`, which stand at offset `at` of the stream.
    pub(crate) const fn new(bytes: &'a [u8], at: u64) -> Self {
        Self { rest: bytes, at, record: "", clause: "", trace: None }
    }

    /// The same; every element that is read is added to `trace`.
    pub(crate) const fn tracing(bytes: &'a [u8], at: u64, trace: &'t mut Vec<Traced<'a>>) -> Self {
        Self { rest: bytes, at, record: "", clause: "", trace: Some(trace) }
    }

    /// The record to which the elements that follow belong, and the clause of its syntax.
    pub(crate) const fn record(&mut self, record: &'static str, clause: &'static str) {
        (self.record, self.clause) = (record, clause);
    }

    /// Absolute offset of the next element.
    pub(crate) const fn at(&self) -> u64 {
        self.at
    }

    /// The bytes that have not been read.
    pub(crate) const fn rest(&self) -> &'a [u8] {
        self.rest
    }

    /// An element of `length` bytes.
    pub(crate) fn take(&mut self, element: &'static str, length: usize) -> Result<&'a [u8]> {
        self.take_indexed(element, None, length)
    }

    /// One of several elements of the same name.
    pub(crate) fn take_indexed(
        &mut self,
        element: &'static str,
        index: Option<usize>,
        length: usize,
    ) -> Result<&'a [u8]> {
        let (bytes, rest) = self.rest.split_at_checked(length).ok_or_else(|| self.short(element))?;
        let at = self.at;
        (self.rest, self.at) = (rest, after(at, length));
        if let Some(trace) = &mut self.trace {
            trace.push(Traced { record: self.record, element, index, at, bytes });
        }
        Ok(bytes)
    }

    /// An element of `N` bytes.
    pub(crate) fn array<const N: usize>(&mut self, element: &'static str) -> Result<[u8; N]> {
        let bytes = self.take(element, N)?;
        bytes.try_into().map_err(|_| self.short(element))
    }

    /// An element of one byte.
    pub(crate) fn u8(&mut self, element: &'static str) -> Result<u8> {
        self.array(element).map(u8::from_le_bytes)
    }

    /// An array of `f32`.
    pub(crate) fn f32s<const N: usize>(&mut self, element: &'static str) -> Result<[f32; N]> {
        let bytes = self.take(element, N.saturating_mul(4))?;
        let mut values = bytes.as_chunks::<4>().0.iter().map(|value| f32::from_le_bytes(*value));
        Ok([(); N].map(|()| values.next().unwrap_or_default()))
    }

    /// Unsigned LEB128, the shortest form, below 2^32.
    pub(crate) fn number(&mut self, element: &'static str) -> Result<u32> {
        self.number_indexed(element, None)
    }

    /// One of several numbers of the same name.
    pub(crate) fn number_indexed(&mut self, element: &'static str, index: Option<usize>) -> Result<u32> {
        let (value, rest) = leb128(self.rest, self.at, element, self.clause)?;
        self.take_indexed(element, index, self.rest.len().saturating_sub(rest.len()))?;
        Ok(value)
    }

    /// The element does not fit in the bytes left.
    pub(crate) const fn short(&self, element: &'static str) -> Error {
        Error::new(self.at, self.clause, ErrorKind::ShortSection { element })
    }

    /// 6.1: a payload ends with its last element.
    pub(crate) fn end(&self) -> Result<()> {
        if self.rest.is_empty() {
            return Ok(());
        }
        let kind = ErrorKind::TrailingBytes { element: self.record, bytes: after(0, self.rest.len()) };
        Err(Error::new(self.at, self.clause, kind))
    }
}

/// Reads the number at the start of `bytes`, which stand at offset `at`; gives the bytes after it. The element
/// and the clause of its table go into the error.
///
/// # Errors
/// Malformed: the bytes end within the number, it is not in its shortest form, or it does not fit 32 bits.
pub fn leb128<'a>(
    bytes: &'a [u8],
    at: u64,
    element: &'static str,
    clause: &'static str,
) -> Result<(u32, &'a [u8])> {
    let mut value: u32 = 0;
    let mut rest = bytes;
    for (index, shift) in (0..MAX_BYTES).zip((0_u32..).step_by(7)) {
        let Some((byte, after)) = rest.split_first() else {
            return Err(Error::new(at, clause, ErrorKind::ShortSection { element }));
        };
        rest = after;
        value |= u32::from(byte & !MORE).wrapping_shl(shift);
        let too_large = index.saturating_add(1) == MAX_BYTES && *byte > MAX_LAST;
        let not_shortest = index > 0 && *byte == 0;
        if too_large || not_shortest {
            break;
        }
        if byte & MORE == 0 {
            return Ok((value, rest));
        }
    }
    Err(Error::new(at, clause, ErrorKind::Number { element }))
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

/// Bytes of a number in its shortest form.
pub(crate) fn leb128_length(value: u32) -> usize {
    match value {
        0..0x80 => 1,
        0x80..0x4000 => 2,
        0x4000..0x20_0000 => 3,
        0x20_0000..0x1000_0000 => 4,
        0x1000_0000.. => 5,
    }
}
