//! Bytes and Gaussians by type of frame.

use super::FrameTypeCost;
use splatstream_format::Result;
use splatstream_format::syntax::{
    FrameHeader, FrameType, IncrementHeader, Profile, RefinementHeader, SequenceParameters, UnitHeader,
    UnitType,
};
use splatstream_format::unit::Unit;

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
    /// Gaussians of each spatial layer.
    layers: [u64; 4],
}

impl FrameCosts {
    /// Takes note of a unit; the Gaussians of one that is passed over do not count.
    pub(super) fn unit(
        &mut self,
        unit: &Unit<'_>,
        profile: Profile,
        sequence: Option<&SequenceParameters>,
        is_decoded: bool,
    ) -> Result<()> {
        let (payload, at) = (unit.payload, unit.payload_at);
        let gaussians = match (unit.header.unit_type(), sequence) {
            (UnitType::FrameHeader, _) => {
                self.end_frame();
                let header = FrameHeader::parse_payload(payload, at, profile)?;
                let frame_type = header.kind().unwrap_or(FrameType::Intra);
                self.current = Some(FrameCost { frame_type, bytes: 0, layers: [0; 4] });
                0
            }
            (UnitType::Refinement, Some(sequence)) => {
                RefinementHeader::parse(payload, at, sequence)?.0.gaussian_count
            }
            (UnitType::Increment, _) if !is_decoded => 0,
            (UnitType::Increment, Some(sequence)) => {
                IncrementHeader::parse(payload, at, sequence)?.0.home_count()
            }
            _ => return Ok(()),
        };
        if let Some(frame) = &mut self.current {
            frame.bytes += (UnitHeader::SIZE + payload.len()) as u64;
            if let Some(layer) = frame.layers.get_mut(usize::from(unit.header.spatial_layer)) {
                *layer += u64::from(gaussians);
            }
        }
        Ok(())
    }

    /// The costs of all frames, I before P before B.
    pub(super) fn finish(mut self) -> Vec<FrameTypeCost> {
        self.end_frame();
        self.types.sort_by_key(|cost| cost.frame_type.code());
        self.types
    }

    fn end_frame(&mut self) {
        let Some(FrameCost { frame_type, bytes, layers }) = self.current.take() else { return };
        let place = self.types.iter().position(|cost| cost.frame_type == frame_type);
        let place = place.unwrap_or_else(|| {
            self.types.push(FrameTypeCost { frame_type, frames: 0, bytes: 0, gaussians: 0 });
            self.types.len() - 1
        });
        if let Some(cost) = self.types.get_mut(place) {
            cost.frames += 1;
            cost.bytes += bytes;
            // A layer holds all Gaussians of the layers below it; the highest that came is shown.
            cost.gaussians += layers.iter().rev().find(|&&layer| layer > 0).copied().unwrap_or(0);
        }
    }
}
