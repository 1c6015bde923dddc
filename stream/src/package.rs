//! Annex C: a stream becomes one file per Representation, a manifest and an MPD.

pub(crate) mod description;
pub(crate) mod init;
pub(crate) mod layout;
pub(crate) mod segment;

use crate::division::{Division, Gop};
use crate::manifest::Manifest;
use crate::mpd;
use crate::representation::Representation;
use core::ops::Range;
use description::Describer;
use init::Init;
pub use layout::Layout;
use segment::Subsegment;
use splatstream_format::syntax::SequenceParameters;
use splatstream_format::{Limits, Result};
use std::io::{self, Write};

/// How a stream is packaged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// What a subsegment is.
    pub layout: Layout,
    /// The most bytes of a subsegment, up to 2^31 - 1. A GOP that takes more becomes several.
    pub max_subsegment: u32,
}

impl Options {
    /// The most bytes that `sidx` can say a subsegment has.
    pub const MAX_SUBSEGMENT: u32 = (1 << 31) - 1;
}

impl Default for Options {
    fn default() -> Self {
        Self { layout: Layout::default(), max_subsegment: Self::MAX_SUBSEGMENT }
    }
}

/// How frames become ticks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Clock {
    /// Ticks in a second.
    pub timescale: u32,
    /// Ticks from a frame to the next.
    pub frame_ticks: u32,
}

impl Clock {
    /// The clock of a sequence; one that does not say how long a frame is shown has a frame in a second.
    pub const fn of(sequence: &SequenceParameters) -> Self {
        let (timescale, ticks) = (sequence.ticks_per_second, sequence.ticks_per_frame);
        Self { timescale, frame_ticks: if ticks == 0 { timescale } else { ticks } }
    }

    /// When a frame is shown.
    pub(crate) fn time(self, frame: u32) -> u64 {
        self.ticks(frame.into())
    }

    /// How long so many frames are. Display indices are below 2^32, and so are ticks of a frame: no overflow.
    pub(crate) fn ticks(self, frames: u64) -> u64 {
        frames.saturating_mul(self.frame_ticks.into())
    }

    /// Bits per second of bytes in so many ticks, rounded up.
    pub(crate) fn rate(self, bytes: u64, ticks: u64) -> u64 {
        let bits = u128::from(bytes).saturating_mul(8).saturating_mul(self.timescale.into());
        u64::try_from(bits.div_ceil(u128::from(ticks.max(1)))).unwrap_or(u64::MAX)
    }
}

/// A part of a file.
#[derive(Debug, Clone)]
pub(crate) enum Chunk {
    /// Boxes.
    Boxes(Vec<u8>),
    /// Bytes of the stream.
    Stream(Range<usize>),
}

/// A packaged stream.
#[derive(Debug, Clone)]
pub struct Package<'a> {
    stream: &'a [u8],
    files: Vec<File>,
    /// What is where.
    pub manifest: Manifest,
    /// The media presentation description.
    pub mpd: String,
}

/// A file of a package, before it is written.
#[derive(Debug, Clone)]
pub(crate) struct File {
    pub(crate) name: String,
    pub(crate) chunks: Vec<Chunk>,
}

impl<'a> Package<'a> {
    /// The name of the manifest in its directory.
    pub const MANIFEST: &'static str = "manifest.json";
    /// The name of the media presentation description.
    pub const MPD: &'static str = "manifest.mpd";

    /// Packages a whole stream. Nothing is decoded.
    ///
    /// # Errors
    /// A stream that is damaged or incomplete, whose units do not stand as annex B has them, or that is beyond what
    /// the boxes can say: a frame of 2 GiB, or more than 65,535 subsegments.
    ///
    /// ```
    /// use splatstream_format::Limits;
    /// use splatstream_stream::package::{Options, Package};
    ///
    /// /// The names of the files that a stream becomes, and how many bytes they have.
    /// fn sizes(stream: &[u8]) -> Result<Vec<(String, usize)>, Box<dyn std::error::Error>> {
    ///     let package = Package::of(stream, &Options::default(), &Limits::default())?;
    ///     let mut sizes = Vec::new();
    ///     for name in package.files() {
    ///         let mut file = Vec::new();
    ///         package.write(name, &mut file)?;
    ///         sizes.push((name.to_owned(), file.len()));
    ///     }
    ///     Ok(sizes)
    /// }
    /// assert!(sizes(b"no stream").is_err());
    /// ```
    pub fn of(stream: &'a [u8], options: &Options, limits: &Limits) -> Result<Self> {
        let division = Division::of(stream, limits)?;
        let mut describer = Describer::new(stream, &division, options);
        let mut files = Vec::new();
        for representation in division.representations() {
            let file = Plan::of(representation, &division, options)?.file(stream, &division)?;
            files.push(describer.file(file));
        }
        let manifest = describer.manifest();
        let mpd = mpd::of(&manifest);
        Ok(Self { stream, files, manifest, mpd })
    }

    /// The names of the files of the Representations, in order of dependence.
    pub fn files(&self) -> impl Iterator<Item = &str> {
        self.files.iter().map(|file| file.name.as_str())
    }

    /// Writes the file with a name; nothing where there is none.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write(&self, name: &str, out: &mut impl Write) -> io::Result<()> {
        let file = self.files.iter().find(|file| file.name == name);
        for chunk in file.iter().flat_map(|file| &file.chunks) {
            out.write_all(bytes_of(chunk, self.stream))?;
        }
        Ok(())
    }
}

pub(crate) fn bytes_of<'c>(chunk: &'c Chunk, stream: &'c [u8]) -> &'c [u8] {
    match chunk {
        Chunk::Boxes(bytes) => bytes,
        Chunk::Stream(range) => stream.get(range.clone()).unwrap_or_default(),
    }
}

/// The subsegments of a Representation.
struct Plan {
    representation: Representation,
    /// By GOP.
    segments: Vec<Vec<Subsegment>>,
}

/// A file of a Representation, and what its parts are.
pub(crate) struct Planned {
    pub(crate) representation: Representation,
    /// The initialisation segment.
    pub(crate) init: Vec<u8>,
    /// `sidx` and `ssix`.
    pub(crate) indices: Vec<u8>,
    /// By GOP.
    pub(crate) segments: Vec<Vec<Subsegment>>,
    /// `gssT`, of the base.
    pub(crate) tail: Vec<u8>,
}

impl Plan {
    fn of(representation: Representation, division: &Division, options: &Options) -> Result<Self> {
        let (clock, mut number) = (Clock::of(&division.sequence), 1);
        let refinements = division.sequence.refinement_count;
        let of_gop =
            |gop: &Gop| segment::subsegments(gop, representation, refinements, clock, options, &mut number);
        let segments = division.gops.iter().map(of_gop).collect::<Result<_>>()?;
        Ok(Self { representation, segments })
    }

    fn file(self, stream: &[u8], division: &Division) -> Result<Planned> {
        let Self { representation, segments } = self;
        let clock = Clock::of(&division.sequence);
        let head = stream.get(..usize::try_from(division.head_end).unwrap_or(0)).unwrap_or_default();
        let refinements = division.sequence.refinement_count;
        let init = Init { representation, refinements, clock, head }.to_bytes();
        let all: Vec<_> = segments.iter().flatten().cloned().collect();
        let indices = segment::indices(&all, clock)?;
        let mut tail = Vec::new();
        if representation == Representation::Spatial(0) {
            let start = usize::try_from(division.tail_start).unwrap_or(usize::MAX);
            init::put_tail(&mut tail, stream.get(start..).unwrap_or_default());
        }
        Ok(Planned { representation, init, indices, segments, tail })
    }
}
