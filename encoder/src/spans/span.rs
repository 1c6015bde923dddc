//! A span, and what it is coded with.

use crate::settings::Settings;
use splatstream_format::Limits;
use splatstream_format::payload::Network;
use splatstream_format::syntax::SequenceParameters;

/// What all spans of a sequence are coded with.
#[derive(Clone, Copy)]
pub(crate) struct Common<'a> {
    pub(crate) settings: &'a Settings,
    pub(crate) sequence: SequenceParameters,
    /// Those of the level of the stream.
    pub(crate) limits: Limits,
    /// The network that the GOPs may use.
    pub(crate) network: Option<&'a Network>,
}

/// Frames that are coded by themselves: display indices of the first, and of the one after the last.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Span {
    pub(crate) first: u32,
    pub(crate) end: u32,
}
