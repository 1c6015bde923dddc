//! C.9: a stream that is still being made, GOP by GOP or frame by frame.

mod timeline;

use crate::division::{Divider, Gop};
use crate::manifest::{ByteRange, Digest, SubsegmentInfo, digest_of};
use crate::package::description::describe;
use crate::package::init::{Init, put_brands, put_tail};
use crate::package::segment::{self, Subsegment};
use crate::package::{Clock, Layout, Options, Package};
use crate::representation::Representation;
use splatstream_format::syntax::{FileHeader, Profile};
use splatstream_format::unit_reader::{Event, UnitReader};
use splatstream_format::{Limits, Result};
use timeline::{End, Timeline, Times, name_of_init};

/// How a stream that is being made is packaged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// As of a whole stream.
    pub package: Options,
    /// Milliseconds of the stream that the manifest lists while it grows; three GOPs at least.
    pub window_ms: u32,
    /// The latency that players are told to aim at; without it two frames or, with the layout gop, two of the longest GOPs.
    pub target_latency_ms: Option<u32>,
    /// Bytes of GOPs that the manifest has at its end, and that are held until then: the first GOPs of a longer stream
    /// are left out of it.
    pub manifest_bytes: usize,
}

impl Settings {
    /// GOPs that are listed even if they are longer than the window.
    const LEAST: usize = 3;

    /// A window of a minute or, with the layout frame, whose manifest is written with every frame, of 6 s; 128 MiB of
    /// GOPs, half of what readers take.
    pub const fn new(package: Options) -> Self {
        let window_ms = match package.layout {
            Layout::Gop => 60_000,
            Layout::Frame => 6000,
        };
        Self { package, window_ms, target_latency_ms: None, manifest_bytes: 1 << 27 }
    }
}

/// A change of a file of a live package.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Change {
    /// The name of the file.
    pub name: String,
    /// Bytes.
    pub bytes: Vec<u8>,
    /// Whether they are appended to a file that is there; otherwise they are all of it.
    pub appends: bool,
}

/// Packages a stream while it is being made. It holds the bytes of one GOP at most, what the manifest says of as many GOPs
/// as [`Settings::manifest_bytes`] allows, and 64 bytes for each GOP of the MPD.
///
/// ```
/// use splatstream_format::Limits;
/// use splatstream_stream::live::{Live, Settings};
/// use splatstream_stream::package::Options;
///
/// /// The names of the files that change while a stream arrives.
/// fn names(pieces: &[&[u8]]) -> splatstream_format::Result<Vec<String>> {
///     let mut live = Live::new(&Settings::new(Options::default()), &Limits::default());
///     let mut names = Vec::new();
///     for piece in pieces {
///         names.extend(live.push(piece, 1_767_225_600_000)?.into_iter().map(|change| change.name));
///     }
///     names.extend(live.finish(1_767_225_601_000)?.into_iter().map(|change| change.name));
///     Ok(names)
/// }
/// assert!(names(&[b"no stream, whatever comes"]).is_err());
/// ```
#[derive(Debug)]
pub struct Live {
    settings: Settings,
    /// When the first bytes came.
    started_ms: Option<u64>,
    reader: UnitReader,
    divider: Option<(FileHeader, Divider)>,
    /// Bytes from an offset of the stream on.
    kept: Vec<u8>,
    kept_at: u64,
    /// Bytes of the stream so far, and their digest.
    bytes: u64,
    digest: Digest,
    /// The units before the first GOP, once it has begun.
    head: Option<Vec<u8>>,
    /// Of each Representation.
    outputs: Vec<Output>,
    /// Pieces of the GOP in progress that have been written.
    written: usize,
    /// Whether there is something that the manifest does not say yet.
    is_news: bool,
    timeline: Timeline,
}

/// What has been written of a Representation.
#[derive(Debug)]
struct Output {
    representation: Representation,
    /// Of the next fragment.
    number: u32,
    /// Bytes of the file of the GOP in progress; 0 if there is none.
    size: u64,
    /// Whether there is a subsegment in it.
    is_begun: bool,
}

impl Live {
    /// Before the first byte.
    pub fn new(settings: &Settings, limits: &Limits) -> Self {
        Self {
            settings: *settings,
            started_ms: None,
            reader: UnitReader::new(limits),
            divider: None,
            kept: Vec::new(),
            kept_at: 0,
            bytes: 0,
            digest: Digest::default(),
            head: None,
            outputs: Vec::new(),
            written: 0,
            is_news: false,
            timeline: Timeline::new(*settings),
        }
    }

    /// Takes more bytes; gives what to write, in this order, before the next bytes are waited for. `now_ms` is the
    /// time, in milliseconds since 1970; that of the first bytes counts as the time when frame 0 was made.
    ///
    /// # Errors
    /// As [`Package::of`](crate::package::Package::of). Nothing more can be taken after one.
    pub fn push(&mut self, bytes: &[u8], now_ms: u64) -> Result<Vec<Change>> {
        self.started_ms.get_or_insert(now_ms);
        self.kept.extend_from_slice(bytes);
        self.digest.add(bytes);
        self.bytes = self.bytes.saturating_add(size(bytes.len()));
        let mut changes = self.read(false, now_ms)?;
        if std::mem::take(&mut self.is_news) {
            changes.extend(self.manifest(now_ms, None));
        }
        Ok(changes)
    }

    /// Whether the end unit has come: nothing more is expected.
    pub fn has_ended(&self) -> bool {
        self.divider.is_some() && !self.reader.is_open()
    }

    /// After the last byte.
    ///
    /// # Errors
    /// As [`Live::push`]; a stream without its end unit.
    pub fn finish(mut self, now_ms: u64) -> Result<Vec<Change>> {
        let mut changes = self.read(true, now_ms)?;
        let tail = self.divider.as_ref().and_then(|(_, divider)| divider.tail_start());
        self.begin(&mut changes);
        let mut end = segment_file();
        let offset = end.len();
        put_tail(&mut end, self.since(tail.unwrap_or(u64::MAX)));
        let end = Change::whole("s0-end.m4s".to_owned(), end);
        let tail = range_of(&end.bytes, 0, offset);
        let digest = self.digest.text();
        let known = End { bytes: self.bytes, digest, file: end.name.clone(), tail };
        changes.push(end);
        changes.extend(self.manifest(now_ms, Some(&known)));
        changes.extend(self.mpd(now_ms, Some(&known)));
        Ok(changes)
    }

    fn read(&mut self, is_end: bool, now_ms: u64) -> Result<Vec<Change>> {
        let mut changes = Vec::new();
        let kept = core::mem::take(&mut self.kept);
        let result = self.events(&kept, is_end, now_ms, &mut changes);
        self.kept = kept;
        result?;
        self.forget();
        Ok(changes)
    }

    /// All units of the bytes at hand.
    fn events(&mut self, kept: &[u8], is_end: bool, now_ms: u64, changes: &mut Vec<Change>) -> Result<()> {
        loop {
            let at = self.reader.position().saturating_sub(self.kept_at);
            let rest = usize::try_from(at).ok().and_then(|at| kept.get(at..)).unwrap_or_default();
            let unit = match self.reader.read(rest, is_end)? {
                Event::FileHeader(header) => {
                    self.divider = Some((header, Divider::new(&header)));
                    continue;
                }
                Event::Unit(unit) => unit,
                Event::NeedMoreData(_) | Event::End => return Ok(()),
            };
            let Some((_, divider)) = &mut self.divider else { return Ok(()) };
            let done = divider.take(&unit)?;
            if let Some(gop) = done {
                self.complete(&gop, kept, changes)?;
                changes.extend(self.mpd(now_ms, None));
            }
            self.open(kept, now_ms, changes)?;
        }
    }

    /// After a unit: begins what a first GOP begins, and writes frames that are complete.
    fn open(&mut self, kept: &[u8], now_ms: u64, changes: &mut Vec<Change>) -> Result<()> {
        let Some((_, divider)) = &self.divider else { return Ok(()) };
        let Some(gop) = divider.open_gop() else { return Ok(()) };
        if self.head.is_none() {
            let length = usize::try_from(divider.head_end()).unwrap_or(usize::MAX);
            self.head = Some(kept.get(..length).unwrap_or_default().to_vec());
        }
        let frame = gop.pieces.last().map(|piece| piece.place.frame);
        let complete = gop.pieces.iter().filter(|piece| Some(piece.place.frame) != frame).count();
        if self.settings.package.layout == Layout::Gop || complete <= self.written {
            return Ok(());
        }
        let pieces = gop.pieces.get(self.written..complete).unwrap_or_default().to_vec();
        let part = Gop { pieces, ..gop.clone() };
        self.begin(changes);
        let is_new = self.written == 0;
        if is_new {
            self.announce(&part, changes);
        }
        self.written = complete;
        self.write(&part, false, kept, changes)?;
        if is_new {
            changes.extend(self.mpd(now_ms, None));
        }
        Ok(())
    }

    /// Begins the files of a GOP that will grow.
    fn announce(&mut self, gop: &Gop, changes: &mut Vec<Change>) {
        self.timeline.announce(gop);
        for output in &mut self.outputs {
            let name = self.timeline.name_of_segment(output.representation);
            let bytes = segment_file();
            output.size = size(bytes.len());
            changes.push(Change::whole(name, bytes));
        }
    }

    /// Writes the rest of a GOP.
    fn complete(&mut self, gop: &Gop, kept: &[u8], changes: &mut Vec<Change>) -> Result<()> {
        let pieces = gop.pieces.get(self.written..).unwrap_or_default().to_vec();
        self.begin(changes);
        self.write(&Gop { pieces, ..gop.clone() }, true, kept, changes)?;
        self.written = 0;
        self.is_news = true;
        self.timeline.add(gop);
        self.outputs.iter_mut().for_each(|output| (output.size, output.is_begun) = (0, false));
        Ok(())
    }

    /// Writes the initialisation segments, if they have not been written.
    fn begin(&mut self, changes: &mut Vec<Change>) {
        let Some((header, divider)) = &self.divider else { return };
        let Some(sequence) = divider.sequence().filter(|_| self.outputs.is_empty()) else { return };
        let is_there = |one: &Representation| one.is_intra() || header.profile() == Profile::Dynamic;
        let start = usize::try_from(divider.head_end()).unwrap_or(usize::MAX);
        let head = self.head.as_deref().or(self.kept.get(..start)).unwrap_or_default();
        self.timeline.begin(header, sequence);
        for representation in Representation::of_sequence(sequence).filter(is_there) {
            let (refinements, clock) = (sequence.refinement_count, Clock::of(sequence));
            let init = Init { representation, refinements, clock, head }.to_bytes();
            self.timeline.track(representation, &init);
            changes.push(Change::whole(name_of_init(representation), init));
            self.outputs.push(Output { representation, number: 1, size: 0, is_begun: false });
        }
    }

    /// Writes pieces of a GOP, which are the last if `is_end`: then every Representation has a file.
    fn write(&mut self, part: &Gop, is_end: bool, kept: &[u8], changes: &mut Vec<Change>) -> Result<()> {
        let Some(sequence) = self.divider.as_ref().and_then(|(_, divider)| divider.sequence()) else {
            return Ok(());
        };
        let (clock, refinements) = (Clock::of(sequence), sequence.refinement_count);
        let percents = &sequence.refinement_percent;
        for (index, output) in self.outputs.iter_mut().enumerate() {
            let of_it = part.pieces.iter().any(|piece| piece.place.representation == output.representation);
            if !of_it && (!is_end || output.is_begun) {
                continue;
            }
            let representation = output.representation;
            let number = &mut output.number;
            let mut made = segment::subsegments(
                part,
                representation,
                refinements,
                clock,
                &self.settings.package,
                number,
            )?;
            if let (true, Some(first)) = (output.is_begun, made.first_mut()) {
                first.is_access_point = false;
            }
            let name = self.timeline.name_of_segment(representation);
            let (bytes, ranges) = bytes_of(&made, clock, output.size, (kept, self.kept_at))?;
            let described = made.iter().zip(ranges).map(|(subsegment, ranges)| SubsegmentInfo {
                file: Some(name.clone()),
                ..describe(subsegment, representation, part, percents, ranges.into_iter())
            });
            self.timeline.count(index, &made, described.collect());
            let appends = output.size > 0;
            output.size = output.size.saturating_add(size(bytes.len()));
            output.is_begun = true;
            self.is_news = true;
            changes.push(Change { name, bytes, appends });
        }
        Ok(())
    }

    /// The manifest as it is now.
    fn manifest(&self, now_ms: u64, end: Option<&End>) -> Option<Change> {
        let manifest = self.timeline.manifest(self.times(now_ms), end)?;
        Some(Change::whole(Package::MANIFEST.to_owned(), manifest.into_bytes()))
    }

    /// The MPD as it is now.
    fn mpd(&self, now_ms: u64, end: Option<&End>) -> Option<Change> {
        let mpd = self.timeline.mpd(self.times(now_ms), end)?;
        Some(Change::whole(Package::MPD.to_owned(), mpd.into_bytes()))
    }

    /// When the stream began, and what time it is.
    fn times(&self, now_ms: u64) -> Times {
        Times { started_ms: self.started_ms.unwrap_or(now_ms), now_ms }
    }

    /// The bytes from an offset of the stream on.
    fn since(&self, at: u64) -> &[u8] {
        let start = usize::try_from(at.saturating_sub(self.kept_at)).unwrap_or(usize::MAX);
        self.kept.get(start..).unwrap_or_default()
    }

    /// Lets go of bytes that have been written.
    fn forget(&mut self) {
        let Some((_, divider)) = &self.divider else { return };
        let Some(from) = divider.open_gop().map(|gop| gop.start) else { return };
        let count = usize::try_from(from.saturating_sub(self.kept_at)).unwrap_or(0).min(self.kept.len());
        self.kept.drain(..count);
        self.kept_at = self.kept_at.max(from);
    }
}

/// The brands of segments.
const SEGMENT: [[u8; 4]; 2] = [*b"msdh", *b"msix"];

impl Change {
    fn whole(name: String, bytes: Vec<u8>) -> Self {
        Self { name, bytes, appends: false }
    }
}

/// A file of a GOP without subsegments.
fn segment_file() -> Vec<u8> {
    let mut bytes = Vec::new();
    put_brands(&mut bytes, *b"styp", &SEGMENT);
    bytes
}

/// Subsegments with their indices, to be appended to a file of so many bytes, and the ranges of their levels; `stream` is
/// bytes of it and their offset.
fn bytes_of(
    made: &[Subsegment],
    clock: Clock,
    before: u64,
    (bytes, at): (&[u8], u64),
) -> Result<(Vec<u8>, Vec<Vec<ByteRange>>)> {
    let index = |offset: u64| usize::try_from(offset.saturating_sub(at)).unwrap_or(usize::MAX);
    let mut out = if before == 0 { segment_file() } else { Vec::new() };
    out.extend(segment::indices(made, clock)?);
    let mut ranges = Vec::new();
    for subsegment in made {
        let mut of_levels = Vec::new();
        for level in &subsegment.levels {
            let from = out.len();
            out.extend_from_slice(&level.header);
            for part in &level.parts {
                out.extend_from_slice(bytes.get(index(part.start)..index(part.end)).unwrap_or_default());
            }
            of_levels.push(range_of(&out, before, from));
        }
        ranges.push(of_levels);
    }
    Ok((out, ranges))
}

/// The bytes from one on, which is to be appended to so many others.
fn range_of(bytes: &[u8], before: u64, from: usize) -> ByteRange {
    let part = bytes.get(from..).unwrap_or_default();
    ByteRange {
        offset: before.saturating_add(size(from)),
        size: size(part.len()),
        digest: digest_of(&[part]),
    }
}

fn size(bytes: usize) -> u64 {
    u64::try_from(bytes).unwrap_or(u64::MAX)
}
