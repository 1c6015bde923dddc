//! C.9: a stream that is still being made, GOP by GOP or frame by frame.

mod timeline;

use crate::division::{Divider, Gop};
use crate::package::init::{Init, put_brands, put_tail};
use crate::package::segment::{self, Subsegment};
use crate::package::{Clock, Layout, Options};
use crate::representation::Representation;
use splatstream_format::syntax::{FileHeader, Profile};
use splatstream_format::unit_reader::{Event, UnitReader};
use splatstream_format::{Limits, Result};
use timeline::Timeline;

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

/// Packages a stream while it is being made. It holds the bytes of one GOP at most.
///
/// ```
/// use splatstream_format::Limits;
/// use splatstream_stream::live::Live;
/// use splatstream_stream::package::Options;
///
/// /// The names of the files that change while a stream arrives.
/// fn names(pieces: &[&[u8]]) -> splatstream_format::Result<Vec<String>> {
///     let mut live = Live::new(&Options::default(), &Limits::default(), "2026-01-01T00:00:00Z");
///     let mut names = Vec::new();
///     for piece in pieces {
///         names.extend(live.push(piece, "2026-01-01T00:00:01Z")?.into_iter().map(|change| change.name));
///     }
///     names.extend(live.finish("2026-01-01T00:00:02Z")?.into_iter().map(|change| change.name));
///     Ok(names)
/// }
/// assert!(names(&[b"no stream, whatever comes"]).is_err());
/// ```
#[derive(Debug)]
pub struct Live {
    options: Options,
    started: String,
    reader: UnitReader,
    divider: Option<(FileHeader, Divider)>,
    /// Bytes from an offset of the stream on.
    kept: Vec<u8>,
    kept_at: u64,
    /// The units before the first GOP, once it has begun.
    head: Option<Vec<u8>>,
    /// Of each Representation.
    outputs: Vec<Output>,
    /// Pieces of the GOP in progress that have been written.
    written: usize,
    timeline: Timeline,
}

/// What has been written of a Representation.
#[derive(Debug)]
struct Output {
    representation: Representation,
    /// Of the next fragment.
    number: u32,
    /// Whether there is a file of the GOP in progress.
    is_open: bool,
    /// Whether there is a subsegment in it.
    is_begun: bool,
}

impl Live {
    /// Before the first byte. `started` is when the stream began, an `xs:dateTime` in UTC.
    pub fn new(options: &Options, limits: &Limits, started: &str) -> Self {
        Self {
            options: *options,
            started: started.to_owned(),
            reader: UnitReader::new(limits),
            divider: None,
            kept: Vec::new(),
            kept_at: 0,
            head: None,
            outputs: Vec::new(),
            written: 0,
            timeline: Timeline::default(),
        }
    }

    /// Takes more bytes; gives what to write, in this order, before the next bytes are waited for. `now` is the time, an
    /// `xs:dateTime` in UTC.
    ///
    /// # Errors
    /// As [`Package::of`](crate::package::Package::of). Nothing more can be taken after one.
    pub fn push(&mut self, bytes: &[u8], now: &str) -> Result<Vec<Change>> {
        self.kept.extend_from_slice(bytes);
        self.read(false, now)
    }

    /// Whether the end unit has come: nothing more is expected.
    pub fn has_ended(&self) -> bool {
        self.divider.is_some() && !self.reader.is_open()
    }

    /// After the last byte.
    ///
    /// # Errors
    /// As [`Live::push`]; a stream without its end unit.
    pub fn finish(mut self, now: &str) -> Result<Vec<Change>> {
        let mut changes = self.read(true, now)?;
        let tail = self.divider.as_ref().and_then(|(_, divider)| divider.tail_start());
        self.begin(&mut changes);
        let mut end = Vec::new();
        put_brands(&mut end, *b"styp", &SEGMENT);
        put_tail(&mut end, self.since(tail.unwrap_or(u64::MAX)));
        changes.push(Change::whole("s0-end.m4s".to_owned(), end));
        changes.extend(self.describe(now, true));
        Ok(changes)
    }

    fn read(&mut self, is_end: bool, now: &str) -> Result<Vec<Change>> {
        let mut changes = Vec::new();
        let kept = core::mem::take(&mut self.kept);
        let result = self.events(&kept, is_end, now, &mut changes);
        self.kept = kept;
        result?;
        self.forget();
        Ok(changes)
    }

    /// All units of the bytes at hand.
    fn events(&mut self, kept: &[u8], is_end: bool, now: &str, changes: &mut Vec<Change>) -> Result<()> {
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
                changes.extend(self.describe(now, false));
            }
            self.open(kept, now, changes)?;
        }
    }

    /// After a unit: begins what a first GOP begins, and writes frames that are complete.
    fn open(&mut self, kept: &[u8], now: &str, changes: &mut Vec<Change>) -> Result<()> {
        let Some((_, divider)) = &self.divider else { return Ok(()) };
        let Some(gop) = divider.open_gop() else { return Ok(()) };
        if self.head.is_none() {
            let length = usize::try_from(divider.head_end()).unwrap_or(usize::MAX);
            self.head = Some(kept.get(..length).unwrap_or_default().to_vec());
        }
        let frame = gop.pieces.last().map(|piece| piece.place.frame);
        let complete = gop.pieces.iter().filter(|piece| Some(piece.place.frame) != frame).count();
        if self.options.layout == Layout::Gop || complete <= self.written {
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
            changes.extend(self.describe(now, false));
        }
        Ok(())
    }

    /// Begins the files of a GOP that will grow.
    fn announce(&mut self, gop: &Gop, changes: &mut Vec<Change>) {
        self.timeline.announce(gop);
        for output in &mut self.outputs {
            let name = self.timeline.name_of_segment(output.representation);
            let mut bytes = Vec::new();
            put_brands(&mut bytes, *b"styp", &SEGMENT);
            changes.push(Change::whole(name, bytes));
            output.is_open = true;
        }
    }

    /// Writes the rest of a GOP.
    fn complete(&mut self, gop: &Gop, kept: &[u8], changes: &mut Vec<Change>) -> Result<()> {
        let pieces = gop.pieces.get(self.written..).unwrap_or_default().to_vec();
        self.begin(changes);
        self.write(&Gop { pieces, ..gop.clone() }, true, kept, changes)?;
        self.written = 0;
        self.timeline.add(gop);
        self.outputs.iter_mut().for_each(|output| (output.is_open, output.is_begun) = (false, false));
        Ok(())
    }

    /// Writes the initialisation segments, if they have not been written.
    fn begin(&mut self, changes: &mut Vec<Change>) {
        let Some((header, divider)) = &self.divider else { return };
        let Some(sequence) = divider.sequence().filter(|_| self.outputs.is_empty()) else { return };
        let is_there = |one: &Representation| one.is_intra() || header.profile() == Profile::Dynamic;
        let start = usize::try_from(divider.head_end()).unwrap_or(usize::MAX);
        let head = self.head.as_deref().or(self.kept.get(..start)).unwrap_or_default();
        for representation in Representation::of_sequence(sequence).filter(is_there) {
            let (refinements, clock) = (sequence.refinement_count, Clock::of(sequence));
            let init = Init { representation, refinements, clock, head }.to_bytes();
            changes.push(Change::whole(format!("{representation}-init.mp4"), init));
            self.outputs.push(Output { representation, number: 1, is_open: false, is_begun: false });
        }
        self.timeline.begin(header, sequence, self.outputs.len());
    }

    /// Writes pieces of a GOP, which are the last if `is_end`: then every Representation has a file.
    fn write(&mut self, part: &Gop, is_end: bool, kept: &[u8], changes: &mut Vec<Change>) -> Result<()> {
        let Some(sequence) = self.divider.as_ref().and_then(|(_, divider)| divider.sequence()) else {
            return Ok(());
        };
        let (clock, refinements) = (Clock::of(sequence), sequence.refinement_count);
        for (index, output) in self.outputs.iter_mut().enumerate() {
            let of_it = part.pieces.iter().any(|piece| piece.place.representation == output.representation);
            if !of_it && (!is_end || output.is_begun) {
                continue;
            }
            let representation = output.representation;
            let number = &mut output.number;
            let mut made =
                segment::subsegments(part, representation, refinements, clock, &self.options, number)?;
            if let (true, Some(first)) = (output.is_begun, made.first_mut()) {
                first.is_access_point = false;
            }
            let name = self.timeline.name_of_segment(representation);
            let bytes = bytes_of(&made, clock, output.is_open, (kept, self.kept_at))?;
            self.timeline.count(index, &made);
            changes.push(Change { name, bytes, appends: output.is_open });
            (output.is_open, output.is_begun) = (true, true);
        }
        Ok(())
    }

    /// The MPD as it is now.
    fn describe(&self, now: &str, is_end: bool) -> Option<Change> {
        let names = self.outputs.iter().map(|output| output.representation);
        let mpd = self.timeline.mpd(names, self.options.layout, &self.started, now, is_end)?;
        Some(Change::whole(crate::package::Package::MPD.to_owned(), mpd.into_bytes()))
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

/// Subsegments with their indices; `stream` is bytes of it and their offset.
fn bytes_of(made: &[Subsegment], clock: Clock, appends: bool, stream: (&[u8], u64)) -> Result<Vec<u8>> {
    let (bytes, at) = stream;
    let index = |offset: u64| usize::try_from(offset.saturating_sub(at)).unwrap_or(usize::MAX);
    let mut out = Vec::new();
    if !appends {
        put_brands(&mut out, *b"styp", &SEGMENT);
    }
    out.extend(segment::indices(made, clock)?);
    for level in made.iter().flat_map(|subsegment| &subsegment.levels) {
        out.extend_from_slice(&level.header);
        for part in &level.parts {
            out.extend_from_slice(bytes.get(index(part.start)..index(part.end)).unwrap_or_default());
        }
    }
    Ok(out)
}
