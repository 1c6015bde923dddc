//! What each attribute and each kind of unit costs.

use super::Shown;
use super::statistics::{AttributeCost, Statistics, UnitCost, stream_statistics};
use crate::console::Console;
use crate::numbers::{bits_per_gaussian, grouped, percent};
use crate::stream_file::StreamFile;
use crate::table::Table;
use serde::Serialize;
use splatstream_format::Limits;

/// What `--json` prints.
#[derive(Serialize)]
struct Costs {
    bytes: u64,
    gaussians: u64,
    bpg: f64,
    attributes: Vec<OfAttribute>,
    units: Vec<OfUnits>,
}

/// Bits a Gaussian.
#[derive(Serialize)]
struct OfAttribute {
    attribute: &'static str,
    symbols_bpg: f64,
    models_bpg: f64,
    bpg: f64,
}

#[derive(Serialize)]
struct OfUnits {
    #[serde(rename = "type")]
    kind: &'static str,
    units: u32,
    bytes: u64,
    percent: f64,
    bpg: f64,
}

/// Shows where the bits go.
pub(super) fn show(stream: &StreamFile, limits: &Limits, console: &Console) -> Shown {
    let costs = match stream_statistics(&stream.bytes, limits) {
        Ok(statistics) => Costs::new(&statistics),
        Err(error) => return Ok(Some(error)),
    };
    console.report(&costs, || costs.text())?;
    Ok(None)
}

impl Costs {
    fn new(statistics: &Statistics) -> Self {
        let gaussians = statistics.gaussians;
        let attribute = |cost: &AttributeCost| {
            let of_one = |bits: f64| bits / gaussians.max(1) as f64;
            let (symbols_bpg, models_bpg) = (of_one(cost.symbol_bits), of_one(cost.model_bits as f64));
            let bpg = symbols_bpg + models_bpg;
            OfAttribute { attribute: cost.attribute.name(), symbols_bpg, models_bpg, bpg }
        };
        let units = |cost: &UnitCost| OfUnits {
            kind: cost.unit_type.name(),
            units: cost.units,
            bytes: cost.bytes,
            percent: percent(cost.bytes, statistics.bytes),
            bpg: bits_per_gaussian(cost.bytes, gaussians),
        };
        Self {
            bytes: statistics.bytes,
            gaussians,
            bpg: bits_per_gaussian(statistics.bytes, gaussians),
            attributes: statistics.attributes.iter().map(attribute).collect(),
            units: statistics.units.iter().map(units).collect(),
        }
    }

    fn text(&self) -> String {
        let mut attributes = Table::new(["attribute", "bits a Gaussian", "symbols", "models"]);
        for cost in &self.attributes {
            let bits = [cost.bpg, cost.symbols_bpg, cost.models_bpg].map(|bits| format!("{bits:.3}"));
            let [all, symbols, models] = bits;
            attributes.row([cost.attribute.to_owned(), all, symbols, models]);
        }
        let mut units = Table::new(["unit", "units", "bytes", "%", "bits a Gaussian"]);
        for cost in &self.units {
            units.row([
                cost.kind.to_owned(),
                grouped(cost.units.into()),
                grouped(cost.bytes),
                format!("{:.2}", cost.percent),
                format!("{:.3}", cost.bpg),
            ]);
        }
        let (bytes, gaussians, bpg) = (grouped(self.bytes), grouped(self.gaussians), self.bpg);
        format!(
            "{bytes} bytes, {gaussians} Gaussians, {bpg:.2} bits a Gaussian\n\n{}\n{}",
            attributes.text(),
            units.text()
        )
    }
}
