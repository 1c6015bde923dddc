//! Annex B and the inspector, on any bytes.

use crate::LIMITS;
use crate::seal::sealed;
use splatstream_format::Result;
use splatstream_format::inspect::inspect;
use splatstream_format::syntax::{FileHeader, UnitHeader};
use splatstream_format::unit::{Delivery, Stream};

/// Units lie back to back and within the stream; so do the elements that the inspector shows, and where it
/// finds no fault they are the whole stream.
pub fn run(data: &[u8]) {
    let bytes = sealed(data);
    let delimited = delimit(&bytes);
    if inspected(&bytes) {
        assert_eq!(delimited, Ok(()), "the inspector passes over an error");
    }
}

/// Walks the units; gives the error that ends the walk.
fn delimit(bytes: &[u8]) -> Result<()> {
    let end = bytes.len() as u64;
    let within = |error: splatstream_format::Error| {
        assert!(error.at <= end, "{error} is outside the stream");
        error
    };
    let stream = Stream::open(bytes, &LIMITS).map_err(within)?;
    let mut units = stream.units();
    let mut next = FileHeader::SIZE as u64;
    let mut damage = Ok(());
    loop {
        assert_eq!(units.position(), next);
        let payload_at = next + UnitHeader::SIZE as u64;
        match units.next_unit() {
            Some(Ok(Delivery::Intact(unit))) => {
                assert_eq!((unit.at, unit.payload_at), (next, payload_at));
                assert_eq!(
                    stream.units_from(unit.at).next(),
                    Some(Ok(unit)),
                    "a unit is found by its offset"
                );
                next = payload_at + unit.payload.len() as u64;
                assert_eq!(bytes[payload_at as usize..next as usize], *unit.payload);
            }
            Some(Ok(Delivery::Damaged(damaged))) => {
                next = payload_at + u64::from(damaged.unit.header.payload_length);
                if !damaged.passed_over {
                    damage = damage.and(Err(within(damaged.error)));
                }
            }
            Some(Err(error)) => {
                assert_eq!(units.next_unit(), None, "after an error nothing comes");
                return Err(within(error));
            }
            None => {
                assert_eq!(next, end, "bytes are left over");
                return damage;
            }
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
