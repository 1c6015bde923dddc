//! Annex B and the inspector, on any bytes.

use crate::LIMITS;
use crate::seal::sealed;
use splatstream_format::Result;
use splatstream_format::inspect::inspect;
use splatstream_format::syntax::{FileHeader, UnitHeader};
use splatstream_format::unit::{Landmark, Stream, Units};

/// Units lie back to back and within the stream; so do the elements that the inspector shows, and where it
/// finds no fault they are the whole stream.
pub fn run(data: &[u8]) {
    let bytes = sealed(data);
    let delimited = delimit(&bytes);
    if inspected(&bytes) {
        assert_eq!(delimited, Ok(()), "the inspector passes over an error");
    }
}

/// Walks the units; gives the first error.
fn delimit(bytes: &[u8]) -> Result<()> {
    let end = bytes.len() as u64;
    let within = |error: splatstream_format::Error| {
        assert!(error.at <= end, "{error} is outside the stream");
        error
    };
    let stream = Stream::open(bytes, &LIMITS).map_err(within)?;
    let profile = stream.header().profile();
    let mut units = stream.units();
    let mut next = FileHeader::SIZE as u64;
    let mut first = Ok(());
    loop {
        assert_eq!(units.position(), next);
        match units.next_unit() {
            Some(Ok(unit)) => {
                let payload_at = next + UnitHeader::SIZE as u64;
                assert_eq!((unit.at, unit.payload_at), (next, payload_at));
                let found = stream.units_from(unit.at).next_unit();
                assert_eq!(found, Some(Ok(unit)), "a unit is found by its offset");
                next = payload_at + unit.payload.len() as u64;
                assert_eq!(bytes[payload_at as usize..next as usize], *unit.payload);
                let checked = unit.check_header(profile).and_then(|()| unit.check_payload());
                first = first.and(checked.map_err(within));
            }
            Some(Err(error)) => {
                assert_eq!(units.next_unit(), None, "the end of a unit is not known");
                scans(&units, next);
                return first.and(Err(within(error)));
            }
            None => {
                assert_eq!(next, end, "bytes are left over");
                return first;
            }
        }
    }
}

/// A scan for a landmark goes forward, to a unit of its kind, or to the end.
fn scans(units: &Units<'_>, from: u64) {
    for landmark in [Landmark::GopHeader, Landmark::SequenceParameters] {
        let mut units = units.clone();
        if units.scan_for(landmark) {
            assert!(units.position() > from, "a scan goes forward");
            assert!(matches!(units.next_unit(), Some(Ok(_))), "a landmark is a unit");
        } else {
            assert_eq!(units.next_unit(), None, "nothing is left");
        }
    }
}

/// Whether the inspector finds no fault.
fn inspected(bytes: &[u8]) -> bool {
    let end = bytes.len() as u64 * 8;
    let (mut next, mut gaps) = (0, false);
    let error = inspect(bytes, &LIMITS, &mut |element| {
        assert!(element.at_bit >= next, "{element:?} overlaps the element before, which ends at bit {next}");
        gaps |= element.at_bit > next;
        next = element.at_bit + element.bits;
        assert!(next <= end, "{element:?} ends outside the stream");
    });
    if error.is_none() {
        assert!(!gaps && next == end, "elements are missing");
    }
    error.is_none()
}
