//! What each part of a stream costs. From decoding its symbols again.

mod frames;
mod models;
mod symbols;

use frames::FrameCosts;
use models::Models;
use splatstream_decoder::block::CodedBlock;
use splatstream_decoder::process::Gop;
use splatstream_format::entropy::layout::{Attribute, Layout, Section};
use splatstream_format::entropy::model::PlaneModel;
use splatstream_format::follower::{Content, Follower, Standing};
use splatstream_format::payload::{FramePayload, Increment};
use splatstream_format::syntax::{FrameHeader, FrameType, Profile, UnitHeader, UnitType};
use splatstream_format::unit::{Stream, Unit};
use splatstream_format::{Limits, Result};
use symbols::symbol_bits;

/// Bits spent on one attribute in one section over a whole stream.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SectionCost {
    /// The section.
    pub section: Section,
    /// The attribute.
    pub attribute: Attribute,
    /// Entries: cells, parents, predictors, Gaussians.
    pub entries: u64,
    /// Bits of symbols: the information of the tokens in their tables, and raw bits.
    pub symbol_bits: f64,
    /// Bits of plane models.
    pub model_bits: u64,
}

/// Bytes of one kind of unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UnitCost {
    /// The kind.
    pub unit_type: UnitType,
    /// How many.
    pub units: u32,
    /// Bytes, headers included.
    pub bytes: u64,
}

/// What frames of one type cost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameTypeCost {
    /// The type.
    pub frame_type: FrameType,
    /// How many.
    pub frames: u32,
    /// Bytes of their units, headers included.
    pub bytes: u64,
    /// Their Gaussians; carried ones are not counted.
    pub gaussians: u64,
}

/// What a stream spends on what.
#[derive(Debug, Clone, PartialEq)]
pub struct Statistics {
    /// Gaussians over all frames.
    pub gaussians: u64,
    /// Bytes of the stream.
    pub bytes: u64,
    /// By section and attribute, in coding order; those that occur.
    pub sections: Vec<SectionCost>,
    /// By kind of unit, in order of first appearance.
    pub units: Vec<UnitCost>,
    /// By type of frame; those that occur.
    pub frame_types: Vec<FrameTypeCost>,
}

/// Adds up the costs of a stream.
///
/// # Errors
/// As decoding, digests not verified.
pub fn stream_statistics(bytes: &[u8], limits: &Limits) -> Result<Statistics> {
    let stream = Stream::open(bytes, limits)?;
    let mut statistics = Statistics {
        gaussians: 0,
        bytes: u64::try_from(bytes.len()).unwrap_or(u64::MAX),
        sections: Vec::new(),
        units: Vec::new(),
        frame_types: Vec::new(),
    };
    let (profile, mut units) = (stream.header().profile(), stream.units());
    let mut state = State::new(profile, *limits);
    while let Some(unit) = units.next_unit() {
        let unit = unit?;
        statistics.count(&unit.header);
        state.unit(&unit, &mut statistics)?;
    }
    statistics.frame_types = state.frames.finish();
    statistics.gaussians = statistics.frame_types.iter().map(|cost| cost.gaussians).sum();
    statistics.sections.sort_by_key(|cost| (cost.section, cost.attribute));
    Ok(statistics)
}

struct State {
    follower: Follower,
    limits: Limits,
    gop: Option<Gop>,
    frame: Option<FrameHeader>,
    models: Models,
    frames: FrameCosts,
}

impl State {
    fn new(profile: Profile, limits: Limits) -> Self {
        Self {
            follower: Follower::new(profile),
            limits,
            gop: None,
            frame: None,
            models: Models::default(),
            frames: FrameCosts::default(),
        }
    }

    /// Adds what a unit costs. The payload of one that decoders discard may be anything.
    fn unit(&mut self, unit: &Unit<'_>, statistics: &mut Statistics) -> Result<()> {
        if self.follower.take(unit)? == Standing::Discarded {
            self.frames.unit(unit, None);
            return Ok(());
        }
        match unit.header.unit_type() {
            UnitType::SequenceParameters | UnitType::GopHeader => {
                if let Content::GopHeader(header) = self.follower.content(unit)? {
                    self.models = Models::default();
                    self.gop = Some(Gop::new(header, unit.header.frame));
                }
            }
            UnitType::Transform | UnitType::Codebook | UnitType::Weights => {
                if let (Some(gop), Some(sequence)) = (&mut self.gop, self.follower.sequence()) {
                    gop.tool(unit, sequence, &self.limits)?;
                }
            }
            UnitType::FrameHeader => self.frame_header(unit, statistics)?,
            UnitType::Increment => self.increment(unit, statistics)?,
            _ => {}
        }
        Ok(())
    }

    fn frame_header(&mut self, unit: &Unit<'_>, statistics: &mut Statistics) -> Result<()> {
        let (Some(sequence), Some(gop)) = (self.follower.sequence(), &self.gop) else { return Ok(()) };
        let frame = FramePayload::parse(unit.payload, unit.payload_at, sequence, &self.limits)?;
        self.models.start_frame(unit.header.frame, gop);
        if let Some(cells) = &frame.cells {
            self.models.cells(cells, sequence, statistics)?;
        }
        self.frames.start_frame(frame.header.kind().unwrap_or(FrameType::Intra));
        self.frames.unit(unit, None);
        self.frame = Some(frame.header);
        Ok(())
    }

    fn increment(&mut self, unit: &Unit<'_>, statistics: &mut Statistics) -> Result<()> {
        let (Some(sequence), Some(gop), Some(frame)) = (self.follower.sequence(), &self.gop, &self.frame)
        else {
            return Ok(());
        };
        let (at, refinement) = (unit.payload_at, unit.header.refinement);
        let increment = Increment::parse(unit.payload, at, sequence, self.follower.profile(), &self.limits)?;
        let tools = gop.transforms(frame, at)?;
        self.models.increment(&increment, refinement, tools, sequence, statistics)?;
        self.frames.unit(unit, Some(increment.header.list_size()));
        Ok(())
    }
}

/// The planes of a section, decoded.
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
            let index = self.index_of(info.section, info.attribute);
            let Some(cost) = self.sections.get_mut(index) else { continue };
            // The planes of an attribute have as many values; they are counted with the first.
            cost.entries += if info.index == 0 { u64::from(entries) } else { 0 };
            cost.model_bits = cost.model_bits.saturating_add(model_bits);
            let bits = planes.blocks.iter().map(|block| symbol_bits(model, info, plane, block));
            cost.symbol_bits += bits.sum::<f64>();
        }
    }

    fn index_of(&mut self, section: Section, attribute: Attribute) -> usize {
        let known =
            self.sections.iter().position(|cost| (cost.section, cost.attribute) == (section, attribute));
        known.unwrap_or_else(|| {
            let (entries, symbol_bits, model_bits) = (0, 0.0, 0);
            self.sections.push(SectionCost { section, attribute, entries, symbol_bits, model_bits });
            self.sections.len() - 1
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splatstream_encoder::{Settings, ShChoice, encode};
    use splatstream_files::builtin::BuiltinScene;

    /// Contexts of components are those of clusters, so that sums of magnitudes are among their sources.
    #[test]
    fn attributes_together_take_what_their_units_take() {
        let scene = BuiltinScene { gaussians: 6000, ..BuiltinScene::default() };
        let settings = Settings { sh: ShChoice::Coefficients, refinements: vec![100], ..Settings::default() };
        let mut stream = Vec::new();
        encode(&mut vec![scene.frame(0)], &settings, &mut stream, &mut |_, _| ()).unwrap();
        let Statistics { sections, units, .. } = stream_statistics(&stream, &Limits::default()).unwrap();
        let of_sections: f64 = sections.iter().map(|cost| cost.symbol_bits + cost.model_bits as f64).sum();
        let increments = units.iter().find(|cost| cost.unit_type == UnitType::Increment).unwrap();
        let share = of_sections / (8.0 * increments.bytes as f64);
        // The rest is headers, and what is in the lanes at the end of a block.
        assert!((0.97..=1.0).contains(&share), "{share}");
    }
}
