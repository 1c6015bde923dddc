//! What holds where a unit stands: the sequence, the GOP, and which increments decoders discard; and what the unit says.
//!
//! Everybody who reads units without decoding them asks here: the inspector, statistics, extraction, seeking.

use crate::payload::{Index, OperatingPoints, SceneDescription};
use crate::syntax::{
    CodebookHeader, EndOfStream, FrameHeader, GopHeader, IncrementHeader, Profile, SequenceParameters,
    TransformHeader, UnitHeader, UnitType, WeightsHeader,
};
use crate::unit::Unit;
use crate::{Error, ErrorKind, Result};

/// What the units of a stream up to some place say about those after them.
///
/// ```
/// use splatstream_format::Limits;
/// use splatstream_format::follower::{Content, Follower, Standing};
/// use splatstream_format::unit::Stream;
///
/// /// The Gaussians that each increment adds.
/// fn added(stream: &[u8]) -> splatstream_format::Result<Vec<u32>> {
///     let stream = Stream::open(stream, &Limits::default())?;
///     let mut follower = Follower::new(stream.header().profile());
///     let (mut units, mut added) = (stream.units(), Vec::new());
///     while let Some(unit) = units.next_unit() {
///         let unit = unit?;
///         if follower.take(&unit)? == Standing::Taken
///             && let Content::Increment(header) = follower.content(&unit)?
///         {
///             added.push(header.new_count);
///         }
///     }
///     Ok(added)
/// }
/// assert!(added(b"no stream").is_err());
/// ```
#[derive(Debug, Clone)]
pub struct Follower {
    profile: Profile,
    /// The first sequence parameters: all others are the same.
    sequence: Option<SequenceParameters>,
    /// The GOP in progress, and the display index of its first frame.
    gop: Option<(GopHeader, u32)>,
    /// Increments of the I frame so far: all, and those of the top spatial layer.
    anchor: (u32, u8),
    /// Level of each frame that came, by its index in the GOP: at most 1024 of them.
    levels: Vec<u8>,
}

/// Whether decoders look at a unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Standing {
    /// They do; its header and its payload are intact.
    Taken,
    /// They discard it, since its reference frame has fewer refinements. Its header is intact, its payload may be anything.
    Discarded,
}

/// What a unit says, by its type: records without the sections after them.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Content {
    /// What holds for the whole stream.
    SequenceParameters(SequenceParameters),
    /// What a viewer may want to know about the scene.
    SceneDescription(Box<SceneDescription>),
    /// A GOP begins.
    GopHeader(GopHeader),
    /// A transform of colour components.
    Transform(TransformHeader),
    /// Entries of vector-quantised colour.
    Codebook(CodebookHeader),
    /// The learned predictor of the GOP.
    Weights(WeightsHeader),
    /// A frame begins.
    FrameHeader(FrameHeader),
    /// A refinement of a layer.
    Increment(IncrementHeader),
    /// What the operating points cost.
    OperatingPoints(OperatingPoints),
    /// Where the GOPs begin.
    Index(Index),
    /// The stream ends.
    End(EndOfStream),
    /// A unit of a later version, or of a user.
    Unknown,
}

impl Follower {
    /// Before the first unit of a stream of a profile.
    pub const fn new(profile: Profile) -> Self {
        Self { profile, sequence: None, gop: None, anchor: (0, 0), levels: Vec::new() }
    }

    /// Before a GOP of the same sequence.
    #[must_use]
    pub fn restarted(&self) -> Self {
        Self { sequence: self.sequence, ..Self::new(self.profile) }
    }

    /// The profile.
    pub const fn profile(&self) -> Profile {
        self.profile
    }

    /// The sequence parameters, once they have come.
    pub const fn sequence(&self) -> Option<&SequenceParameters> {
        self.sequence.as_ref()
    }

    /// The GOP in progress, and the display index of its first frame.
    pub const fn gop(&self) -> Option<&(GopHeader, u32)> {
        self.gop.as_ref()
    }

    /// The next unit of a stream.
    ///
    /// # Errors
    /// A header or a payload that is not intact. Units that decoders discard may have any payload.
    pub fn take(&mut self, unit: &Unit<'_>) -> Result<Standing> {
        unit.check_header(self.profile)?;
        if !self.is_decoded(&unit.header) {
            return Ok(Standing::Discarded);
        }
        unit.check_payload()?;
        self.follow(unit);
        Ok(Standing::Taken)
    }

    /// Takes note of sequence parameters and of GOP headers, checked or not.
    pub fn follow(&mut self, unit: &Unit<'_>) {
        match unit.header.unit_type() {
            UnitType::SequenceParameters => {
                let parsed = SequenceParameters::parse_payload(unit.payload, unit.payload_at, self.profile);
                self.sequence = self.sequence.or(parsed.ok());
            }
            UnitType::GopHeader => {
                let parsed = GopHeader::parse_payload(unit.payload, unit.payload_at, self.profile);
                self.gop = parsed.ok().map(|gop| (gop, unit.header.frame));
                self.anchor = (0, 0);
                self.levels.clear();
            }
            _ => {}
        }
    }

    /// What a unit that was [taken](Follower::take) says.
    ///
    /// # Errors
    /// A payload that breaks its syntax or the semantics of its elements; a unit that needs sequence parameters before
    /// there are any.
    pub fn content(&self, unit: &Unit<'_>) -> Result<Content> {
        let (payload, at, profile) = (unit.payload, unit.payload_at, self.profile);
        Ok(match unit.header.unit_type() {
            UnitType::SequenceParameters => {
                Content::SequenceParameters(SequenceParameters::parse_payload(payload, at, profile)?)
            }
            UnitType::SceneDescription => {
                Content::SceneDescription(Box::new(SceneDescription::parse(payload, at)?))
            }
            UnitType::GopHeader => Content::GopHeader(GopHeader::parse_payload(payload, at, profile)?),
            UnitType::Transform => {
                Content::Transform(TransformHeader::parse(payload, at, self.sequence_at(at)?)?.0)
            }
            UnitType::Codebook => Content::Codebook(CodebookHeader::parse(payload, at)?.0),
            UnitType::Weights => Content::Weights(WeightsHeader::parse(payload, at)?.0),
            UnitType::FrameHeader => Content::FrameHeader(FrameHeader::parse(payload, at)?.0),
            UnitType::Increment => {
                Content::Increment(IncrementHeader::parse(payload, at, self.sequence_at(at)?, profile)?.0)
            }
            UnitType::OperatingPoints => Content::OperatingPoints(OperatingPoints::parse(payload, at)?),
            UnitType::Index => Content::Index(Index::parse(payload, at)?),
            UnitType::End => Content::End(EndOfStream::parse_payload(payload, at)?),
            UnitType::Reserved(_) | UnitType::User(_) => Content::Unknown,
        })
    }

    /// The sequence parameters, which a unit at an offset needs.
    ///
    /// # Errors
    /// There are none yet.
    pub fn sequence_at(&self, at: u64) -> Result<&SequenceParameters> {
        let kind = ErrorKind::UnexpectedUnit { unit: "sequence-dependent" };
        self.sequence.as_ref().ok_or(Error::new(at, "7.1.2", kind))
    }

    /// The number of spatial layers, for an increment of a whole anchor: the I frame of a predicted GOP, if the sequence
    /// says that a receiver of all spatial layers takes all of it.
    pub fn whole_anchor_layers(&self, header: &UnitHeader) -> Option<u8> {
        let sequence = self.sequence.filter(SequenceParameters::whole_anchor)?;
        let (gop, first_frame) = self.gop?;
        let is_anchor = gop.is_predicted() && header.frame == first_frame;
        (header.unit_type() == UnitType::Increment && is_anchor).then_some(sequence.spatial_layer_count)
    }

    /// Takes note of the header of a unit; whether it is decoded, as far as the reference frame goes.
    fn is_decoded(&mut self, header: &UnitHeader) -> bool {
        let (Some((gop, first)), Some(sequence)) = (self.gop, self.sequence) else { return true };
        let in_gop = header.frame.checked_sub(first).filter(|index| *index < gop.gop_frame_count);
        let (UnitType::Increment, Some(index), true) = (header.unit_type(), in_gop, gop.is_predicted())
        else {
            return true;
        };
        let Some(reference) = gop.role(index).reference else {
            let top = header.spatial_layer.saturating_add(1) == sequence.spatial_layer_count;
            self.anchor.0 = self.anchor.0.saturating_add(1);
            self.anchor.1 = self.anchor.1.saturating_add(top.into());
            return true;
        };
        if header.refinement >= self.level(reference, &sequence)
            && header.refinement < sequence.refinement_count
        {
            return false;
        }
        let index = usize::try_from(index).unwrap_or(0);
        if self.levels.len() <= index {
            self.levels.resize(index.saturating_add(1), 0);
        }
        if let Some(level) = self.levels.get_mut(index) {
            *level = level.saturating_add(1);
        }
        true
    }

    /// 7.3: the level of the frame with an index in the GOP.
    fn level(&self, index: u32, sequence: &SequenceParameters) -> u8 {
        let (all, of_top) = self.anchor;
        let refinements = sequence.refinement_count;
        let whole = u32::from(refinements).saturating_mul(sequence.spatial_layer_count.into());
        match index {
            0 if !sequence.whole_anchor() => of_top,
            0 if all == whole => refinements,
            0 => 0,
            _ => usize::try_from(index).ok().and_then(|index| self.levels.get(index)).copied().unwrap_or(0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::syntax::UnitId;

    fn sequence(whole_anchor: bool) -> SequenceParameters {
        let (spatial_layer_count, refinement_count) = (2, 3);
        let sequence_flags = SequenceParameters::flags(false, false, whole_anchor);
        let bytes = [0; SequenceParameters::SIZE];
        let (zero, _): (SequenceParameters, _) =
            crate::syntax::decode(&SequenceParameters::TABLE, &bytes, 0).unwrap();
        SequenceParameters { spatial_layer_count, refinement_count, sequence_flags, ..zero }
    }

    /// What is decoded of a frame with so many refinements at a layer.
    fn taken(levels: &mut Follower, frame: u32, layer: u8, refinements: u8) -> Vec<bool> {
        let unit = |refinement| {
            let id = UnitId::of_increment(frame, refinement).on_layers(layer, 0);
            levels.is_decoded(&UnitHeader::new(id, &[]).unwrap())
        };
        (0..refinements).map(unit).collect()
    }

    #[test]
    fn a_frame_has_no_more_refinements_than_its_reference() {
        for whole_anchor in [false, true] {
            let gop = Some((GopHeader::predicted(0, 8, 1), 40));
            let mut levels =
                Follower { gop, sequence: Some(sequence(whole_anchor)), ..Follower::new(Profile::Dynamic) };
            assert_eq!(taken(&mut levels, 40, 0, 3), [true; 3]);
            assert_eq!(taken(&mut levels, 40, 1, 2), [true; 2], "refinement 2 of the top layer is absent");
            let of_anchor = [!whole_anchor, !whole_anchor, false];
            assert_eq!(taken(&mut levels, 42, 1, 3), of_anchor, "refers to 40");
            assert_eq!(taken(&mut levels, 43, 1, 3), of_anchor, "refers to 42");
            assert_eq!(taken(&mut levels, 47, 1, 1), [false], "refers to 46, which is absent");
        }
    }
}
