//! What comes out of a decoder for a frame.

use crate::entropy_state::UnitEntropy;
use crate::frame::QuantizedFrame;
use splatstream_format::Error;
use splatstream_format::syntax::FrameType;

/// One frame as far as its units were there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DecodedFrame {
    /// Display index.
    pub number: u32,
    /// How it is coded.
    pub frame_type: FrameType,
    /// The integer planes that are shown.
    pub planes: QuantizedFrame,
    /// Refinement units decoded; in an intra frame with spatial layers, those of the layer shown.
    pub refinements: u8,
    /// Spatial layer shown.
    pub spatial_layer: u8,
    /// Gaussians at the end of `planes` that are carried over from the intra frame (7.18).
    pub carried: usize,
    /// The frame that is shown in place of this one, of which nothing could be decoded (7.20.3).
    pub frozen: Option<u32>,
    /// Digest of the decoded planes, clause 7.9; none if it was not asked for, or nothing was decoded.
    pub digest: Option<u64>,
    /// Digest of the carried planes, clause 7.18, under the same conditions.
    pub carried_digest: Option<u64>,
    /// What is added before output.
    pub compensation: Compensation,
    /// Bytes of the frame's units that were decoded, headers included.
    pub bytes: u64,
    /// Entropy states of the frame's units that were decoded, if they were asked for.
    pub entropy: Vec<UnitEntropy>,
    /// The first error of the frame: why the refinement after the last decoded one was lost, or that the carried
    /// planes are not those of their digest.
    pub lost: Option<Error>,
    /// That the carried planes are not those of their digest, where another error comes before (SS-ER-007): `lost`, or
    /// the one that ended decoding within the frame.
    pub carried_fault: Option<Error>,
}

/// Clause 7.18: what fills the holes that missing refinements leave.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Compensation {
    /// Added to each log-scale, steps.
    pub log_scale: i8,
    /// Added to the opacity, steps.
    pub opacity: i8,
    /// Which Gaussians, from the first on; those without a flag stay as they are.
    pub applies: Vec<bool>,
}

impl DecodedFrame {
    /// A frame of which nothing is there.
    pub(super) fn empty(number: u32, frame_type: FrameType) -> Self {
        Self {
            number,
            frame_type,
            planes: QuantizedFrame::default(),
            refinements: 0,
            spatial_layer: 0,
            carried: 0,
            frozen: None,
            digest: None,
            carried_digest: None,
            compensation: Compensation::default(),
            bytes: 0,
            entropy: Vec::new(),
            lost: None,
            carried_fault: None,
        }
    }

    /// The planes that clause 7.10 makes output of: compensated.
    pub fn into_shown(self) -> QuantizedFrame {
        let Self { mut planes, compensation, .. } = self;
        compensation.apply(&mut planes);
        planes
    }
}

impl Compensation {
    fn apply(&self, planes: &mut QuantizedFrame) {
        let range = crate::attribute::ATTRIBUTE_RANGE;
        let shift = |plane: &mut Vec<i32>, by: i8| {
            for (value, _) in plane.iter_mut().zip(&self.applies).filter(|(_, applies)| **applies) {
                *value = value.wrapping_add(by.into()).clamp(*range.start(), *range.end());
            }
        };
        planes.log_scale.iter_mut().for_each(|plane| shift(plane, self.log_scale));
        shift(&mut planes.opacity, self.opacity);
    }
}
