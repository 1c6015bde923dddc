//! A number for values of any kind, by which two runs tell whether theirs are the same.

use core::fmt::{self, Debug, Write};
use xxhash_rust::xxh64::Xxh64;

/// XXH64 of how values are written for debugging, which has every bit of them.
pub(crate) fn digest_of(values: &impl Debug) -> u64 {
    let mut digest = Digest(Xxh64::new(0));
    // Nothing can fail.
    let _written = write!(digest, "{values:?}");
    digest.0.digest()
}

/// Takes text as it comes: that of photographs is a hundred times as long as they are.
struct Digest(Xxh64);

impl Write for Digest {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0.update(text.as_bytes());
        Ok(())
    }
}
