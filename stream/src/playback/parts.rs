//! What a decision of the controller is on the server: levels of subsegments, and the ranges of bytes that they are in.

use crate::control::Fetch;
use crate::manifest::{ByteRange, Manifest};

/// Bytes with a digest of their own.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Part {
    pub(super) gop: usize,
    pub(super) representation: usize,
    /// The piece that it belongs to in the ladder.
    pub(super) piece: u8,
    pub(super) kind: Kind,
    pub(super) range: ByteRange,
}

/// What a part is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// The initialisation segment of the Representation.
    Init,
    /// A level of a subsegment, which is counted within its GOP and Representation.
    Level { subsegment: usize, level: u8 },
}

/// One request: bytes of a file, one or more.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ByteRequest {
    /// Name of the file, beside the manifest.
    pub file: String,
    /// Of the first byte.
    pub offset: u64,
    /// How many.
    pub size: u64,
}

/// The parts of a fetch in its order, each first one of a Representation after its initialisation segment if that is wanted.
pub(super) fn parts(manifest: &Manifest, fetch: &Fetch, needs_init: impl Fn(usize) -> bool) -> Vec<Part> {
    let mut parts: Vec<Part> = Vec::new();
    for range in fetch.ranges() {
        let (gop, representation) = (fetch.gop(), range.representation);
        let Some(info) = manifest.representations.get(representation) else { continue };
        let is_first = parts.iter().all(|part| part.representation != representation);
        if is_first && needs_init(representation) {
            let (kind, range) = (Kind::Init, info.init.clone());
            parts.push(Part { gop, representation, piece: 0, kind, range });
        }
        for piece in range.from..range.to {
            parts.extend(of_piece(manifest, gop, representation, piece));
        }
    }
    parts
}

/// The parts of a piece of the ladder, as they are in the file.
fn of_piece(manifest: &Manifest, gop: usize, representation: usize, piece: u8) -> Vec<Part> {
    let levels = manifest.levels_of_piece(representation, piece).unwrap_or(0..0);
    let id = manifest.representations.get(representation).map(|info| &info.id);
    let all = manifest.gops.get(gop).map_or(&[][..], |gop| &gop.subsegments);
    let mut parts = Vec::new();
    for (subsegment, info) in all.iter().filter(|one| Some(&one.representation) == id).enumerate() {
        let own = info.levels.iter().filter(|level| levels.contains(&level.refinement));
        parts.extend(own.map(|level| Part {
            gop,
            representation,
            piece,
            kind: Kind::Level { subsegment, level: level.refinement },
            range: level.bytes.clone(),
        }));
    }
    parts
}

/// The requests for some parts: one for those that follow each other in a file.
pub(super) fn requests(manifest: &Manifest, parts: &[Part]) -> Vec<ByteRequest> {
    let mut requests: Vec<ByteRequest> = Vec::new();
    for part in parts.iter().filter(|part| part.range.size > 0) {
        let Some(info) = manifest.representations.get(part.representation) else { continue };
        match requests.last_mut() {
            Some(last)
                if last.file == info.file && last.offset.saturating_add(last.size) == part.range.offset =>
            {
                last.size = last.size.saturating_add(part.range.size);
            }
            _ => requests.push(ByteRequest {
                file: info.file.clone(),
                offset: part.range.offset,
                size: part.range.size,
            }),
        }
    }
    requests
}
