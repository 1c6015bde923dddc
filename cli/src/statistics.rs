//! What each attribute of a stream costs. From decoding its symbols again.

use splatstream_decoder::block::CodedBlock;
use splatstream_decoder::context::{delta_contexts, plane_contexts};
use splatstream_decoder::gop::Gop;
use splatstream_decoder::unit::{CodedUnit, PreparedUnit};
use splatstream_format::entropy::layout::{Attribute, Layout, PlaneInfo};
use splatstream_format::entropy::model::{ModelTrace, PlaneModel};
use splatstream_format::entropy::token::{Alphabet, split, zigzag};
use splatstream_format::payload::Refinement;
use splatstream_format::syntax::{FrameHeader, GopHeader, SequenceParameters, UnitHeader, UnitType};
use splatstream_format::unit::Stream;
use splatstream_format::{Limits, Result};

/// Bits spent on one attribute over a whole stream.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct AttributeCost {
    /// The attribute.
    pub(crate) attribute: Attribute,
    /// Bits of symbols: the information of the tokens in their tables, and raw bits.
    pub(crate) symbol_bits: f64,
    /// Bits of plane models.
    pub(crate) model_bits: u64,
}

/// Bytes of one kind of unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct UnitCost {
    /// The kind.
    pub(crate) unit_type: UnitType,
    /// How many.
    pub(crate) units: u32,
    /// Bytes, headers included.
    pub(crate) bytes: u64,
}

/// What a stream spends on what.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Statistics {
    /// Gaussians over all frames.
    pub(crate) gaussians: u64,
    /// Bytes of the stream.
    pub(crate) bytes: u64,
    /// By attribute, in coding order.
    pub(crate) attributes: Vec<AttributeCost>,
    /// By kind of unit, in order of first appearance.
    pub(crate) units: Vec<UnitCost>,
}

/// Adds up the costs of a stream.
///
/// # Errors
/// As decoding, digests not verified.
pub(crate) fn stream_statistics(bytes: &[u8], limits: &Limits) -> Result<Statistics> {
    let cost = |attribute| AttributeCost { attribute, symbol_bits: 0.0, model_bits: 0 };
    let mut statistics = Statistics {
        gaussians: 0,
        bytes: u64::try_from(bytes.len()).unwrap_or(u64::MAX),
        attributes: Attribute::ALL.map(cost).to_vec(),
        units: Vec::new(),
    };
    let mut state = State::default();
    let stream = Stream::open(bytes, limits)?;
    let profile = stream.header().profile();
    for unit in stream.units() {
        let unit = unit?;
        statistics.count(&unit.header);
        match unit.header.unit_type() {
            UnitType::SequenceParameters => {
                state.sequence =
                    Some(SequenceParameters::parse_payload(unit.payload, unit.payload_at, profile)?);
            }
            UnitType::GopHeader => {
                let header = GopHeader::parse_payload(unit.payload, unit.payload_at, profile)?;
                state.gop = Some(Gop::new(header, unit.header.frame));
            }
            UnitType::FrameHeader => {
                state.frame = Some(FrameHeader::parse_payload(unit.payload, unit.payload_at, profile)?);
                state.models = None;
            }
            UnitType::Transform | UnitType::Codebook => {
                if let (Some(gop), Some(sequence)) = (&mut state.gop, &state.sequence) {
                    gop.tool(&unit, sequence, profile, limits)?;
                }
            }
            UnitType::Refinement => state.refinement(&unit, limits, &mut statistics)?,
            _ => {}
        }
    }
    Ok(statistics)
}

#[derive(Default)]
struct State {
    sequence: Option<SequenceParameters>,
    gop: Option<Gop>,
    frame: Option<FrameHeader>,
    models: Option<(Layout, Vec<PlaneModel>)>,
}

impl State {
    fn refinement(
        &mut self,
        unit: &splatstream_format::unit::Unit<'_>,
        limits: &Limits,
        statistics: &mut Statistics,
    ) -> Result<()> {
        let (Some(sequence), Some(gop), Some(frame)) = (&self.sequence, &self.gop, &self.frame) else {
            return Ok(());
        };
        let refinement = Refinement::parse(unit.payload, unit.payload_at, sequence, limits)?;
        let transforms = gop.transforms(frame, unit.payload_at)?;
        let coded = CodedUnit { refinement: &refinement, payload_at: unit.payload_at };
        let mut trace = BitsOfPlanes::default();
        let before = self.models.as_ref().map(|(layout, models)| (layout, models.as_slice()));
        let prepared = PreparedUnit::new(coded, gop, transforms, before, &mut trace)?;
        let gaussians = u64::from(refinement.header.gaussian_count);
        statistics.gaussians = statistics.gaussians.saturating_add(gaussians);
        let blocks = prepared.coded_blocks(sequence)?;
        let planes = prepared.layout.planes().iter().zip(&prepared.models).zip(&trace.bits);
        for (plane, ((&info, model), &model_bits)) in planes.enumerate() {
            let of_attribute = |cost: &&mut AttributeCost| cost.attribute == info.attribute;
            if let Some(cost) = statistics.attributes.iter_mut().find(of_attribute) {
                cost.model_bits = cost.model_bits.saturating_add(model_bits);
                cost.symbol_bits +=
                    blocks.iter().map(|block| symbol_bits(model, info, plane, block)).sum::<f64>();
            }
        }
        if !prepared.models.is_empty() {
            self.models = Some((prepared.layout.clone(), prepared.models.clone()));
        }
        Ok(())
    }
}

impl Statistics {
    fn count(&mut self, header: &UnitHeader) {
        let unit_type = header.unit_type();
        let size =
            u64::try_from(UnitHeader::SIZE).unwrap_or(0).saturating_add(u64::from(header.payload_length));
        match self.units.iter_mut().find(|cost| cost.unit_type == unit_type) {
            Some(cost) => {
                cost.units = cost.units.saturating_add(1);
                cost.bytes = cost.bytes.saturating_add(size);
            }
            None => self.units.push(UnitCost { unit_type, units: 1, bytes: size }),
        }
    }
}

/// Adds up the bits of each plane's model: every model begins with its reuse flag.
#[derive(Default)]
struct BitsOfPlanes {
    bits: Vec<u64>,
}

impl ModelTrace for BitsOfPlanes {
    fn element(&mut self, name: &'static str, _: u64, bits: u64, _: i64) {
        if name == "reuse" {
            self.bits.push(0);
        }
        if let Some(last) = self.bits.last_mut() {
            *last = last.saturating_add(bits);
        }
    }
}

/// The information of a plane's symbols: 12 - log2(frequency) bits a token, and the raw bits.
fn symbol_bits(model: &PlaneModel, info: PlaneInfo, plane: usize, block: &CodedBlock) -> f64 {
    let coded = block.coded.get(plane).map(Vec::as_slice).unwrap_or_default();
    let (contexts, values): (Vec<u8>, Vec<u64>) = match info.alphabet {
        Alphabet::Position => (delta_contexts(&model.axes, &block.deltas), block.deltas.clone()),
        Alphabet::Attribute | Alphabet::Index => {
            let unsigned = |&value: &i32| match info.alphabet {
                Alphabet::Index => u64::from(value.cast_unsigned()),
                _ => u64::from(zigzag(value)),
            };
            (plane_contexts(&model.axes, plane, block, coded), coded.iter().map(unsigned).collect())
        }
    };
    let cost = |(place, &value): (usize, &u64)| {
        let token = split(value, model.direct_log2);
        let context = usize::from(contexts.get(place).copied().unwrap_or(0));
        let frequency = model
            .table_of_context
            .get(context)
            .and_then(|&table| model.tables.get(usize::from(table)))
            .and_then(|table| table.of_token().get(usize::from(token.token)))
            .copied()
            .unwrap_or(1);
        12.0 - f64::from(frequency.max(1)).log2() + f64::from(token.raw_bits)
    };
    values.iter().enumerate().map(cost).sum()
}
