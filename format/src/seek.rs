//! Annex B.3: where decoding can start so that a frame comes out without all that stands before it.

use crate::Limits;
use crate::payload::Index;
use crate::syntax::{EndOfStream, FileHeader, GopHeader, IndexEntry, Profile, UnitHeader, UnitType, after};
use crate::unit_reader::{Event, UnitReader};

/// Bytes of the end unit, the last of a stream.
const END_SIZE: usize = UnitHeader::SIZE + EndOfStream::SIZE;

/// A stream that can be read at any place.
pub trait ReadAt {
    /// Bytes of the stream, if that can be told.
    fn length(&mut self) -> Option<u64>;

    /// Exactly `length` bytes from an absolute offset on; none if they are not there.
    fn read_at(&mut self, at: u64, length: usize) -> Option<Vec<u8>>;
}

impl ReadAt for &[u8] {
    fn length(&mut self) -> Option<u64> {
        Some(after(0, self.len()))
    }

    fn read_at(&mut self, at: u64, length: usize) -> Option<Vec<u8>> {
        let at = usize::try_from(at).ok()?;
        self.get(at..at.checked_add(length)?).map(<[u8]>::to_vec)
    }
}

/// The GOP that holds `frame`, by the index of the stream: its first frame, and the offset of its header. None where
/// decoding starts at the first GOP: that is the right one, or the stream has no index, is cut, or its index does not say
/// what is there.
pub fn gop_of(stream: &mut impl ReadAt, frame: u32, limits: &Limits) -> Option<IndexEntry> {
    let profile = FileHeader::parse(&stream.read_at(0, FileHeader::SIZE)?).ok()?.0.profile();
    let end_at = stream.length()?.checked_sub(after(0, END_SIZE))?;
    let end = payload_at(stream, end_at, UnitType::End, profile, limits)?;
    let end = EndOfStream::parse_payload(&end.payload, end.at).ok()?;
    let index = payload_at(stream, end.index_offset, UnitType::Index, profile, limits)?;
    let index = Index::parse(&index.payload, index.at).ok()?;
    let last = index.entries.iter().rposition(|entry| entry.frame <= frame)?;
    let entry = *index.entries.get(last).filter(|_| last > 0)?;
    let gop = payload_at(stream, entry.offset, UnitType::GopHeader, profile, limits)?;
    let header = GopHeader::parse_payload(&gop.payload, gop.at, profile).ok()?;
    let holds = gop.frame == entry.frame && frame.saturating_sub(entry.frame) < header.gop_frame_count;
    holds.then_some(entry)
}

/// The payload of a unit, and what its header says.
struct Found {
    payload: Vec<u8>,
    at: u64,
    frame: u32,
}

/// The payload of the unit of a type at an offset, if it is there and intact.
fn payload_at(
    stream: &mut impl ReadAt,
    at: u64,
    unit_type: UnitType,
    profile: Profile,
    limits: &Limits,
) -> Option<Found> {
    let mut bytes = stream.read_at(at, UnitHeader::SIZE)?;
    let mut reader = UnitReader::starting_at(at, limits);
    if let Event::NeedMoreData(missing) = reader.read(&bytes, false).ok()? {
        bytes.extend(stream.read_at(after(at, bytes.len()), usize::try_from(missing).ok()?)?);
    }
    // A unit without a payload has been read already.
    let Event::Unit(unit) = UnitReader::starting_at(at, limits).read(&bytes, true).ok()? else { return None };
    unit.check_header(profile).and_then(|()| unit.check_payload()).ok()?;
    let is_it = unit.header.unit_type() == unit_type;
    is_it.then(|| Found { payload: unit.payload.to_vec(), at: unit.payload_at, frame: unit.header.frame })
}
