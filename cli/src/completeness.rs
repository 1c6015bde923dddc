//! How far a stream that breaks off is complete, operating point by operating point.

use crate::numbers::grouped;
use crate::structure::{Frame, Group, LayerUnit, Structure, UnitPlace};
use serde::Serialize;
use splatstream_decoder::operating_point::{OperatingPoint, all_points};
use splatstream_format::{Error, Limits};

/// What a stream holds of an operating point before it breaks off.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(crate) struct Complete {
    /// The operating point.
    op: String,
    /// Frames from the first on of which every unit is there.
    frames: u32,
    /// Display index of the last of them.
    last_frame: Option<u32>,
}

/// What there is of each operating point up to `end`, the error at which decoding ended.
pub(crate) fn complete_points(bytes: &[u8], limits: &Limits, end: Error) -> Vec<Complete> {
    let structure = Structure::of(bytes, limits);
    let Some(sequence) = &structure.sequence else { return Vec::new() };
    all_points(sequence).into_iter().map(|point| complete(&structure, point, end.at)).collect()
}

/// The lines of a report: points with the same frames share one.
pub(crate) fn text(points: &[Complete]) -> String {
    let same = |a: &Complete, b: &Complete| (a.frames, a.last_frame) == (b.frames, b.last_frame);
    let mut text = String::new();
    for (place, run) in points.chunk_by(same).enumerate() {
        let (Some(first), Some(last)) = (run.first(), run.last()) else { continue };
        let span = if run.len() > 1 { format!("{} to {}", first.op, last.op) } else { first.op.clone() };
        let label = if place == 0 { "complete" } else { "" };
        let frames = match first.last_frame {
            Some(last) => {
                let plural = if first.frames == 1 { "" } else { "s" };
                format!("{} frame{plural}, up to frame {last}", grouped(first.frames.into()))
            }
            None => "no frame".to_owned(),
        };
        text += &format!("  {label:<12} {frames}: {span}\n");
    }
    text
}

fn complete(structure: &Structure, point: OperatingPoint, end: u64) -> Complete {
    let mut complete = Complete { op: point.to_string(), frames: 0, last_frame: None };
    for group in &structure.groups {
        for frame in group.frames.iter().filter(|frame| structure.belongs(frame, point)) {
            if !is_whole(structure, group, frame, point, end) {
                return complete;
            }
            complete.frames = complete.frames.saturating_add(1);
            complete.last_frame = Some(frame.number);
        }
    }
    complete
}

/// Whether every unit that a frame has, or may have, at an operating point is there.
fn is_whole(structure: &Structure, group: &Group, frame: &Frame, point: OperatingPoint, end: u64) -> bool {
    let is_there = |unit: &UnitPlace| !unit.damaged && unit.end() <= end;
    let layers = |unit: &LayerUnit| (unit.header.spatial_layer, unit.header.refinement);
    let present: Vec<(u8, u8)> =
        frame.units.iter().filter(|unit| is_there(&unit.place)).map(layers).collect();
    // Behind a frame that has not ended there may have been more.
    let possible: Vec<(u8, u8)> = match frame.ended {
        true => frame.units.iter().map(layers).collect(),
        false => structure.possible_units(frame),
    };
    let mut needed = possible.into_iter().filter(|&unit| structure.takes(point, group, frame, unit));
    is_there(&frame.place) && needed.all(|unit| present.contains(&unit))
}
