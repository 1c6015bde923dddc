//! What can go wrong, and what was lost.

use core::fmt;
use core::ops::RangeInclusive;
use splatstream_format::{Class, Error as StreamError, ErrorKind};

/// The result of a [`Decoder`](crate::Decoder) or of [`Slots`](crate::Slots).
pub type Result<T> = core::result::Result<T, Error>;

/// Why there is no frame.
#[derive(Debug)]
#[must_use]
#[non_exhaustive]
pub enum Error {
    /// The bytes are no stream that this version decodes, or need more than the [`Limits`](crate::Limits) allow. Nothing
    /// more comes.
    Stream(StreamError),
    /// The stream has ended, and after its last frame something was missing or damaged. All frames that are left have
    /// been given out.
    Incomplete(Vec<Warning>),
    /// A file cannot be opened or read.
    Io(std::io::Error),
    /// What has been decoded does not fit together, such as the planes of a frame or the identities of its Gaussians; in words: a
    /// defect of this library, which its authors want to hear of. Nothing more comes.
    Broken(String),
    /// [`Cancel`](crate::Cancel) was requested. A [seek](crate::Decoder::seek) starts again.
    Cancelled,
    /// Bytes wait in the decoder, and these are more than the limits let it keep: take frames first.
    TooMuchInput {
        /// Bytes that would wait.
        waiting: u64,
        /// How many may.
        allowed: u64,
    },
    /// Bytes were pushed after the end, or to a decoder that reads by itself.
    NotPushed,
    /// A decoder that bytes are pushed to cannot go to another place by itself.
    NotSeekable,
    /// A frame does not fit into the slots, which are as they were.
    TooFewSlots {
        /// Gaussians of the frame.
        needed: usize,
        /// Slots there are.
        capacity: usize,
    },
}

impl fmt::Display for Error {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stream(error) => error.fmt(formatter),
            Self::Incomplete(warnings) => {
                let lines: Vec<String> = warnings.iter().map(ToString::to_string).collect();
                write!(formatter, "the stream is not whole: {}", lines.join("; "))
            }
            Self::Io(error) => error.fmt(formatter),
            Self::Broken(what) => {
                write!(formatter, "the decoder gave a broken frame: {what}; please report this")
            }
            Self::Cancelled => formatter.write_str("decoding was cancelled"),
            Self::TooMuchInput { waiting, allowed } => {
                write!(formatter, "{waiting} bytes wait to be decoded, at most {allowed} may")
            }
            Self::NotPushed => formatter.write_str("this decoder takes no more bytes"),
            Self::NotSeekable => formatter.write_str("bytes that are pushed cannot be sought in"),
            Self::TooFewSlots { needed, capacity } => {
                write!(formatter, "a frame has {needed} Gaussians, there are {capacity} slots")
            }
        }
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Stream(error) => Some(error),
            Self::Io(error) => Some(error),
            _ => None,
        }
    }
}

/// A stream that cannot be decoded, or not by this library.
impl From<StreamError> for Error {
    fn from(error: StreamError) -> Self {
        match error.kind {
            ErrorKind::Fault { broken } => Self::Broken(format!("{broken} does not hold")),
            _ => Self::Stream(error),
        }
    }
}

impl From<std::io::Error> for Error {
    fn from(error: std::io::Error) -> Self {
        Self::Io(error)
    }
}

impl Error {
    /// The class of clause 9.1 of the specification, if the stream is at fault.
    pub fn class(&self) -> Option<Class> {
        match self {
            Self::Stream(error) => Some(error.class()),
            Self::Incomplete(warnings) => warnings.iter().find_map(Warning::class),
            _ => None,
        }
    }
}

/// Something that was lost on the way to a frame.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Warning {
    /// A part of the stream is damaged; what it held is missing.
    Damaged(StreamError),
    /// Frames with these display indices are not given out.
    Lost(RangeInclusive<u32>),
}

impl Warning {
    fn class(&self) -> Option<Class> {
        match self {
            Self::Damaged(error) => Some(error.class()),
            Self::Lost(_) => None,
        }
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Damaged(error) => error.fmt(formatter),
            Self::Lost(frames) if frames.start() == frames.end() => {
                write!(formatter, "frame {} is lost", frames.start())
            }
            Self::Lost(frames) => write!(formatter, "frames {} to {} are lost", frames.start(), frames.end()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_of_the_decoder_is_none_of_the_stream() {
        let broken = Error::from(StreamError::fault("one length"));
        assert!(matches!(&broken, Error::Broken(what) if what == "one length does not hold"), "{broken}");
        assert_eq!(broken.class(), None);
        let signature = StreamError::new(0, "6.2", ErrorKind::Signature);
        assert_eq!(Error::from(signature).class(), Some(Class::Malformed));
    }
}
