//! Dependencies in the language of Graphviz: an arrow goes from a unit to one that it needs.

use super::{Dependencies, FrameRow, GopRow};

/// The graph; a GOP is a box with a box for each frame.
pub(super) fn graph(dependencies: &Dependencies) -> String {
    let mut text = String::from("digraph splatstream {\n  rankdir = RL;\n  node [shape = box];\n");
    dependencies.gops.iter().for_each(|row| text += &gop(row));
    text += "}\n";
    text
}

fn gop(row: &GopRow) -> String {
    let number = row.gop;
    let mut text =
        format!("  subgraph cluster_gop_{number} {{\n    label = \"GOP {number}, unit {}\";\n", row.unit);
    for tool in &row.tools {
        text += &format!(
            "    u{} [label = \"{}, t{}\\nunit {}\", shape = ellipse];\n",
            tool.unit, tool.kind, tool.temporal_layer, tool.unit
        );
    }
    row.frames.iter().for_each(|it| text += &frame(it));
    text += "  }\n";
    row.frames.iter().for_each(|it| text += &edges(it));
    text
}

fn frame(row: &FrameRow) -> String {
    let number = row.frame;
    let mut text = format!(
        "    subgraph cluster_frame_{number} {{\n      label = \"frame {number}: {}, t{}\";\n      \
         u{} [label = \"frame_header\\nunit {}\"];\n",
        row.kind, row.temporal_layer, row.unit, row.unit
    );
    for unit in &row.units {
        let colour = if unit.damaged { ", color = red" } else { "" };
        text += &format!(
            "      u{} [label = \"s{},r{}\\nunit {}\"{colour}];\n",
            unit.unit, unit.spatial_layer, unit.refinement, unit.unit
        );
    }
    text + "    }\n"
}

fn edges(row: &FrameRow) -> String {
    let edge = |from: usize, to: usize| format!("  u{from} -> u{to};\n");
    let mut text: String = row.transforms.iter().map(|&unit| edge(row.unit, unit)).collect();
    for (index, unit) in row.units.iter().enumerate() {
        // The header of the frame is needed by all of its units; the others need the first.
        if index == 0 {
            text += &edge(unit.unit, row.unit);
        }
        text.extend(unit.needs.iter().filter_map(|need| Some(edge(unit.unit, need.unit?))));
        text.extend(unit.codebooks.iter().chain(&unit.weights).map(|&tool| edge(unit.unit, tool)));
    }
    text
}
