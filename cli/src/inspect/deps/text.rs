//! Dependencies as an indented list.

use super::{Dependencies, FrameRow, GopRow, Need, ToolRow, UnitRow};
use splatstream_chart::numbers::grouped;

/// Every GOP with its frames and units.
pub(super) fn list(dependencies: &Dependencies) -> String {
    let mut text: String = dependencies.gops.iter().map(gop).collect();
    if let Some(error) = &dependencies.error {
        text += &format!("the first error is at {error}\n");
    }
    text
}

fn gop(row: &GopRow) -> String {
    let structure = match (row.predicted, row.temporal_depth) {
        (false, _) => "every frame by itself".to_owned(),
        (true, depth) => format!("predicted, temporal depth {depth}"),
    };
    let last = row.first_frame.saturating_add(row.frame_count.saturating_sub(1));
    let mut text = format!(
        "GOP {}  unit {} at {:#x}: frames {}..={last}, {structure}\n",
        row.gop, row.unit, row.at, row.first_frame
    );
    let mut tools = row.tools.iter().peekable();
    for (before, of_frame) in row.frames.iter().enumerate() {
        while let Some(it) = tools.next_if(|tool| tool.frames_before == before) {
            text += &tool(it);
        }
        text += &frame(of_frame);
    }
    tools.for_each(|it| text += &tool(it));
    text
}

fn tool(row: &ToolRow) -> String {
    let damaged = if row.damaged { "  damaged" } else { "" };
    let (kind, bytes) = (row.kind, grouped(row.bytes));
    format!("  unit {} {kind}  t{}  {bytes} bytes{damaged}\n", row.unit, row.temporal_layer)
}

fn frame(row: &FrameRow) -> String {
    let reference = match (row.reference, row.reference_present) {
        (Some(number), Some(false)) => format!("refers to frame {number}, which is absent"),
        (Some(number), _) => format!("refers to frame {number}"),
        (None, _) => "refers to no frame".to_owned(),
    };
    let damaged = if row.damaged { "  damaged" } else { "" };
    let mut text = format!(
        "  frame {}  {}  t{}  unit {}  {reference}{damaged}\n",
        row.frame, row.kind, row.temporal_layer, row.unit
    );
    row.units.iter().for_each(|it| text += &unit(row.frame, it));
    text
}

fn unit(frame: u32, row: &UnitRow) -> String {
    let mut needs: Vec<String> = row.needs.iter().map(|it| need(frame, it)).collect();
    needs.extend(row.codebooks.iter().map(|unit| format!("codebook unit {unit}")));
    needs.extend(row.weights.iter().map(|unit| format!("weights unit {unit}")));
    let needs = if needs.is_empty() { "nothing".to_owned() } else { needs.join(", ") };
    let damaged = if row.damaged { "  damaged" } else { "" };
    let (layer, refinement, bytes) = (row.spatial_layer, row.refinement, grouped(row.bytes));
    format!("    unit {}  s{layer},r{refinement}  {bytes} bytes  needs {needs}{damaged}\n", row.unit)
}

/// A unit that is needed; the frame is named if it is another one.
fn need(frame: u32, row: &Need) -> String {
    let (layer, refinement) = (row.spatial_layer, row.refinement);
    let unit = match row.unit {
        Some(unit) => format!("unit {unit}"),
        None => "absent".to_owned(),
    };
    let other = if row.frame == frame { String::new() } else { format!("frame {} ", row.frame) };
    format!("{other}s{layer},r{refinement} ({unit})")
}
