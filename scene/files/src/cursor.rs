//! A position in a byte slice that never passes its end.

use crate::error::SceneError;

/// Bytes not yet read, and where they lie in the whole.
#[derive(Clone, Copy)]
pub(crate) struct Cursor<'a> {
    rest: &'a [u8],
    at: usize,
}

impl<'a> Cursor<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes, at: 0 }
    }

    /// Byte offset of the next byte.
    pub(crate) fn at(&self) -> usize {
        self.at
    }

    pub(crate) fn remaining(&self) -> &'a [u8] {
        self.rest
    }

    /// The next `count` bytes. `what` names them in the error when they are not there.
    pub(crate) fn take(&mut self, count: u64, what: &'static str) -> Result<&'a [u8], SceneError> {
        let split = usize::try_from(count).ok().and_then(|count| self.rest.split_at_checked(count));
        let (taken, rest) = split
            .ok_or_else(|| SceneError::truncated(self.at as u64, what, count, self.rest.len() as u64))?;
        self.at = taken.len().saturating_add(self.at);
        self.rest = rest;
        Ok(taken)
    }

    /// `rows` records of `stride` bytes each.
    pub(crate) fn take_rows(
        &mut self,
        rows: u64,
        stride: u64,
        what: &'static str,
    ) -> Result<&'a [u8], SceneError> {
        self.take(rows.saturating_mul(stride), what)
    }

    /// The next `N` bytes.
    pub(crate) fn array<const N: usize>(&mut self, what: &'static str) -> Result<[u8; N], SceneError> {
        let short = SceneError::truncated(self.at as u64, what, N as u64, self.rest.len() as u64);
        self.take(N as u64, what)?.first_chunk().copied().ok_or(short)
    }

    /// The next four bytes as a number, least significant first.
    pub(crate) fn u32(&mut self, what: &'static str) -> Result<u32, SceneError> {
        self.array(what).map(u32::from_le_bytes)
    }
}
