//! How to decode: what a client asks for before the first unit.

use crate::budget::Budget;
use crate::operating_point::OperatingPoint;
use splatstream_format::Limits;

/// How to decode.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// What is accepted at most.
    pub limits: Limits,
    /// Compare every list with the digest in the stream.
    pub verify: bool,
    /// The units to take.
    pub operating_point: OperatingPoint,
    /// Stop at the first error of any kind, and do not output the frame in which it was found.
    pub stop_at_first_error: bool,
    /// Of P and B frames with exact lists show these only: the paper's subset.
    pub subset: bool,
    /// Give the entropy states of units in [`DecodedFrame::entropy`](super::DecodedFrame::entropy).
    pub entropy: bool,
    /// Give the identities of Gaussians in [`DecodedFrame::identities`](super::DecodedFrame::identities).
    pub identities: bool,
    /// What decoding may take.
    pub budget: Budget,
    /// Decode a frame that no other one refers to beside the frame after it, if there is more than one thread and that frame
    /// comes before [`Decoder::stop_waiting`](super::Decoder::stop_waiting) is called. This takes the memory of one frame more. Not where decoding stops at
    /// the first error.
    pub ahead: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            limits: Limits::default(),
            verify: true,
            operating_point: OperatingPoint::ALL,
            stop_at_first_error: false,
            subset: false,
            entropy: false,
            identities: false,
            budget: Budget::UNLIMITED,
            ahead: false,
        }
    }
}
