//! Why a measurement failed.

use splatstream_gaussians::FrameError;
use std::fmt;

/// Why a measurement failed.
#[derive(Debug)]
pub enum Error {
    /// A stream that was encoded a moment ago cannot be read.
    Stream(splatstream_format::Error),
    /// Anything else, in words.
    Other(String),
}

impl Error {
    /// A failure in words.
    pub(crate) fn other(message: impl Into<String>) -> Self {
        Self::Other(message.into())
    }
}

impl From<splatstream_format::Error> for Error {
    fn from(error: splatstream_format::Error) -> Self {
        Self::Stream(error)
    }
}

impl From<FrameError> for Error {
    fn from(error: FrameError) -> Self {
        Self::other(format!("a frame just decoded is broken: {error}; please report this"))
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stream(error) => write!(f, "the stream just encoded: {error}"),
            Self::Other(message) => f.write_str(message),
        }
    }
}

impl std::error::Error for Error {}
