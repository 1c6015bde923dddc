//! Decompression that stops where it was told to, whatever the stream says of itself.

use std::io::Read;

use ruzstd::decoding::StreamingDecoder;

use crate::error::SceneError;
use crate::limits::refused;

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
    read_into(source, size, at, what, &mut out)?;
    Ok(out)
}

fn read_into(
    source: &mut impl Read,
    size: u64,
    at: usize,
    what: &str,
    out: &mut Vec<u8>,
) -> Result<(), SceneError> {
    let read = source.take(size).read_to_end(out);
    read.map_err(|error| SceneError::malformed(at, format!("cannot decompress {what}: {error}"), DAMAGED))?;
    Ok(())
}

/// As [`read_up_to`], and fewer bytes are an error. The caller has counted `size` bytes.
pub(crate) fn read_exactly(
    source: &mut impl Read,
    size: u64,
    at: usize,
    what: &'static str,
) -> Result<Vec<u8>, SceneError> {
    let mut out = Vec::new();
    let room = usize::try_from(size).map_err(|_| refused(size, what))?;
    out.try_reserve_exact(room).map_err(|_| refused(size, what))?;
    read_into(source, size, at, what, &mut out)?;
    if (out.len() as u64) < size {
        return Err(SceneError::truncated(at as u64, what, size, out.len() as u64));
    }
    Ok(out)
}

/// The content of a zstd frame that must be `size` bytes, no more and no less. `at` is where it starts; its window may
/// have `most_window` bytes.
pub(crate) fn zstd(
    frame: &[u8],
    size: u64,
    most_window: u64,
    at: usize,
    what: &'static str,
) -> Result<Vec<u8>, SceneError> {
    let refuse = |error| SceneError::malformed(at, format!("{what} is no zstd frame: {error}"), DAMAGED);
    let mut decoder =
        StreamingDecoder::new_with_max_window_size(frame, most_window.min(ZSTD_WINDOW)).map_err(refuse)?;
    let out = read_exactly(&mut decoder, size, at, what)?;
    if read_up_to(&mut decoder, 1, at, what)?.is_empty() {
        return Ok(out);
    }
    Err(SceneError::malformed(at, format!("{what} holds more than the {size} bytes it should"), DAMAGED))
}
