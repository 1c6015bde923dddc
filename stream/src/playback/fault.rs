//! Why requests are of no use.

use std::fmt;

/// Why a request was of no use.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Fault {
    /// The server refuses with this status.
    Status(u16),
    /// There is no such file on this machine, in words.
    Missing(String),
    /// The connection, the file or time failed, in words.
    Failed(String),
    /// The response ends early, after so many bytes.
    Short(u64),
    /// What was asked for is not what the response is, in words.
    Wrong(&'static str),
    /// The file is another one than before.
    Changed,
    /// The bytes are not those that were packaged.
    Digest,
}

impl Fault {
    /// Whether asking again is unlikely to help.
    pub const fn is_final(&self) -> bool {
        matches!(self, Self::Missing(_) | Self::Status(401 | 403 | 404 | 410 | 451))
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Status(status) => write!(f, "the server answers with status {status}"),
            Self::Missing(why) | Self::Failed(why) => f.write_str(why),
            Self::Short(bytes) => write!(f, "the response ends after {bytes} bytes"),
            Self::Wrong(what) => f.write_str(what),
            Self::Changed => f.write_str("the file has changed"),
            Self::Digest => f.write_str("the bytes do not have the digest in the manifest"),
        }
    }
}
