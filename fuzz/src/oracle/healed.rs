//! Digests that fit.

use crate::laws::{Decoded, VERIFIED};
use crate::seal::seal;
use splatstream_decoder::process::Options;
use splatstream_format::{Error, ErrorKind};

/// More digests than a small stream has.
const MOST_DIGESTS: usize = 100;

/// The stream with check sums that fit, and with the digests of what it decodes to, as far as it decodes.
pub(super) fn healed(stream: Vec<u8>) -> Vec<u8> {
    let mut stream = seal(stream);
    for _ in 0..MOST_DIGESTS {
        let Some((at, computed)) = wrong_digest(&stream) else { break };
        let Some(element) = at.and_then(|at| stream.get_mut(at..at + 8)) else { break };
        element.copy_from_slice(&computed.to_le_bytes());
        stream = seal(stream);
    }
    stream
}

/// Where the first wrong digest is, if that is what ends decoding, and what it should be.
fn wrong_digest(stream: &[u8]) -> Option<(Option<usize>, u64)> {
    let options = Options { limits: super::LIMITS, ..VERIFIED };
    match Decoded::of(stream, &options).end {
        Some(Error { at, kind: ErrorKind::Digest { computed, .. }, .. }) => {
            Some((usize::try_from(at).ok(), computed))
        }
        _ => None,
    }
}
