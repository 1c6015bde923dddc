//! A unit applied to its list: clauses 7.4 to 7.7.
//!
//! In an I frame the list of the layer below becomes that of the unit. In a P or B frame it is the list of the reference
//! frame, displaced by the cells of the frame; where neither these nor the unit change anything, it is that list itself.

use super::frame::{Context, FrameInProgress};
use super::lists::Head;
use crate::frame::QuantizedFrame;
use crate::frame_state::{FrameState, span_log2};
use crate::increment::{Applied, Situation, Temporal, Unit, apply, is_idle};
use crate::interrupt::Interrupt;
use crate::list::{Change, GaussianList};
use crate::moves::{MoveSpace, SpanRatio};
use splatstream_format::syntax::IncrementHeader;
use splatstream_format::{Error, Result};
use std::sync::Arc;

/// What a unit makes of its list.
pub(super) struct Outcome {
    pub(super) list: Arc<GaussianList>,
    /// New Gaussians, the last ones of the list.
    pub(super) added: usize,
    /// Which parents stay; empty: all.
    pub(super) keep: Vec<bool>,
}

impl From<Applied> for Outcome {
    fn from(Applied { list, added, keep }: Applied) -> Self {
        Self { list: Arc::new(list), added: added.len(), keep }
    }
}

/// Whether a unit of a P or B frame predicts from the displaced lists before its own.
pub(super) fn predicts(header: &IncrementHeader) -> bool {
    header.move_predictor_count() > 0 || header.predictor_count() > 0
}

impl FrameInProgress {
    /// Applies a unit.
    pub(super) fn applied(
        &mut self,
        unit: &Unit<'_>,
        refinement: u8,
        context: &Context<'_>,
    ) -> Result<Outcome> {
        context.interrupt.check()?;
        let r = usize::from(refinement);
        let Some(reference) = context.reference else {
            // The lowest spatial layer has no parents.
            let empty = || Arc::new(GaussianList::empty(usize::from(context.sequence.sh_dimension())));
            let below = self.lists.lists.get(r).cloned().unwrap_or_else(empty);
            let parents = below.unchanged_in(self.lists.spares.list(&below), context.interrupt);
            context.interrupt.check()?;
            let lower: Vec<&QuantizedFrame> =
                self.lists.lists.iter().take(r).map(|list| &list.planes).collect();
            let situation = Situation { around: [&lower, &[]], temporal: None };
            return apply(unit, parents, &situation).map(Outcome::from);
        };
        let before = Arc::clone(reference.list(r)?);
        if self.field.is_empty() && is_idle(unit.header, &before) {
            let list = if before.change == Change::default() { before } else { Arc::new(before.unchanged()) };
            return Ok(Outcome { list, added: 0, keep: Vec::new() });
        }
        self.applied_to(unit, r, &before, reference, context.interrupt)
    }

    /// Applies a unit of a P or B frame to list r of the reference frame.
    fn applied_to(
        &mut self,
        unit: &Unit<'_>,
        r: usize,
        before: &Arc<GaussianList>,
        reference: &FrameState,
        interrupt: &Interrupt,
    ) -> Result<Outcome> {
        let ratio = SpanRatio::new(span_log2(self.index, reference), reference.span_log2);
        if predicts(unit.header) {
            self.displace_before(r, reference, interrupt);
        }
        let parents = self.parents(r, before, reference, interrupt);
        interrupt.check()?;
        let mut moves = None;
        if unit.header.move_predictor_count() > 0 {
            let mut space = self.moves_before(r, reference, ratio, unit.sequence.position_bits, interrupt);
            interrupt.check()?;
            space.push(before, &parents);
            moves = Some(space);
        }
        let temporal = Temporal { reference: before, ratio, moves: moves.as_ref() };
        let added = if unit.header.predictor_count() > 0 { self.added_before(r)? } else { Vec::new() };
        let lower: Vec<&QuantizedFrame> =
            self.lists.displaced.iter().take(r).map(|list| &list.planes).collect();
        let anchor = reference.anchor.iter().flat_map(|lists| lists.iter().skip(r.saturating_add(1)));
        let after: Vec<&QuantizedFrame> = anchor.map(|list| &list.planes).chain(&added).collect();
        let situation = Situation { around: [&lower, &after], temporal: Some(temporal) };
        let applied = apply(unit, parents, &situation)?;
        interrupt.check()?;
        if let Some(mut space) = moves {
            space.settle(&applied.list, &applied.keep);
            (self.lists.spares.moves, self.lists.has_moves) = (space, true);
        }
        Ok(applied.into())
    }

    /// List r of the reference frame, displaced, to be changed. Where a unit may still need it, a copy is kept.
    fn parents(
        &mut self,
        r: usize,
        before: &GaussianList,
        reference: &FrameState,
        interrupt: &Interrupt,
    ) -> GaussianList {
        if r < self.lists.displaced_needed {
            self.displace_before(r.saturating_add(1), reference, interrupt);
            if let Some(displaced) = self.lists.displaced.get(r) {
                return displaced.unchanged_in(self.lists.spares.list(before), interrupt);
            }
        }
        let mut parents = before.unchanged_in(self.lists.spares.list(before), interrupt);
        parents.displace_unless(interrupt, &self.field);
        parents
    }

    /// Displaces the first lists of the reference frame, `end` of them, unless units before have asked for them.
    fn displace_before(&mut self, end: usize, reference: &FrameState, interrupt: &Interrupt) {
        for list in reference.lists.iter().take(end).skip(self.lists.displaced.len()) {
            if interrupt.is_requested() {
                return;
            }
            let displaced = match self.field.is_empty() {
                true => Arc::clone(list),
                false => {
                    let mut displaced = list.unchanged_in(self.lists.spares.list(list), interrupt);
                    displaced.displace_unless(interrupt, &self.field);
                    Arc::new(displaced)
                }
            };
            self.lists.displaced.push(displaced);
        }
    }

    /// The parents of the units before unit r, with their motions; their lists have been displaced.
    fn moves_before(
        &mut self,
        r: usize,
        reference: &FrameState,
        ratio: SpanRatio,
        position_bits: u8,
        interrupt: &Interrupt,
    ) -> MoveSpace {
        let mut space = core::mem::take(&mut self.lists.spares.moves);
        if !core::mem::take(&mut self.lists.has_moves) {
            space.restart(ratio, position_bits, interrupt);
        }
        let units = reference.lists.iter().zip(&self.lists.displaced).zip(&self.lists.lists);
        let units = units.zip(&self.lists.kept).take(r).skip(space.len());
        for (((before, displaced), list), keep) in units {
            if interrupt.is_requested() {
                break;
            }
            space.push(before, displaced);
            space.settle(list, keep);
        }
        space
    }

    /// The Gaussians that the units before unit r added.
    ///
    /// # Errors
    /// A fault: a list has fewer Gaussians than its unit has left.
    fn added_before(&self, r: usize) -> Result<Vec<QuantizedFrame>> {
        let added = |(list, head): (&Arc<GaussianList>, &Head)| {
            let added =
                head.size.checked_sub(head.added).and_then(|start| list.planes.part(start..head.size));
            added.ok_or(Error::fault("the new Gaussians of a unit at the end of its list"))
        };
        self.lists.lists.iter().zip(&self.lists.heads).take(r).map(added).collect()
    }
}
