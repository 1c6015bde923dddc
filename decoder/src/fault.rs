//! Defects of this crate: something that always holds does not.
//!
//! Where a clause, or the code before, has established that something is there or fits, and it is not so, decoding ends with
//! an [`Error::fault`]: a frame with a value that was made up would be wrong without a word. Kernels look at nothing of the
//! kind. What their loops build on has been established before: that planes have one length, and by annex F that no
//! sum, product or shift leaves its type, so that operations which wrap never do.

use splatstream_format::{Error, Result};

/// A length as the stream writes it.
///
/// # Errors
/// A fault if it has more than 32 bits: no count of a stream has.
pub(crate) fn count(length: usize) -> Result<u32> {
    u32::try_from(length).map_err(|_| Error::fault("a length of 32 bits"))
}
