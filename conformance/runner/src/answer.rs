//! The answer of a decoder: how it ended and what it reported. [`crate::judge`] decides whether that is right.

use crate::protocol::Said;
use std::process::ExitStatus;
use std::time::Duration;

/// How a decoder ended a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// With an exit code.
    Code(i32),
    /// By a signal.
    Signal(i32),
    /// Not within the time; it was killed.
    TimedOut,
    /// It used too much memory and was killed.
    TooMuchMemory,
    /// It wrote too much and was killed.
    TooMuchOutput,
    /// A persistent process wrote a line that is not an answer.
    NoAnswer,
    /// The run was cancelled before the case ended.
    Cancelled,
}

/// The answer to a case.
#[derive(Debug, Clone)]
pub struct Answer {
    /// How it ended.
    pub ending: Ending,
    /// What it reported about its verdict.
    pub said: Said,
    /// How it violated the protocol or exceeded a limit, in words.
    pub fault: Option<String>,
    /// The end of its standard error.
    pub stderr: String,
    /// Wall time.
    pub took: Duration,
}

impl From<ExitStatus> for Ending {
    fn from(status: ExitStatus) -> Self {
        match (status.code(), signal(status)) {
            (Some(code), _) => Self::Code(code),
            (None, signal) => Self::Signal(signal.unwrap_or(0)),
        }
    }
}

#[cfg(unix)]
fn signal(status: ExitStatus) -> Option<i32> {
    std::os::unix::process::ExitStatusExt::signal(&status)
}

#[cfg(not(unix))]
fn signal(_: ExitStatus) -> Option<i32> {
    None
}
