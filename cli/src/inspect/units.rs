//! One line a unit.

use super::{Shown, span};
use crate::console::Console;
use crate::failure::StreamFault;
use crate::stream_file::StreamFile;
use crate::table::Table;
use serde::Serialize;
use splatstream_format::syntax::UnitHeader;
use splatstream_format::unit::{Delivery, Stream};
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
    let mut units = match Stream::open(&stream.bytes, limits) {
        Ok(opened) => opened.units(),
        Err(error) => return Some(error),
    };
    let mut first = None;
    while let Some(delivery) = units.next_unit() {
        match delivery {
            Ok(Delivery::Intact(unit)) => lines.push(Line::new(lines.len(), unit.at, &unit.header, false)),
            Ok(Delivery::Damaged(unit)) => {
                lines.push(Line::new(lines.len(), unit.at, &unit.header, true));
                first = first.or(Some(unit.error));
            }
            Err(error) => first = first.or(Some(error)),
        }
    }
    first
}

impl Line {
    fn new(unit: usize, at: u64, header: &UnitHeader, damaged: bool) -> Self {
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
            damaged,
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
                if line.damaged { "damaged".to_owned() } else { String::new() },
            ]);
        }
        let mut text = table.text();
        if let Some(error) = &self.error {
            text += &format!("the first error is at {error}\n");
        }
        text
    }
}
