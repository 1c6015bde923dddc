//! The two containers of glTF: a header and chunks (GLB), or JSON alone.

use std::ops::Range;

use super::{EXPORT, is_glb, is_json};
use crate::cursor::Cursor;
use crate::error::SceneError;
use crate::walk::{Walk, part};

/// The first bytes of a GLB file.
pub(super) const MAGIC: [u8; 4] = *b"glTF";
/// The version of the container that is read and written.
pub(super) const VERSION: u32 = 2;
/// Types of chunks.
pub(super) const JSON: [u8; 4] = *b"JSON";
pub(super) const BINARY: [u8; 4] = *b"BIN\0";

/// The JSON of a file, and its binary chunk where it has one.
pub(super) fn split(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), SceneError> {
    if is_glb(bytes) {
        let mut cursor = Cursor::new(bytes);
        cursor.take(MAGIC.len() as u64, "the GLB header")?;
        let chunks = chunks(&mut cursor)?;
        return Ok((part(bytes, &chunks.json), chunks.binary.map(|binary| part(bytes, &binary))));
    }
    if is_json(bytes) {
        return Ok((bytes, None));
    }
    Err(SceneError::malformed(0, "neither a GLB header nor JSON", "this is no glTF file"))
}

/// Bytes of JSON in a file, told by its start alone.
pub(super) fn json_bytes(walk: &mut impl Walk) -> Result<u64, SceneError> {
    let size = walk.left();
    if size < 4 || walk.array("the GLB header")? != MAGIC {
        return Ok(size);
    }
    let json = chunks(walk)?.json;
    Ok(json.end.saturating_sub(json.start))
}

/// Where the chunks of a GLB file are that are read.
struct Chunks {
    json: Range<u64>,
    binary: Option<Range<u64>>,
}

/// The chunks of a file whose magic number is behind.
fn chunks(walk: &mut impl Walk) -> Result<Chunks, SceneError> {
    const WHAT: &str = "the GLB header";
    let [version, length] = [walk.u32(WHAT)?, walk.u32(WHAT)?];
    if version != VERSION {
        let what = format!("GLB of version {version}");
        return Err(SceneError::unsupported(what, "version 2 is known; export the file as glTF 2.0"));
    }
    let whole = walk.at().saturating_add(walk.left());
    if u64::from(length) > whole {
        return Err(SceneError::truncated(0, "the GLB file", length.into(), whole));
    }
    let (kind, json) = chunk(walk)?;
    if kind != JSON {
        return Err(SceneError::malformed(12, "the first chunk is not JSON", EXPORT));
    }
    if walk.at() >= u64::from(length) {
        return Ok(Chunks { json, binary: None });
    }
    let (kind, binary) = chunk(walk)?;
    Ok(Chunks { json, binary: (kind == BINARY).then_some(binary) })
}

/// The type and the place of the next chunk.
fn chunk(walk: &mut impl Walk) -> Result<([u8; 4], Range<u64>), SceneError> {
    let length = walk.u32("the header of a chunk")?;
    let kind = walk.array("the header of a chunk")?;
    Ok((kind, walk.pass(length.into(), "a chunk")?))
}
