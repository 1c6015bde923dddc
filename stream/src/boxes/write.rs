//! Boxes into a buffer.

use super::FourCc;

/// Appends a box with a body. A box of 4 GiB or more does not occur: subsegments are smaller.
pub(crate) fn put(out: &mut Vec<u8>, kind: FourCc, body: impl FnOnce(&mut Vec<u8>)) {
    let start = out.len();
    out.extend([0; 4]);
    out.extend(kind);
    body(out);
    let size = u32::try_from(out.len().saturating_sub(start)).unwrap_or(u32::MAX);
    if let Some(place) = out.get_mut(start..start.saturating_add(4)) {
        place.copy_from_slice(&size.to_be_bytes());
    }
}

/// Appends a box with a version and flags.
pub(crate) fn put_full(
    out: &mut Vec<u8>,
    kind: FourCc,
    version: u8,
    flags: u32,
    body: impl FnOnce(&mut Vec<u8>),
) {
    put(out, kind, |out| {
        u32s(out, &[u32::from(version) << 24 | flags & 0xFF_FFFF]);
        body(out);
    });
}

/// Appends numbers of 32 bits.
pub(crate) fn u32s(out: &mut Vec<u8>, values: &[u32]) {
    values.iter().for_each(|value| out.extend(value.to_be_bytes()));
}

/// Appends numbers of 16 bits.
pub(crate) fn u16s(out: &mut Vec<u8>, values: &[u16]) {
    values.iter().for_each(|value| out.extend(value.to_be_bytes()));
}

/// Appends a number of 64 bits.
pub(crate) fn u64(out: &mut Vec<u8>, value: u64) {
    out.extend(value.to_be_bytes());
}
