//! Bytes and Gaussians by type of frame.

use super::FrameTypeCost;
use splatstream_format::syntax::{FrameType, UnitHeader};
use splatstream_format::unit::Unit;
use std::collections::BTreeMap;

/// The frames so far.
#[derive(Default)]
pub(super) struct FrameCosts {
    types: Vec<FrameTypeCost>,
    /// The frame in progress.
    current: Option<FrameCost>,
}

struct FrameCost {
    frame_type: FrameType,
    bytes: u64,
    /// Gaussians of each list, of the highest spatial layer that has it.
    lists: BTreeMap<u8, u64>,
}

impl FrameCosts {
    /// A frame starts.
    pub(super) fn start_frame(&mut self, frame_type: FrameType) {
        self.end_frame();
        self.current = Some(FrameCost { frame_type, bytes: 0, lists: BTreeMap::new() });
    }

    /// Takes note of a frame_header or an increment, after which its list has so many Gaussians; none of one that is
    /// discarded.
    pub(super) fn unit(&mut self, unit: &Unit<'_>, gaussians: Option<u32>) {
        if let Some(frame) = &mut self.current {
            frame.bytes += (UnitHeader::SIZE + unit.payload.len()) as u64;
            if let Some(gaussians) = gaussians {
                frame.lists.insert(unit.header.refinement, gaussians.into());
            }
        }
    }

    /// The costs of all frames, I before P before B.
    pub(super) fn finish(mut self) -> Vec<FrameTypeCost> {
        self.end_frame();
        self.types.sort_by_key(|cost| cost.frame_type.code());
        self.types
    }

    fn end_frame(&mut self) {
        let Some(FrameCost { frame_type, bytes, lists }) = self.current.take() else { return };
        let known = self.types.iter().position(|cost| cost.frame_type == frame_type);
        let index = known.unwrap_or_else(|| {
            self.types.push(FrameTypeCost { frame_type, frames: 0, bytes: 0, gaussians: 0 });
            self.types.len() - 1
        });
        if let Some(cost) = self.types.get_mut(index) {
            cost.frames += 1;
            cost.bytes += bytes;
            cost.gaussians += lists.values().sum::<u64>();
        }
    }
}
