//! What is shown, and what a playback was like.

use crate::control::{Ladder, OperatingPoint, Shown};
use crate::qoe::Score;
use crate::simulation::Report;

/// A GOP that is to be shown now.
#[derive(Debug, Clone, Copy)]
pub struct PlayedGop<'a> {
    /// Its number in the manifest.
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

/// Takes what is to be shown. It should return at once, as nothing is fetched meanwhile.
pub trait Screen {
    /// Shows a GOP from now on.
    fn show(&mut self, gop: &PlayedGop<'_>);
}

impl<F: FnMut(&PlayedGop<'_>)> Screen for F {
    fn show(&mut self, gop: &PlayedGop<'_>) {
        self(gop);
    }
}

/// A GOP of a playback. Of requests it counts those up to when it began, and those after that for what came too late.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct GopLog {
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

/// Something that was left out of a GOP.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Loss {
    /// The GOP, by its number in the manifest.
    pub gop: usize,
    /// The identifier of the Representation.
    pub representation: String,
    /// The first refinement that is left out, with all above it.
    pub refinement: u8,
    /// Why.
    pub reason: String,
}

/// A playback.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// What was played when. `requests` are those of HTTP, of which a fetch may have several.
    pub report: Report,
    /// All GOPs, in order.
    pub gops: Vec<GopLog>,
    /// What was left out, in the order in which it was given up.
    pub losses: Vec<Loss>,
    /// The presentation as it was planned.
    pub ladder: Ladder,
}

impl Outcome {
    /// What it was worth.
    pub fn score(&self) -> Score {
        Score::of(&self.ladder, &self.report)
    }
}
