//! What is shown, and what is known of it.

use crate::control::{OperatingPoint, Shown};

/// A GOP that is to be shown now.
#[derive(Debug, Clone, Copy)]
pub struct PlayedGop<'a> {
    /// Its number in the stream, from 0.
    pub number: usize,
    /// What to decode it at: without a temporal layer, only the first frame, for which alone units are there. None if nothing of it could be
    /// had: what was shown before stands still.
    pub point: Option<OperatingPoint>,
    /// Start of the stream: the file header and the units before the first GOP.
    pub head: &'a [u8],
    /// Units of the GOP, in the order of the stream, for a decoder that has had the head. They are those of the operating
    /// point, and maybe some that a decoder leaves out.
    pub units: &'a [u8],
    /// What is known of it.
    pub log: &'a GopLog,
}

/// A GOP of a playback. Of requests it counts those up to when it began, and those after that for what came too late.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct GopLog {
    /// Its number in the stream, from 0.
    pub number: usize,
    /// Display index of its first frame.
    pub first_frame: u32,
    /// Its frames.
    pub frame_count: u32,
    /// How it was played; none if nothing of it could be had.
    pub shown: Option<Shown>,
    /// Media time that was buffered when it began, in microseconds, without itself.
    pub buffer_us: u64,
    /// Requests that were sent.
    pub requests: u64,
    /// Requests that were of no use.
    pub failures: u64,
    /// Fetches that the controller gave up.
    pub abandoned: u64,
    /// Bytes that arrived, of initialisation segments too.
    pub bytes: u64,
}

/// Something that was left out of a GOP, or of several that were skipped.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Loss {
    /// The GOP, by its number in the stream.
    pub gop: usize,
    /// How many GOPs from it on.
    pub count: usize,
    /// The identifier of the Representation.
    pub representation: String,
    /// The first refinement that is left out, with all above it.
    pub refinement: u8,
    /// Why.
    pub reason: String,
}
