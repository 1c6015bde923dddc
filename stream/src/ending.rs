//! Streams that lack their end: those that still grow, and those that were cut.

use splatstream_format::syntax::{EndOfStream, SequenceParameters, UnitHeader, UnitId, UnitType};
use splatstream_format::unit::Stream;
use splatstream_format::{Limits, Result};

/// The complete GOPs of a stream that is cut or damaged further on, as a stream with an end of its own. Nothing is decoded.
///
/// ```
/// use splatstream_format::Limits;
/// use splatstream_stream::ending::complete_gops;
///
/// let whole = include_bytes!("../../examples/talk.gss");
/// let part = complete_gops(&whole[..whole.len() * 2 / 3], &Limits::default())?;
/// assert!(part.starts_with(&whole[..16]) && part.len() < whole.len());
/// # Ok::<(), splatstream_format::Error>(())
/// ```
///
/// # Errors
/// The first error of the stream, where no GOP before it is complete; and sequence parameters that are damaged.
pub fn complete_gops(bytes: &[u8], limits: &Limits) -> Result<Vec<u8>> {
    let mut units = Stream::open(bytes, limits)?.units();
    // Where the GOP in progress begins, with the copy of the sequence parameters before it, and whether one was complete before.
    let (mut start, mut copy) = (None, None);
    let (mut end, mut is_any) = (None, false);
    let mut failed = None;
    while let Some(unit) = units.next_unit() {
        let unit = match unit {
            Ok(unit) => unit,
            Err(error) => {
                failed = Some(error);
                break;
            }
        };
        match unit.header.unit_type() {
            UnitType::GopHeader => {
                is_any |= start.is_some();
                start = Some(copy.unwrap_or(unit.at));
            }
            UnitType::OperatingPoints | UnitType::Index | UnitType::End => {
                (is_any, end) = (true, Some(unit.at));
                break;
            }
            _ => {}
        }
        copy = (unit.header.unit_type() == UnitType::SequenceParameters).then_some(unit.at);
    }
    let end = end.or(start).filter(|_| is_any).and_then(|end| bytes.get(..usize::try_from(end).ok()?));
    let mut stream = match (end, failed) {
        (Some(stream), _) => stream.to_vec(),
        (None, Some(error)) => return Err(error),
        // A stream that has no GOP ends where it ends.
        (None, None) => bytes.to_vec(),
    };
    end_here(&mut stream, limits)?;
    Ok(stream)
}

/// Ends a stream that has no end unit: with one that counts frames and units, and knows no index, since those that a stream may
/// have come after its last GOP. Sequence parameters announce no frames any more, as not all that they announced are there.
///
/// # Errors
/// What delimiting the units finds, and damaged sequence parameters.
pub(crate) fn end_here(stream: &mut Vec<u8>, limits: &Limits) -> Result<()> {
    let mut end = EndOfStream { frame_count: 0, unit_count: 0, index_offset: 0 };
    let mut changed = Vec::new();
    let opened = Stream::open(stream, limits)?;
    let profile = opened.header().profile();
    let mut units = opened.units();
    let whole = u64::try_from(stream.len()).unwrap_or(u64::MAX);
    while let Some(unit) = units.next_unit() {
        let unit = match unit {
            // What is missed there is the unit that is made here.
            Err(error) if error.at == whole => break,
            unit => unit?,
        };
        let kind = unit.header.unit_type();
        end.frame_count = end.frame_count.saturating_add(u32::from(kind == UnitType::FrameHeader));
        end.unit_count = end.unit_count.saturating_add(1);
        if kind == UnitType::SequenceParameters {
            let sequence = SequenceParameters::parse_payload(unit.payload, unit.payload_at, profile)?;
            let payload = SequenceParameters { frame_count: 0, ..sequence }.to_bytes()?;
            changed.push((unit.at, of_stream(kind, &payload)?));
        }
    }
    for (at, bytes) in changed {
        let place = usize::try_from(at).ok().and_then(|at| stream.get_mut(at..)?.get_mut(..bytes.len()));
        place.into_iter().for_each(|place| place.copy_from_slice(&bytes));
    }
    stream.extend(of_stream(UnitType::End, &end.to_bytes()?)?);
    Ok(())
}

/// A unit of the whole stream: its header and its payload.
fn of_stream(kind: UnitType, payload: &[u8]) -> Result<Vec<u8>> {
    let header = UnitHeader::new(UnitId::stream(kind), payload)?;
    Ok([&header.to_bytes()?[..], payload].concat())
}
