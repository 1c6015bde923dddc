//! What a decision of the controller is on the server: levels of subsegments, and the ranges of bytes that they are in.

use crate::control::Fetch;
use crate::manifest::{ByteRange, Manifest};

/// Bytes with a digest of their own.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Part {
    pub(crate) gop: usize,
    pub(crate) representation: usize,
    /// The piece that it belongs to in the ladder.
    pub(crate) piece: u8,
    pub(crate) kind: Kind,
    pub(crate) file: String,
    pub(crate) range: ByteRange,
    /// Bytes of a request between the part before it and this one, which nobody wants.
    pub(crate) gap: u64,
}

impl Part {
    /// Whether nothing of its GOP can be shown without it.
    pub(crate) fn is_base(&self) -> bool {
        self.representation == 0 && self.piece == 0
    }
}

/// What a part is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
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
pub(crate) fn parts(manifest: &Manifest, fetch: &Fetch, needs_init: impl Fn(usize) -> bool) -> Vec<Part> {
    let mut parts: Vec<Part> = Vec::new();
    for range in fetch.ranges() {
        let (gop, representation) = (fetch.gop(), range.representation);
        let Some(info) = manifest.representations.get(representation) else { continue };
        let is_first = parts.iter().all(|part| part.representation != representation);
        if is_first && needs_init(representation) {
            let (kind, range) = (Kind::Init, info.init.clone());
            let file = info.file.clone();
            parts.push(Part { gop, representation, piece: 0, kind, file, range, gap: 0 });
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
    let Some(of_it) = manifest.representations.get(representation) else { return Vec::new() };
    let all = manifest.gops.get(gop).map_or(&[][..], |gop| &gop.subsegments);
    let mut parts = Vec::new();
    for (subsegment, info) in all.iter().filter(|one| one.representation == of_it.id).enumerate() {
        let own = info.levels.iter().filter(|level| levels.contains(&level.refinement));
        parts.extend(own.map(|level| Part {
            gop,
            representation,
            piece,
            kind: Kind::Level { subsegment, level: level.refinement },
            file: info.file.as_ref().unwrap_or(&of_it.file).clone(),
            range: level.bytes.clone(),
            gap: 0,
        }));
    }
    parts
}

/// Bytes that are fetched in vain for one request less: indices between the frames of a live package.
const GAP: u64 = 1024;

/// The requests for some parts: one for those that follow each other in a file, or nearly so.
pub(crate) fn requests(parts: &mut [Part]) -> Vec<ByteRequest> {
    let mut requests: Vec<ByteRequest> = Vec::new();
    for part in parts.iter_mut().filter(|part| part.range.size > 0) {
        let last = requests.last_mut().filter(|last| last.file == part.file);
        let gap =
            last.as_ref().and_then(|last| part.range.offset.checked_sub(last.offset.checked_add(last.size)?));
        match last.zip(gap.filter(|gap| *gap <= GAP)) {
            Some((last, gap)) => {
                part.gap = gap;
                last.size = last.size.saturating_add(gap).saturating_add(part.range.size);
            }
            None => requests.push(ByteRequest {
                file: part.file.clone(),
                offset: part.range.offset,
                size: part.range.size,
            }),
        }
    }
    requests
}
