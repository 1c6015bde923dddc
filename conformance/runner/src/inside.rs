//! What a decoder gets that starts inside a stream (B.3): the file_header, the sequence_parameters unit, and the units from
//! a gop_header on.

use splatstream_format::Limits;
use splatstream_format::syntax::{FileHeader, UnitType};
use splatstream_format::unit::{Stream, Unit};

/// The input that starts at the gop_header at this offset of a stream. If the stream has no intact sequence_parameters
/// unit before it, the input has none.
pub(crate) fn input(bytes: &[u8], gop: u64) -> Vec<u8> {
    let gop = usize::try_from(gop).unwrap_or(usize::MAX);
    let part = |range: std::ops::Range<usize>| bytes.get(range).unwrap_or_default();
    let sequence = sequence_parameters(bytes);
    [part(0..FileHeader::SIZE), part(sequence), bytes.get(gop..).unwrap_or_default()].concat()
}

/// Where the gop_header stands in such an input.
pub(crate) fn first_gop(input: &[u8]) -> u64 {
    let end = sequence_parameters(input).end.max(FileHeader::SIZE);
    u64::try_from(end).unwrap_or(u64::MAX)
}

/// The bytes of the first intact sequence_parameters unit; an empty range if there is none.
fn sequence_parameters(bytes: &[u8]) -> std::ops::Range<usize> {
    let Ok(stream) = Stream::open(bytes, &Limits::of_level(4)) else { return 0..0 };
    let profile = stream.header().profile();
    let mut units = stream.units();
    let is_intact = |unit: &Unit<'_>| {
        unit.header.unit_type() == UnitType::SequenceParameters
            && unit.check_header(profile).is_ok()
            && unit.check_payload().is_ok()
    };
    while let Some(Ok(unit)) = units.next_unit() {
        if is_intact(&unit) {
            let offset = |at: u64| usize::try_from(at).unwrap_or(usize::MAX);
            return offset(unit.at)..offset(unit.payload_at).saturating_add(unit.payload.len());
        }
    }
    0..0
}
