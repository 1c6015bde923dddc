//! Changes of streams, after which the reference decoder makes of them what a decoder with an error makes of the original.

use splatstream_format::Limits;
use splatstream_format::syntax::{FileHeader, SequenceParameters, UnitHeader, UnitType};
use splatstream_format::unit::{Stream, Unit};

/// The stream with some of its units changed or removed. What stands after the last unit that can be delimited stays.
fn edited(stream: &[u8], mut edit: impl FnMut(&Unit<'_>) -> Edit) -> Vec<u8> {
    let Ok(opened) = Stream::open(stream, &Limits::of_level(4)) else { return stream.to_vec() };
    let mut out = stream.get(..FileHeader::SIZE).unwrap_or_default().to_vec();
    let (mut units, mut end) = (opened.units(), out.len());
    while let Some(Ok(unit)) = units.next_unit() {
        let start = end;
        end = start.saturating_add(UnitHeader::SIZE).saturating_add(unit.payload.len());
        match edit(&unit) {
            Edit::Keep => out.extend_from_slice(stream.get(start..end).unwrap_or_default()),
            Edit::Remove => {}
            Edit::Replace(bytes) => out.extend(bytes),
        }
    }
    out.extend_from_slice(stream.get(end..).unwrap_or_default());
    out
}

/// What becomes of a unit.
enum Edit {
    Keep,
    Remove,
    Replace(Vec<u8>),
}

/// The stream with `whole_anchor` set.
pub(crate) fn with_whole_anchor(stream: &[u8]) -> Vec<u8> {
    /// Bit 2 of `sequence_flags`.
    const WHOLE_ANCHOR: u8 = 4;
    let Ok(profile) = Stream::open(stream, &Limits::of_level(4)).map(|stream| stream.header().profile())
    else {
        return stream.to_vec();
    };
    let changed = |unit: &Unit<'_>| {
        let mut sequence = SequenceParameters::parse_payload(unit.payload, unit.payload_at, profile).ok()?;
        sequence.sequence_flags |= WHOLE_ANCHOR;
        let payload = sequence.to_bytes().ok()?;
        let header = unit.header.with_payload(&payload).ok()?.to_bytes().ok()?;
        Some([header, payload].concat())
    };
    edited(stream, |unit| match unit.header.unit_type() {
        UnitType::SequenceParameters => changed(unit).map_or(Edit::Keep, Edit::Replace),
        _ => Edit::Keep,
    })
}

/// The stream without the increments that stand after an error at this offset, up to the next GOP.
pub(crate) fn without_increments_after(stream: &[u8], error_at: u64) -> Vec<u8> {
    let mut is_in_gop = true;
    edited(stream, |unit| {
        let is_after = unit.at > error_at;
        let starts_gop = unit.header.unit_type() == UnitType::GopHeader;
        is_in_gop &= !(is_after && starts_gop);
        match unit.header.unit_type() {
            UnitType::Increment if is_after && is_in_gop => Edit::Remove,
            _ => Edit::Keep,
        }
    })
}
