//! The bytes that glTF refers to: the binary chunk, data inside the JSON, and files.

use std::borrow::Cow;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::document::{BufferView, Document, broken};
use crate::error::SceneError;
use crate::limits::Budget;

/// Every buffer of a file.
pub(super) struct Buffers<'a>(Vec<Cow<'a, [u8]>>);

impl<'a> Buffers<'a> {
    /// Collects the buffers; `fetch` reads those that have a name.
    pub(super) fn load(
        document: &Document,
        binary: Option<&'a [u8]>,
        mut fetch: impl FnMut(&str, &mut Budget) -> Result<Vec<u8>, SceneError>,
        budget: &mut Budget,
    ) -> Result<Self, SceneError> {
        let mut buffers = budget.room(document.buffers.len() as u64, "the buffers")?;
        for (index, buffer) in document.buffers.iter().enumerate() {
            let bytes = match &buffer.uri {
                Some(uri) if uri.starts_with("data:") => Cow::Owned(decoded(index, uri, budget)?),
                Some(uri) => Cow::Owned(fetch(&percent_decoded(uri), budget)?),
                None if index == 0 => Cow::Borrowed(binary.unwrap_or_default()),
                None => Cow::Borrowed(&[][..]),
            };
            if (bytes.len() as u64) < buffer.byte_length {
                let (needed, there) = (buffer.byte_length, bytes.len());
                return Err(broken(format!("buffer {index} has {there} bytes, the file says {needed}")));
            }
            buffers.push(bytes);
        }
        Ok(Self(buffers))
    }

    /// The bytes of a buffer view, and the view.
    pub(super) fn view<'b>(
        &'b self,
        document: &'b Document,
        index: u32,
    ) -> Result<(&'b [u8], &'b BufferView), SceneError> {
        let view = document.buffer_views.get(index as usize);
        let view = view.ok_or_else(|| broken(format!("there is no buffer view {index}")))?;
        if view.extensions.meshopt.is_some() {
            let what = format!("buffer view {index} is compressed with meshopt");
            return Err(SceneError::unsupported(what, "export the file without it"));
        }
        let bytes = self.0.get(view.buffer as usize);
        let bytes = bytes.ok_or_else(|| broken(format!("there is no buffer {}", view.buffer)))?;
        let (from, length) = (usize::try_from(view.byte_offset), usize::try_from(view.byte_length));
        let range = from.ok().zip(length.ok());
        let view_of = |(from, length)| bytes.get(from..)?.get(..length);
        let bytes = range.and_then(view_of).ok_or_else(|| {
            let (from, length, buffer) = (view.byte_offset, view.byte_length, view.buffer);
            let size = bytes.len();
            broken(format!(
                "buffer view {index} has {length} bytes from {from} of buffer {buffer}, which has {size}"
            ))
        })?;
        Ok((bytes, view))
    }
}

/// The content of a `data:` URI in base 64.
fn decoded(index: usize, uri: &str, budget: &mut Budget) -> Result<Vec<u8>, SceneError> {
    let refuse = |why: &str| broken(format!("the data of buffer {index} is {why}"));
    let (kind, text) = uri.split_once(',').ok_or_else(|| refuse("without content"))?;
    if !kind.ends_with(";base64") {
        return Err(refuse("not in base 64"));
    }
    let mut bytes = budget.room((text.len() as u64).div_ceil(4).saturating_mul(3), "a buffer")?;
    STANDARD.decode_vec(text, &mut bytes).map_err(|error| refuse(&format!("no base 64: {error}")))?;
    Ok(bytes)
}

/// A name with what stands after percent signs put back; a name that is none is left as it is.
fn percent_decoded(uri: &str) -> String {
    let mut out = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((&byte, after)) = rest.split_first() {
        let hex = (byte == b'%').then(|| after.get(..2)).flatten();
        let hex = hex.and_then(|hex| u8::from_str_radix(std::str::from_utf8(hex).ok()?, 16).ok());
        out.push(hex.unwrap_or(byte));
        rest = after.get(if hex.is_some() { 2 } else { 0 }..).unwrap_or_default();
    }
    String::from_utf8(out).unwrap_or_else(|_| uri.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_decoded() {
        assert_eq!(percent_decoded("a%20b%2.bin%"), "a b%2.bin%");
        assert_eq!(percent_decoded("%ff"), "%ff");
    }
}
