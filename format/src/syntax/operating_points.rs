//! 5.16 operating_points: what each operating point of the stream costs.

use super::{MAX_LAYERS, MAX_REFINEMENTS, record_io, table};
use crate::Result;

table! {
    /// 5.16 — the fixed part of the list; the operating points follow.
    "5.16" "6.16" operating_points OperatingPointsHeader {
        /// operating points listed
        point_count: u16,
        /// zero
        reserved_zero: u16,
    }
}

table! {
    /// 5.16.1 — one operating point.
    "5.16.1" "6.16" operating_point OperatingPointEntry {
        /// highest spatial layer
        spatial_layer: u8,
        /// highest temporal layer
        temporal_layer: u8,
        /// highest refinement
        refinement: u8,
        /// zero
        reserved_zero: u8,
        /// frames that are output
        frame_count: u32,
        /// exact Gaussians that are output, over all frames
        gaussian_count: u64,
        /// bytes of the units of its frames and GOPs
        byte_count: u64,
    }
}

record_io!(OperatingPointsHeader);
record_io!(OperatingPointEntry);

impl OperatingPointsHeader {
    /// 6.16.
    ///
    /// # Errors
    /// Unsupported: reserved bits are set.
    pub fn validate(&self, at: u64) -> Result<()> {
        Self::TABLE.check(at).reserved_bits("reserved_zero", 0, self.reserved_zero)
    }
}

impl OperatingPointEntry {
    /// 6.16.
    ///
    /// # Errors
    /// Unsupported: reserved bits are set. Invalid: a layer or refinement that no sequence has.
    pub fn validate(&self, at: u64) -> Result<()> {
        let check = Self::TABLE.check(at);
        check.range("spatial_layer", self.spatial_layer, 0, MAX_LAYERS.saturating_sub(1))?;
        check.range("temporal_layer", self.temporal_layer, 0, MAX_LAYERS.saturating_sub(1))?;
        check.range("refinement", self.refinement, 0, MAX_REFINEMENTS.saturating_sub(1))?;
        check.reserved_bits("reserved_zero", 0, self.reserved_zero)
    }

    /// Layers and refinement: what entries are sorted by.
    pub const fn key(&self) -> (u8, u8, u8) {
        (self.spatial_layer, self.temporal_layer, self.refinement)
    }
}
