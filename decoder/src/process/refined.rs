//! Frames of profile Intra: refinement units, clause 7.1.3.

use super::expected::{element_at, same, unexpected};
use super::{DecodedFrame, Decoder, FrameUnits, PendingFrame, keep, unit_bytes};
use crate::digest::{UnitDigest, frame_digest, unit_digest};
use crate::frame::QuantizedFrame;
use crate::gop::Gop;
use crate::unit::{CodedUnit, decode_units, entropy_states};
use splatstream_format::payload::Refinement;
use splatstream_format::syntax::{FrameHeader, FrameType, RefinementHeader, SequenceParameters};
use splatstream_format::unit::Unit;
use splatstream_format::{Error, ErrorKind, Result};

/// A frame whose refinement units are still arriving.
pub(super) struct RefinedFrame<'a> {
    units: Vec<PendingUnit<'a>>,
}

struct PendingUnit<'a> {
    refinement: Refinement<'a>,
    payload_at: u64,
    bytes: u64,
}

impl RefinedFrame<'_> {
    pub(super) const fn new() -> Self {
        Self { units: Vec::new() }
    }
}

impl<'a> Decoder<'a> {
    /// Clause 7.1.3, except that blocks are decoded when the frame ends.
    pub(super) fn refinement(&mut self, unit: &Unit<'a>) -> Result<()> {
        if !self.arrives(unit)? {
            return Ok(());
        }
        let (Some(frame), Some((sequence, _)), Some(gop)) = (&mut self.frame, &self.sequence, &self.gop)
        else {
            return Err(unexpected(unit));
        };
        let FrameUnits::Refined(refined) = &mut frame.units else { return Err(unexpected(unit)) };
        let expected = refined.units.len();
        let parsed = if usize::from(unit.header.refinement) != expected
            || unit.header.refinement >= sequence.refinement_count
        {
            Err(unexpected(unit))
        } else {
            parse_refinement(unit, sequence, &frame.header, gop)
        };
        let (payload_at, bytes) = (unit.payload_at, unit_bytes(unit));
        let parsed = parsed.map(|refinement| PendingUnit { refinement, payload_at, bytes });
        keep(parsed, &mut refined.units, &mut frame.lost, self.options.tolerant)
    }

    pub(super) fn decode_refined(
        &self,
        frame: &PendingFrame<'a>,
        refined: &RefinedFrame<'a>,
    ) -> Result<Option<DecodedFrame>> {
        let (Some(gop), Some((sequence, _))) = (&self.gop, &self.sequence) else { return Ok(None) };
        let coded: Vec<CodedUnit<'_, '_>> = refined
            .units
            .iter()
            .map(|unit| CodedUnit { refinement: &unit.refinement, payload_at: unit.payload_at })
            .collect();
        let tools = gop.transforms(&frame.header, 0)?;
        let (planes, results) = decode_units(&coded, gop, tools, sequence);
        let mut decoded = self.assemble(frame, refined, planes, results)?;
        if self.options.entropy {
            let known = coded.get(..decoded.refinements.into()).unwrap_or_default();
            decoded.entropy = entropy_states(known, gop, tools, sequence);
        }
        Ok(Some(decoded))
    }

    /// Checks the units of a frame, and cuts the planes before the first that failed.
    fn assemble(
        &self,
        frame: &PendingFrame<'a>,
        refined: &RefinedFrame<'a>,
        planes: QuantizedFrame,
        results: Vec<Result<usize>>,
    ) -> Result<DecodedFrame> {
        let mut decoded = DecodedFrame {
            planes,
            bytes: frame.bytes,
            lost: frame.lost,
            ..DecodedFrame::empty(frame.number, FrameType::Intra)
        };
        let mut digests: Vec<UnitDigest> = Vec::new();
        let mut gaussians = 0_usize;
        for (unit, result) in refined.units.iter().zip(results) {
            let checked = result.and_then(|count| {
                let end = gaussians.wrapping_add(count);
                let digest = self.check_digest(unit, &decoded.planes, gaussians..end, &mut digests)?;
                Ok((end, digest))
            });
            match checked {
                Ok((end, digest)) => {
                    gaussians = end;
                    decoded.digest = digest;
                    decoded.refinements = decoded.refinements.wrapping_add(1);
                    decoded.bytes = decoded.bytes.wrapping_add(unit.bytes);
                }
                Err(error) if self.options.tolerant => {
                    decoded.lost = Some(error);
                    break;
                }
                Err(error) => return Err(error),
            }
        }
        decoded.planes.truncate(gaussians);
        Ok(decoded)
    }

    fn check_digest(
        &self,
        unit: &PendingUnit<'_>,
        planes: &QuantizedFrame,
        gaussians: core::ops::Range<usize>,
        digests: &mut Vec<UnitDigest>,
    ) -> Result<Option<u64>> {
        if !self.options.verify {
            return Ok(None);
        }
        digests.push(unit_digest(planes, gaussians));
        let computed = frame_digest(digests);
        let stored = unit.refinement.header.refinement_digest;
        if computed != stored {
            return Err(Error::new(unit.payload_at, "7.9", ErrorKind::Digest { stored, computed }));
        }
        Ok(Some(computed))
    }
}

fn parse_refinement<'a>(
    unit: &Unit<'a>,
    sequence: &SequenceParameters,
    frame: &FrameHeader,
    gop: &Gop,
) -> Result<Refinement<'a>> {
    let at = unit.payload_at;
    let (header, rest) = RefinementHeader::parse(unit.payload, at, sequence)?;
    let expected = sequence.refinement_length(unit.header.refinement, frame.gaussian_count);
    let count_at = element_at(&RefinementHeader::TABLE, at, "gaussian_count");
    same(count_at, "6.9", "gaussian_count", header.gaussian_count, expected)?;
    gop.colour(gop.transforms(frame, at)?, &header.sh(), 0, (&RefinementHeader::TABLE, at))?;
    Refinement::parse_behind(header, rest, at, sequence)
}
