//! Frames of profile Dynamic: increments in layers, references, what is carried. Clauses 7.13, 7.18, 7.20.

use super::assembly::Assembly;
use super::expected::unexpected;
use super::{DecodedFrame, Decoder, FrameUnits, Options, PendingFrame, keep, unit_bytes};
use crate::frame_state::FrameState;
use splatstream_format::payload::Increment;
use splatstream_format::syntax::{IncrementHeader, SequenceParameters};
use splatstream_format::unit::Unit;
use splatstream_format::{Error, ErrorKind, Limits, Result};
use std::sync::Arc;

/// A decoded frame and how far others may refer to it.
#[derive(Debug, Clone)]
pub(super) struct Reference {
    pub(super) number: u32,
    /// Refinements that frames which refer to this one can have; 0: none can be decoded.
    pub(super) level: u8,
    pub(super) state: Arc<FrameState>,
}

/// The last frame of each temporal layer.
#[derive(Debug, Clone, Default)]
pub(super) struct References {
    layers: [Option<Reference>; 4],
}

impl References {
    fn find(&self, number: u32) -> Option<&Reference> {
        self.layers.iter().flatten().find(|reference| reference.number == number)
    }

    /// A frame of a layer ends the use of those of higher layers.
    fn store(&mut self, layer: u8, reference: Reference) {
        for (place, slot) in (0_u8..).zip(&mut self.layers) {
            if place > layer {
                *slot = None;
            } else if place == layer {
                *slot = Some(reference.clone());
            }
        }
    }
}

/// A frame whose increments are still arriving.
pub(super) struct LayeredFrame<'a> {
    /// Display index of the frame it refers to.
    reference: Option<u32>,
    /// Refinements that the reference allows.
    level: u8,
    /// Refinements of the sequence.
    refinements: u8,
    /// Gaussians of the homes of the reference.
    parents: Vec<u32>,
    units: Vec<PendingIncrement<'a>>,
}

/// An increment that has been divided.
pub(super) struct PendingIncrement<'a> {
    pub(super) spatial_layer: u8,
    pub(super) refinement: u8,
    pub(super) increment: Increment<'a>,
    pub(super) payload_at: u64,
    pub(super) bytes: u64,
}

impl LayeredFrame<'_> {
    pub(super) fn new(
        reference: Option<u32>,
        references: &References,
        sequence: &SequenceParameters,
    ) -> Self {
        let refinements = sequence.refinement_count;
        let found = reference.and_then(|number| references.find(number));
        let level = match (reference, found) {
            (None, _) => refinements,
            (Some(_), found) => found.map_or(0, |reference| reference.level),
        };
        let homes = found.map(|reference| reference.state.homes.as_slice()).unwrap_or_default();
        let parents = homes.iter().map(|home| u32::try_from(home.len()).unwrap_or(u32::MAX)).collect();
        Self { reference, level, refinements, parents, units: Vec::new() }
    }

    /// Whether a unit is passed over because the reference frame was not decoded as far.
    pub(super) const fn is_beyond(&self, refinement: u8) -> bool {
        refinement >= self.level && refinement < self.refinements
    }

    /// Gaussians that a unit may change.
    fn parent_count(&self, spatial_layer: u8, refinement: u8) -> u32 {
        if self.reference.is_some() {
            return self.parents.get(usize::from(refinement)).copied().unwrap_or(0);
        }
        let is_below = |unit: &&PendingIncrement<'_>| {
            unit.spatial_layer.wrapping_add(1) == spatial_layer && unit.refinement == refinement
        };
        self.units.iter().find(is_below).map_or(0, |unit| unit.increment.header.home_count())
    }

    /// Whether a unit, of a layer of the sequence, is the next: of the same layer, or the first of the next layer of an
    /// intra frame.
    fn expects(&self, spatial_layer: u8, refinement: u8, sequence: &SequenceParameters) -> bool {
        let top = sequence.spatial_layer_count.wrapping_sub(1);
        let allowed = refinement < sequence.refinement_count;
        let next = match self.units.last() {
            None => refinement == 0 && spatial_layer == if self.reference.is_some() { top } else { 0 },
            Some(last) if spatial_layer == last.spatial_layer => {
                refinement == last.refinement.wrapping_add(1)
            }
            Some(last) => refinement == 0 && spatial_layer == last.spatial_layer.wrapping_add(1),
        };
        let below = spatial_layer.checked_sub(1).filter(|_| self.reference.is_none());
        let has_parents = below.is_none_or(|below| {
            let mut lower = self.units.iter().filter(|unit| unit.spatial_layer == below);
            lower.any(|unit| unit.refinement == refinement)
        });
        allowed && next && has_parents
    }
}

impl<'a> Decoder<'a> {
    /// Clause 7.13: an increment that belongs to the operating point.
    pub(super) fn increment(&mut self, unit: &Unit<'a>) -> Result<()> {
        if !self.arrives(unit)? {
            return Ok(());
        }
        let limits = self.limits();
        let (Some(frame), Some((sequence, _)), Some(gop)) = (&mut self.frame, &self.sequence, &self.gop)
        else {
            return Err(unexpected(unit));
        };
        let FrameUnits::Layered(layered) = &mut frame.units else { return Err(unexpected(unit)) };
        let (spatial_layer, refinement) = (unit.header.spatial_layer, unit.header.refinement);
        let parsed = if layered.expects(spatial_layer, refinement, sequence) {
            let parents = layered.parent_count(spatial_layer, refinement);
            let has_cells = layered.reference.is_some() && refinement == 0;
            let counts = (parents, has_cells, frame.header.gaussian_count);
            let check = |header: &IncrementHeader| {
                let transforms = gop.transforms(&frame.header, unit.payload_at)?;
                let table = (&IncrementHeader::TABLE, unit.payload_at);
                gop.colour(transforms, &header.sh(), unit.header.temporal_layer, table).map(drop)
            };
            parse(unit, sequence, counts, &limits, check)
        } else {
            Err(unexpected(unit))
        };
        let (payload_at, bytes) = (unit.payload_at, unit_bytes(unit));
        let pending =
            |increment| PendingIncrement { spatial_layer, refinement, increment, payload_at, bytes };
        keep(parsed.map(pending), &mut layered.units, &mut frame.lost, self.options.tolerant)
    }

    /// Decodes a frame and keeps it for those that refer to it; `at` is the offset of the unit that ends it, if one
    /// does.
    pub(super) fn close_layered(
        &mut self,
        frame: &PendingFrame<'a>,
        layered: &LayeredFrame<'a>,
        at: Option<u64>,
    ) -> Result<Option<DecodedFrame>> {
        let Some((decoded, level, state)) = self.decode_layered(frame, layered, at)? else { return Ok(None) };
        let reference = Reference { number: frame.number, level, state };
        self.references.store(frame.place.temporal_layer, reference);
        Ok(Some(decoded))
    }

    /// What a frame shows; its level and state for frames that refer to it.
    pub(super) fn decode_layered(
        &self,
        frame: &PendingFrame<'a>,
        layered: &LayeredFrame<'a>,
        at: Option<u64>,
    ) -> Result<Option<(DecodedFrame, u8, Arc<FrameState>)>> {
        let (Some((sequence, _)), Some(gop)) = (&self.sequence, &self.gop) else { return Ok(None) };
        let reference = layered.reference.and_then(|number| self.references.find(number));
        let mut lost = frame.lost;
        let options = Options { limits: self.limits(), ..self.options };
        let mut assembly = Assembly::new(options, sequence, gop, frame, reference)?;
        if let Err(error) = assembly.units(&layered.units) {
            lost = Some(error);
        }
        let finished = assembly.finish();
        // SS-ER-007: found because an error ends the frame, it comes after that error.
        let comes_first = lost.is_none() && at.is_some();
        let carried_fault = finished.fault.filter(|_| !comes_first);
        lost = lost.or(finished.fault.filter(|_| comes_first));
        // SS-LO-005: a frozen frame that no error of its own explains.
        if let (0, Some(reference), None, Some(at)) = (finished.level, layered.reference, lost, at) {
            let kind = ErrorKind::Undefined { element: "reference frame", id: reference.into() };
            lost = Some(Error::new(at, "7.20", kind));
        }
        match lost {
            Some(error) if !self.options.tolerant => Err(error),
            _ => {
                let decoded = DecodedFrame { lost, carried_fault, ..finished.decoded };
                Ok(Some((decoded, finished.level, finished.state)))
            }
        }
    }
}

/// 9.3: the fixed part and its relations, then the sections. `counts` go to
/// [`IncrementHeader::validate_counts`], the rest of the relations to `check`.
fn parse<'a>(
    unit: &Unit<'a>,
    sequence: &SequenceParameters,
    (parents, has_cells, gaussians): (u32, bool, u32),
    limits: &Limits,
    check: impl FnOnce(&IncrementHeader) -> Result<()>,
) -> Result<Increment<'a>> {
    let at = unit.payload_at;
    let (header, rest) = IncrementHeader::parse(unit.payload, at, sequence)?;
    header.within(at, limits)?;
    header.validate_counts(at, parents, has_cells, gaussians)?;
    check(&header)?;
    Increment::parse_behind(header, rest, at, sequence)
}
