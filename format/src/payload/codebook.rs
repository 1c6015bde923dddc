//! 5.8 codebook: header, entries.

use super::{length, only};
use crate::syntax::{CodebookHeader, after, encode};
use crate::{Error, ErrorKind, Limits, Result};

/// The entries of one stage of vector quantisation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Codebook {
    /// The fixed part.
    pub header: CodebookHeader,
    /// Index `x * component_count + k` is component k of entry x.
    pub entries: Vec<i16>,
}

impl Codebook {
    /// Reads and checks a payload that stands at offset `at`.
    ///
    /// # Errors
    /// Malformed: bytes are missing or left over. Invalid: the header, by clause 6.8. Over limit: more values
    /// than `limits` allow.
    pub fn parse(payload: &[u8], at: u64, limits: &Limits) -> Result<Self> {
        let (header, rest) = CodebookHeader::parse(payload, at)?;
        header.within(at, limits)?;
        Self::parse_rest(header, rest, at)
    }

    /// Reads `rest`, the bytes after a header that has been accepted. `at` is the offset of the payload, that
    /// is of the header.
    ///
    /// # Errors
    /// Malformed: there are not as many bytes as the entries that the header says.
    pub fn parse_rest(header: CodebookHeader, rest: &[u8], at: u64) -> Result<Self> {
        // Taken before anything is allocated: the bytes are there.
        let bytes = length(header.value_count()).saturating_mul(header.value_bytes.into());
        let raw = only(&CodebookHeader::TABLE, rest, at, "entries", bytes)?;
        let entries = match header.value_bytes {
            1 => raw.iter().map(|value| i8::from_le_bytes([*value]).into()).collect(),
            _ => raw.as_chunks::<2>().0.iter().map(|value| i16::from_le_bytes(*value)).collect(),
        };
        Ok(Self { header, entries })
    }

    /// The bytes of the payload; refused where [`Self::parse`] would refuse them, and where an entry does not
    /// fit in `value_bytes`. Offsets of errors count from the start of the payload.
    ///
    /// # Errors
    /// Invalid: the header, the number of entries, or an entry that `value_bytes` cannot hold.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        self.header.validate(0)?;
        if self.entries.len() != length(self.header.value_count()) {
            let rule = "there are as many entries as the header says";
            return Err(Error::new(0, CodebookHeader::TABLE.semantics, ErrorKind::Constraint { rule }));
        }
        let mut bytes = encode(&self.header);
        for &entry in &self.entries {
            if self.header.value_bytes == 1 {
                bytes.extend(Self::narrow(entry, bytes.len())?.to_le_bytes());
            } else {
                bytes.extend(entry.to_le_bytes());
            }
        }
        Ok(bytes)
    }

    /// Each entry in turn, `component_count` values of it.
    pub fn rows(&self) -> impl ExactSizeIterator<Item = &[i16]> {
        self.entries.chunks_exact(usize::from(self.header.component_count).max(1))
    }

    fn narrow(entry: i16, offset: usize) -> Result<i8> {
        i8::try_from(entry).map_err(|_| {
            let (value, min, max) = (entry.into(), i8::MIN.into(), i8::MAX.into());
            let kind = ErrorKind::OutOfRange { element: "entries", value, min, max };
            Error::new(after(0, offset), CodebookHeader::TABLE.semantics, kind)
        })
    }
}
