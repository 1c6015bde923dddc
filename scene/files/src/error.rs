//! What can be wrong with a scene file.

use crate::printable::Printable;
use splatstream_gaussians::{Defect, FrameError};
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// Why a scene could not be read or written: which file where known, where in it, what, and what to do.
#[derive(Debug, thiserror::Error)]
pub struct SceneError {
    /// The file, where one is known: readers of byte slices do not know it.
    pub path: Option<PathBuf>,
    /// What is wrong.
    pub kind: SceneErrorKind,
}

/// What is wrong with a scene. Words of the file in it, such as names, have their characters of control as escapes. Byte offsets count from the start of the file, or, where the message says
/// so, of its decompressed content.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneErrorKind {
    /// The file system refused.
    #[error("cannot read: {0}")]
    Io(#[from] io::Error),
    /// There are no bytes: the file was never written, or something went wrong where it was copied.
    #[error("it is empty; check what wrote it, or copy it again")]
    Empty,
    /// The bytes end early.
    #[error(
        "byte {at}: {what} needs {needed} bytes, {available} are left; the file is cut short, copy it again"
    )]
    Truncated {
        /// Where the missing part starts.
        at: u64,
        /// The part that is cut.
        what: &'static str,
        /// Bytes it needs.
        needed: u64,
        /// Bytes there are.
        available: u64,
    },
    /// The bytes break the rules of their format.
    #[error("byte {at}: {what}; {advice}")]
    Malformed {
        /// Where the broken part starts.
        at: u64,
        /// What is wrong with it.
        what: String,
        /// What to do.
        advice: &'static str,
    },
    /// Parts of the file, each readable by itself, do not fit together or are missing.
    #[error("{what}; {advice}")]
    Inconsistent {
        /// What does not fit.
        what: String,
        /// What to do.
        advice: &'static str,
    },
    /// The file is well formed, as far as seen, and asks for something outside what is implemented.
    #[error("{what}; {advice}")]
    Unsupported {
        /// What is asked for.
        what: String,
        /// What to do.
        advice: &'static str,
    },
    /// The file asks for more memory than [`crate::ReadLimits::max_memory`] allows.
    #[error(
        "with {what}, reading takes {asked} bytes of memory or more; at most {allowed} are allowed (max_memory)"
    )]
    OverLimit {
        /// What would have been allocated next.
        what: &'static str,
        /// Bytes in use with it; more may follow.
        asked: u64,
        /// What the limit is.
        allowed: u64,
    },
    /// The limit allows it, but the machine has not as much memory.
    #[error("{what} takes {bytes} bytes of memory, which this machine does not have")]
    OutOfMemory {
        /// What was to be allocated.
        what: &'static str,
        /// Its bytes.
        bytes: u64,
    },
    /// A value that no frame may hold.
    #[error(transparent)]
    Defect(#[from] Defect),
    /// Planes that do not fit together.
    #[error(transparent)]
    Frame(#[from] FrameError),
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.path {
            Some(path) => write!(f, "{}: {}", Printable(&path.to_string_lossy()), self.kind),
            None => self.kind.fmt(f),
        }
    }
}

impl<K: Into<SceneErrorKind>> From<K> for SceneError {
    fn from(kind: K) -> Self {
        Self { path: None, kind: kind.into() }
    }
}

impl SceneError {
    /// The same error, said of `path`. A path already known, such as a member of a directory, is kept.
    pub(crate) fn in_file(mut self, path: &Path) -> Self {
        self.path.get_or_insert_with(|| path.to_path_buf());
        self
    }

    pub(crate) fn malformed(at: usize, what: impl Into<String>, advice: &'static str) -> Self {
        SceneErrorKind::Malformed { at: at as u64, what: printable(what), advice }.into()
    }

    pub(crate) fn inconsistent(what: impl Into<String>, advice: &'static str) -> Self {
        SceneErrorKind::Inconsistent { what: printable(what), advice }.into()
    }

    pub(crate) fn unsupported(what: impl Into<String>, advice: &'static str) -> Self {
        SceneErrorKind::Unsupported { what: printable(what), advice }.into()
    }

    pub(crate) fn truncated(at: u64, what: &'static str, needed: u64, available: u64) -> Self {
        SceneErrorKind::Truncated { at, what, needed, available }.into()
    }
}

/// What is said of a file, which may have words of the file in it.
fn printable(what: impl Into<String>) -> String {
    Printable(&what.into()).to_string()
}
