//! The units after the last frame: operating points, index, end. Clauses 6.16, 6.10, 6.11.

use super::Decoder;
use super::phase::same;
use crate::fault;
use crate::gop::element_at;
use splatstream_format::Result;
use splatstream_format::payload::{Index, OperatingPoints};
use splatstream_format::syntax::{EndOfStream, IndexEntry, IndexHeader};
use splatstream_format::unit::Unit;

impl Decoder {
    /// Whether what the units say about the whole stream can be compared: it was decoded from its start, without errors.
    fn is_whole(&self) -> bool {
        !self.starts_inside && self.report.is_clean()
    }

    pub(super) fn operating_points(&self, unit: &Unit<'_>) -> Result<()> {
        let points = OperatingPoints::parse(unit.payload, unit.payload_at)?;
        match self.is_whole() && !self.has_discarded {
            true => self.tally.check(&points, unit.payload_at),
            false => Ok(()),
        }
    }

    pub(super) fn index(&mut self, unit: &Unit<'_>) -> Result<()> {
        self.counted.index_offset = Some(unit.at);
        if !self.is_whole() {
            return Index::parse(unit.payload, unit.payload_at).map(drop);
        }
        let gops = &self.counted.gops;
        let (header, _) = IndexHeader::parse(unit.payload, unit.payload_at)?;
        let expected = fault::count(gops.len())?;
        same(unit.payload_at, "6.10", "entry_count", header.entry_count, expected)?;
        let index = Index::parse(unit.payload, unit.payload_at)?;
        let mut at = element_at(&IndexHeader::TABLE, unit.payload_at, "");
        for (entry, &(frame, offset)) in index.entries.iter().zip(gops) {
            same(at, "6.10", "frame", entry.frame, frame)?;
            same(element_at(&IndexEntry::TABLE, at, "offset"), "6.10", "offset", entry.offset, offset)?;
            at = element_at(&IndexEntry::TABLE, at, "");
        }
        Ok(())
    }

    pub(super) fn end(&self, unit: &Unit<'_>) -> Result<()> {
        let end = EndOfStream::parse_payload(unit.payload, unit.payload_at)?;
        if !self.is_whole() {
            return Ok(());
        }
        let expected = EndOfStream {
            frame_count: self.counted.frame_headers,
            unit_count: self.counted.units.saturating_sub(1),
            index_offset: self.counted.index_offset.unwrap_or(0),
        };
        end.validate_against(unit.payload_at, &expected)?;
        let announced = self.sequence().map_or(0, |sequence| sequence.frame_count);
        let frames = if announced == 0 { 0 } else { self.next_frame };
        same(unit.payload_at, "6.4", "frame_count", frames, announced.into())
    }
}
