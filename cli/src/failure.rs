//! What went wrong, for people: file, byte, clause, cause, and what to do about it.

use crate::over_limit;
use crate::standard::is_standard;
use serde::Serialize;
use splatstream_format::{Class, Error};
use splatstream_gaussians::FrameError;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// Why a command did not do what it was asked.
#[derive(Debug)]
pub(crate) enum Failure {
    /// The arguments do not make sense together.
    Usage(String),
    /// A stream is at fault.
    Stream {
        /// The file.
        path: PathBuf,
        /// Its first error.
        error: Error,
        /// What it is if not a stream.
        instead: Instead,
        /// The level of the stream, if it is known.
        level: Option<u8>,
    },
    /// Files and settings.
    Other(String),
    /// It takes more memory than it may.
    Memory(String),
    /// A decoder under test failed; where to read more.
    Decoder(String),
    /// The user ended a run; how far it had come.
    Interrupted(String),
    /// The verdict on a stream in the words of the conformance protocol.
    Verdict {
        /// Exit code of its class.
        exit_code: u8,
        /// A line of JSON.
        line: String,
    },
}

/// What a file is that is given for a stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Instead {
    /// It is a stream, or nothing is known about it.
    Nothing,
    /// A scene in a format that `encode` reads.
    Scene,
    /// A file of a package.
    Package,
    /// A web page.
    Page,
    /// A file without bytes.
    Empty,
}

impl Failure {
    /// A failure of files or settings.
    pub(crate) fn other(message: impl Into<String>) -> Self {
        Self::Other(message.into())
    }

    /// The file system refused; `what` is "read" or the like.
    pub(crate) fn file(what: &str, path: &Path, error: &io::Error) -> Self {
        let advice = match error.kind() {
            io::ErrorKind::NotFound if is_standard(path) => return Self::not_from_standard(path),
            io::ErrorKind::NotFound => "check the path",
            io::ErrorKind::PermissionDenied => "check the permissions",
            io::ErrorKind::StorageFull => "make room, or choose another disk",
            io::ErrorKind::FileTooLarge | io::ErrorKind::InvalidData => {
                "check whether it is the file that is meant"
            }
            io::ErrorKind::OutOfMemory => "it needs more memory than there is: close other programs",
            _ => "check the path and the disk",
        };
        Self::Other(format!("{}: cannot {what}: {error}\n  {advice}", path.display()))
    }

    /// Standard input is given for what this command reads in parts, several times or as a directory.
    fn not_from_standard(path: &Path) -> Self {
        let path = path.display();
        Self::Other(format!(
            "{path}: this command cannot read that from standard input; give a file or a directory"
        ))
    }

    /// Refuses standard input for what is not read from there. A file that is called so is no standard input.
    ///
    /// # Errors
    /// Of a path that stands for standard input.
    pub(crate) fn refuse_standard_input(path: &Path) -> Result<(), Self> {
        match is_standard(path) && !path.exists() {
            true => Err(Self::not_from_standard(path)),
            false => Ok(()),
        }
    }

    /// A stream that breaks the specification.
    pub(crate) fn stream(path: &Path, error: Error) -> Self {
        Self::Stream { path: path.to_path_buf(), error, instead: Instead::Nothing, level: None }
    }

    /// 2 usage, 1 files, settings and defects of the decoder, 3 a decoder under test, 10 to 14 by the class of a stream's error, 13 too much memory, 130
    /// interrupted.
    pub(crate) fn exit_code(&self) -> u8 {
        match self {
            Self::Usage(_) => 2,
            Self::Other(_) => 1,
            Self::Memory(_) => Class::OverLimit.exit_code(),
            Self::Decoder(_) => 3,
            Self::Interrupted(_) => 130,
            Self::Verdict { exit_code, .. } => *exit_code,
            Self::Stream { error, .. } if error.is_fault() => 1,
            Self::Stream { error, .. } => error.class().exit_code(),
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Usage(message)
            | Self::Other(message)
            | Self::Memory(message)
            | Self::Decoder(message)
            | Self::Interrupted(message) => f.write_str(message),
            Self::Verdict { line, .. } => f.write_str(line),
            Self::Stream { path, error, instead, level } => {
                let name = if is_standard(path) { "standard input".into() } else { path.to_string_lossy() };
                let advice = match instead {
                    Instead::Nothing => advice(error, *level),
                    Instead::Scene => OF_SCENE.to_owned(),
                    Instead::Package => OF_PACKAGE.to_owned(),
                    Instead::Page => OF_PAGE.to_owned(),
                    Instead::Empty => return write!(f, "{name}: it is empty\n  {OF_NOTHING}"),
                };
                write!(f, "{name}: {error}\n  {}", advice.replace("FILE", &path.to_string_lossy()))
            }
        }
    }
}

/// What to do with a scene that is given for a stream.
const OF_SCENE: &str = "this is a scene, not a stream; `splatstream encode FILE -o STREAM.gss` encodes it";

/// What to do with a file of a package.
const OF_PACKAGE: &str = "this is a file of a package, not a stream; `splatstream unpackage DIR -o STREAM.gss` makes a stream of its directory";

/// What to do with a web page.
const OF_PAGE: &str =
    "this is a web page, not a stream; one that `splatstream view` has written is opened in a browser";

/// What to do with a file that has no bytes.
const OF_NOTHING: &str = "check what wrote it, or copy it again";

/// What to do about an error of a stream of this level; FILE stands for the stream.
fn advice(error: &Error, level: Option<u8>) -> String {
    let by_class = match error.class() {
        Class::Malformed => {
            "the file is damaged, or it is not a stream; copy it again; `splatstream inspect FILE` shows where it breaks"
        }
        Class::Invalid => {
            "the file violates that clause of the specification; report it to the author of the encoder; \
             `splatstream inspect FILE` shows the elements up to there"
        }
        Class::Unsupported => {
            "the file needs a later version or another profile; look for a newer splatstream"
        }
        Class::OverLimit => return over_limit::advice(error, level),
        Class::Truncated => {
            "the file is incomplete; copy it again; `splatstream extract FILE --incomplete -o OUT.gss` keeps its complete GOPs, and \
             `splatstream decode FILE -o DIR` writes what is there"
        }
    };
    by_class.to_owned()
}

/// A failure, as `--json` prints it where there is no report.
#[derive(Serialize)]
pub(crate) struct FailureReport {
    pub(crate) error: FailureWords,
}

#[derive(Serialize)]
pub(crate) struct FailureWords {
    kind: &'static str,
    exit_code: u8,
    /// The text on standard error.
    message: String,
    /// Of a stream, its file and what is wrong there.
    file: Option<PathBuf>,
    fault: Option<StreamFault>,
}

impl From<FrameError> for Failure {
    fn from(error: FrameError) -> Self {
        Self::Other(format!("the decoder gave a broken frame: {error}; please report this, with the stream"))
    }
}

impl From<&Failure> for FailureReport {
    fn from(failure: &Failure) -> Self {
        let kind = match failure {
            Failure::Usage(_) => "usage",
            Failure::Stream { .. } | Failure::Verdict { .. } => "stream",
            Failure::Other(_) => "other",
            Failure::Memory(_) => "memory",
            Failure::Decoder(_) => "decoder",
            Failure::Interrupted(_) => "interrupted",
        };
        let (file, fault) = match failure {
            Failure::Stream { path, error, .. } => (Some(path.clone()), Some(StreamFault::from(*error))),
            _ => (None, None),
        };
        let (exit_code, message) = (failure.exit_code(), failure.to_string());
        Self { error: FailureWords { kind, exit_code, message, file, fault } }
    }
}

/// An error of a stream, as reports give it.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct StreamFault {
    class: &'static str,
    pub(crate) code: &'static str,
    clause: &'static str,
    byte: u64,
    message: String,
}

impl From<Error> for StreamFault {
    fn from(error: Error) -> Self {
        Self {
            class: error.class().name(),
            code: error.kind.code(),
            clause: error.clause,
            byte: error.at,
            message: error.kind.to_string(),
        }
    }
}

impl fmt::Display for StreamFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "byte {:#x}: {} (clause {})", self.byte, self.message, self.clause)
    }
}

/// Errors that a report lists one by one; a file can have any number.
const LISTED: usize = 20;

/// The lines of a report for the errors of a stream; nothing if there are none.
pub(crate) fn faults_text(faults: &[StreamFault]) -> String {
    let mut text = String::new();
    for (index, fault) in faults.iter().take(LISTED).enumerate() {
        let label = if index == 0 { "errors" } else { "" };
        text += &format!("  {label:<12} {fault}\n");
    }
    match faults.len().saturating_sub(LISTED) {
        0 => text,
        more => text + &format!("  {:<12} and {more} more\n", ""),
    }
}
