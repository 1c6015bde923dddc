//! The units behind the last frame: operating points, index, end. Clauses 6.16, 6.10, 6.11.

use super::Decoder;
use super::expected::{after, element_at, same};
use splatstream_format::Result;
use splatstream_format::payload::{Index, OperatingPoints};
use splatstream_format::syntax::{EndOfStream, IndexEntry, IndexHeader};
use splatstream_format::unit::Unit;

impl<'a> Decoder<'a> {
    /// Whether everything from the start of the stream on has been decoded.
    fn is_whole(&self) -> bool {
        !self.starts_inside && !self.has_lost_any && !self.has_passed_over
    }

    pub(super) fn operating_points(&mut self, unit: &Unit<'a>) -> Result<()> {
        self.close_gop(unit.at)?;
        let points = OperatingPoints::parse(unit.payload, unit.payload_at)?;
        if self.is_whole() {
            self.tally.check(&points, unit.payload_at)?;
        }
        self.listed = true;
        Ok(())
    }

    pub(super) fn index(&mut self, unit: &Unit<'a>) -> Result<()> {
        self.close_gop(unit.at)?;
        if !self.starts_inside {
            let (header, _) = IndexHeader::parse(unit.payload, unit.payload_at)?;
            let gops = u32::try_from(self.gops.len()).unwrap_or(u32::MAX);
            same(unit.payload_at, "6.10", "entry_count", header.entry_count, gops)?;
        }
        let index = Index::parse(unit.payload, unit.payload_at)?;
        let mut at = after(unit.payload_at, IndexHeader::SIZE);
        for (entry, &(frame, offset)) in index.entries.iter().zip(&self.gops) {
            if self.starts_inside {
                break;
            }
            same(at, "6.10", "frame", entry.frame, frame)?;
            same(element_at(&IndexEntry::TABLE, at, "offset"), "6.10", "offset", entry.offset, offset)?;
            at = after(at, IndexEntry::SIZE);
        }
        self.index_offset = Some(unit.at);
        Ok(())
    }

    pub(super) fn end(&mut self, unit: &Unit<'a>) -> Result<()> {
        self.close_gop(unit.at)?;
        let (end, rest) = EndOfStream::parse(unit.payload, unit.payload_at)?;
        let expected = EndOfStream {
            frame_count: self.frame_headers,
            unit_count: self.units,
            index_offset: self.index_offset.unwrap_or(0),
        };
        self.ended = true;
        let announced = self.sequence().map_or(0, |sequence| sequence.frame_count);
        if !self.starts_inside {
            end.validate_against(unit.payload_at, &expected)?;
            let frames = if announced == 0 { 0 } else { self.frames };
            same(unit.payload_at, "6.4", "frame_count", frames, announced)?;
        }
        EndOfStream::TABLE.ends(rest, unit.payload_at)
    }
}
