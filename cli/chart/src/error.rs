//! Why a measurement failed.

use splatstream_gaussians::FrameError;
use std::fmt;

/// Why a measurement failed.
#[derive(Debug)]
pub enum Error {
    /// A stream that was encoded a moment ago cannot be read.
    Stream(splatstream_format::Error),
    /// Encoding takes more memory than it may.
    Memory {
        /// What was to be encoded, and why not.
        message: String,
        /// Bytes that it takes at most.
        asked: u64,
    },
    /// Anything else, in words.
    Other(String),
}

impl Error {
    /// A failure in words.
    pub(crate) fn other(message: impl Into<String>) -> Self {
        Self::Other(message.into())
    }

    /// The same of a scene.
    pub(crate) fn of_scene(self, name: &str) -> Self {
        match self {
            Self::Memory { message, asked } => Self::Memory { message: format!("{name}: {message}"), asked },
            Self::Other(message) => Self::Other(format!("{name}: {message}")),
            Self::Stream(_) => self,
        }
    }
}

impl From<splatstream_format::Error> for Error {
    fn from(error: splatstream_format::Error) -> Self {
        Self::Stream(error)
    }
}

impl From<splatstream_encoder::Error> for Error {
    fn from(error: splatstream_encoder::Error) -> Self {
        let message = error.to_string();
        match error {
            splatstream_encoder::Error::OverMemory { asked, .. } => Self::Memory { message, asked },
            _ => Self::Other(message),
        }
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
            Self::Memory { message, .. } | Self::Other(message) => f.write_str(message),
        }
    }
}

impl std::error::Error for Error {}
