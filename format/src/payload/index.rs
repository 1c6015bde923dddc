//! 5.10 index: header, entries.

use super::{length, only};
use crate::syntax::{IndexEntry, IndexHeader, after};
use crate::{Error, ErrorKind, Result};

/// Where the GOPs start.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Index {
    /// One entry for each GOP, in stream order.
    pub entries: Vec<IndexEntry>,
}

impl Index {
    /// Reads and checks a payload that stands at offset `at`.
    ///
    /// # Errors
    /// Malformed: there are not as many bytes as entries. Unsupported: reserved bits of an entry. Invalid:
    /// frames or offsets that do not rise.
    pub fn parse(payload: &[u8], at: u64) -> Result<Self> {
        let (header, rest) = IndexHeader::parse(payload, at)?;
        // Taken before room is made: the bytes are there.
        let bytes = length(header.entry_count).saturating_mul(IndexEntry::SIZE);
        let raw = only(&IndexHeader::TABLE, rest, at, "entries", bytes)?;
        let mut entries: Vec<IndexEntry> = Vec::with_capacity(length(header.entry_count));
        let mut at = after(at, IndexHeader::SIZE);
        for raw in raw.chunks(IndexEntry::SIZE) {
            let (entry, _) = IndexEntry::parse(raw, at)?;
            if let Some(before) = entries.last() {
                entry.validate_after(at, before)?;
            }
            entries.push(entry);
            at = after(at, IndexEntry::SIZE);
        }
        Ok(Self { entries })
    }

    /// The bytes of the payload; refused where [`Self::parse`] would refuse them.
    ///
    /// # Errors
    /// Those of [`Self::parse`]; invalid with 2^32 entries or more.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        let entry_count = u32::try_from(self.entries.len()).map_err(|_| {
            let rule = "there are fewer than 2^32 entries";
            Error::new(0, IndexHeader::TABLE.semantics, ErrorKind::Constraint { rule })
        })?;
        let mut bytes = IndexHeader { entry_count }.to_bytes()?;
        for entry in &self.entries {
            bytes.extend(entry.to_bytes()?);
        }
        Self::parse(&bytes, 0)?;
        Ok(bytes)
    }
}
