//! Edits of a valid stream, taken from bytes: five to an edit, so that changing one byte changes one edit.

use crate::seal::set_payload_length;
use crate::streams;
use splatstream_format::Limits;
use splatstream_format::syntax::{FileHeader, UnitHeader};
use splatstream_format::unit::Stream;

/// Bytes of an edit: what, in which unit, where (16 bits), and with which value.
const EDIT: usize = 5;
/// More add time, not depth.
const MAX_EDITS: usize = 32;

/// One of the valid streams with edits.
pub fn edited(data: &[u8]) -> Vec<u8> {
    let (choice, edits) = data.split_first().unwrap_or((&0, &[]));
    let stream = streams::ALL[usize::from(*choice) % streams::ALL.len()];
    let mut units = units(stream);
    for &[what, unit, low, high, value] in edits.as_chunks::<EDIT>().0.iter().take(MAX_EDITS) {
        apply(&mut units, what, unit.into(), u16::from_le_bytes([low, high]).into(), value);
    }
    let mut out = stream[..FileHeader::SIZE].to_vec();
    out.extend(units.into_iter().flatten());
    out
}

/// The stream with a unit, of those that can be told apart, so many times more behind itself, as long as its payloads
/// have no more than so many bytes together.
pub fn repeated(stream: &[u8], unit: usize, times: usize, max_payload: usize) -> Vec<u8> {
    let units = units(stream);
    let mut out = stream.to_vec();
    let index = unit % units.len().max(1);
    if let Some(unit) = units.get(index) {
        let end = FileHeader::SIZE + units.iter().take(index + 1).map(Vec::len).sum::<usize>();
        let payload = unit.len() - UnitHeader::SIZE;
        out.splice(end..end, unit.repeat(times.min(max_payload / payload.max(1))));
    }
    out
}

/// Header and payload of each unit.
fn units(stream: &[u8]) -> Vec<Vec<u8>> {
    let limits = Limits::default();
    let Ok(opened) = Stream::open(stream, &limits) else { return Vec::new() };
    let mut rest = &stream[FileHeader::SIZE..];
    let mut units = Vec::new();
    for unit in opened.units().map_while(Result::ok) {
        let (this, after) = rest.split_at(UnitHeader::SIZE + unit.payload.len());
        units.push(this.to_vec());
        rest = after;
    }
    units
}

fn apply(units: &mut Vec<Vec<u8>>, what: u8, unit: usize, index: usize, value: u8) {
    let count = units.len();
    if count == 0 {
        return;
    }
    let unit = unit % count;
    let bytes = &mut units[unit];
    let index = index % bytes.len();
    match what % 8 {
        0 => bytes[index] = value,
        1 => bytes[index] ^= 1 << (value % 8),
        2 => bytes[index] = bytes[index].wrapping_add(value),
        // In the payload, and the header knows: the other units stay what they are.
        3 => {
            bytes.insert(index.max(UnitHeader::SIZE), value);
            set_payload_length(bytes);
        }
        4 => {
            bytes.truncate(index.max(UnitHeader::SIZE));
            set_payload_length(bytes);
        }
        5 => drop(units.remove(unit)),
        6 => {
            let again = bytes.clone();
            units.insert(usize::from(value) % count, again);
        }
        _ => units.swap(unit, usize::from(value) % count),
    }
}
