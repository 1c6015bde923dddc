//! What a call comes to.

use splatstream::Error;

/// What a call has come to. Later versions of the library may add values.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[must_use]
pub enum SplatstreamStatus {
    /// Done. Of splatstream_decoder_next_frame: there is a frame.
    Ok = 0,
    /// The next frame needs more bytes: push them, or say that there are none.
    NeedBytes = 1,
    /// There are no more frames.
    End = 2,
    /// The stream does not parse.
    Malformed = 10,
    /// The stream parses, and breaks a rule of the specification.
    Invalid = 11,
    /// The stream has a feature that this version does not decode.
    Unsupported = 12,
    /// The stream needs more than the limits allow.
    OverLimit = 13,
    /// The stream ends too early.
    Truncated = 14,
    /// All frames that are left have been given; after the last one something was lost, which warnings tell.
    Incomplete = 20,
    /// A file cannot be opened or read, or there is no memory.
    Io = 21,
    /// The work was cancelled. Seeking starts again.
    Cancelled = 22,
    /// More bytes would wait in the decoder than the limits allow: take frames first.
    TooMuchInput = 23,
    /// Bytes were pushed after the end, or to a decoder that reads by itself.
    NotPushed = 24,
    /// A decoder that bytes are pushed to cannot seek.
    NotSeekable = 25,
    /// A frame has more Gaussians than there are slots, which are as they were.
    TooFewSlots = 26,
    /// A null pointer where there must be none, a call that is too late, or before there is a frame.
    InvalidArgument = 30,
    /// A defect of the library. The handle can only be freed.
    Internal = 31,
}

/// Why a call fails.
#[derive(Debug)]
pub(crate) struct Failure {
    pub(crate) status: SplatstreamStatus,
    pub(crate) message: String,
}

impl Failure {
    pub(crate) fn argument(message: &str) -> Self {
        Self { status: SplatstreamStatus::InvalidArgument, message: message.to_owned() }
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        use SplatstreamStatus as Status;
        let status = match &error {
            Error::Incomplete(_) => Status::Incomplete,
            Error::Io(_) => Status::Io,
            Error::Cancelled => Status::Cancelled,
            Error::TooMuchInput { .. } => Status::TooMuchInput,
            Error::NotPushed => Status::NotPushed,
            Error::NotSeekable => Status::NotSeekable,
            Error::TooFewSlots { .. } => Status::TooFewSlots,
            other => match other.class().map(|class| class.exit_code()) {
                Some(10) => Status::Malformed,
                Some(11) => Status::Invalid,
                Some(12) => Status::Unsupported,
                Some(13) => Status::OverLimit,
                Some(14) => Status::Truncated,
                _ => Status::Internal,
            },
        };
        Self { status, message: error.to_string() }
    }
}
