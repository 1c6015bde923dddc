//! One line per unit.

use super::{Shown, span};
use crate::console::Console;
use crate::failure::StreamFault;
use crate::stream_file::StreamFile;
use serde::Serialize;
use splatstream_chart::numbers::grouped;
use splatstream_chart::table::Table;
use splatstream_format::entropy::layout::Section;
use splatstream_format::follower::{Content, Follower, Standing};
use splatstream_format::payload::FramePayload;
use splatstream_format::syntax::{FrameType, IncrementHeader, UnitHeader, UnitType};
use splatstream_format::unit::{Landmark, Stream, Unit};
use splatstream_format::{Error, Limits};

/// What `--json` prints.
#[derive(Serialize)]
struct Listing {
    units: Vec<Line>,
    error: Option<StreamFault>,
}

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
}

/// Lists the units.
pub(super) fn show(stream: &StreamFile, limits: &Limits, console: &Console) -> Shown {
    let mut lines = Vec::new();
    let error = list(stream, limits, &mut lines);
    let listing = Listing { units: lines, error: error.map(StreamFault::from) };
    console.report(&listing, || listing.text())?;
    Ok(error)
}

/// Adds a line per unit; gives the first error. Where the end of a unit is not known it goes on at the next intact
/// gop_header.
fn list(stream: &StreamFile, limits: &Limits, lines: &mut Vec<Line>) -> Option<Error> {
    let opened = match Stream::open(&stream.bytes, limits) {
        Ok(opened) => opened,
        Err(error) => return Some(error),
    };
    let mut context =
        Context { follower: Follower::new(opened.header().profile()), limits: *limits, frame_type: None };
    let mut units = opened.units();
    let mut first = None;
    while let Some(unit) = units.next_unit() {
        let error = match unit {
            Ok(unit) => {
                let (line, error) = context.line(lines.len(), &unit);
                lines.push(line);
                error
            }
            Err(error) => {
                units.scan_for(Landmark::GopHeader);
                Some(error)
            }
        };
        first = first.or(error);
    }
    first
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
    /// The line of a unit, and what is wrong with it.
    fn line(&mut self, number: usize, unit: &Unit<'_>) -> (Line, Option<Error>) {
        let mut line = Line::new(number, unit.at, &unit.header);
        let standing = self.follower.take(unit);
        line.damaged = standing.is_err();
        // What decoders discard may hold anything.
        if standing != Ok(Standing::Discarded) {
            self.take(unit, &mut line);
        }
        let of_frame = matches!(unit.header.unit_type(), UnitType::FrameHeader | UnitType::Increment);
        line.frame_type = self.frame_type.filter(|_| of_frame).map(FrameType::name);
        (line, standing.err())
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

impl Listing {
    fn text(&self) -> String {
        let mut table = Table::new(["unit", "type", "bytes at", "bytes", "frame", "layer", "refinement", ""]);
        for line in &self.units {
            table.row([
                line.unit.to_string(),
                line.kind.to_owned(),
                span(line.at, line.bytes),
                line.bytes.to_string(),
                line.frame.to_string(),
                format!("s{},t{}", line.spatial_layer, line.temporal_layer),
                line.refinement.to_string(),
                line.note(),
            ]);
        }
        let mut text = table.text();
        if let Some(error) = &self.error {
            text += &format!("the first error is at {error}\n");
        }
        text
    }
}
