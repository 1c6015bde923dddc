//! Digests that fit.

use crate::laws::{Decoded, VERIFIED};
use crate::seal::seal;
use splatstream_decoder::process::Options;
use splatstream_format::ErrorKind;

/// Rounds: a digest that fits lets other units be decoded.
const MAX_ROUNDS: usize = 40;

/// The stream with checksums that fit, and with the digests of what it decodes to, as far as it decodes.
pub(super) fn healed(stream: Vec<u8>) -> Vec<u8> {
    let mut stream = seal(stream);
    let options = Options { limits: super::LIMITS, ..VERIFIED };
    for _ in 0..MAX_ROUNDS {
        let errors = Decoded::of(&stream, &options).errors;
        let digests = errors.into_iter().filter_map(|error| match error.kind {
            ErrorKind::Digest { computed, .. } => Some((usize::try_from(error.at).ok()?, computed)),
            _ => None,
        });
        let mut is_done = true;
        for (at, computed) in digests {
            if let Some(element) = stream.get_mut(at..at + 8) {
                element.copy_from_slice(&computed.to_le_bytes());
                is_done = false;
            }
        }
        if is_done {
            break;
        }
        stream = seal(stream);
    }
    stream
}
