//! Where the bits of a stream go, per Gaussian: what `inspect --stats` prints and `chart` draws.

use crate::numbers::{bits_per_gaussian, percent};
use crate::statistics::{FrameTypeCost, SectionCost, Statistics, UnitCost, stream_statistics};
use serde::Serialize;
use splatstream_format::Limits;
use splatstream_format::entropy::layout::Attribute;

/// What a stream spends on what.
#[derive(Debug, Clone, Serialize)]
pub struct Costs {
    /// Bytes.
    pub bytes: u64,
    /// Gaussians over all frames.
    pub gaussians: u64,
    /// Bits per Gaussian.
    pub bpg: f64,
    /// By attribute, in coding order.
    pub attributes: Vec<OfAttribute>,
    /// By section and attribute, in coding order.
    pub sections: Vec<OfSection>,
    /// By type of frame.
    pub frame_types: Vec<OfFrames>,
    /// By kind of unit, in order of first appearance.
    pub units: Vec<OfUnits>,
}

/// Bits per Gaussian of one attribute.
#[derive(Debug, Clone, Serialize)]
pub struct OfAttribute {
    /// The attribute.
    pub attribute: &'static str,
    /// Of symbols.
    pub symbols_bpg: f64,
    /// Of plane models.
    pub models_bpg: f64,
    /// Bits per Gaussian.
    pub bpg: f64,
}

/// Bits of one attribute in one section.
#[derive(Debug, Clone, Serialize)]
pub struct OfSection {
    /// The section.
    pub section: &'static str,
    /// Cells, parents, predictors or Gaussians that it codes.
    pub entries: u64,
    /// Bits per entry.
    pub bits_per_entry: f64,
    /// Of all Gaussians of the stream.
    #[serde(flatten)]
    pub cost: OfAttribute,
}

/// What frames of one type cost.
#[derive(Debug, Clone, Serialize)]
pub struct OfFrames {
    /// I, P or B.
    #[serde(rename = "type")]
    pub kind: &'static str,
    /// How many.
    pub frames: u32,
    /// Bytes of their units.
    pub bytes: u64,
    /// Their Gaussians.
    pub gaussians: u64,
    /// Share of the stream.
    pub percent: f64,
    /// Bits per Gaussian of these frames.
    pub bpg: f64,
}

/// Bytes of one kind of unit.
#[derive(Debug, Clone, Serialize)]
pub struct OfUnits {
    /// The kind.
    #[serde(rename = "type")]
    pub kind: &'static str,
    /// How many.
    pub units: u32,
    /// Bytes.
    pub bytes: u64,
    /// Share of the stream.
    pub percent: f64,
    /// Bits per Gaussian.
    pub bpg: f64,
}

impl Costs {
    /// Adds up the costs of a stream.
    ///
    /// # Errors
    /// As decoding, digests not verified.
    pub fn of(stream: &[u8], limits: &Limits) -> splatstream_format::Result<Self> {
        stream_statistics(stream, limits).map(|statistics| Self::new(&statistics))
    }

    fn new(statistics: &Statistics) -> Self {
        let gaussians = statistics.gaussians;
        let units = |cost: &UnitCost| OfUnits {
            kind: cost.unit_type.name(),
            units: cost.units,
            bytes: cost.bytes,
            percent: percent(cost.bytes, statistics.bytes),
            bpg: bits_per_gaussian(cost.bytes, gaussians),
        };
        let frames = |cost: &FrameTypeCost| OfFrames {
            kind: cost.frame_type.name(),
            frames: cost.frames,
            bytes: cost.bytes,
            gaussians: cost.gaussians,
            percent: percent(cost.bytes, statistics.bytes),
            bpg: bits_per_gaussian(cost.bytes, cost.gaussians),
        };
        Self {
            bytes: statistics.bytes,
            gaussians,
            bpg: bits_per_gaussian(statistics.bytes, gaussians),
            attributes: attributes(statistics),
            sections: statistics.sections.iter().map(|cost| OfSection::new(cost, gaussians)).collect(),
            frame_types: statistics.frame_types.iter().map(frames).collect(),
            units: statistics.units.iter().map(units).collect(),
        }
    }
}

/// Each attribute over all sections: those of a Gaussian, and what else occurs.
fn attributes(statistics: &Statistics) -> Vec<OfAttribute> {
    let is_of_gaussian = |attribute: Attribute| attribute <= Attribute::Sh;
    let mut rows = Vec::new();
    for attribute in Attribute::ALL {
        let parts: Vec<&SectionCost> =
            statistics.sections.iter().filter(|cost| cost.attribute == attribute).collect();
        if parts.is_empty() && !is_of_gaussian(attribute) {
            continue;
        }
        // The sum of nothing is the negative zero; nobody wants to read that.
        let symbols = parts.iter().map(|cost| cost.symbol_bits).sum::<f64>() + 0.0;
        let models = parts.iter().map(|cost| cost.model_bits).sum::<u64>() as f64;
        rows.push(OfAttribute::new(attribute, symbols, models, statistics.gaussians));
    }
    rows
}

impl OfAttribute {
    fn new(attribute: Attribute, symbols: f64, models: f64, gaussians: u64) -> Self {
        let of_one = |bits: f64| bits / gaussians.max(1) as f64;
        let (symbols_bpg, models_bpg) = (of_one(symbols), of_one(models));
        Self { attribute: attribute.name(), symbols_bpg, models_bpg, bpg: symbols_bpg + models_bpg }
    }
}

impl OfSection {
    fn new(cost: &SectionCost, gaussians: u64) -> Self {
        let models = cost.model_bits as f64;
        Self {
            section: cost.section.name(),
            entries: cost.entries,
            bits_per_entry: (cost.symbol_bits + models) / cost.entries.max(1) as f64,
            cost: OfAttribute::new(cost.attribute, cost.symbol_bits, models, gaussians),
        }
    }
}
