//! 5.6 frame_header: starts a frame.

use super::{MAX_ID, SequenceParameters, record_io, table};
use crate::{Limits, Result};

/// `sh_transform_id` of a frame without spherical harmonics of degree 1 and above.
pub const NO_TRANSFORM: u8 = 255;

/// How a frame is coded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FrameType {
    /// I: refers to no other frame.
    Intra,
    /// P: refers to an earlier frame of the base temporal layer.
    Predicted,
    /// B: temporal enhancement, refers to an earlier frame of a lower temporal layer; never bidirectional.
    Enhancement,
}

impl FrameType {
    /// The code in the stream.
    pub const fn code(self) -> u8 {
        match self {
            Self::Intra => 0,
            Self::Predicted => 1,
            Self::Enhancement => 2,
        }
    }

    /// The type of a code; others are reserved.
    pub const fn from_code(code: u8) -> Option<Self> {
        match code {
            0 => Some(Self::Intra),
            1 => Some(Self::Predicted),
            2 => Some(Self::Enhancement),
            _ => None,
        }
    }

    /// The letter used in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Intra => "I",
            Self::Predicted => "P",
            Self::Enhancement => "B",
        }
    }
}

table! {
    /// 5.6 — the fixed part of a frame header; the digest of carried lists and the motion of cells may follow.
    "5.6" "6.6" frame_header FrameHeader {
        /// 0 is I, 1 is P, 2 is B
        frame_type: u8,
        /// transform of the degree 0 colour, 0 to 15
        dc_transform_id: u8,
        /// transform of the higher degrees, 0 to 15; 255 is none
        sh_transform_id: u8,
        /// bit 0 has_carried_digest, bit 1 has_cells; zero in an I frame
        frame_flags: u8,
        /// Gaussians of the whole frame, all refinements
        gaussian_count: u32,
    }
}

record_io!(FrameHeader);

/// What the structure of a GOP says about one of its frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameRole {
    /// Intra, predicted, or temporal enhancement.
    pub frame_type: FrameType,
    /// 0 is the base layer.
    pub temporal_layer: u8,
    /// The frame it refers to, counted from the first of the GOP; none for an intra frame.
    pub reference: Option<u32>,
}

impl FrameHeader {
    /// Bit 0 of `frame_flags`.
    pub const HAS_CARRIED_DIGEST: u8 = 1;
    /// Bit 1 of `frame_flags`.
    pub const HAS_CELLS: u8 = 2;

    /// An intra frame; `sh_transform_id` is `None` without spherical harmonics.
    pub fn intra(dc_transform_id: u8, sh_transform_id: Option<u8>, gaussian_count: u32) -> Self {
        Self::new(FrameType::Intra, dc_transform_id, sh_transform_id, gaussian_count)
    }

    /// A frame without motion; `sh_transform_id` is `None` without spherical harmonics.
    pub fn new(
        frame_type: FrameType,
        dc_transform_id: u8,
        sh_transform_id: Option<u8>,
        gaussian_count: u32,
    ) -> Self {
        Self {
            frame_type: frame_type.code(),
            dc_transform_id,
            sh_transform_id: sh_transform_id.unwrap_or(NO_TRANSFORM),
            frame_flags: 0,
            gaussian_count,
        }
    }

    /// How the frame is coded; `None` for a header that is refused.
    pub const fn kind(&self) -> Option<FrameType> {
        FrameType::from_code(self.frame_type)
    }

    /// Whether `carried_digest` follows.
    pub const fn has_carried_digest(&self) -> bool {
        self.frame_flags & Self::HAS_CARRIED_DIGEST != 0
    }

    /// Whether the motion of cells follows.
    pub const fn has_cells(&self) -> bool {
        self.frame_flags & Self::HAS_CELLS != 0
    }

    /// The transform of the higher degrees, where there is one.
    pub fn sh_transform(&self) -> Option<u8> {
        (self.sh_transform_id != NO_TRANSFORM).then_some(self.sh_transform_id)
    }

    /// 6.6: the type is the one that the structure of the GOP gives the frame.
    ///
    /// # Errors
    /// Invalid: it is another.
    pub fn validate_role(&self, at: u64, role: &FrameRole) -> Result<()> {
        let (found, expected) = (self.frame_type.into(), role.frame_type.code().into());
        Self::TABLE.check(at).equal("frame_type", found, expected)
    }

    /// 6.6.
    ///
    /// # Errors
    /// Unsupported: a frame type or flags that are reserved. Invalid: a transform outside its range, or flags
    /// of an I frame.
    pub fn validate(&self, at: u64) -> Result<()> {
        let check = Self::TABLE.check(at);
        check.known(self.kind().is_some(), "frame_type", self.frame_type)?;
        check.range("dc_transform_id", self.dc_transform_id, 0, MAX_ID)?;
        if self.sh_transform_id != NO_TRANSFORM {
            check.range("sh_transform_id", self.sh_transform_id, 0, MAX_ID)?;
        }
        let reserved = self.frame_flags & !(Self::HAS_CARRIED_DIGEST | Self::HAS_CELLS);
        check.reserved_bits("frame_flags", 0, reserved)?;
        if self.kind() == Some(FrameType::Intra) {
            check.equal("frame_flags", self.frame_flags.into(), 0)?;
        }
        Ok(())
    }

    /// A.2: the frame is not larger than agreed, nor are there more Gaussians in a second.
    ///
    /// # Errors
    /// Over limit: it is, or there are.
    pub fn within(&self, at: u64, sequence: &SequenceParameters, limits: &Limits) -> Result<()> {
        let at = Self::TABLE.check(at).offset("gaussian_count", 0);
        Limits::check(at, "max_gaussians", self.gaussian_count.into(), limits.max_gaussians.into())?;
        let rate = sequence.gaussian_rate(self.gaussian_count);
        Limits::check(at, "max_gaussian_rate", rate, limits.max_gaussian_rate)
    }
}
