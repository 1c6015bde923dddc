//! 5.5 gop_header: a place where decoding can start.

use super::{record_io, table};
use crate::Result;

/// Display indices are below this.
const DISPLAY_INDICES: i64 = 1 << 32;

/// `gop_structure`: every frame is intra coded.
const ALL_INTRA: u8 = 0;

table! {
    /// 5.5 — starts a group of pictures.
    "5.5" "6.5" gop_header GopHeader {
        /// place of the group in the sequence
        gop_index: u32,
        /// frames of the group, 1 or more
        gop_frame_count: u32,
        /// 0 is all intra; the others are reserved
        gop_structure: u8,
        /// zero
        reserved_zero: u8[3],
    }
}

record_io!(GopHeader);

impl GopHeader {
    /// A group of intra frames.
    pub const fn intra(gop_index: u32, gop_frame_count: u32) -> Self {
        Self { gop_index, gop_frame_count, gop_structure: ALL_INTRA, reserved_zero: [0; 3] }
    }

    /// 6.5.
    pub fn validate(&self, at: u64) -> Result<()> {
        let check = Self::TABLE.check(at);
        check.range("gop_frame_count", self.gop_frame_count, 1, u32::MAX)?;
        check.known(self.gop_structure == ALL_INTRA, "gop_structure", self.gop_structure)?;
        for (place, value) in self.reserved_zero.into_iter().enumerate() {
            check.reserved_bits("reserved_zero", place, value)?;
        }
        Ok(())
    }

    /// 6.5: the last frame of a group that starts at display index `frame` has a display index too.
    pub fn validate_from(&self, at: u64, frame: u32) -> Result<()> {
        let left = DISPLAY_INDICES.saturating_sub(frame.into());
        Self::TABLE.check(at).range("gop_frame_count", self.gop_frame_count, 1, left)
    }
}
