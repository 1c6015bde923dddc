//! What each attribute and each kind of unit costs.

use super::Shown;
use crate::console::Console;
use crate::numbers::counted;
use crate::stream_file::StreamFile;
use splatstream_chart::costs::{Costs, OfAttribute};
use splatstream_chart::numbers::grouped;
use splatstream_chart::table::Table;
use splatstream_format::Limits;
use splatstream_format::entropy::layout::Section;

/// Shows where the bits go.
pub(super) fn show(stream: &StreamFile, limits: &Limits, console: &Console) -> Shown {
    let costs = match Costs::of(&stream.bytes, limits) {
        Ok(costs) => costs,
        Err(error) => return Ok(Some(error)),
    };
    console.report(&costs, || text(&costs))?;
    Ok(None)
}

fn text(costs: &Costs) -> String {
    let (bytes, gaussians) = (counted(costs.bytes, "byte"), counted(costs.gaussians, "Gaussian"));
    let bpg = costs.bpg;
    let mut parts = vec![format!("{bytes}, {gaussians}, {bpg:.2} bits per Gaussian\n")];
    parts.push(attributes(costs));
    if costs.sections.iter().any(|part| part.section != Section::New.name()) {
        parts.push(sections(costs));
    }
    if costs.frame_types.len() > 1 {
        parts.push(frame_types(costs));
    }
    parts.push(units(costs));
    parts.join("\n")
}

fn attributes(costs: &Costs) -> String {
    let mut table = Table::new(["attribute", "bits per Gaussian", "symbols", "models"]);
    for cost in &costs.attributes {
        let [all, symbols, models] = bits(cost);
        table.row([cost.attribute.to_owned(), all, symbols, models]);
    }
    table.text()
}

fn sections(costs: &Costs) -> String {
    let headings =
        ["section", "attribute", "entries", "bits per entry", "bits per Gaussian", "symbols", "models"];
    let mut table = Table::new(headings);
    for part in &costs.sections {
        let [all, symbols, models] = bits(&part.cost);
        table.row([
            part.section.to_owned(),
            part.cost.attribute.to_owned(),
            grouped(part.entries),
            format!("{:.3}", part.bits_per_entry),
            all,
            symbols,
            models,
        ]);
    }
    table.text()
}

fn frame_types(costs: &Costs) -> String {
    let mut table = Table::new(["frame type", "frames", "bytes", "%", "Gaussians", "bits per Gaussian"]);
    for cost in &costs.frame_types {
        table.row([
            cost.kind.to_owned(),
            grouped(cost.frames.into()),
            grouped(cost.bytes),
            format!("{:.2}", cost.percent),
            grouped(cost.gaussians),
            format!("{:.3}", cost.bpg),
        ]);
    }
    table.text()
}

fn units(costs: &Costs) -> String {
    let mut table = Table::new(["unit", "units", "bytes", "%", "bits per Gaussian"]);
    for cost in &costs.units {
        table.row([
            cost.kind.to_owned(),
            grouped(cost.units.into()),
            grouped(cost.bytes),
            format!("{:.2}", cost.percent),
            format!("{:.3}", cost.bpg),
        ]);
    }
    table.text()
}

fn bits(cost: &OfAttribute) -> [String; 3] {
    [cost.bpg, cost.symbols_bpg, cost.models_bpg].map(|bits| format!("{bits:.3}"))
}
