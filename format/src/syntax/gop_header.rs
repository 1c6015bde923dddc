//! 5.5 gop_header: a point where decoding can start.

use super::{FrameRole, FrameType, MAX_LAYERS, Profile, record_io_in_profile, table};
use crate::Result;

/// Display indices are below this.
const DISPLAY_INDICES: i64 = 1 << 32;

/// `gop_structure`: every frame is intra coded.
const ALL_INTRA: u8 = 0;
/// `gop_structure`: frames are predicted.
const PREDICTED: u8 = 1;
/// Frames of a predicted GOP, at most: each but the first depends on others.
const MAX_PREDICTED: u32 = 1024;

table! {
    /// 5.5 — starts a GOP.
    "5.5" "6.5" gop_header GopHeader {
        /// index of the GOP in the sequence
        gop_index: u32,
        /// frames of the GOP, 1 or more
        gop_frame_count: u32,
        /// 0 is all intra, 1 is predicted
        gop_structure: u8,
        /// dyadic levels between frames of temporal layer 0, less than temporal_layer_count
        temporal_depth: u8,
        /// zero
        reserved_zero: u8[2],
    }
}

record_io_in_profile!(GopHeader);

impl GopHeader {
    /// A GOP of intra frames.
    pub const fn intra(gop_index: u32, gop_frame_count: u32) -> Self {
        Self {
            gop_index,
            gop_frame_count,
            gop_structure: ALL_INTRA,
            temporal_depth: 0,
            reserved_zero: [0; 2],
        }
    }

    /// A GOP of an intra frame and predicted ones, with `temporal_depth` layers above those of layer 0.
    pub const fn predicted(gop_index: u32, gop_frame_count: u32, temporal_depth: u8) -> Self {
        Self { gop_index, gop_frame_count, gop_structure: PREDICTED, temporal_depth, reserved_zero: [0; 2] }
    }

    /// Whether frames refer to others.
    pub const fn is_predicted(&self) -> bool {
        self.gop_structure == PREDICTED
    }

    /// 6.5: type, layer and reference of frame `index` of the GOP, counted from 0.
    ///
    /// The reference is the nearest earlier frame of a lower temporal layer; in the base layer, of that layer.
    pub fn role(&self, index: u32) -> FrameRole {
        if !self.is_predicted() || index == 0 {
            return FrameRole { frame_type: FrameType::Intra, temporal_layer: 0, reference: None };
        }
        let step_log2 = index.trailing_zeros().min(self.temporal_depth.into());
        let layer = u32::from(self.temporal_depth).saturating_sub(step_log2);
        FrameRole {
            frame_type: if layer == 0 { FrameType::Predicted } else { FrameType::Enhancement },
            temporal_layer: u8::try_from(layer).unwrap_or(u8::MAX),
            reference: Some(index.saturating_sub(1_u32.wrapping_shl(step_log2))),
        }
    }

    /// 6.5.
    ///
    /// # Errors
    /// Unsupported: reserved bits, or a structure that is reserved in the profile. Invalid: a number of
    /// frames or layers outside its range.
    pub fn validate(&self, at: u64, profile: Profile) -> Result<()> {
        let check = Self::TABLE.check(at);
        check.range("gop_frame_count", self.gop_frame_count, 1, u32::MAX)?;
        let structures = if profile == Profile::Intra { ALL_INTRA } else { PREDICTED };
        check.known(self.gop_structure <= structures, "gop_structure", self.gop_structure)?;
        let deepest = if self.is_predicted() { MAX_LAYERS.saturating_sub(1) } else { 0 };
        check.range("temporal_depth", self.temporal_depth, 0, deepest)?;
        for (index, value) in self.reserved_zero.into_iter().enumerate() {
            check.reserved_bits("reserved_zero", index, value)?;
        }
        let most = if self.is_predicted() { MAX_PREDICTED } else { u32::MAX };
        check.range("gop_frame_count", self.gop_frame_count, 1, most)
    }

    /// 6.5: the sequence has the layers of the structure.
    ///
    /// # Errors
    /// Invalid: it does not.
    pub fn validate_layers(&self, at: u64, temporal_layer_count: u8) -> Result<()> {
        let deepest = temporal_layer_count.saturating_sub(1);
        Self::TABLE.check(at).range("temporal_depth", self.temporal_depth, 0, deepest)
    }

    /// 6.5: the last frame of a GOP that starts at display index `frame` has a display index too.
    ///
    /// # Errors
    /// Invalid: it has none.
    pub fn validate_from(&self, at: u64, frame: u32) -> Result<()> {
        let left = DISPLAY_INDICES.saturating_sub(frame.into());
        Self::TABLE.check(at).range("gop_frame_count", self.gop_frame_count, 1, left)
    }
}
