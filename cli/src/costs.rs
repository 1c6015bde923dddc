//! Where the bits of a stream go, per Gaussian: what `inspect --stats` prints and `chart` draws.

use crate::numbers::{bits_per_gaussian, percent};
use crate::statistics::{AttributeCost, Statistics, UnitCost, stream_statistics};
use serde::Serialize;
use splatstream_format::Limits;

/// What a stream spends on what.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Costs {
    /// Bytes.
    pub(crate) bytes: u64,
    /// Gaussians over all frames.
    pub(crate) gaussians: u64,
    /// Bits a Gaussian.
    pub(crate) bpg: f64,
    /// By attribute, in coding order.
    pub(crate) attributes: Vec<OfAttribute>,
    /// By kind of unit, in order of first appearance.
    pub(crate) units: Vec<OfUnits>,
}

/// Bits a Gaussian of one attribute.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct OfAttribute {
    /// The attribute.
    pub(crate) attribute: &'static str,
    /// Of symbols.
    pub(crate) symbols_bpg: f64,
    /// Of plane models.
    pub(crate) models_bpg: f64,
    /// Bits a Gaussian.
    pub(crate) bpg: f64,
}

/// Bytes of one kind of unit.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct OfUnits {
    /// The kind.
    #[serde(rename = "type")]
    pub(crate) kind: &'static str,
    /// How many.
    pub(crate) units: u32,
    /// Bytes.
    pub(crate) bytes: u64,
    /// Share of the stream.
    pub(crate) percent: f64,
    /// Bits a Gaussian.
    pub(crate) bpg: f64,
}

impl Costs {
    /// Adds up the costs of a stream.
    ///
    /// # Errors
    /// As decoding, digests not verified.
    pub(crate) fn of(stream: &[u8], limits: &Limits) -> splatstream_format::Result<Self> {
        stream_statistics(stream, limits).map(|statistics| Self::new(&statistics))
    }

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
}
