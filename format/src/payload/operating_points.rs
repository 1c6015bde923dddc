//! 5.16 operating_points: header, entries.

use super::{length, only};
use crate::syntax::{OperatingPointEntry, OperatingPointsHeader, after};
use crate::{Error, ErrorKind, Result};

/// What the operating points of a stream cost.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OperatingPoints {
    /// The points, rising by spatial layer, temporal layer and refinement.
    pub entries: Vec<OperatingPointEntry>,
}

impl OperatingPoints {
    /// Reads and checks a payload that stands at offset `at`.
    ///
    /// # Errors
    /// Malformed: there are not as many bytes as entries. Unsupported: reserved bits. Invalid: a layer or
    /// refinement that no sequence has, or entries that do not rise.
    pub fn parse(payload: &[u8], at: u64) -> Result<Self> {
        let table = &OperatingPointsHeader::TABLE;
        let (header, rest) = OperatingPointsHeader::parse(payload, at)?;
        let bytes = length(header.point_count.into()).saturating_mul(OperatingPointEntry::SIZE);
        let raw = only(table, rest, at, "entries", bytes)?;
        let mut entries: Vec<OperatingPointEntry> = Vec::new();
        let mut here = after(at, OperatingPointsHeader::SIZE);
        for raw in raw.chunks(OperatingPointEntry::SIZE) {
            let entry = OperatingPointEntry::parse(raw, here)?.0;
            if entries.last().is_some_and(|before| before.key() >= entry.key()) {
                let rule = "operating points rise by spatial layer, temporal layer and refinement";
                return Err(Error::new(here, table.semantics, ErrorKind::Constraint { rule }));
            }
            entries.push(entry);
            here = after(here, OperatingPointEntry::SIZE);
        }
        Ok(Self { entries })
    }

    /// The bytes of the payload; refused where [`Self::parse`] would refuse them.
    ///
    /// # Errors
    /// Those of [`Self::parse`]; invalid with 2^16 entries or more.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        let point_count = u16::try_from(self.entries.len()).map_err(|_| {
            let rule = "there are fewer than 2^16 operating points";
            Error::new(0, OperatingPointsHeader::TABLE.semantics, ErrorKind::Constraint { rule })
        })?;
        let mut bytes = OperatingPointsHeader { point_count, reserved_zero: 0 }.to_bytes()?;
        for entry in &self.entries {
            bytes.extend(entry.to_bytes()?);
        }
        Self::parse(&bytes, 0)?;
        Ok(bytes)
    }
}
