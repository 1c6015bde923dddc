//! 5.6 frame_header: starts a frame.

use super::{MAX_ID, PlaceInGop, Profile, record_io_in_profile, table};
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
    /// B: temporal enhancement, refers to an earlier frame of a lower temporal layer.
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
    /// 5.6 — how a frame is coded and how large it is.
    "5.6" "6.6" frame_header FrameHeader {
        /// 0 is I, 1 is P, 2 is B
        frame_type: u8,
        /// transform of the degree 0 colour, 0 to 15
        dc_transform_id: u8,
        /// transform of the higher degrees, 0 to 15; 255 is none
        sh_transform_id: u8,
        /// zero
        reserved_zero: u8,
        /// Gaussians of the whole frame
        gaussian_count: u32,
    }
}

record_io_in_profile!(FrameHeader);

impl FrameHeader {
    /// An intra frame; `sh_transform_id` is `None` without spherical harmonics.
    pub fn intra(dc_transform_id: u8, sh_transform_id: Option<u8>, gaussian_count: u32) -> Self {
        Self::new(FrameType::Intra, dc_transform_id, sh_transform_id, gaussian_count)
    }

    /// A frame; `sh_transform_id` is `None` without spherical harmonics.
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
            reserved_zero: 0,
            gaussian_count,
        }
    }

    /// How the frame is coded; `None` for a header that is refused.
    pub const fn kind(&self) -> Option<FrameType> {
        FrameType::from_code(self.frame_type)
    }

    /// 6.6: the type is the one that the structure of the group gives the frame.
    pub fn validate_place(&self, at: u64, place: &PlaceInGop) -> Result<()> {
        let (found, expected) = (self.frame_type.into(), place.frame_type.code().into());
        Self::TABLE.check(at).equal("frame_type", found, expected)
    }

    /// 6.6.
    pub fn validate(&self, at: u64, profile: Profile) -> Result<()> {
        let check = Self::TABLE.check(at);
        let known = self.kind().is_some_and(|kind| profile == Profile::Dynamic || kind == FrameType::Intra);
        check.known(known, "frame_type", self.frame_type)?;
        check.range("dc_transform_id", self.dc_transform_id, 0, MAX_ID)?;
        if self.sh_transform_id != NO_TRANSFORM {
            check.range("sh_transform_id", self.sh_transform_id, 0, MAX_ID)?;
        }
        check.reserved_bits("reserved_zero", 0, self.reserved_zero)
    }

    /// The transform of the higher degrees, where there is one.
    pub fn sh_transform(&self) -> Option<u8> {
        (self.sh_transform_id != NO_TRANSFORM).then_some(self.sh_transform_id)
    }

    /// A.2: the frame is not larger than agreed.
    pub fn within(&self, at: u64, limits: &Limits) -> Result<()> {
        let at = Self::TABLE.check(at).offset("gaussian_count", 0);
        Limits::check(at, "max_gaussians", self.gaussian_count.into(), limits.max_gaussians.into())
    }
}
