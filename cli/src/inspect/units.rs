//! One line a unit.

use super::{Shown, span};
use crate::console::Console;
use crate::failure::StreamFault;
use crate::numbers::grouped;
use crate::stream_file::StreamFile;
use crate::table::Table;
use serde::Serialize;
use splatstream_format::entropy::layout::Section;
use splatstream_format::levels::Levels;
use splatstream_format::syntax::{
    FrameHeader, FrameType, IncrementHeader, Profile, SequenceParameters, UnitHeader, UnitType,
};
use splatstream_format::unit::{Damaged, Delivery, Stream, Unit};
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
    /// Of a frame and its units.
    frame_type: Option<&'static str>,
    /// Of an increment.
    increment: Option<Counts>,
}

/// What an increment does, from its fixed part.
#[derive(Serialize)]
struct Counts {
    parents: u32,
    cells: u32,
    moves: u32,
    updates: u32,
    removed: u32,
    new: u32,
    sections: Vec<&'static str>,
}

/// What lines need of the units before.
struct Context {
    profile: Profile,
    sequence: Option<SequenceParameters>,
    frame_type: Option<FrameType>,
    levels: Levels,
}

/// Lists the units.
pub(super) fn show(stream: &StreamFile, limits: &Limits, console: &Console) -> Shown {
    let mut lines = Vec::new();
    let error = list(stream, limits, &mut lines);
    let listing = Listing { units: lines, error: error.map(StreamFault::from) };
    console.report(&listing, || listing.text())?;
    Ok(error)
}

/// Adds a line a unit as far as units can be told apart; gives the first error.
fn list(stream: &StreamFile, limits: &Limits, lines: &mut Vec<Line>) -> Option<Error> {
    let opened = match Stream::open(&stream.bytes, limits) {
        Ok(opened) => opened,
        Err(error) => return Some(error),
    };
    let mut context = Context {
        profile: opened.header().profile(),
        sequence: None,
        frame_type: None,
        levels: Levels::default(),
    };
    let mut units = opened.units();
    let mut first = None;
    while let Some(delivery) = units.next_unit() {
        match delivery {
            Ok(Delivery::Intact(unit)) => {
                let increment = context.take(&unit);
                let line = Line::new(lines.len(), unit.at, &unit.header);
                let frame_type = context.frame_type_of(&unit.header);
                lines.push(Line { frame_type, increment, ..line });
            }
            Ok(Delivery::Damaged(Damaged { unit, error, passed_over })) => {
                if unit.header.unit_type() == UnitType::FrameHeader {
                    context.frame_type = None;
                }
                let line = Line::new(lines.len(), unit.at, &unit.header);
                let frame_type = context.frame_type_of(&unit.header);
                lines.push(Line { damaged: true, frame_type, ..line });
                first = first.or((!passed_over).then_some(error));
            }
            Err(error) => first = first.or(Some(error)),
        }
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
            increment: None,
        }
    }

    /// What stands behind the columns.
    fn note(&self) -> String {
        if self.damaged {
            return "damaged".to_owned();
        }
        let Some(counts) = &self.increment else { return String::new() };
        let named = [
            ("parents", counts.parents),
            ("cells", counts.cells),
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
        format!("{}: {}", self.frame_type.unwrap_or("?"), parts.join(", "))
    }
}

impl Context {
    /// Takes note of a unit; gives the counts of an increment.
    fn take(&mut self, unit: &Unit<'_>) -> Option<Counts> {
        let (payload, at) = (unit.payload, unit.payload_at);
        self.levels.follow(unit, self.profile);
        match unit.header.unit_type() {
            UnitType::SequenceParameters => {
                self.sequence = SequenceParameters::parse_payload(payload, at, self.profile).ok();
            }
            UnitType::FrameHeader => {
                let header = FrameHeader::parse_payload(payload, at, self.profile).ok();
                self.frame_type = header.and_then(|header| header.kind());
            }
            // What is passed over by decoders may hold anything.
            UnitType::Increment if self.profile == Profile::Dynamic && self.levels.takes(&unit.header) => {
                let (header, _) = IncrementHeader::parse(payload, at, self.sequence.as_ref()?).ok()?;
                return Some(Counts::of(&header));
            }
            _ => {}
        }
        None
    }

    fn frame_type_of(&self, header: &UnitHeader) -> Option<&'static str> {
        let unit_type = header.unit_type();
        let of_frame = unit_type == UnitType::FrameHeader || unit_type.has_refinement();
        self.frame_type.filter(|_| of_frame).map(FrameType::name)
    }
}

impl Counts {
    fn of(header: &IncrementHeader) -> Self {
        let present = Section::ALL.into_iter().filter(|&section| header.count(section) > 0);
        Self {
            parents: header.parent_count,
            cells: header.cell_count,
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
        let mut table = Table::new(["unit", "type", "place", "bytes", "frame", "layer", "refinement", ""]);
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
