//! 5.10 index: header, entries.

use super::{element, length, whole};
use crate::syntax::{IndexEntry, IndexHeader, after};
use crate::{Error, ErrorKind, Result};
use nom::bytes::complete::take;

/// Where the groups of pictures start.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Index {
    /// One entry for each group, in stream order.
    pub entries: Vec<IndexEntry>,
}

impl Index {
    /// Reads and checks a payload that stands at offset `at`.
    pub fn parse(payload: &[u8], at: u64) -> Result<Self> {
        let table = &IndexHeader::TABLE;
        let (header, rest) = IndexHeader::parse(payload, at)?;
        let at = after(at, IndexHeader::SIZE);
        // Taken before room is made: the bytes are there.
        let bytes = length(header.entry_count).saturating_mul(IndexEntry::SIZE);
        let raw: &[u8] = whole(table, rest, at, element("entries", take(bytes)))?;
        let places = (0_usize..).step_by(IndexEntry::SIZE);
        let entry = |(raw, place)| Ok(IndexEntry::parse(raw, after(at, place))?.0);
        let entries = raw.chunks(IndexEntry::SIZE).zip(places).map(entry).collect::<Result<_>>()?;
        Ok(Self { entries })
    }

    /// The bytes of the payload; refused where [`Self::parse`] would refuse them.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        let entry_count = u32::try_from(self.entries.len()).map_err(|_| {
            let rule = "there are fewer than 2^32 entries";
            Error::new(0, IndexHeader::TABLE.semantics, ErrorKind::Constraint { rule })
        })?;
        let mut bytes = IndexHeader { entry_count }.to_bytes()?;
        for entry in &self.entries {
            bytes.extend(entry.to_bytes()?);
        }
        Ok(bytes)
    }
}
