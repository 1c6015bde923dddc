//! Where decoding can start so that a frame comes out without all that stands before it: annex B.3.

use crate::stream_file::StreamFile;
use serde::Serialize;
use splatstream_format::Limits;
use splatstream_format::payload::Index;
use splatstream_format::syntax::{EndOfStream, GopHeader, IndexEntry, UnitHeader, UnitType};
use splatstream_format::unit::{Stream, Unit};

/// Bytes of the end unit, the last of a stream.
const END_SIZE: usize = UnitHeader::SIZE + EndOfStream::SIZE;

/// The GOP at which decoding starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub(crate) struct Seek {
    /// Display index of its first frame.
    pub(crate) frame: u32,
    /// Offset of its header.
    pub(crate) byte: u64,
}

/// The GOP that holds `frame`, by the index of the stream. None where decoding starts at the first GOP: that
/// is the right one, or the stream has no index, is cut, or its index does not say what is there.
pub(crate) fn gop_of(file: &StreamFile, frame: u32, limits: &Limits) -> Option<Seek> {
    let stream = Stream::open(&file.bytes, limits).ok()?;
    file.sequence(limits)?;
    let end_at = u64::try_from(file.bytes.len().checked_sub(END_SIZE)?).ok()?;
    let end = unit_at(&stream, end_at, UnitType::End)?;
    let end = EndOfStream::parse_payload(end.payload, end.payload_at).ok()?;
    let index = unit_at(&stream, end.index_offset, UnitType::Index)?;
    let index = Index::parse(index.payload, index.payload_at).ok()?;
    let last = index.entries.iter().rposition(|entry| entry.frame <= frame)?;
    let entry = index.entries.get(last).filter(|_| last > 0)?;
    holds(&stream, entry, frame).then_some(Seek { frame: entry.frame, byte: entry.offset })
}

/// The unit of a type at an offset, if it is there and intact.
fn unit_at<'a>(stream: &Stream<'a>, at: u64, unit_type: UnitType) -> Option<Unit<'a>> {
    let unit = stream.units_from(at).next()?.ok()?;
    (unit.header.unit_type() == unit_type).then_some(unit)
}

/// Whether the GOP that an entry points at has the frame.
fn holds(stream: &Stream<'_>, entry: &IndexEntry, frame: u32) -> bool {
    let Some(unit) = unit_at(stream, entry.offset, UnitType::GopHeader) else { return false };
    let header = GopHeader::parse_payload(unit.payload, unit.payload_at, stream.header().profile());
    let frames = header.map_or(0, |header| header.gop_frame_count);
    unit.header.frame == entry.frame && frame.saturating_sub(entry.frame) < frames
}
