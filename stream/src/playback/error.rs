//! Why playback ends before the end.

use std::fmt;

/// Why nothing, or no more, can be played.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum PlaybackError {
    /// The package has become another one: the first GOP that differs, or none if all do.
    Changed(Option<usize>),
    /// Three GOPs have more bytes than [`Options::memory`](super::Options::memory): bytes of the largest one.
    TooLarge(u64),
    /// A manifest that was written later has fewer GOPs than one that was read before.
    Backwards {
        /// GOPs up to the last one that was listed before.
        known: usize,
        /// GOPs up to the last one that is listed now.
        listed: usize,
    },
    /// A presentation has neither grown nor ended for so many microseconds.
    Stopped(u64),
}

impl fmt::Display for PlaybackError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Changed(None) => write!(f, "the package was replaced by another one while it was played"),
            Self::Changed(Some(gop)) => {
                write!(f, "the package changed while it was played, from GOP {gop} on")
            }
            Self::TooLarge(bytes) => write!(f, "a GOP of {bytes} bytes is too large to be buffered"),
            Self::Backwards { known, listed } => {
                write!(f, "the manifest went back: it had {known} GOPs, and has {listed} now")
            }
            Self::Stopped(us) => {
                let seconds = us / 1_000_000;
                write!(
                    f,
                    "the presentation has not grown for {seconds} s, nor does its manifest say that it has ended"
                )
            }
        }
    }
}

impl std::error::Error for PlaybackError {}
