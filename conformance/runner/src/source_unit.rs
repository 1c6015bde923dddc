//! Which unit of a stream a Gaussian of a frame was decoded from, and which clauses to read about it.

use crate::attribute::Attribute;
use serde::{Deserialize, Serialize};
use splatstream_decoder::process::DecodedFrame;
use splatstream_format::Limits;
use splatstream_format::follower::{Follower, Standing};
use splatstream_format::payload::Increment;
use splatstream_format::syntax::{SequenceParameters, UnitType};
use splatstream_format::unit::{Stream, Unit};

/// A unit in a report.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SourceUnit {
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
    /// From its header.
    pub spatial_layer: u8,
    /// From its header.
    pub refinement: u8,
}

/// The increments of a stream.
#[derive(Debug, Default)]
pub(crate) struct SourceUnits {
    increments: Vec<Coded>,
    /// Display indices in coding order.
    frames: Vec<u32>,
}

/// An increment.
#[derive(Debug)]
struct Coded {
    source: SourceUnit,
    /// Parents that its list keeps.
    parents: u64,
    /// New Gaussians of its list.
    new: u64,
}

/// How a Gaussian came into its frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Origin {
    /// Kept or updated by an increment of an I frame.
    LayerParent,
    /// Kept or updated by an increment of a P or B frame.
    Parent,
    /// New in an increment.
    New,
    /// In a carried list.
    Carried,
}

impl SourceUnits {
    /// Reads the units of a stream as far as they can be read.
    pub(crate) fn of(bytes: &[u8]) -> Self {
        let mut found = Self::default();
        let Ok(stream) = Stream::open(bytes, &Limits::of_level(4)) else { return found };
        let mut follower = Follower::new(stream.header().profile());
        let mut units = stream.units();
        let mut index = 0_usize;
        while let Some(Ok(unit)) = units.next_unit() {
            if follower.take(&unit) == Ok(Standing::Taken) {
                match unit.header.unit_type() {
                    UnitType::FrameHeader => found.frames.push(unit.header.frame),
                    UnitType::Increment => found
                        .increments
                        .extend(follower.sequence().and_then(|sequence| Coded::of(index, &unit, sequence))),
                    _ => {}
                }
            }
            index = index.saturating_add(1);
        }
        found
    }

    /// Position of a frame in coding order: an error in one frame spreads to those after it.
    pub(crate) fn coding_order(&self, frame: u32) -> usize {
        self.frames.iter().position(|&coded| coded == frame).unwrap_or(usize::MAX)
    }

    /// The unit that a Gaussian of a frame was decoded from, and the clauses that define an attribute of it.
    pub(crate) fn find(
        &self,
        frame: &DecodedFrame,
        gaussian: u64,
        attribute: Attribute,
    ) -> (Option<SourceUnit>, &'static [&'static str]) {
        let (unit, origin) = self.origin(frame, gaussian);
        (unit.map(|unit| unit.source.clone()), clauses(origin, attribute))
    }

    fn origin(&self, frame: &DecodedFrame, gaussian: u64) -> (Option<&Coded>, Origin) {
        let is_intra = frame.frame_type.name() == "I";
        let increments = self.increments.iter().filter(|unit| {
            unit.source.frame == frame.index && unit.source.spatial_layer == frame.spatial_layer
        });
        let exact = frame.planes.len().saturating_sub(frame.carried) as u64;
        if gaussian >= exact {
            return (None, Origin::Carried);
        }
        let mut before = 0_u64;
        for unit in increments {
            let in_list = gaussian.saturating_sub(before);
            before = before.saturating_add(unit.parents).saturating_add(unit.new);
            if gaussian < before {
                let origin = match (in_list >= unit.parents, is_intra) {
                    (true, _) => Origin::New,
                    (false, true) => Origin::LayerParent,
                    (false, false) => Origin::Parent,
                };
                return (Some(unit), origin);
            }
        }
        (None, Origin::New)
    }
}

impl Coded {
    /// None for an increment that cannot be read.
    fn of(index: usize, unit: &Unit<'_>, sequence: &SequenceParameters) -> Option<Self> {
        let limits = Limits::of_level(4);
        let profile = splatstream_format::syntax::Profile::Dynamic;
        let increment = Increment::parse(unit.payload, unit.payload_at, sequence, profile, &limits).ok()?;
        let parents = increment.header.parent_count.saturating_sub(increment.header.remove_count);
        let source = SourceUnit {
            unit: index,
            unit_type: unit.header.unit_type().name().to_owned(),
            byte: unit.at,
            bytes: unit.payload_at.saturating_sub(unit.at).saturating_add(unit.payload.len() as u64),
            frame: unit.header.frame,
            spatial_layer: unit.header.spatial_layer,
            refinement: unit.header.refinement,
        };
        Some(Self { source, parents: parents.into(), new: increment.header.new_count.into() })
    }
}

/// The clauses that define an attribute, the likeliest first.
const fn clauses(origin: Origin, attribute: Attribute) -> &'static [&'static str] {
    use Attribute::{Dc, LogScale, Opacity, Position, Rotation, Sh};
    match (origin, attribute) {
        (Origin::Carried, Position) => &["7.8.1", "7.5.2"],
        (Origin::Carried, LogScale | Opacity) => &["7.8.1", "7.8.3"],
        (Origin::Carried, _) => &["7.8.1", "7.8.2"],
        (Origin::Parent, Position) => &["7.4.3", "7.5.2"],
        (Origin::LayerParent, Position) => &["7.4.3"],
        (Origin::Parent | Origin::LayerParent, LogScale | Opacity) => &["7.4.3", "7.6.2", "7.8.3"],
        (Origin::Parent | Origin::LayerParent, Rotation) => &["7.4.3", "7.6.3"],
        (Origin::Parent | Origin::LayerParent, Dc | Sh) => &["7.4.3", "7.6.5"],
        (Origin::New, Position) => &["7.6.4"],
        (Origin::New, LogScale | Opacity) => &["7.6.2", "7.7", "7.8.3"],
        (Origin::New, Rotation) => &["7.6.3", "7.7"],
        (Origin::New, Dc | Sh) => &["7.6.5", "7.7"],
    }
}
