//! The end of a frame: what is shown, with which compensation, and what later frames refer to. Clauses 7.3.3 and 7.8.

use super::decoded::{Compensation, DecodedFrame};
use super::frame::{Context, FrameInProgress};
use super::lists::Lists;
use super::spares::Spares;
use crate::carried::Carried;
use crate::digest::lists_digest;
use crate::fault;
use crate::frame::QuantizedFrame;
use crate::frame_state::{FrameState, span_log2};
use crate::interrupt::Interrupt;
use crate::list::GaussianList;
use crate::shift::Shift;
use splatstream_format::{Error, ErrorKind, Result};
use std::sync::Arc;

/// Identities that are given between two looks at the interrupt.
const IDENTITIES: usize = 1 << 16;

/// A frame that has ended.
pub(super) struct Closed {
    pub(super) decoded: DecodedFrame,
    /// For frames that refer to it.
    pub(super) state: FrameState,
    /// The carried lists are not those of their digest.
    pub(super) difference: Option<Error>,
    /// The identity of the next new Gaussian.
    pub(super) next_identity: u32,
    /// For the frames after this one.
    pub(super) spares: Spares,
}

impl FrameInProgress {
    /// Takes the content of the frame, all units of which have been decoded. The digest of carried lists is compared if the frame
    /// is not cut short.
    ///
    /// # Errors
    /// A fault: what has been decoded does not fit together. So it is where an interrupt is requested.
    pub(super) fn close(
        &mut self,
        context: &Context<'_>,
        reference: Option<&mut FrameState>,
        is_whole: bool,
    ) -> Result<Closed> {
        self.has_ended = true;
        self.carried_digest = self.carried_digest.filter(|_| is_whole);
        let mut decoded = DecodedFrame::empty(self.index, self.role.frame_type);
        let level = u8::try_from(self.lists.heads.len());
        decoded.level = level.map_err(|_| Error::fault("as many lists as there are refinements"))?;
        decoded.spatial_layer = self.lists.heads.last().map_or(0, |head| head.spatial_layer);
        decoded.bytes = self.bytes;
        decoded.entropy = core::mem::take(&mut self.entropy);
        decoded.error = self.error;
        let has_digest = context.options.verify && decoded.level > 0;
        decoded.digest = has_digest.then(|| lists_digest(&self.lists.digests));
        let refers_to_reduced = reference.as_ref().is_some_and(|reference| reference.is_reduced);
        let mut closed = match self.is_intra() {
            true => self.close_intra(context, decoded),
            false => self.close_predicted(context, decoded, reference),
        }?;
        let decoded = &mut closed.decoded;
        let asked = context.sequence.refinement_count.min(self.point.refinement.saturating_add(1));
        decoded.is_reduced = self.is_cut
            || decoded.is_lost
            || decoded.error.is_some()
            || refers_to_reduced && decoded.level < asked;
        closed.state.is_reduced = decoded.is_reduced;
        closed.decoded.check(context.sequence.sh_degree, context.options.identities)?;
        Ok(closed)
    }

    fn close_intra(&mut self, context: &Context<'_>, mut decoded: DecodedFrame) -> Result<Closed> {
        let sequence = context.sequence;
        let sh_planes = usize::from(sequence.sh_dimension());
        let refinements = sequence.refinement_count;
        let top = sequence.spatial_layer_count.saturating_sub(1);
        let layers = (0..sequence.spatial_layer_count).map(|layer| self.decoded.count(layer));
        let is_complete = layers.into_iter().all(|count| count == refinements);
        let level = match sequence.whole_anchor() {
            true if is_complete => refinements,
            true => 0,
            false => self.decoded.count(top),
        };
        let is_short = decoded.level < refinements;
        let shift = self.lists.shift_if(is_short);
        decoded.compensation = Compensation { exact: shift, ..Compensation::default() };
        decoded.is_lost = decoded.level == 0;
        let mut state =
            FrameState { index: self.index, level, carried_shift: shift, ..FrameState::default() };
        if context.gop.header.is_predicted() {
            self.lists.divide(context.options.identities, context.interrupt)?;
            state.identities = self.lists.identities.clone();
            let lists = || self.lists.lists.iter().cloned();
            state.carried = (decoded.level > 0).then(|| Carried::new(lists(), &self.lists.identities));
            state.anchor = sequence.whole_anchor().then(|| self.lists.lists.as_slice().into());
            state.is_exact = level == refinements;
        }
        decoded.planes = self.lists.planes(sh_planes, context);
        if context.options.identities {
            decoded.identities = self.lists.shown_identities(decoded.planes.len(), context.interrupt)?;
        }
        let next_identity = self.next_identity();
        let Lists { lists, digests, models, displaced, mut spares, .. } = core::mem::take(&mut self.lists);
        (state.lists, state.models, state.digests) = (lists, models.first, digests);
        spares.end_frame(displaced);
        Ok(Closed { decoded, state, difference: None, next_identity, spares })
    }

    fn close_predicted(
        &mut self,
        context: &Context<'_>,
        mut decoded: DecodedFrame,
        reference: Option<&mut FrameState>,
    ) -> Result<Closed> {
        let mut state = FrameState { index: self.index, level: decoded.level, ..FrameState::default() };
        let level = usize::from(decoded.level);
        let shows_subset = context.options.subset && level > 0;
        let mut difference = None;
        decoded.planes = self.lists.planes(usize::from(context.sequence.sh_dimension()), context);
        if context.options.identities {
            decoded.identities = self.lists.shown_identities(decoded.planes.len(), context.interrupt)?;
            state.identities = self.lists.identities.clone();
        }
        if let Some(reference) = reference {
            state.span_log2 = span_log2(self.index, reference);
            state.anchor = reference.anchor.clone();
            state.is_exact = reference.is_exact && level > 0;
            state.carried_shift = reference.carried_shift;
            let digest = self.carried_digest.filter(|_| context.options.verify && !context.options.subset);
            let count = reference.carried.as_ref().map_or(0, Carried::len);
            let digest = digest.filter(|_| state.is_exact && level < count && self.error.is_none());
            let from = if digest.is_some() { 0 } else { level };
            let from = if shows_subset { count } else { from };
            state.carried = reference
                .carried
                .as_mut()
                .map(|carried| carried.moved(&self.field, level > 0, from, context.interrupt));
            if let (Some((stored, at)), Some(carried)) = (digest, &mut state.carried) {
                let computed = carried.digest(context.interrupt);
                decoded.carried_digest = Some(computed);
                let kind = ErrorKind::Digest { stored, computed };
                difference = (computed != stored).then_some(Error::new(at, "7.9.3", kind));
            }
            if let (Some(carried), false) = (&mut state.carried, shows_subset) {
                show_carried(&mut decoded, carried, context.interrupt);
            }
        }
        decoded.error = decoded.error.or(difference);
        decoded.is_lost = level == 0 && decoded.carried_lists == 0;
        let refinements = context.sequence.refinement_count;
        decoded.compensation = self.lists.compensation(&decoded, refinements, state.carried_shift);
        let next_identity = self.next_identity();
        let Lists { lists, digests, models, displaced, mut spares, .. } = core::mem::take(&mut self.lists);
        (state.lists, state.models, state.digests) = (lists, models.first, digests);
        spares.end_frame(displaced);
        Ok(Closed { decoded, state, difference, next_identity, spares })
    }
}

/// Shows the carried lists from the level of the frame on.
fn show_carried(decoded: &mut DecodedFrame, carried: &mut Carried, interrupt: &Interrupt) {
    let exact = decoded.planes.len();
    for (list, identities) in carried.lists_from(decoded.level.into(), interrupt) {
        if interrupt.is_requested() {
            return;
        }
        decoded.planes.append_unless(interrupt, &list.planes);
        decoded.identities.extend_from_slice(identities);
        decoded.carried_lists = decoded.carried_lists.saturating_add(1);
    }
    decoded.carried = decoded.planes.len().saturating_sub(exact);
}

impl Lists {
    /// The exact Gaussians, list by list.
    fn planes(&mut self, sh_planes: usize, context: &Context<'_>) -> QuantizedFrame {
        if self.lists.is_empty() && !self.planes.is_empty() {
            return core::mem::take(&mut self.planes);
        }
        let parts: Vec<&QuantizedFrame> = self.lists.iter().map(|list| &list.planes).collect();
        let count = parts.iter().map(|part| part.len()).fold(0, usize::saturating_add);
        let blank = context.buffers.frames.blank(count, sh_planes, context.interrupt);
        QuantizedFrame::joined(blank, &parts, context.interrupt)
    }

    /// The identities of the exact Gaussians, of which there are so many. Where an interrupt is requested, some are missing.
    fn shown_identities(&mut self, count: usize, interrupt: &Interrupt) -> Result<Vec<u32>> {
        let mut shown = Vec::with_capacity(count);
        if self.identities.is_empty() {
            let mut identities = self.identify(fault::count(count)?);
            while shown.len() < count && !interrupt.is_requested() {
                shown.extend(identities.by_ref().take(IDENTITIES));
            }
        }
        for identities in self.identities.iter().take_while(|_| !interrupt.is_requested()) {
            shown.extend_from_slice(identities);
        }
        Ok(shown)
    }

    /// What the last unit says of a frame that ends with it, if that lacks refinements. Nothing is added to a whole one.
    fn shift_if(&self, is_short: bool) -> Shift {
        self.heads.last().filter(|_| is_short).map_or_else(Shift::default, |head| head.shift)
    }

    /// Clause 7.8.3, of a P or B frame. Where carried lists fill the frame, only Gaussians that are not of the I frame
    /// are compensated.
    fn compensation(&self, decoded: &DecodedFrame, refinements: u8, carried: Shift) -> Compensation {
        let is_short = decoded.level < refinements;
        let exact = self.shift_if(is_short);
        if decoded.carried_lists == 0 {
            return Compensation { exact, ..Compensation::default() };
        }
        let is_new = |list: &Arc<GaussianList>| list.anchor.iter().map(|anchor| !anchor).collect::<Vec<_>>();
        let only = match exact.is_zero() {
            true => Vec::new(),
            false => self.lists.iter().flat_map(is_new).collect(),
        };
        Compensation { exact, only, carried }
    }
}
