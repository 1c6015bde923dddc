//! The two containers of glTF: a header and chunks (GLB), or JSON alone.

use super::{EXPORT, is_glb, is_json};
use crate::cursor::Cursor;
use crate::error::SceneError;

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
        return chunks(bytes);
    }
    if is_json(bytes) {
        return Ok((bytes, None));
    }
    Err(SceneError::malformed(0, "neither a GLB header nor JSON", "this is no glTF file"))
}

fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), SceneError> {
    const WHAT: &str = "the GLB header";
    let mut cursor = Cursor::new(bytes);
    cursor.take(4, WHAT)?;
    let [version, length] = [cursor.u32(WHAT)?, cursor.u32(WHAT)?];
    if version != VERSION {
        let what = format!("GLB of version {version}");
        return Err(SceneError::unsupported(what, "version 2 is known; export the file as glTF 2.0"));
    }
    let whole = cursor.remaining().len().saturating_add(cursor.at()) as u64;
    if u64::from(length) > whole {
        return Err(SceneError::truncated(0, "the GLB file", length.into(), bytes.len()));
    }
    let (kind, json) = chunk(&mut cursor)?;
    if kind != JSON {
        return Err(SceneError::malformed(12, "the first chunk is not JSON", EXPORT));
    }
    if cursor.at() as u64 >= u64::from(length) {
        return Ok((json, None));
    }
    let (kind, binary) = chunk(&mut cursor)?;
    Ok((json, (kind == BINARY).then_some(binary)))
}

/// The type and the content of the next chunk.
fn chunk<'a>(cursor: &mut Cursor<'a>) -> Result<([u8; 4], &'a [u8]), SceneError> {
    let length = cursor.u32("the header of a chunk")?;
    let kind = cursor.array("the header of a chunk")?;
    Ok((kind, cursor.take(length.into(), "a chunk")?))
}
