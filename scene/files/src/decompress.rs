//! Decompression that stops where it was told to, whatever the stream says of itself.

use std::io::Read;

use ruzstd::decoding::StreamingDecoder;

use crate::error::SceneError;

/// The largest window a zstd decoder has to support by default, 128 MiB.
const ZSTD_WINDOW: u64 = 1 << 27;

const DAMAGED: &str = "the file is damaged; copy it again";

/// The first `size` bytes of what `source` gives, or the fewer there are. Memory grows with the bytes that
/// really come, not with `size`.
pub(crate) fn read_up_to(
    source: &mut impl Read,
    size: u64,
    at: usize,
    what: &str,
) -> Result<Vec<u8>, SceneError> {
    let mut out = Vec::new();
    source
        .take(size)
        .read_to_end(&mut out)
        .map_err(|error| SceneError::malformed(at, format!("cannot decompress {what}: {error}"), DAMAGED))?;
    Ok(out)
}

/// As [`read_up_to`], and fewer bytes are an error.
pub(crate) fn read_exactly(
    source: &mut impl Read,
    size: u64,
    at: usize,
    what: &'static str,
) -> Result<Vec<u8>, SceneError> {
    let out = read_up_to(source, size, at, what)?;
    if (out.len() as u64) < size {
        return Err(SceneError::truncated(at, what, size, out.len()));
    }
    Ok(out)
}

/// The content of a zstd frame that must be `size` bytes, no more and no less. `at` is where it starts.
pub(crate) fn zstd(frame: &[u8], size: u64, at: usize, what: &'static str) -> Result<Vec<u8>, SceneError> {
    let refuse = |error| SceneError::malformed(at, format!("{what} is no zstd frame: {error}"), DAMAGED);
    let mut decoder = StreamingDecoder::new_with_max_window_size(frame, ZSTD_WINDOW).map_err(refuse)?;
    let out = read_exactly(&mut decoder, size, at, what)?;
    if read_up_to(&mut decoder, 1, at, what)?.is_empty() {
        return Ok(out);
    }
    Err(SceneError::malformed(at, format!("{what} holds more than the {size} bytes it should"), DAMAGED))
}
