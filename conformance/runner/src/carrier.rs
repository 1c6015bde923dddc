//! Which unit of a stream carries a Gaussian of a frame, and what to read about it.

use crate::attribute::Attribute;
use serde::{Deserialize, Serialize};
use splatstream_decoder::process::DecodedFrame;
use splatstream_format::Limits;
use splatstream_format::syntax::{IncrementHeader, RefinementHeader, SequenceParameters, UnitType};
use splatstream_format::unit::{Delivery, Stream, Unit};

/// A unit in a report.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Carrier {
    /// Counted from 0, as `splatstream inspect --units` counts.
    pub unit: usize,
    /// Name of its type.
    #[serde(rename = "type")]
    pub unit_type: String,
    /// Absolute offset of its header.
    pub byte: u64,
    /// Header and payload.
    pub bytes: u64,
    /// Display index of its frame.
    pub frame: u32,
    /// Of its header.
    pub spatial_layer: u8,
    /// Of its header.
    pub refinement: u8,
}

/// The units of a stream, as far as Gaussians are concerned.
#[derive(Debug, Default)]
pub(crate) struct Carriers {
    units: Vec<Coded>,
    /// Display indices in the order in which the frames are coded.
    frames: Vec<u32>,
}

/// A unit with Gaussians.
#[derive(Debug)]
struct Coded {
    carrier: Carrier,
    /// Gaussians that the unit keeps of its parents; 0 in profile 0.
    parents: u64,
    /// Gaussians that the unit adds.
    new: u64,
}

/// How a Gaussian came into its frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Origin {
    /// Coded by itself, in profile 0.
    Refinement,
    /// Changed or kept by an increment of an I frame.
    LayerParent,
    /// Changed or kept by an increment of a predicted frame.
    Parent,
    /// Added by an increment.
    New,
    /// Carried over without a unit of its own.
    Carried,
    /// In a frame that is shown in place of one that was lost.
    Frozen,
}

impl Carriers {
    /// Reads the units of a stream as far as they can be read.
    pub(crate) fn of(bytes: &[u8]) -> Self {
        let mut carriers = Self::default();
        let Ok(stream) = Stream::open(bytes, &Limits::default()) else { return carriers };
        let mut sequence = None;
        let mut units = stream.units();
        let mut index = 0_usize;
        while let Some(Ok(delivery)) = units.next_unit() {
            if let Delivery::Intact(unit) = delivery {
                match unit.header.unit_type() {
                    UnitType::SequenceParameters => {
                        let profile = stream.header().profile();
                        sequence =
                            SequenceParameters::parse_payload(unit.payload, unit.payload_at, profile).ok();
                    }
                    UnitType::FrameHeader => carriers.frames.push(unit.header.frame),
                    _ => carriers
                        .units
                        .extend(sequence.as_ref().and_then(|sequence| coded(index, &unit, sequence))),
                }
            }
            index = index.saturating_add(1);
        }
        carriers
    }

    /// Place of a frame in the order of coding: a fault in one spreads to those behind.
    pub(crate) fn coding_order(&self, frame: u32) -> usize {
        self.frames.iter().position(|&coded| coded == frame).unwrap_or(usize::MAX)
    }

    /// The unit that carries a Gaussian of a frame, and the clauses that say how an attribute of it comes about.
    pub(crate) fn find(
        &self,
        frame: &DecodedFrame,
        gaussian: u64,
        attribute: Attribute,
    ) -> (Option<Carrier>, &'static [&'static str]) {
        let (unit, origin) = self.origin(frame, gaussian);
        (unit.map(|unit| unit.carrier.clone()), clauses(origin, attribute))
    }

    fn origin(&self, frame: &DecodedFrame, gaussian: u64) -> (Option<&Coded>, Origin) {
        let mut units = self.units.iter().filter(|unit| {
            unit.carrier.frame == frame.number && unit.carrier.spatial_layer == frame.spatial_layer
        });
        if frame.frozen.is_some() {
            return (None, Origin::Frozen);
        }
        let exact = frame.planes.len().saturating_sub(frame.carried) as u64;
        if gaussian >= exact {
            return (units.next(), Origin::Carried);
        }
        let mut before = 0_u64;
        for unit in units {
            let place = gaussian.saturating_sub(before);
            before = before.saturating_add(unit.parents).saturating_add(unit.new);
            if gaussian < before {
                let is_new = place >= unit.parents;
                let origin = match (unit.carrier.unit_type == UnitType::Refinement.name(), is_new) {
                    (true, _) => Origin::Refinement,
                    (false, true) => Origin::New,
                    (false, false) if frame.frame_type.name() == "I" => Origin::LayerParent,
                    (false, false) => Origin::Parent,
                };
                return (Some(unit), origin);
            }
        }
        (None, Origin::New)
    }
}

/// A unit with Gaussians; none for other units and for those that cannot be read.
fn coded(index: usize, unit: &Unit<'_>, sequence: &SequenceParameters) -> Option<Coded> {
    let (parents, new) = match unit.header.unit_type() {
        UnitType::Refinement => {
            let (header, _) = RefinementHeader::parse(unit.payload, unit.payload_at, sequence).ok()?;
            (0, header.gaussian_count)
        }
        UnitType::Increment => {
            let (header, _) = IncrementHeader::parse(unit.payload, unit.payload_at, sequence).ok()?;
            (header.parent_count.saturating_sub(header.remove_count), header.new_count)
        }
        _ => return None,
    };
    let header = unit.payload_at.saturating_sub(unit.at);
    let carrier = Carrier {
        unit: index,
        unit_type: unit.header.unit_type().name().to_owned(),
        byte: unit.at,
        bytes: header.saturating_add(unit.payload.len() as u64),
        frame: unit.header.frame,
        spatial_layer: unit.header.spatial_layer,
        refinement: unit.header.refinement,
    };
    Some(Coded { carrier, parents: parents.into(), new: new.into() })
}

/// The clauses that say how an attribute comes about, the likeliest first.
const fn clauses(origin: Origin, attribute: Attribute) -> &'static [&'static str] {
    use Attribute::{Dc, LogScale, Opacity, Position, Rotation, Sh};
    match (origin, attribute) {
        (Origin::Frozen, _) => &["7.20.3", "7.18.3"],
        (Origin::Carried, Position) => &["7.18.1", "7.15.2"],
        (Origin::Carried, _) => &["7.18.1", "7.18.2"],
        (Origin::Refinement, Position) => &["7.3"],
        (Origin::Refinement, LogScale) => &["7.4"],
        (Origin::Refinement, Opacity) => &["7.5"],
        (Origin::Refinement, Rotation) => &["7.6"],
        (Origin::Refinement, Dc) => &["7.7"],
        (Origin::Refinement, Sh) => &["7.8"],
        (Origin::Parent, Position) => &["7.14.3", "7.15.2"],
        (Origin::LayerParent, Position) => &["7.14.3"],
        (Origin::Parent | Origin::LayerParent, LogScale | Opacity) => &["7.14.3", "7.16.2", "7.18.3"],
        (Origin::Parent | Origin::LayerParent, Rotation) => &["7.14.3", "7.16.3"],
        (Origin::Parent | Origin::LayerParent, Dc | Sh) => &["7.14.3", "7.16.5"],
        (Origin::New, Position) => &["7.16.4"],
        (Origin::New, LogScale | Opacity) => &["7.16.2", "7.17", "7.18.3"],
        (Origin::New, Rotation) => &["7.16.3", "7.17"],
        (Origin::New, Dc | Sh) => &["7.16.5", "7.17"],
    }
}
