//! The GOP at which decoding starts so that a frame comes out without all that stands before it.

use crate::stream_file::StreamFile;
use serde::Serialize;
use splatstream_format::Limits;
use splatstream_format::seek;

/// The GOP at which decoding starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub(crate) struct Seek {
    /// Display index of its first frame.
    pub(crate) frame: u32,
    /// Offset of its header.
    pub(crate) byte: u64,
}

/// The GOP that holds `frame`, by the index of the stream. None where decoding starts at the first GOP.
pub(crate) fn gop_of(file: &StreamFile, frame: u32, limits: &Limits) -> Option<Seek> {
    file.sequence(limits)?;
    let entry = seek::gop_of(&mut file.bytes.as_slice(), frame, limits)?;
    Some(Seek { frame: entry.frame, byte: entry.offset })
}
