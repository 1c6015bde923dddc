//! Where the bytes of a stream come from.

use crate::error::{Error, Result};
use splatstream_format::seek::ReadAt;
use std::io::{ErrorKind, Read, Seek, SeekFrom};
use std::sync::Arc;

/// Bytes that a file is read by at a time, at least.
const CHUNK: usize = 256 << 10;

/// A file or something like it.
pub(crate) trait ReadSeek: Read + Seek + Send {}

impl<T: Read + Seek + Send> ReadSeek for T {}

pub(crate) enum Source {
    /// All bytes are there, and others use them too.
    Shared(Arc<[u8]>),
    /// They are read as they are needed.
    Reader(Box<dyn ReadSeek>, Window),
    /// They are pushed.
    Pushed(Window),
}

/// The bytes of a stream that are there and still needed.
#[derive(Default)]
pub(crate) struct Window {
    bytes: Vec<u8>,
    /// Where in `bytes` those begin that are needed.
    start: usize,
    /// Absolute offset of the first needed byte.
    at: u64,
    /// Whether no more will come.
    is_end: bool,
}

impl Window {
    fn rest(&self) -> &[u8] {
        self.bytes.get(self.start..).unwrap_or_default()
    }

    /// Absolute offset after the last byte.
    fn end(&self) -> u64 {
        self.at.saturating_add(self.rest().len() as u64)
    }

    /// Forgets what stands before an absolute offset. Bytes elsewhere are forgotten altogether.
    fn go_to(&mut self, at: u64) {
        let passed = at.checked_sub(self.at).and_then(|passed| usize::try_from(passed).ok());
        match passed.filter(|&passed| passed <= self.rest().len()) {
            Some(passed) => self.start += passed,
            None => {
                self.bytes.clear();
                self.start = 0;
                // What lies after the end is at the end too.
                self.is_end &= at > self.at;
            }
        }
        self.at = at;
        // Moves what is left at most as often as it passed half of the bytes.
        if self.start > self.bytes.len() / 2 {
            self.bytes.drain(..self.start);
            self.start = 0;
            self.bytes.shrink_to(2 * self.bytes.len().max(CHUNK));
        }
    }
}

impl Source {
    /// Forgets the bytes before an absolute offset, which are no longer needed.
    pub(crate) fn go_to(&mut self, at: u64) {
        if let Self::Reader(_, window) | Self::Pushed(window) = self
            && window.at != at
        {
            window.go_to(at);
        }
    }

    /// The bytes from an absolute offset on, and whether they are the last.
    pub(crate) fn bytes(&mut self, at: u64) -> (&[u8], bool) {
        self.go_to(at);
        match self {
            Self::Shared(bytes) => {
                let rest = usize::try_from(at).ok().and_then(|at| bytes.get(at..));
                (rest.unwrap_or_default(), true)
            }
            Self::Reader(_, window) | Self::Pushed(window) => (window.rest(), window.is_end),
        }
    }

    /// Gets at least so many more bytes; false if they have to come first.
    ///
    /// # Errors
    /// A file that cannot be read, no memory.
    pub(crate) fn fill(&mut self, more: u64) -> Result<bool> {
        let Self::Reader(reader, window) = self else { return Ok(false) };
        let more = usize::try_from(more).unwrap_or(usize::MAX).max(CHUNK);
        reader.seek(SeekFrom::Start(window.end()))?;
        // Room grows with the bytes that are there, whatever the stream announces.
        let before = window.bytes.len();
        match reader.take(more as u64).read_to_end(&mut window.bytes) {
            Ok(read) => window.is_end = read < more,
            // What was there has been read.
            Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(window.bytes.len() > before),
            Err(error) => return Err(error.into()),
        }
        Ok(true)
    }

    /// Adds bytes at the end.
    ///
    /// # Errors
    /// A source that is not pushed or has ended, more bytes than may wait.
    pub(crate) fn push(&mut self, bytes: &[u8], allowed: u64) -> Result<()> {
        let window = match self {
            Self::Pushed(window) if !window.is_end => window,
            _ => return Err(Error::NotPushed),
        };
        let waiting = (window.rest().len() as u64).saturating_add(bytes.len() as u64);
        if waiting > allowed || window.bytes.try_reserve(bytes.len()).is_err() {
            return Err(Error::TooMuchInput { waiting, allowed });
        }
        window.bytes.extend_from_slice(bytes);
        Ok(())
    }

    /// No more bytes will be pushed.
    pub(crate) fn end(&mut self) {
        if let Self::Pushed(window) = self {
            window.is_end = true;
        }
    }

    pub(crate) fn is_pushed(&self) -> bool {
        matches!(self, Self::Pushed(_))
    }

    pub(crate) fn is_shared(&self) -> bool {
        matches!(self, Self::Shared(_))
    }
}

impl ReadAt for Source {
    fn length(&mut self) -> Option<u64> {
        match self {
            Self::Shared(bytes) => Some(bytes.len() as u64),
            Self::Reader(reader, _) => reader.seek(SeekFrom::End(0)).ok(),
            Self::Pushed(_) => None,
        }
    }

    fn read_at(&mut self, at: u64, length: usize) -> Option<Vec<u8>> {
        match self {
            Self::Shared(bytes) => bytes.as_ref().read_at(at, length),
            Self::Reader(reader, _) => {
                reader.seek(SeekFrom::Start(at)).ok()?;
                let mut bytes = Vec::new();
                reader.take(length as u64).read_to_end(&mut bytes).ok()?;
                (bytes.len() == length).then_some(bytes)
            }
            Self::Pushed(_) => None,
        }
    }
}
