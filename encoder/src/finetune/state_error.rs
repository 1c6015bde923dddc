//! What is wrong with a state that fitting to pictures is to go on from.

use std::io;
use std::path::PathBuf;

/// Why a state cannot be kept, or not be gone on from.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StateError {
    /// An earlier run has left its state.
    #[error("{directory}: an earlier run has left its state there; go on with it, or remove the directory")]
    Exists {
        /// Where.
        directory: PathBuf,
    },
    /// A setting is not the one that the state was kept with.
    #[error(
        "{directory}: the state is that of a run whose {name} was {kept}, and it is {found} now; \
         give the settings of that run, or remove the directory to start again"
    )]
    OtherSetting {
        /// Where the state is.
        directory: PathBuf,
        /// The setting.
        name: String,
        /// What it was.
        kept: String,
        /// What it is.
        found: String,
    },
    /// A frame is not the one that the state was kept with.
    #[error(
        "{directory}: the state is that of a run whose frame {frame} had other values; \
         give the frames of that run, or remove the directory to start again"
    )]
    OtherFrame {
        /// Where the state is.
        directory: PathBuf,
        /// The frame.
        frame: u32,
    },
    /// A file of the state is not as it was written.
    #[error("{path}: the state is damaged: {what}; remove it to start again with what it had")]
    Damaged {
        /// The file of a fit; the directory, where its settings are damaged.
        path: PathBuf,
        /// What is wrong.
        what: &'static str,
    },
    /// The file system refuses.
    #[error("{path}: the state cannot be {what}: {source}")]
    File {
        /// The file.
        path: PathBuf,
        /// What was to be done.
        what: &'static str,
        /// Why it was not.
        source: io::Error,
    },
}
