//! Checksums that fit. Built for fuzzing, the decoder does not look at them; replayed by a test, it does, and
//! the same bytes must reach the same depth.

use splatstream_format::syntax::{FileHeader, UnitHeader};
use std::borrow::Cow;

/// Where the checksum of the file header is; it covers what stands before.
const FILE_CHECK: usize = FileHeader::SIZE - 4;
/// Where the checksum of a unit header is; it covers the other bytes of the header.
const HEADER_CHECK: usize = 6;
/// Where the length of the payload is, and after it the checksum of the payload.
const PAYLOAD_LENGTH: usize = 12;

/// The stream with checksums that fit, as far as units can be told apart.
pub fn sealed(stream: &[u8]) -> Cow<'_, [u8]> {
    if cfg!(fuzzing) { Cow::Borrowed(stream) } else { Cow::Owned(seal(stream.to_vec())) }
}

/// Makes every checksum fit.
pub fn seal(mut stream: Vec<u8>) -> Vec<u8> {
    let Some((header, mut rest)) = stream.split_at_mut_checked(FileHeader::SIZE) else { return stream };
    let check = crc32fast::hash(&header[..FILE_CHECK]);
    header[FILE_CHECK..].copy_from_slice(&check.to_le_bytes());
    while let Some((header, after)) = rest.split_at_mut_checked(UnitHeader::SIZE) {
        let length = payload_length(header).min(after.len());
        let (payload, after) = after.split_at_mut(length);
        header[PAYLOAD_LENGTH + 4..].copy_from_slice(&crc32fast::hash(payload).to_le_bytes());
        let mut covered = crc32fast::Hasher::new();
        covered.update(&header[..HEADER_CHECK]);
        covered.update(&header[HEADER_CHECK + 2..]);
        header[HEADER_CHECK..HEADER_CHECK + 2].copy_from_slice(&covered.finalize().to_le_bytes()[..2]);
        rest = after;
    }
    stream
}

/// What a unit header says of its payload.
fn payload_length(header: &[u8]) -> usize {
    let bytes = header[PAYLOAD_LENGTH..].first_chunk().copied().unwrap_or_default();
    usize::try_from(u32::from_le_bytes(bytes)).unwrap_or(usize::MAX)
}

/// Makes a unit, header and payload in one, say how long its payload is.
pub fn set_payload_length(unit: &mut [u8]) {
    let length = u32::try_from(unit.len().saturating_sub(UnitHeader::SIZE)).unwrap_or(u32::MAX);
    if let Some(element) = unit.get_mut(PAYLOAD_LENGTH..PAYLOAD_LENGTH + 4) {
        element.copy_from_slice(&length.to_le_bytes());
    }
}
