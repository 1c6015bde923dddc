//! What each attribute and each kind of unit costs.

use super::Shown;
use crate::console::Console;
use crate::costs::Costs;
use crate::numbers::grouped;
use crate::stream_file::StreamFile;
use crate::table::Table;
use splatstream_format::Limits;

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
    let mut attributes = Table::new(["attribute", "bits a Gaussian", "symbols", "models"]);
    for cost in &costs.attributes {
        let bits = [cost.bpg, cost.symbols_bpg, cost.models_bpg].map(|bits| format!("{bits:.3}"));
        let [all, symbols, models] = bits;
        attributes.row([cost.attribute.to_owned(), all, symbols, models]);
    }
    let mut units = Table::new(["unit", "units", "bytes", "%", "bits a Gaussian"]);
    for cost in &costs.units {
        units.row([
            cost.kind.to_owned(),
            grouped(cost.units.into()),
            grouped(cost.bytes),
            format!("{:.2}", cost.percent),
            format!("{:.3}", cost.bpg),
        ]);
    }
    let (bytes, gaussians, bpg) = (grouped(costs.bytes), grouped(costs.gaussians), costs.bpg);
    format!(
        "{bytes} bytes, {gaussians} Gaussians, {bpg:.2} bits a Gaussian\n\n{}\n{}",
        attributes.text(),
        units.text()
    )
}
