//! 5.16 operating_points: header, entries.

use super::{element, length, whole};
use crate::syntax::{OperatingPointEntry, OperatingPointsHeader, after};
use crate::{Error, ErrorKind, Result};
use nom::bytes::complete::take;

/// What the operating points of a stream cost.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OperatingPoints {
    /// The points, rising by spatial layer, temporal layer and refinement.
    pub entries: Vec<OperatingPointEntry>,
}

impl OperatingPoints {
    /// Reads and checks a payload that stands at offset `at`.
    pub fn parse(payload: &[u8], at: u64) -> Result<Self> {
        let table = &OperatingPointsHeader::TABLE;
        let (header, rest) = OperatingPointsHeader::parse(payload, at)?;
        let at = after(at, OperatingPointsHeader::SIZE);
        let bytes = length(header.point_count.into()).saturating_mul(OperatingPointEntry::SIZE);
        let raw: &[u8] = whole(table, rest, at, element("entries", take(bytes)))?;
        let mut entries: Vec<OperatingPointEntry> = Vec::new();
        for (raw, place) in
            raw.chunks(OperatingPointEntry::SIZE).zip((0_usize..).step_by(OperatingPointEntry::SIZE))
        {
            let here = after(at, place);
            let entry = OperatingPointEntry::parse(raw, here)?.0;
            if entries.last().is_some_and(|before| before.key() >= entry.key()) {
                let rule = "operating points rise by spatial layer, temporal layer and refinement";
                return Err(Error::new(here, table.semantics, ErrorKind::Constraint { rule }));
            }
            entries.push(entry);
        }
        Ok(Self { entries })
    }

    /// The bytes of the payload; refused where [`Self::parse`] would refuse them.
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
