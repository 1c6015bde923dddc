//! A file of a Representation: what its boxes say, and the samples of its tracks.

use crate::boxes::flags;
use crate::boxes::read::{Box, Cursor};
use crate::division::Place;
use crate::package::Clock;
use crate::representation::Representation;
use splatstream_format::syntax::{MAX_REFINEMENTS, SequenceParameters, UnitType};
use splatstream_format::unit::Stream;
use splatstream_format::{Error, ErrorKind, Limits, Result};

const TOP: &str = "C.2";
const INIT: &str = "C.4.1";
const CONFIGURATION: &str = "C.4.2";
const FRAGMENT: &str = "C.5.1";
const TAIL: &str = "C.6";

/// A file, read.
#[derive(Debug, Clone)]
pub(crate) struct Media<'a> {
    pub(crate) representation: Representation,
    pub(crate) refinements: u8,
    /// The file header and the units before the first GOP.
    pub(crate) head: &'a [u8],
    /// Where they are in the file.
    pub(crate) head_at: u64,
    /// The units after the last GOP.
    pub(crate) tail: Option<&'a [u8]>,
    /// By track: the samples in order.
    tracks: Vec<Vec<Sample<'a>>>,
}

/// Bytes in a file.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Part<'a> {
    pub(crate) bytes: &'a [u8],
    /// Absolute offset in the file.
    pub(crate) at: u64,
}

#[derive(Debug, Clone, Copy)]
struct Sample<'a> {
    /// Decode time, ticks.
    time: u64,
    part: Part<'a>,
}

/// A run of samples that `moof` announces.
struct Fragment {
    track: usize,
    time: u64,
    /// Offset of its first byte in the file.
    data: u64,
    /// Duration and size of each sample.
    entries: Vec<(u32, u32)>,
}

/// What `gssC` says.
struct Configuration<'a> {
    representation: Representation,
    refinement: u8,
    refinements: u8,
    head: Part<'a>,
}

impl<'a> Media<'a> {
    /// Reads a file: the boxes of C.2 in any number, others are passed over.
    pub(crate) fn parse(bytes: &'a [u8]) -> Result<Self> {
        let mut cursor = Cursor::new(bytes, 0);
        while let Some(found) = cursor.next_box(TOP)? {
            match &found.kind {
                b"moov" => {
                    let mut file = movie(found)?;
                    file.boxes(cursor, bytes)?;
                    return Ok(file);
                }
                b"moof" | b"gssT" => {
                    let rule = "moov comes before fragments";
                    return Err(Error::new(found.at, TOP, ErrorKind::Constraint { rule }));
                }
                _ => {}
            }
        }
        Err(Error::new(cursor.at(), TOP, ErrorKind::Truncated { element: "moov" }))
    }

    /// A file of which no sample is known.
    pub(crate) fn empty(representation: Representation, refinements: u8) -> Self {
        let tracks = vec![Vec::new(); refinements.into()];
        Self { representation, refinements, head: &[], head_at: 0, tail: None, tracks }
    }

    /// Reads fragments, of which `bytes` are all.
    pub(crate) fn read(&mut self, bytes: &'a [u8]) -> Result<()> {
        self.boxes(Cursor::new(bytes, 0), bytes)
    }

    /// Reads the boxes after `moov`.
    fn boxes(&mut self, mut cursor: Cursor<'a>, bytes: &'a [u8]) -> Result<()> {
        // Where the next sample may start: none is used twice.
        let mut free = 0;
        while let Some(found) = cursor.next_box(TOP)? {
            match &found.kind {
                b"moov" => {
                    let rule = "a file has one moov";
                    return Err(Error::new(found.at, TOP, ErrorKind::Constraint { rule }));
                }
                b"moof" => self.fragments(found, bytes, &mut free)?,
                b"gssT" => self.take_tail(found)?,
                _ => {}
            }
        }
        Ok(())
    }

    fn take_tail(&mut self, found: Box<'a>) -> Result<()> {
        let mut body = found.body;
        version_0(&mut body, "gssT", TAIL)?;
        let twice = ErrorKind::Constraint { rule: "there is one gssT" };
        match self.tail.replace(body.rest()) {
            None => Ok(()),
            Some(_) => Err(Error::new(found.at, TAIL, twice)),
        }
    }

    /// The samples of a `moof`, whose bytes are in the file after it.
    fn fragments(&mut self, found: Box<'a>, bytes: &'a [u8], free: &mut u64) -> Result<()> {
        let mut body = found.body;
        *free = (*free).max(body.at().saturating_add(length_of(body.rest())));
        while let Some(inner) = body.next_box(FRAGMENT)? {
            if &inner.kind != b"traf" {
                continue;
            }
            let fragment = fragment(inner, found.at, self.tracks.len())?;
            let (mut time, mut at) = (fragment.time, fragment.data);
            let overlap = ErrorKind::Constraint { rule: "samples follow each other after their moof" };
            if at < *free && !fragment.entries.is_empty() {
                return Err(Error::new(inner.at, FRAGMENT, overlap));
            }
            let track = self.tracks.get_mut(fragment.track);
            let track = track.ok_or(Error::new(inner.at, FRAGMENT, overlap))?;
            for (duration, size) in fragment.entries {
                let part = Part { bytes: slice(bytes, at, size)?, at };
                let later = ErrorKind::Constraint { rule: "samples of a track are in the order of time" };
                if track.last().is_some_and(|last| last.time >= time) {
                    return Err(Error::new(inner.at, FRAGMENT, later));
                }
                track.push(Sample { time, part });
                (time, at) = (time.saturating_add(duration.into()), at.saturating_add(size.into()));
            }
            *free = at.max(*free);
        }
        Ok(())
    }

    /// C.3: the places of the samples that are not empty.
    pub(crate) fn places(&self, sequence: &SequenceParameters) -> Result<Vec<(Place, Part<'a>)>> {
        let times = |track: &Vec<Sample<'_>>| track.iter().map(|sample| sample.time).collect::<Vec<u64>>();
        let first = self.tracks.first().map(times).unwrap_or_default();
        if self.tracks.iter().any(|track| times(track) != first) {
            let rule = "the samples of all tracks have the same times";
            return Err(Error::new(self.head_at, "C.3", ErrorKind::Constraint { rule }));
        }
        self.places_of_levels(sequence)
    }

    /// The same of a file that need not have all levels.
    pub(crate) fn places_of_levels(&self, sequence: &SequenceParameters) -> Result<Vec<(Place, Part<'a>)>> {
        let ticks = u64::from(Clock::of(sequence).frame_ticks);
        let mut places = Vec::new();
        for (refinement, track) in (0_u8..).zip(&self.tracks) {
            for Sample { time, part } in track.iter().filter(|sample| !sample.part.bytes.is_empty()) {
                let whole = time.checked_rem(ticks) == Some(0);
                let frame = time.checked_div(ticks).and_then(|frame| u32::try_from(frame).ok());
                let rule = "the time of a sample is that of a frame";
                let off = Error::new(part.at, "C.3", ErrorKind::Constraint { rule });
                let frame = frame.filter(|_| whole).ok_or(off)?;
                places.push((Place { frame, representation: self.representation, refinement }, *part));
            }
        }
        Ok(places)
    }
}

/// C.4: `moov`.
fn movie(found: Box<'_>) -> Result<Media<'_>> {
    let mut body = found.body;
    let mut media: Option<Media<'_>> = None;
    while let Some(inner) = body.next_box(INIT)? {
        if &inner.kind != b"trak" {
            continue;
        }
        let configuration = track(inner)?;
        let Configuration { representation, refinements, head, refinement } = configuration;
        let media = media.get_or_insert_with(|| Media {
            representation,
            refinements,
            head: head.bytes,
            head_at: head.at,
            tail: None,
            tracks: Vec::new(),
        });
        let same = (media.representation, media.refinements) == (representation, refinements);
        let is_next = usize::from(refinement) == media.tracks.len() && refinement < refinements;
        let rule = "tracks are those of the refinements of one Representation, in order";
        if !same || !is_next || (refinement > 0 && !head.bytes.is_empty()) {
            return Err(Error::new(head.at, CONFIGURATION, ErrorKind::Constraint { rule }));
        }
        media.tracks.push(Vec::new());
    }
    let rule = "there is a track for each refinement";
    let missing = Error::new(found.at, INIT, ErrorKind::Constraint { rule });
    media.filter(|media| media.tracks.len() == usize::from(media.refinements)).ok_or(missing)
}

/// A `trak`: its identifier is its refinement and 1.
fn track(found: Box<'_>) -> Result<Configuration<'_>> {
    let mut header = found.body.find(*b"tkhd", "tkhd", INIT)?;
    let (version, _) = header.version("tkhd", INIT)?;
    header.bytes(if version == 1 { 16 } else { 8 }, "tkhd", INIT)?;
    let at = header.at();
    let id = header.u32("track_ID", INIT)?;
    let media = found.body.find(*b"mdia", "mdia", INIT)?.find(*b"minf", "minf", INIT)?;
    let mut entries = media.find(*b"stbl", "stbl", INIT)?.find(*b"stsd", "stsd", INIT)?;
    version_0(&mut entries, "stsd", INIT)?;
    entries.u32("entry_count", INIT)?;
    let mut entry = entries.find(*b"gss1", "gss1", CONFIGURATION)?;
    // SampleEntry, and the name of the compressor.
    entry.bytes(40, "gss1", CONFIGURATION)?;
    let configuration = configuration(entry.find(*b"gssC", "gssC", CONFIGURATION)?)?;
    let expected = u64::from(configuration.refinement).saturating_add(1);
    if u64::from(id) != expected {
        let kind = ErrorKind::Mismatch { element: "track_ID", value: id.into(), expected };
        return Err(Error::new(at, INIT, kind));
    }
    Ok(configuration)
}

fn configuration(mut body: Cursor<'_>) -> Result<Configuration<'_>> {
    version_0(&mut body, "gssC", CONFIGURATION)?;
    let at = body.at();
    let (kind, layer) = (body.u8("representation_kind", CONFIGURATION)?, body.u8("layer", CONFIGURATION)?);
    let unknown = ErrorKind::Reserved { element: "representation_kind", value: kind.into() };
    let representation = Representation::from_codes(kind, layer);
    let representation = representation.ok_or(Error::new(at, CONFIGURATION, unknown))?;
    let refinement = body.u8("refinement", CONFIGURATION)?;
    let refinements = body.u8("refinement_count", CONFIGURATION)?;
    let (value, max) = (refinements.into(), MAX_REFINEMENTS.into());
    let range = ErrorKind::OutOfRange { element: "refinement_count", value, min: 1, max };
    if !(1..=MAX_REFINEMENTS).contains(&refinements) {
        return Err(Error::new(body.at().saturating_sub(1), CONFIGURATION, range));
    }
    let head = Part { bytes: body.rest(), at: body.at() };
    Ok(Configuration { representation, refinement, refinements, head })
}

/// The sequence parameters among the units of `gssC`, which are all the stream has before its first GOP.
pub(crate) fn sequence(head: &[u8], at: u64) -> Result<SequenceParameters> {
    let in_file = |error: Error| Error { at: error.at.saturating_add(at), ..error };
    let stream = Stream::open(head, &Limits::default()).map_err(in_file)?;
    let profile = stream.header().profile();
    let missing = Error::new(length_of(head), CONFIGURATION, ErrorKind::Truncated { element: "unit_header" });
    for unit in stream.units() {
        let unit = unit.map_err(in_file)?;
        if unit.header.unit_type() == UnitType::SequenceParameters {
            return SequenceParameters::parse_payload(unit.payload, unit.payload_at, profile)
                .map_err(in_file);
        }
    }
    Err(in_file(missing))
}

/// C.5.1: a `traf` of the `moof` at an offset, in a file of so many tracks.
fn fragment(found: Box<'_>, moof: u64, tracks: usize) -> Result<Fragment> {
    let mut header = found.body.find(*b"tfhd", "tfhd", FRAGMENT)?;
    let (_, options) = header.version("tfhd", FRAGMENT)?;
    let rule = |at, rule| Error::new(at, FRAGMENT, ErrorKind::Constraint { rule });
    if options & flags::DEFAULT_BASE_IS_MOOF == 0 {
        return Err(rule(header.at(), "tfhd has default-base-is-moof"));
    }
    let at = header.at();
    let id = header.u32("track_ID", FRAGMENT)?;
    let index = usize::try_from(id).ok().and_then(|id| id.checked_sub(1)).filter(|&index| index < tracks);
    let unknown = Error::new(at, FRAGMENT, ErrorKind::Undefined { element: "track_ID", id: id.into() });
    let track = index.ok_or(unknown)?;
    for (option, size) in flags::TFHD_OPTIONS {
        if options & option != 0 {
            header.bytes(size, "tfhd", FRAGMENT)?;
        }
    }
    let mut time = found.body.find(*b"tfdt", "tfdt", FRAGMENT)?;
    let (version, _) = time.version("tfdt", FRAGMENT)?;
    let time = time.number(if version == 1 { 8 } else { 4 }, "baseMediaDecodeTime", FRAGMENT)?;
    let mut fragment = Fragment { track, time, data: 0, entries: Vec::new() };
    if options & flags::DURATION_IS_EMPTY == 0 {
        run(found.body.find(*b"trun", "trun", FRAGMENT)?, moof, &mut fragment)?;
    }
    Ok(fragment)
}

/// A `trun` that says duration and size of every sample: so its length bounds their number.
fn run(mut body: Cursor<'_>, moof: u64, fragment: &mut Fragment) -> Result<()> {
    let at = body.at();
    let (_, options) = body.version("trun", FRAGMENT)?;
    let needed = flags::DATA_OFFSET | flags::SAMPLE_DURATION | flags::SAMPLE_SIZE;
    if options & needed != needed {
        let rule = "trun has data-offset-present, sample-duration-present and sample-size-present";
        return Err(Error::new(at, FRAGMENT, ErrorKind::Constraint { rule }));
    }
    let count = body.u32("sample_count", FRAGMENT)?;
    let offset = body.u32("data_offset", FRAGMENT)?;
    if options & flags::FIRST_SAMPLE_FLAGS != 0 {
        body.u32("first_sample_flags", FRAGMENT)?;
    }
    let negative = ErrorKind::OutOfRange {
        element: "data_offset",
        value: i64::from(offset.cast_signed()),
        min: 0,
        max: i64::from(i32::MAX),
    };
    if offset.cast_signed() < 0 {
        return Err(Error::new(at.saturating_add(8), FRAGMENT, negative));
    }
    fragment.data = moof.saturating_add(offset.into());
    for _ in 0..count {
        let duration = body.u32("sample_duration", FRAGMENT)?;
        let size = body.u32("sample_size", FRAGMENT)?;
        for option in [flags::SAMPLE_FLAGS, flags::COMPOSITION_OFFSET] {
            if options & option != 0 {
                body.u32("trun", FRAGMENT)?;
            }
        }
        fragment.entries.push((duration, size));
    }
    Ok(())
}

fn version_0(body: &mut Cursor<'_>, element: &'static str, clause: &'static str) -> Result<()> {
    let at = body.at();
    match body.version(element, clause)? {
        (0, _) => Ok(()),
        (version, _) => Err(Error::new(at, clause, ErrorKind::Reserved { element, value: version.into() })),
    }
}

fn slice(bytes: &[u8], at: u64, size: u32) -> Result<&[u8]> {
    let part = usize::try_from(at).ok().and_then(|start| {
        let size = usize::try_from(size).ok()?;
        bytes.get(start..start.checked_add(size)?)
    });
    part.ok_or(Error::new(at, FRAGMENT, ErrorKind::Truncated { element: "mdat" }))
}

fn length_of(bytes: &[u8]) -> u64 {
    u64::try_from(bytes.len()).unwrap_or(u64::MAX)
}
