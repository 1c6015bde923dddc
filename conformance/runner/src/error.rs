//! Errors of files and settings. What a decoder does wrong is a result instead.

use std::io;
use std::path::{Path, PathBuf};

/// The result of an operation that needs files or settings.
pub type Result<T> = std::result::Result<T, Error>;

/// An error of files or settings.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The file system refused.
    #[error("{path}: cannot {what}: {source}")]
    File {
        /// The file.
        path: PathBuf,
        /// "read" or the like.
        what: &'static str,
        /// Why.
        source: io::Error,
    },
    /// A file is not what it should be.
    #[error("{path}: {message}")]
    Content {
        /// The file.
        path: PathBuf,
        /// What is wrong, and what to do.
        message: String,
    },
    /// The arguments do not make sense.
    #[error("{0}")]
    Usage(String),
    /// The decoder under test does not start.
    #[error("{program}: cannot start the decoder: {why}")]
    Start {
        /// The first word of its command.
        program: String,
        /// Why, and what to do.
        why: String,
    },
}

impl Error {
    pub(crate) fn content(path: &Path, message: impl Into<String>) -> Self {
        Self::Content { path: path.to_path_buf(), message: message.into() }
    }

    /// For `map_err`: what could not be done with a file.
    pub(crate) fn file(what: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        move |source| Self::File { path: path.to_path_buf(), what, source }
    }
}

/// Reads a file of text.
pub(crate) fn read_text(path: &Path) -> Result<String> {
    std::fs::read_to_string(path).map_err(Error::file("read", path))
}

/// Reads a file of JSON of this form.
pub(crate) fn read_json<T: serde::de::DeserializeOwned>(path: &Path) -> Result<T> {
    serde_json::from_str(&read_text(path)?).map_err(|error| Error::content(path, error.to_string()))
}
