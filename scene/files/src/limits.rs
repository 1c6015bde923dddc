//! How much memory a file may ask of this machine.

use std::collections::TryReserveError;

use crate::error::{SceneError, SceneErrorKind};
use crate::note::Note;
use splatstream_gaussians::{Planes, sh_planes};

/// The bound on the memory of one read.
///
/// Everything that a read keeps at one time counts: the file where the reader has it in memory, what is
/// decompressed, images, and the planes of the frame. The size of each allocation that follows from the input is
/// computed and compared with what is left before it is made, and an allocation that the machine refuses is an
/// error too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReadLimits {
    /// Most bytes of memory. Default: 1 GiB, which a server can give to a stranger's file: a frame of degree 3
    /// and 3 million Gaussians, in any format.
    pub max_memory: u64,
}

impl Default for ReadLimits {
    fn default() -> Self {
        Self { max_memory: 1 << 30 }
    }
}

/// What is left of the memory of one read, and what the read has noted so far.
#[derive(Debug)]
pub(crate) struct Budget {
    allowed: u64,
    used: u64,
    notes: Vec<Note>,
}

impl Budget {
    pub(crate) fn new(limits: &ReadLimits) -> Self {
        Self { allowed: limits.max_memory, used: 0, notes: Vec::new() }
    }

    /// Takes note of something that the frame will not show. Equal notes count once.
    pub(crate) fn note(&mut self, note: Note) {
        if !self.notes.contains(&note) {
            self.notes.push(note);
        }
    }

    /// What was noted.
    pub(crate) fn into_notes(self) -> Vec<Note> {
        self.notes
    }

    /// Bytes that are left.
    pub(crate) fn left(&self) -> u64 {
        self.allowed.saturating_sub(self.used)
    }

    /// Counts `bytes` for `what`, which is about to be allocated.
    pub(crate) fn take(&mut self, bytes: u64, what: &'static str) -> Result<(), SceneError> {
        let asked = self.used.saturating_add(bytes);
        if asked > self.allowed {
            return Err(SceneErrorKind::OverLimit { what, asked, allowed: self.allowed }.into());
        }
        self.used = asked;
        Ok(())
    }

    /// Whether there is room for `bytes` for `what`, of which nothing is allocated yet.
    pub(crate) fn check(&mut self, bytes: u64, what: &'static str) -> Result<(), SceneError> {
        self.take(bytes, what)?;
        self.give_back(bytes);
        Ok(())
    }

    /// `bytes` are no longer needed.
    pub(crate) fn give_back(&mut self, bytes: u64) {
        self.used = self.used.saturating_sub(bytes);
    }

    /// An empty vector with room for `count` values of `what`.
    pub(crate) fn room<T>(&mut self, count: u64, what: &'static str) -> Result<Vec<T>, SceneError> {
        let bytes = count.saturating_mul(size_of::<T>() as u64);
        self.take(bytes, what)?;
        let mut values = Vec::new();
        let room = usize::try_from(count).map_err(|_| refused(bytes, what))?;
        values.try_reserve_exact(room).map_err(|_: TryReserveError| refused(bytes, what))?;
        Ok(values)
    }

    /// Empty planes with room for `rows` Gaussians, all of whose bytes are counted.
    pub(crate) fn planes(&mut self, sh_degree: u8, rows: u64) -> Result<Planes, SceneError> {
        const WHAT: &str = "the frame";
        let bytes = bytes_of_planes(sh_degree, rows);
        self.take(bytes, WHAT)?;
        let rows = usize::try_from(rows).map_err(|_| refused(bytes, WHAT))?;
        Planes::try_with_capacity(sh_degree, rows).map_err(|_: TryReserveError| refused(bytes, WHAT))
    }
}

/// Bytes of the planes of `rows` Gaussians: 14 and those of the spherical harmonics, four bytes a value.
pub(crate) fn bytes_of_planes(sh_degree: u8, rows: u64) -> u64 {
    let planes = (sh_planes(sh_degree) as u64).saturating_add(14);
    planes.saturating_mul(4).saturating_mul(rows)
}

/// The machine has not as much memory.
pub(crate) fn refused(bytes: u64, what: &'static str) -> SceneError {
    SceneErrorKind::OutOfMemory { what, bytes }.into()
}
