//! Boxes out of bytes: a cursor that knows its offset in the file, so that errors do.

use super::FourCc;
use splatstream_format::{Error, ErrorKind, Result};

/// Bytes of a file, read from the front.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cursor<'a> {
    bytes: &'a [u8],
    /// Absolute offset of the first of them.
    at: u64,
}

/// A box.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Box<'a> {
    /// Its type.
    pub(crate) kind: FourCc,
    /// Absolute offset of its header.
    pub(crate) at: u64,
    /// What is in it.
    pub(crate) body: Cursor<'a>,
}

impl<'a> Cursor<'a> {
    /// Bytes that stand at an offset of a file.
    pub(crate) const fn new(bytes: &'a [u8], at: u64) -> Self {
        Self { bytes, at }
    }

    /// Absolute offset of the next byte.
    pub(crate) const fn at(&self) -> u64 {
        self.at
    }

    /// The bytes that are left.
    pub(crate) const fn rest(&self) -> &'a [u8] {
        self.bytes
    }

    /// The next bytes; `element` names them in the error.
    pub(crate) fn bytes(
        &mut self,
        count: usize,
        element: &'static str,
        clause: &'static str,
    ) -> Result<&'a [u8]> {
        let short = Error::new(self.at, clause, ErrorKind::ShortSection { element });
        let (taken, rest) = self.bytes.split_at_checked(count).ok_or(short)?;
        self.bytes = rest;
        self.at = self.at.saturating_add(u64::try_from(count).unwrap_or(u64::MAX));
        Ok(taken)
    }

    /// A number of up to eight bytes, the most significant first.
    pub(crate) fn number(&mut self, size: usize, element: &'static str, clause: &'static str) -> Result<u64> {
        let bytes = self.bytes(size, element, clause)?;
        Ok(bytes.iter().fold(0, |value: u64, byte| value << 8 | u64::from(*byte)))
    }

    /// A number of 32 bits.
    pub(crate) fn u32(&mut self, element: &'static str, clause: &'static str) -> Result<u32> {
        self.number(4, element, clause).map(|value| u32::try_from(value).unwrap_or(u32::MAX))
    }

    /// A number of 8 bits.
    pub(crate) fn u8(&mut self, element: &'static str, clause: &'static str) -> Result<u8> {
        self.number(1, element, clause).map(|value| u8::try_from(value).unwrap_or(u8::MAX))
    }

    /// Version and flags.
    pub(crate) fn version(&mut self, element: &'static str, clause: &'static str) -> Result<(u8, u32)> {
        let value = self.u32(element, clause)?;
        Ok((u8::try_from(value >> 24).unwrap_or(u8::MAX), value & 0xFF_FFFF))
    }

    /// The next box; none at the end.
    pub(crate) fn next_box(&mut self, clause: &'static str) -> Result<Option<Box<'a>>> {
        if self.bytes.is_empty() {
            return Ok(None);
        }
        let at = self.at;
        let size = self.number(4, "box size", clause)?;
        let kind = self.bytes(4, "box type", clause)?;
        let kind = FourCc::try_from(kind).unwrap_or_default();
        let (header, size) = match size {
            0 => (8, u64::try_from(self.bytes.len()).unwrap_or(u64::MAX).saturating_add(8)),
            1 => (16, self.number(8, "box largesize", clause)?),
            size => (8, size),
        };
        let length = size.checked_sub(header).and_then(|length| usize::try_from(length).ok());
        let short = Error::new(at, clause, ErrorKind::ShortSection { element: "box" });
        let start = self.at;
        let body = self.bytes(length.ok_or(short)?, "box", clause)?;
        Ok(Some(Box { kind, at, body: Self::new(body, start) }))
    }

    /// The first box of a type, among the boxes that are left; others are passed over.
    pub(crate) fn find(
        mut self,
        kind: FourCc,
        element: &'static str,
        clause: &'static str,
    ) -> Result<Cursor<'a>> {
        let start = self.at;
        while let Some(found) = self.next_box(clause)? {
            if found.kind == kind {
                return Ok(found.body);
            }
        }
        Err(Error::new(start, clause, ErrorKind::ShortSection { element }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::boxes::write::{put, put_full};

    #[test]
    fn a_box_is_what_was_written_and_one_that_does_not_fit_is_refused() {
        let mut bytes = Vec::new();
        put(&mut bytes, *b"free", |out| out.extend([1, 2, 3]));
        put_full(&mut bytes, *b"vvhd", 1, 5, |_| {});
        let mut cursor = Cursor::new(&bytes, 100);
        let first = cursor.next_box("C.2").unwrap().unwrap();
        assert_eq!(
            (first.kind, first.at, first.body.rest(), first.body.at()),
            (*b"free", 100, &[1, 2, 3][..], 108)
        );
        let mut second = cursor.next_box("C.2").unwrap().unwrap();
        assert_eq!(second.body.version("vvhd", "C.2").unwrap(), (1, 5));
        assert!(cursor.next_box("C.2").unwrap().is_none());
        for end in 1..bytes.len() {
            let cut = bytes.get(..end).unwrap();
            let mut cursor = Cursor::new(cut, 0);
            let refused = loop {
                match cursor.next_box("C.2") {
                    Ok(Some(_)) => {}
                    end => break end.is_err(),
                }
            };
            assert_eq!(refused, end != 11, "{end}");
        }
    }
}
