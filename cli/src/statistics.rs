//! What each part of a stream costs. From decoding its symbols again.

mod frames;
mod increments;
mod symbols;

use frames::FrameCosts;
use increments::Increments;
use splatstream_decoder::block::CodedBlock;
use splatstream_decoder::gop::Gop;
use splatstream_decoder::unit::{CodedUnit, PreparedUnit};
use splatstream_format::entropy::layout::{Attribute, Layout, Section};
use splatstream_format::entropy::model::PlaneModel;
use splatstream_format::levels::Levels;
use splatstream_format::payload::Refinement;
use splatstream_format::syntax::{
    FrameHeader, FrameType, GopHeader, Profile, SequenceParameters, UnitHeader, UnitType,
};
use splatstream_format::unit::{Stream, Unit};
use splatstream_format::{Limits, Result};
use symbols::{BitsOfPlanes, symbol_bits};

/// Bits spent on one attribute in one section over a whole stream; a refinement unit is one section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SectionCost {
    /// The section.
    pub(crate) section: Section,
    /// The attribute.
    pub(crate) attribute: Attribute,
    /// Entries: cells, parents, predictors, Gaussians.
    pub(crate) entries: u64,
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

/// What frames of one type cost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct FrameTypeCost {
    /// The type.
    pub(crate) frame_type: FrameType,
    /// How many.
    pub(crate) frames: u32,
    /// Bytes of their units, headers included.
    pub(crate) bytes: u64,
    /// Their Gaussians; what is carried over is not counted.
    pub(crate) gaussians: u64,
}

/// What a stream spends on what.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Statistics {
    /// The profile of the stream.
    pub(crate) profile: Profile,
    /// Gaussians over all frames.
    pub(crate) gaussians: u64,
    /// Bytes of the stream.
    pub(crate) bytes: u64,
    /// By section and attribute, in coding order; those that occur.
    pub(crate) sections: Vec<SectionCost>,
    /// By kind of unit, in order of first appearance.
    pub(crate) units: Vec<UnitCost>,
    /// By type of frame; those that occur.
    pub(crate) frame_types: Vec<FrameTypeCost>,
}

/// Adds up the costs of a stream.
///
/// # Errors
/// As decoding, digests not verified.
pub(crate) fn stream_statistics(bytes: &[u8], limits: &Limits) -> Result<Statistics> {
    let stream = Stream::open(bytes, limits)?;
    let profile = stream.header().profile();
    let mut statistics = Statistics {
        profile,
        gaussians: 0,
        bytes: u64::try_from(bytes.len()).unwrap_or(u64::MAX),
        sections: Vec::new(),
        units: Vec::new(),
        frame_types: Vec::new(),
    };
    let (mut state, mut frames) = (State::default(), FrameCosts::default());
    for unit in stream.units() {
        let unit = unit?;
        statistics.count(&unit.header);
        if !unit.header.unit_type().is_known_in(profile) {
            continue;
        }
        let is_decoded = state.unit(&unit, profile, limits, &mut statistics)?;
        frames.unit(&unit, profile, state.sequence.as_ref(), is_decoded)?;
    }
    statistics.frame_types = frames.finish();
    statistics.gaussians = statistics.frame_types.iter().map(|cost| cost.gaussians).sum();
    statistics.sections.sort_by_key(|cost| (cost.section, cost.attribute));
    Ok(statistics)
}

#[derive(Default)]
struct State {
    sequence: Option<SequenceParameters>,
    gop: Option<Gop>,
    frame: Option<FrameHeader>,
    models: Option<(Layout, Vec<PlaneModel>)>,
    increments: Increments,
    levels: Levels,
}

impl State {
    /// Adds what a unit costs; gives whether it is decoded and not passed over.
    fn unit(
        &mut self,
        unit: &Unit<'_>,
        profile: Profile,
        limits: &Limits,
        statistics: &mut Statistics,
    ) -> Result<bool> {
        self.levels.follow(unit, profile);
        match unit.header.unit_type() {
            UnitType::SequenceParameters => {
                let parsed = SequenceParameters::parse_payload(unit.payload, unit.payload_at, profile)?;
                self.sequence = Some(parsed);
            }
            UnitType::GopHeader => {
                let header = GopHeader::parse_payload(unit.payload, unit.payload_at, profile)?;
                self.start_gop(header, unit.header.frame);
            }
            UnitType::FrameHeader => {
                self.frame = Some(FrameHeader::parse_payload(unit.payload, unit.payload_at, profile)?);
                self.models = None;
                if let Some(gop) = &self.gop {
                    self.increments.start_frame(unit.header.frame, gop);
                }
            }
            UnitType::Transform | UnitType::Codebook | UnitType::Weights => {
                if let (Some(gop), Some(sequence)) = (&mut self.gop, &self.sequence) {
                    gop.tool(unit, sequence, profile, limits)?;
                }
            }
            UnitType::Refinement if profile == Profile::Intra => {
                self.refinement(unit, limits, statistics)?;
            }
            UnitType::Increment if profile == Profile::Dynamic => {
                if !self.levels.takes(&unit.header) {
                    return Ok(false);
                }
                if let (Some(sequence), Some(gop), Some(frame)) = (&self.sequence, &self.gop, &self.frame) {
                    let tools = gop.transforms(frame, unit.payload_at)?;
                    self.increments.unit(unit, sequence, tools, limits, statistics)?;
                }
            }
            _ => {}
        }
        Ok(true)
    }

    fn start_gop(&mut self, header: GopHeader, first: u32) {
        self.increments = Increments::default();
        self.gop = Some(Gop::new(header, first));
    }

    fn refinement(&mut self, unit: &Unit<'_>, limits: &Limits, statistics: &mut Statistics) -> Result<()> {
        let (Some(sequence), Some(gop), Some(frame)) = (&self.sequence, &self.gop, &self.frame) else {
            return Ok(());
        };
        let refinement = Refinement::parse(unit.payload, unit.payload_at, sequence, limits)?;
        let transforms = gop.transforms(frame, unit.payload_at)?;
        let coded = CodedUnit { refinement: &refinement, payload_at: unit.payload_at };
        let mut trace = BitsOfPlanes::default();
        let before = self.models.as_ref().map(|(layout, models)| (layout, models.as_slice()));
        let prepared = PreparedUnit::new(coded, gop, transforms, before, &mut trace)?;
        let blocks = prepared.coded_blocks(sequence)?;
        let planes = Planes { layout: &prepared.layout, models: &prepared.models, blocks: &blocks };
        statistics.add(refinement.header.gaussian_count, &planes, &trace.bits);
        if !prepared.models.is_empty() {
            self.models = Some((prepared.layout.clone(), prepared.models.clone()));
        }
        Ok(())
    }
}

/// The planes of a section of a unit, decoded.
struct Planes<'a> {
    layout: &'a Layout,
    models: &'a [PlaneModel],
    blocks: &'a [CodedBlock],
}

impl Statistics {
    fn count(&mut self, header: &UnitHeader) {
        let unit_type = header.unit_type();
        let size = UnitHeader::SIZE as u64 + u64::from(header.payload_length);
        match self.units.iter_mut().find(|cost| cost.unit_type == unit_type) {
            Some(cost) => {
                cost.units = cost.units.saturating_add(1);
                cost.bytes = cost.bytes.saturating_add(size);
            }
            None => self.units.push(UnitCost { unit_type, units: 1, bytes: size }),
        }
    }

    /// Adds what the planes of a section of so many entries cost.
    fn add(&mut self, entries: u32, planes: &Planes<'_>, model_bits: &[u64]) {
        let all = planes.layout.planes().iter().zip(planes.models).zip(model_bits);
        for (plane, ((&info, model), &model_bits)) in all.enumerate() {
            let place = self.place(info.section, info.attribute);
            let Some(cost) = self.sections.get_mut(place) else { continue };
            // The planes of an attribute have as many values; they are counted with the first.
            cost.entries += if info.place == 0 { u64::from(entries) } else { 0 };
            cost.model_bits = cost.model_bits.saturating_add(model_bits);
            let bits = planes.blocks.iter().map(|block| symbol_bits(model, info, plane, block));
            cost.symbol_bits += bits.sum::<f64>();
        }
    }

    fn place(&mut self, section: Section, attribute: Attribute) -> usize {
        let known =
            self.sections.iter().position(|cost| (cost.section, cost.attribute) == (section, attribute));
        known.unwrap_or_else(|| {
            let (entries, symbol_bits, model_bits) = (0, 0.0, 0);
            self.sections.push(SectionCost { section, attribute, entries, symbol_bits, model_bits });
            self.sections.len() - 1
        })
    }
}
