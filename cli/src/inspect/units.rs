//! One line per unit.

use super::tree::go_on_if;
use super::{Shown, span};
use crate::console::Console;
use crate::failure::{Failure, StreamFault};
use crate::stream_file::{feed, open_pieces};
use serde::ser::{SerializeSeq, SerializeStruct};
use serde::{Serialize, Serializer};
use splatstream_chart::numbers::grouped;
use splatstream_chart::table::Table;
use splatstream_format::entropy::layout::Section;
use splatstream_format::follower::{Content, Follower, Standing};
use splatstream_format::payload::FramePayload;
use splatstream_format::syntax::{FrameType, IncrementHeader, Profile, UnitHeader, UnitType};
use splatstream_format::unit::{Landmark, Unit};
use splatstream_format::unit_reader::{Event, UnitReader};
use splatstream_format::{Error, Limits};
use std::cell::RefCell;
use std::io::{self, Read, Write};
use std::ops::ControlFlow;
use std::path::Path;

/// What `--json` prints: `units`, `error`.
struct Listing<'a> {
    limits: &'a Limits,
    /// Taken when the units are listed.
    reader: RefCell<Box<dyn Read>>,
    /// The first error, and why not everything could be read, once they have been.
    listed: RefCell<(Option<Error>, Option<io::Error>)>,
}

/// The lines, written as they are made.
struct Lines<'a>(&'a Listing<'a>);

#[derive(Serialize)]
struct Line {
    unit: usize,
    #[serde(rename = "type")]
    kind: &'static str,
    at: u64,
    bytes: u64,
    frame: u32,
    spatial_layer: u8,
    temporal_layer: u8,
    refinement: u8,
    critical: bool,
    damaged: bool,
    /// Of a frame and its increments.
    frame_type: Option<&'static str>,
    /// Of a frame_header: cells that move or are stale.
    cells: Option<u32>,
    /// Of an increment.
    increment: Option<Counts>,
}

/// What an increment does, from the elements before its sections.
#[derive(Serialize)]
struct Counts {
    parents: u32,
    moves: u32,
    updates: u32,
    removed: u32,
    new: u32,
    sections: Vec<&'static str>,
}

/// What lines need of the units before.
struct Context {
    follower: Follower,
    limits: Limits,
    frame_type: Option<FrameType>,
    /// Lines so far, and the first error.
    count: usize,
    first: Option<Error>,
}

/// Lists the units.
pub(super) fn show(path: &Path, limits: &Limits, console: &Console) -> Shown {
    let listing = Listing { limits, reader: RefCell::new(open_pieces(path)?), listed: RefCell::default() };
    console.stream(&listing, |out| listing.write(out))?;
    match listing.listed.take() {
        (_, Some(failed)) => Err(Failure::file("read", path, &failed)),
        (error, None) => Ok(error),
    }
}

impl Serialize for Listing<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut listing = serializer.serialize_struct("Listing", 2)?;
        listing.serialize_field("units", &Lines(self))?;
        listing.serialize_field("error", &self.listed.borrow().0.map(StreamFault::from))?;
        listing.end()
    }
}

impl Serialize for Lines<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut lines = serializer.serialize_seq(None)?;
        let mut written = Ok(());
        self.0.list(&mut |line| {
            written = lines.serialize_element(&line);
            go_on_if(written.is_ok())
        });
        written?;
        lines.end()
    }
}

impl Listing<'_> {
    /// Visits a line per unit. Where the end of a unit is not known it goes on at the next intact gop_header.
    fn list(&self, visit: &mut dyn FnMut(Line) -> ControlFlow<()>) {
        let mut units = UnitReader::new(self.limits);
        let mut context = Context::new(self.limits);
        let fed = feed(&mut **self.reader.borrow_mut(), &mut |bytes, is_end| {
            context.read(&mut units, bytes, is_end, visit).then(|| units.position())
        });
        self.listed.replace((context.first, fed.err()));
    }

    /// The table for people.
    fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        let mut table = Table::new(["unit", "type", "bytes at", "bytes", "frame", "layer", "refinement", ""]);
        self.list(&mut |line| {
            table.row(line.cells());
            ControlFlow::Continue(())
        });
        out.write_all(table.text().as_bytes())?;
        match self.listed.borrow().0 {
            Some(error) => writeln!(out, "the first error is at {}", StreamFault::from(error)),
            None => Ok(()),
        }
    }
}

impl Line {
    fn new(unit: usize, at: u64, header: &UnitHeader) -> Self {
        Self {
            unit,
            kind: header.unit_type().name(),
            at,
            bytes: UnitHeader::SIZE as u64 + u64::from(header.payload_length),
            frame: header.frame,
            spatial_layer: header.spatial_layer,
            temporal_layer: header.temporal_layer,
            refinement: header.refinement,
            critical: header.is_critical(),
            damaged: false,
            frame_type: None,
            cells: None,
            increment: None,
        }
    }

    /// The cells of its row.
    fn cells(&self) -> [String; 8] {
        [
            self.unit.to_string(),
            self.kind.to_owned(),
            span(self.at, self.bytes),
            self.bytes.to_string(),
            self.frame.to_string(),
            format!("s{},t{}", self.spatial_layer, self.temporal_layer),
            self.refinement.to_string(),
            self.note(),
        ]
    }

    /// What stands after the columns.
    fn note(&self) -> String {
        if self.damaged {
            return "damaged".to_owned();
        }
        let frame_type = self.frame_type.unwrap_or("?");
        let Some(counts) = &self.increment else {
            let cells = self.cells.map(|cells| format!("{frame_type}: {} cells", grouped(cells.into())));
            return cells.unwrap_or_default();
        };
        let named = [
            ("parents", counts.parents),
            ("moved", counts.moves),
            ("updated", counts.updates),
            ("removed", counts.removed),
            ("new", counts.new),
        ];
        let parts: Vec<String> = named
            .into_iter()
            .filter(|(_, count)| *count > 0)
            .map(|(name, count)| format!("{} {name}", grouped(count.into())))
            .collect();
        format!("{frame_type}: {}", if parts.is_empty() { "nothing".to_owned() } else { parts.join(", ") })
    }
}

impl Context {
    fn new(limits: &Limits) -> Self {
        let follower = Follower::new(Profile::Dynamic);
        Self { follower, limits: *limits, frame_type: None, count: 0, first: None }
    }

    /// The lines of the units that are there as a whole; whether more may come. `bytes` are those from where the reader
    /// has come to on.
    fn read(
        &mut self,
        units: &mut UnitReader,
        bytes: &[u8],
        is_end: bool,
        visit: &mut dyn FnMut(Line) -> ControlFlow<()>,
    ) -> bool {
        let start = units.position();
        loop {
            let taken = usize::try_from(units.position() - start).unwrap_or(usize::MAX);
            match units.read(bytes.get(taken..).unwrap_or_default(), is_end) {
                Ok(Event::FileHeader(header)) => self.follower = Follower::new(header.profile()),
                Ok(Event::Unit(unit)) if visit(self.line(&unit)).is_break() => return false,
                Ok(Event::Unit(_)) => {}
                Ok(Event::NeedMoreData(_)) => return true,
                Ok(_) => return false,
                Err(error) => {
                    self.first = self.first.or(Some(error));
                    units.scan_for(Landmark::GopHeader);
                }
            }
        }
    }

    /// The line of a unit.
    fn line(&mut self, unit: &Unit<'_>) -> Line {
        let mut line = Line::new(self.count, unit.at, &unit.header);
        self.count += 1;
        let standing = self.follower.take(unit);
        line.damaged = standing.is_err();
        // What decoders discard may hold anything.
        if standing != Ok(Standing::Discarded) {
            self.take(unit, &mut line);
        }
        let of_frame = matches!(unit.header.unit_type(), UnitType::FrameHeader | UnitType::Increment);
        line.frame_type = self.frame_type.filter(|_| of_frame).map(FrameType::name);
        self.first = self.first.or(standing.err());
        line
    }

    /// Takes note of what a unit that is not discarded says, and puts it into its line.
    fn take(&mut self, unit: &Unit<'_>, line: &mut Line) {
        match (unit.header.unit_type(), self.follower.sequence()) {
            (UnitType::FrameHeader, Some(sequence)) => {
                let parsed = FramePayload::parse(unit.payload, unit.payload_at, sequence, &self.limits).ok();
                let frame = parsed.filter(|_| !line.damaged);
                self.frame_type = frame.as_ref().and_then(|frame| frame.header.kind());
                line.cells = frame.and_then(|frame| Some(frame.cells?.coded.count));
            }
            (UnitType::Increment, _) if !line.damaged => {
                if let Ok(Content::Increment(header)) = self.follower.content(unit) {
                    line.increment = Some(Counts::of(&header));
                }
            }
            _ => {}
        }
    }
}

impl Counts {
    fn of(header: &IncrementHeader) -> Self {
        let present = Section::OF_INCREMENT.into_iter().filter(|&section| header.count(section) > 0);
        Self {
            parents: header.parent_count,
            moves: header.move_count,
            updates: header.update_count,
            removed: header.remove_count,
            new: header.new_count,
            sections: present.map(Section::name).collect(),
        }
    }
}
