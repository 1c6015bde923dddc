//! A frame in progress: which increments are accepted (clause 7.1.4).
//!
//! The payload of an increment is divided when it comes; its blocks are decoded later, together with those of the units
//! after it, so that all cores have work ([`super::decoding`]). Until then the unit counts as good. That changes nothing:
//! an error in a unit of refinement r makes the decoder discard units of refinements from r on, and no other unit depends
//! on it. Before an error is reported, the units before it are decoded, so that errors come in stream order.

use super::lists::Lists;
use super::options::Options;
use super::phase::{same, unexpected};
use crate::buffers::{BufferPool, Workspace};
use crate::displacement::CellField;
use crate::entropy_state::UnitEntropy;
use crate::fault;
use crate::frame_state::FrameState;
use crate::gop::{Gop, element_at};
use crate::interrupt::Interrupt;
use crate::operating_point::OperatingPoint;
use splatstream_format::payload::Increment;
use splatstream_format::syntax::{
    FrameHeader, FrameRole, IncrementHeader, ListSizes, Profile, SequenceParameters, UnitHeader,
};
use splatstream_format::unit::Unit;
use splatstream_format::{Error, ErrorKind, Result};
use std::sync::Arc;

/// What stands around a frame.
#[derive(Clone, Copy)]
pub(super) struct Context<'d> {
    pub(super) options: &'d Options,
    pub(super) interrupt: &'d Interrupt,
    pub(super) buffers: &'d BufferPool,
    pub(super) profile: Profile,
    pub(super) sequence: &'d SequenceParameters,
    pub(super) gop: &'d Gop,
    /// The reference frame of a P or B frame, if its header was decoded.
    pub(super) reference: Option<&'d FrameState>,
}

impl Context<'_> {
    /// What tasks that decode its blocks share.
    pub(super) fn workspace(&self) -> Workspace<'_> {
        Workspace { buffers: self.buffers, interrupt: self.interrupt }
    }
}

/// A frame whose units are arriving.
pub(super) struct FrameInProgress {
    /// Display index.
    pub(super) index: u32,
    /// The operating point in force where it starts.
    pub(super) point: OperatingPoint,
    /// Absolute offset of the payload of its header.
    pub(super) payload_at: u64,
    pub(super) header: FrameHeader,
    pub(super) role: FrameRole,
    /// The digest of its carried lists, and its absolute offset.
    pub(super) carried_digest: Option<(u64, u64)>,
    /// Where the reference frame is kept, if it is.
    pub(super) reference: Option<usize>,
    /// The cells that move.
    pub(super) field: Arc<CellField>,
    /// Whether an increment of the frame came, decoded or not.
    pub(super) seen: bool,
    /// Units that were accepted and are not yet decoded.
    pub(super) pending: Vec<PendingUnit>,
    /// The state if all pending units are good.
    pub(super) expected: Progress,
    /// The state after the units that were decoded.
    pub(super) decoded: Progress,
    pub(super) lists: Lists,
    /// Bytes of its units, and their entropy states if they are asked for.
    pub(super) bytes: u64,
    pub(super) entropy: Vec<UnitEntropy>,
    /// The first error of the frame.
    pub(super) error: Option<Error>,
    /// The identity of its first new Gaussian, and how many of these the units that were accepted announce.
    pub(super) identities: (u32, u32),
    /// Whether the bytes or its GOP have ended before all of its units had come.
    pub(super) is_cut: bool,
    /// Whether it has ended, and its content has been taken.
    pub(super) has_ended: bool,
}

/// Which units of a frame there are.
#[derive(Debug, Clone, Default)]
pub(super) struct Progress {
    /// Units of refinements from this one on are discarded.
    pub(super) limit: u8,
    /// The spatial layer of the last unit.
    layer: u8,
    /// Units of each spatial layer.
    pub(super) counts: [u8; 4],
    /// Gaussians of each list, at the highest spatial layer that has it.
    sizes: Vec<u32>,
}

/// An increment that has been accepted. It owns its payload: the bytes of a stream may come and go.
pub(super) struct PendingUnit {
    spatial_layer: u8,
    refinement: u8,
    payload: Vec<u8>,
    payload_at: u64,
    bytes: u64,
}

/// An increment that has been divided.
pub(super) struct DividedUnit<'a> {
    pub(super) spatial_layer: u8,
    pub(super) refinement: u8,
    pub(super) increment: Increment<'a>,
    pub(super) payload_at: u64,
    pub(super) bytes: u64,
}

/// An error of an increment, and the refinements that are still accepted after it.
pub(super) struct Refused {
    pub(super) error: Error,
    pub(super) limit: u8,
}

impl Progress {
    /// Of a frame without units that takes lists below `limit`.
    pub(super) fn new(limit: u8) -> Self {
        Self { limit, ..Self::default() }
    }

    /// Units of a spatial layer; none of one that the sequence has not.
    pub(super) fn count(&self, layer: u8) -> u8 {
        self.counts.get(usize::from(layer)).copied().unwrap_or(0)
    }

    /// Gaussians of list h; none before its first unit.
    fn size(&self, h: u8) -> u32 {
        self.sizes.get(usize::from(h)).copied().unwrap_or(0)
    }

    /// Gaussians of the lists before list h.
    fn size_before(&self, h: u8) -> u32 {
        self.sizes.iter().take(h.into()).copied().fold(0, u32::saturating_add)
    }

    /// Whether there is each unit that `takes` tells by spatial layer and refinement.
    fn has_all(&self, sequence: &SequenceParameters, intra: bool, takes: impl Fn(u8, u8) -> bool) -> bool {
        let top = sequence.spatial_layer_count.saturating_sub(1);
        let mut layers = if intra { 0..=top } else { top..=top };
        layers.all(|layer| (self.count(layer)..sequence.refinement_count).all(|r| !takes(layer, r)))
    }

    /// Whether unit (s, r) is the next: the units of an I frame come layer by layer, and a layer has no list that the layer
    /// below lacks.
    fn expects(&self, layer: u8, refinement: u8, intra: bool) -> bool {
        let has_parents = match layer.checked_sub(1) {
            Some(below) if intra => self.count(below) > refinement,
            _ => true,
        };
        layer >= self.layer && refinement == self.count(layer) && has_parents
    }

    /// Takes a unit that leaves its list with `size` Gaussians.
    pub(super) fn take(&mut self, layer: u8, refinement: u8, size: u32) {
        self.layer = layer;
        if let Some(count) = self.counts.get_mut(usize::from(layer)) {
            *count = count.saturating_add(1);
        }
        match self.sizes.get_mut(usize::from(refinement)) {
            Some(slot) => *slot = size,
            None => self.sizes.push(size),
        }
    }
}

impl FrameInProgress {
    pub(super) const fn is_intra(&self) -> bool {
        self.role.reference.is_none()
    }

    /// Whether all of its units have been accepted that `takes` tells by spatial layer and refinement.
    pub(super) fn has_all(&self, sequence: &SequenceParameters, takes: impl Fn(u8, u8) -> bool) -> bool {
        self.expected.has_all(sequence, self.is_intra(), takes)
    }

    /// Accepts an increment that belongs to the operating point. `None` if it is discarded.
    pub(super) fn accept<'u>(
        &self,
        unit: &Unit<'u>,
        context: &Context<'_>,
    ) -> core::result::Result<Option<DividedUnit<'u>>, Refused> {
        let header = &unit.header;
        let limit = self.expected.limit;
        let costs_nothing = |error| Refused { error, limit };
        let frame_at = element_at(&UnitHeader::TABLE, unit.at, "frame");
        same(frame_at, "7.1.2", "frame", header.frame, self.index).map_err(costs_nothing)?;
        let refinements = context.sequence.refinement_count;
        if header.refinement >= refinements {
            let at = element_at(&UnitHeader::TABLE, unit.at, "refinement");
            let (value, max) = (header.refinement.into(), refinements.saturating_sub(1).into());
            let kind = ErrorKind::OutOfRange { element: "refinement", value, min: 0, max };
            return Err(costs_nothing(Error::new(at, "7.1.4", kind)));
        }
        if header.refinement >= limit {
            return Ok(None);
        }
        let costs_list = |error| Refused { error, limit: header.refinement };
        self.check_layers(unit, context).map_err(costs_list)?;
        let top = context.sequence.spatial_layer_count.saturating_sub(1);
        let layer = if self.is_intra() { header.spatial_layer } else { top };
        if header.spatial_layer != layer || !self.expected.expects(layer, header.refinement, self.is_intra())
        {
            let limit = limit.min(self.expected.count(layer));
            return Err(Refused { error: unexpected(unit), limit });
        }
        unit.check_payload().map_err(costs_list)?;
        let increment = self.divided(unit, context).map_err(costs_list)?;
        Ok(Some(DividedUnit {
            spatial_layer: header.spatial_layer,
            refinement: header.refinement,
            increment,
            payload_at: unit.payload_at,
            bytes: unit_bytes(unit),
        }))
    }

    /// The layers of a unit are layers of the sequence and of the frame.
    fn check_layers(&self, unit: &Unit<'_>, context: &Context<'_>) -> Result<()> {
        unit.header.validate_layers(unit.at, context.sequence)?;
        let at = element_at(&UnitHeader::TABLE, unit.at, "temporal_layer");
        same(at, "7.3.1", "temporal_layer", unit.header.temporal_layer, self.role.temporal_layer)
    }

    /// Checks the elements of the payload, those that relate to the frame included, and divides it into sections.
    fn divided<'u>(&self, unit: &Unit<'u>, context: &Context<'_>) -> Result<Increment<'u>> {
        let Context { sequence, gop, options, .. } = context;
        let at = unit.payload_at;
        let (header, _) = IncrementHeader::parse(unit.payload, at, sequence, context.profile)?;
        header.within(at, unit.payload.len(), &options.limits)?;
        header.validate_counts(at, &self.sizes(unit, context)?)?;
        let transforms = gop.transforms(&self.header, self.payload_at)?;
        gop.colour(transforms, &header, unit.header.temporal_layer, at)?;
        Increment::parse(unit.payload, at, sequence, context.profile, &options.limits)
    }

    /// What the frame says about the list of a unit.
    ///
    /// # Errors
    /// A fault: the reference frame lacks a list that this one can have.
    fn sizes(&self, unit: &Unit<'_>, context: &Context<'_>) -> Result<ListSizes> {
        let (sequence, refinement) = (context.sequence, unit.header.refinement);
        let all = self.header.gaussian_count;
        let before = self.expected.size_before(refinement);
        let max_size = all.saturating_sub(before);
        let is_top = unit.header.spatial_layer.saturating_add(1) == sequence.spatial_layer_count;
        let is_last = refinement.saturating_add(1) == sequence.refinement_count;
        let size = match self.is_intra() {
            true => is_top.then(|| sequence.refinement_length(refinement, all)),
            false => is_last.then_some(max_size),
        };
        let parents = match (context.reference, unit.header.spatial_layer) {
            (Some(reference), _) => fault::count(reference.list(refinement.into())?.len())?,
            (None, 0) => 0,
            (None, _) => self.expected.size(refinement),
        };
        Ok(ListSizes { parents, intra: self.is_intra(), size, max_size })
    }

    /// Puts an accepted unit with this payload to those that wait.
    pub(super) fn push(&mut self, unit: &DividedUnit<'_>, payload: &[u8]) {
        let &DividedUnit { spatial_layer, refinement, payload_at, bytes, .. } = unit;
        self.expected.take(spatial_layer, refinement, unit.increment.header.list_size());
        // Modulo 2^32, as identities count.
        self.identities.1 = self.identities.1.wrapping_add(unit.increment.header.new_count);
        let payload = payload.to_vec();
        self.pending.push(PendingUnit { spatial_layer, refinement, payload, payload_at, bytes });
    }

    /// The identity of the first new Gaussian of the frame after this one. It does not depend on what this one makes of its
    /// units.
    pub(super) const fn next_identity(&self) -> u32 {
        let (first, announced) = self.identities;
        first.wrapping_add(announced)
    }

    /// Takes note of an error; units of refinements from `limit` on are discarded.
    pub(super) fn fail(&mut self, Refused { error, limit }: &Refused) {
        self.error.get_or_insert(*error);
        self.decoded.limit = self.decoded.limit.min(*limit);
        self.expected.limit = self.decoded.limit;
    }
}

impl PendingUnit {
    /// The unit, divided as when it was accepted.
    ///
    /// # Errors
    /// None of a unit that was accepted.
    pub(super) fn divided(&self, context: &Context<'_>) -> Result<DividedUnit<'_>> {
        let Self { spatial_layer, refinement, ref payload, payload_at, bytes } = *self;
        let Context { sequence, profile, options, .. } = *context;
        let increment = Increment::parse(payload, payload_at, sequence, profile, &options.limits)?;
        Ok(DividedUnit { spatial_layer, refinement, increment, payload_at, bytes })
    }
}

/// Bytes of a unit, its header included.
pub(super) fn unit_bytes(unit: &Unit<'_>) -> u64 {
    let length = UnitHeader::SIZE.saturating_add(unit.payload.len());
    u64::try_from(length).unwrap_or(u64::MAX)
}
