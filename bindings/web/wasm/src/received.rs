//! The bytes that have come so far.

use splatstream::{Decoder, Limits};
use std::io::{Error, ErrorKind, Read, Result, Seek, SeekFrom};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// What a tab of a browser may take: bytes of memory for decoding, apart from those of the stream.
const MAX_MEMORY: u64 = 1 << 30;
/// A stream that arrives from its start on. Copies share the bytes. At the end of those that are there, a reader learns
/// that more will come, until the [end](Received::end) is known.
#[derive(Clone, Default)]
pub struct Received {
    shared: Arc<Mutex<Shared>>,
    /// Where the next byte is read.
    at: u64,
}

#[derive(Default)]
struct Shared {
    bytes: Vec<u8>,
    /// How many of `bytes` have come; the rest is room.
    length: usize,
    is_end: bool,
}

impl Received {
    /// Bytes after which none come.
    pub fn whole(bytes: Vec<u8>) -> Self {
        let length = bytes.len();
        let shared = Shared { bytes, length, is_end: true };
        Self { shared: Arc::new(Mutex::new(shared)), at: 0 }
    }

    /// What decodes it.
    pub(crate) fn decoder(&self) -> Decoder {
        Decoder::from_reader(self.clone()).with_limits(Limits {
            max_memory: MAX_MEMORY,
            // A page plays a stream as often as somebody looks at it.
            ..Limits::UNLIMITED
        })
    }

    fn lock(&self) -> MutexGuard<'_, Shared> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Room for `count` bytes after those that have come; none without memory. It lasts until the next call.
    pub fn room(&self, count: usize) -> Option<*mut u8> {
        let mut shared = self.lock();
        let needed = shared.length.checked_add(count)?;
        if shared.bytes.len() < needed {
            let more = needed.checked_sub(shared.bytes.len())?;
            shared.bytes.try_reserve(more).ok()?;
            shared.bytes.resize(needed, 0);
        }
        let start = shared.length;
        shared.bytes.get_mut(start..).map(<[u8]>::as_mut_ptr)
    }

    /// `count` bytes of the [room](Received::room) have been filled.
    pub fn filled(&self, count: usize) {
        let mut shared = self.lock();
        shared.length = shared.length.saturating_add(count).min(shared.bytes.len());
    }

    /// Takes a copy of bytes; whether there was memory for it.
    pub fn push(&self, bytes: &[u8]) -> bool {
        let mut shared = self.lock();
        let length = shared.length;
        shared.bytes.truncate(length);
        let is_possible = shared.bytes.try_reserve(bytes.len()).is_ok();
        if is_possible {
            shared.bytes.extend_from_slice(bytes);
            shared.length = shared.bytes.len();
        }
        is_possible
    }

    /// No more bytes will come.
    pub fn end(&self) {
        self.lock().is_end = true;
    }

    /// How many bytes have come.
    pub fn len(&self) -> usize {
        self.lock().length
    }

    /// Whether none has come.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl Read for Received {
    fn read(&mut self, to: &mut [u8]) -> Result<usize> {
        let shared = self.shared.lock().unwrap_or_else(PoisonError::into_inner);
        let start = usize::try_from(self.at).unwrap_or(usize::MAX).min(shared.length);
        let there = shared.bytes.get(start..shared.length).unwrap_or_default();
        let count = there.len().min(to.len());
        if count == 0 && !to.is_empty() && !shared.is_end {
            return Err(Error::from(ErrorKind::WouldBlock));
        }
        let (from, to) = (there.get(..count).unwrap_or_default(), to.get_mut(..count).unwrap_or_default());
        to.copy_from_slice(from);
        self.at = self.at.saturating_add(count as u64);
        Ok(count)
    }
}

impl Seek for Received {
    fn seek(&mut self, to: SeekFrom) -> Result<u64> {
        let length = self.len() as u64;
        let at = match to {
            SeekFrom::Start(at) => Some(at),
            SeekFrom::End(offset) => length.checked_add_signed(offset),
            SeekFrom::Current(offset) => self.at.checked_add_signed(offset),
        };
        self.at = at.ok_or_else(|| Error::from(ErrorKind::InvalidInput))?;
        Ok(self.at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reader_waits_for_bytes_and_sees_the_end() {
        let received = Received::default();
        let mut reader = received.clone();
        let mut read = [0; 4];
        assert_eq!(reader.read(&mut read).map_err(|error| error.kind()), Err(ErrorKind::WouldBlock));
        assert!(received.push(&[1, 2, 3]));
        assert_eq!(reader.read(&mut read).ok(), Some(3));
        assert_eq!(reader.read(&mut read).map_err(|error| error.kind()), Err(ErrorKind::WouldBlock));
        received.end();
        assert_eq!(reader.read(&mut read).ok(), Some(0));
        assert_eq!(reader.seek(SeekFrom::End(-1)).ok(), Some(2));
        assert_eq!((reader.read(&mut read).ok(), read[0]), (Some(1), 3));
    }
}
