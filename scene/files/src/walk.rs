//! Bytes that are read in order, in memory or in a file, of which only what is asked for has to be there.
//!
//! What follows from headers alone (a version, the sizes of parts) is read through [`Walk`], so that the same lines check a file
//! before it is read and slices that are in memory.

use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;

use crate::cursor::Cursor;
use crate::error::SceneError;

/// A position in bytes that never passes their end.
pub(crate) trait Walk {
    /// Byte offset of the next byte.
    fn at(&self) -> u64;

    /// Bytes from the next one to the end.
    fn left(&self) -> u64;

    /// The next `N` bytes. `what` names them in the error when they are not there.
    fn array<const N: usize>(&mut self, what: &'static str) -> Result<[u8; N], SceneError>;

    /// Passes over `count` bytes, and gives where they are.
    fn pass(&mut self, count: u64, what: &'static str) -> Result<Range<u64>, SceneError>;

    /// The next four bytes as a number, least significant first.
    fn u32(&mut self, what: &'static str) -> Result<u32, SceneError> {
        self.array(what).map(u32::from_le_bytes)
    }

    /// The next eight bytes as a number, least significant first.
    fn u64(&mut self, what: &'static str) -> Result<u64, SceneError> {
        self.array(what).map(u64::from_le_bytes)
    }

    /// Refuses where fewer than `count` bytes are left.
    fn require(&self, count: u64, what: &'static str) -> Result<(), SceneError> {
        match count > self.left() {
            true => Err(SceneError::truncated(self.at(), what, count, self.left())),
            false => Ok(()),
        }
    }
}

impl Walk for Cursor<'_> {
    fn at(&self) -> u64 {
        Cursor::at(self) as u64
    }

    fn left(&self) -> u64 {
        self.remaining().len() as u64
    }

    fn array<const N: usize>(&mut self, what: &'static str) -> Result<[u8; N], SceneError> {
        Cursor::array(self, what)
    }

    fn pass(&mut self, count: u64, what: &'static str) -> Result<Range<u64>, SceneError> {
        let from = Walk::at(self);
        self.take(count, what)?;
        Ok(from..Walk::at(self))
    }
}

/// A position in a file, of which nothing is read but what is asked for.
pub(crate) struct FileWalk<R> {
    source: R,
    at: u64,
    size: u64,
}

impl<R: Read + Seek> FileWalk<R> {
    /// Starts at the first byte of `source`, wherever that stands.
    pub(crate) fn new(mut source: R) -> Result<Self, SceneError> {
        let size = source.seek(SeekFrom::End(0))?;
        Ok(Self { source, at: 0, size })
    }

    /// The file, at the next byte, for what has to be read to be passed over.
    pub(crate) fn source(&mut self) -> Result<&mut R, SceneError> {
        self.source.seek(SeekFrom::Start(self.at))?;
        Ok(&mut self.source)
    }
}

impl<R: Read + Seek> Walk for FileWalk<R> {
    fn at(&self) -> u64 {
        self.at
    }

    fn left(&self) -> u64 {
        self.size.saturating_sub(self.at)
    }

    fn array<const N: usize>(&mut self, what: &'static str) -> Result<[u8; N], SceneError> {
        self.require(N as u64, what)?;
        let mut bytes = [0; N];
        self.source()?.read_exact(&mut bytes)?;
        self.at = self.at.saturating_add(N as u64);
        Ok(bytes)
    }

    fn pass(&mut self, count: u64, what: &'static str) -> Result<Range<u64>, SceneError> {
        self.require(count, what)?;
        let from = self.at;
        self.at = from.saturating_add(count);
        Ok(from..self.at)
    }
}

/// The bytes of a part that a walk over them has passed.
pub(crate) fn part<'a>(bytes: &'a [u8], range: &Range<u64>) -> &'a [u8] {
    let ends = usize::try_from(range.start).ok().zip(usize::try_from(range.end).ok());
    ends.and_then(|(start, end)| bytes.get(start..end)).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_walked_as_a_slice_is() {
        fn walked(mut walk: impl Walk) -> Vec<String> {
            let mut said = vec![format!("{:?}", walk.u32("a").unwrap())];
            said.push(format!("{:?}", walk.pass(3, "b").unwrap()));
            said.push(format!("{:?} {} {}", walk.array::<2>("c").unwrap(), walk.at(), walk.left()));
            said.push(walk.pass(2, "d").unwrap_err().to_string());
            said.push(walk.array::<2>("e").unwrap_err().to_string());
            said
        }
        let bytes: Vec<u8> = (0..10).collect();
        let of_slice = walked(Cursor::new(&bytes));
        assert_eq!(of_slice, walked(FileWalk::new(std::io::Cursor::new(&bytes)).unwrap()));
        assert_eq!(of_slice[..3], ["50462976", "4..7", "[7, 8] 9 1"]);
        assert_eq!(part(&bytes, &(4..7)), [4, 5, 6]);
    }
}
