//! 5.6 frame_header: starts a frame.

use super::{MAX_ID, record_io, table};
use crate::{Limits, Result};

/// `sh_transform_id` of a frame without spherical harmonics of degree 1 and above.
pub const NO_TRANSFORM: u8 = 255;

/// `frame_type`: intra coded.
const INTRA: u8 = 0;

table! {
    /// 5.6 — how a frame is coded and how large it is.
    "5.6" "6.6" frame_header FrameHeader {
        /// 0 is I; the others are reserved
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

record_io!(FrameHeader);

impl FrameHeader {
    /// An intra frame; `sh_transform_id` is `None` without spherical harmonics.
    pub fn intra(dc_transform_id: u8, sh_transform_id: Option<u8>, gaussian_count: u32) -> Self {
        Self {
            frame_type: INTRA,
            dc_transform_id,
            sh_transform_id: sh_transform_id.unwrap_or(NO_TRANSFORM),
            reserved_zero: 0,
            gaussian_count,
        }
    }

    /// 6.6.
    pub fn validate(&self, at: u64) -> Result<()> {
        let check = Self::TABLE.check(at);
        check.known(self.frame_type == INTRA, "frame_type", self.frame_type)?;
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
