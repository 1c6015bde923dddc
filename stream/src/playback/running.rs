//! A fetch that runs: the parts that arrive, one after the other.

use super::parts::{Kind, Part};
use crate::control::number::size;
use std::mem;

/// Parts that are fetched, and how far they have come.
#[derive(Debug)]
pub(super) struct Running {
    parts: Vec<Part>,
    /// The part that arrives, and what has arrived of it.
    next: usize,
    buffer: Vec<u8>,
    /// Bytes of the levels before it.
    before: u64,
}

impl Running {
    /// A fetch of which nothing has come.
    pub(super) fn new(parts: Vec<Part>) -> Self {
        Self { parts, next: 0, buffer: Vec::new(), before: 0 }
    }

    /// The GOP that the parts are of.
    pub(super) fn gop(&self) -> Option<usize> {
        self.parts.first().map(|part| part.gop)
    }

    /// The part that arrives; none if all have.
    pub(super) fn part(&self) -> Option<&Part> {
        self.parts.get(self.next)
    }

    /// Bytes that count: those of a level only with its last one, if its digest is right.
    pub(super) fn counted(&self) -> u64 {
        match self.part().map(|part| part.kind) {
            Some(Kind::Level { .. }) => self.before.saturating_add(size(self.buffer.len())),
            _ => self.before,
        }
    }

    /// Takes from the front of some bytes those that nobody wants and those of the part that arrives; gives all bytes of the part once
    /// its last one has come.
    pub(super) fn fill(&mut self, bytes: &mut &[u8]) -> Option<Vec<u8>> {
        let part = self.parts.get_mut(self.next)?;
        let between = size(bytes.len()).min(part.gap);
        part.gap = part.gap.saturating_sub(between);
        *bytes = bytes.get(usize::try_from(between).unwrap_or(usize::MAX)..).unwrap_or_default();
        let missing = part.range.size.saturating_sub(size(self.buffer.len()));
        let (own, rest) =
            bytes.split_at_checked(usize::try_from(missing).unwrap_or(usize::MAX)).unwrap_or((bytes, &[]));
        self.buffer.extend_from_slice(own);
        *bytes = rest;
        let is_whole = part.gap == 0 && size(self.buffer.len()) >= part.range.size;
        is_whole.then(|| mem::take(&mut self.buffer))
    }

    /// Goes on to the part after the one that has arrived.
    pub(super) fn advance(&mut self) {
        let level = self.part().filter(|part| matches!(part.kind, Kind::Level { .. }));
        let bytes = level.map_or(0, |part| part.range.size);
        self.before = self.before.saturating_add(bytes);
        self.next = self.next.saturating_add(1);
    }
}
