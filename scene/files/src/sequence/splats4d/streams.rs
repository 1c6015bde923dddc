//! The streams of `.splat4d`: unsigned integers as planes of bytes, all lowest bytes first, compressed by Zstandard.

use super::NOT_SPLAT4D;
use super::header::Group;
use crate::cursor;
use crate::decompress;
use crate::error::SceneError;
use crate::limits::Budget;

/// Integers as they are stored: one plane of bytes after another.
#[derive(Default)]
pub(super) struct Stream {
    bytes: Vec<u8>,
    count: usize,
}

impl Stream {
    /// How many integers.
    pub(super) fn len(&self) -> usize {
        self.count
    }

    /// An integer, which is there.
    pub(super) fn get(&self, at: usize) -> u32 {
        let mut word = [0; 4];
        let planes = self.bytes.chunks_exact(self.count.max(1));
        for (byte, plane) in word.iter_mut().zip(planes) {
            *byte = plane.get(at).copied().unwrap_or(0);
        }
        u32::from_le_bytes(word)
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = u32> + '_ {
        self.iter_from(0)
    }

    /// The integers from a place on.
    pub(super) fn iter_from(&self, first: usize) -> impl Iterator<Item = u32> + '_ {
        (first..self.count).map(|at| self.get(at))
    }
}

/// The integer of a symbol, which has the sign in its lowest bit.
pub(super) fn unzigzag(symbol: u32) -> i32 {
    (symbol >> 1).cast_signed() ^ (symbol & 1).cast_signed().wrapping_neg()
}

/// What is next in a section, and where the section is in the file.
pub(super) struct Cursor<'a> {
    inner: cursor::Cursor<'a>,
    offset: usize,
}

/// What stands before a stream.
#[derive(Clone, Copy, Debug)]
struct Head {
    attribute: u8,
    kind: u8,
    width: u8,
    count: u32,
    compressed: u32,
}

impl<'a> Cursor<'a> {
    pub(super) fn new(bytes: &'a [u8], offset: u64) -> Self {
        Self { inner: cursor::Cursor::new(bytes), offset: offset as usize }
    }

    /// A stream of so many integers, after its head.
    pub(super) fn stream(
        &mut self,
        count: usize,
        what: &'static str,
        budget: &mut Budget,
    ) -> Result<Stream, SceneError> {
        let head = self.head(what)?;
        self.content(head, count, what, budget)
    }

    fn at(&self) -> usize {
        self.inner.at().saturating_add(self.offset)
    }

    fn head(&mut self, what: &'static str) -> Result<Head, SceneError> {
        let [attribute, kind, width] = self.inner.array(what)?;
        Ok(Head { attribute, kind, width, count: self.inner.u32(what)?, compressed: self.inner.u32(what)? })
    }

    fn content(
        &mut self,
        head: Head,
        count: usize,
        what: &'static str,
        budget: &mut Budget,
    ) -> Result<Stream, SceneError> {
        let at = self.at();
        let refuse = |what| Err(SceneError::malformed(at, what, NOT_SPLAT4D));
        if !matches!(head.width, 1 | 2 | 4) {
            return refuse(format!("{what}: integers of {} bytes, 1, 2 and 4 are known", head.width));
        }
        if head.count as usize != count {
            return refuse(format!("{what}: {} integers, {count} are needed", head.count));
        }
        let size = u64::from(head.count).saturating_mul(head.width.into());
        let frame = self.inner.take(head.compressed.into(), what)?;
        budget.take(size, what)?;
        // The encoder compresses nothing to nothing where there are no integers.
        let bytes = match size {
            0 => Vec::new(),
            _ => decompress::zstd(frame, size, budget.left(), at, what)?,
        };
        Ok(Stream { bytes, count })
    }
}

/// The streams of a group, by attribute: the values of the first frame, and the differences of all others.
pub(super) struct Chunk {
    pub(super) keys: [Stream; 5],
    pub(super) deltas: [Stream; 5],
}

impl Chunk {
    /// Reads a chunk; `counts` are the values of a frame in each attribute. Where there are none, streams may lack.
    pub(super) fn read(
        bytes: &[u8],
        group: &Group,
        counts: &[usize; 5],
        budget: &mut Budget,
    ) -> Result<Self, SceneError> {
        const WHAT: &str = "the streams of a group";
        let mut cursor = Cursor::new(bytes, group.offset);
        let count = u16::from_le_bytes(cursor.inner.array(WHAT)?);
        let mut heads = budget.room(count.into(), WHAT)?;
        for _ in 0..count {
            heads.push(cursor.head(WHAT)?);
        }
        let (mut keys, mut deltas): ([Option<Stream>; 5], [Option<Stream>; 5]) = Default::default();
        for head in heads {
            let at = cursor.at();
            let (streams, frames) = match head.kind {
                0 => (&mut keys, 1),
                _ => (&mut deltas, group.frames().saturating_sub(1)),
            };
            let slot = streams.get_mut(usize::from(head.attribute));
            let (Some(slot), Some(count)) = (slot, counts.get(usize::from(head.attribute))) else {
                return Err(SceneError::malformed(at, format!("attribute {}", head.attribute), NOT_SPLAT4D));
            };
            if head.kind > 1 || slot.is_some() {
                let what = format!("a stream of kind {} of attribute {}", head.kind, head.attribute);
                return Err(SceneError::malformed(at, what, NOT_SPLAT4D));
            }
            *slot = Some(cursor.content(head, count.saturating_mul(frames), WHAT, budget)?);
        }
        let whole = |streams: [Option<Stream>; 5], frames: usize| {
            let is_whole = streams
                .iter()
                .zip(counts)
                .all(|(stream, &count)| stream.is_some() || count == 0 || frames == 0);
            match is_whole {
                true => Ok(streams.map(Option::unwrap_or_default)),
                false => {
                    Err(SceneError::malformed(group.offset as usize, "a group lacks streams", NOT_SPLAT4D))
                }
            }
        };
        Ok(Self { keys: whole(keys, 1)?, deltas: whole(deltas, group.frames().saturating_sub(1))? })
    }
}
