//! The lists of a frame, as far as its units were decoded.

use super::spares::Spares;
use crate::digest::{ListDigest, lists_digest};
use crate::frame::QuantizedFrame;
use crate::interrupt::Interrupt;
use crate::list::GaussianList;
use crate::shift::Shift;
use splatstream_format::entropy::in_force::{ModelsInForce, ModelsOfFrame};
use splatstream_format::{Error, ErrorKind, Result};
use std::sync::Arc;

/// The lists of a frame so far: list h at the highest spatial layer that has it.
#[derive(Debug, Default)]
pub(super) struct Lists {
    /// The lists one after the other, as long as all were decoded straight into planes; `lists` is empty then.
    pub(super) planes: QuantizedFrame,
    pub(super) lists: Vec<Arc<GaussianList>>,
    /// The unit of each list.
    pub(super) heads: Vec<Head>,
    pub(super) digests: Vec<ListDigest>,
    pub(super) models: ModelsOfFrame,
    /// In a P or B frame: the first lists of the reference frame displaced, as far as units predicted from them.
    pub(super) displaced: Vec<Arc<GaussianList>>,
    /// How many of them units that are still to be applied may need.
    pub(super) displaced_needed: usize,
    /// Which parents the unit of each list has kept; empty: all.
    pub(super) kept: Vec<Vec<bool>>,
    /// In a P or B frame: whether there is a space of the parents of the first units, from which moves were predicted.
    pub(super) has_moves: bool,
    /// Memory of frames before, and that space.
    pub(super) spares: Spares,
    /// The identities of the Gaussians of each list, if they are asked for.
    pub(super) identities: Vec<Identities>,
    /// The identity of the next new Gaussian.
    pub(super) next_identity: u32,
}

/// The identities of the Gaussians of a list, in order.
pub(crate) type Identities = Arc<Vec<u32>>;

/// The last unit of a list.
#[derive(Debug, Clone, Copy)]
pub(super) struct Head {
    pub(super) spatial_layer: u8,
    pub(super) shift: Shift,
    /// Gaussians of the list, and how many of them, the last ones, the unit added.
    pub(super) size: usize,
    pub(super) added: usize,
}

impl Lists {
    /// Of a frame with these models in force before its first unit, whose new Gaussians have identities from this one on.
    pub(super) fn new(models: ModelsInForce, next_identity: u32, spares: Spares) -> Self {
        Self { models: ModelsOfFrame::starting_with(models), next_identity, spares, ..Self::default() }
    }

    /// So many new identities.
    pub(super) fn identify(&mut self, count: usize) -> impl Iterator<Item = u32> + use<> {
        let first = self.next_identity;
        self.next_identity = u32::try_from(count).unwrap_or(u32::MAX).wrapping_add(first);
        (0..count).scan(first, |next, _| {
            let identity = *next;
            *next = next.wrapping_add(1);
            Some(identity)
        })
    }

    /// Takes note of what a unit made of the identities of its parents.
    pub(super) fn follow_identities(&mut self, r: usize, parents: Identities, keep: &[bool], added: usize) {
        let mut identities = parents;
        if added > 0 || !keep.iter().all(|&keep| keep) {
            let changed = Arc::make_mut(&mut identities);
            crate::frame::retain(changed, keep);
            changed.extend(self.identify(added));
        }
        put(&mut self.identities, r, identities);
    }

    /// Makes lists of the planes; gives the Gaussians identities if `identifies` says so. Where an interrupt is requested,
    /// the lists mean nothing.
    pub(super) fn divide(&mut self, identifies: bool, interrupt: &Interrupt) {
        if !self.lists.is_empty() {
            return;
        }
        let mut start = 0_usize;
        // The planes of one list are its own: nothing is copied.
        let is_whole = self.heads.len() == 1;
        let heads = core::mem::take(&mut self.heads).into_iter().enumerate();
        for (r, head) in heads.take_while(|_| !interrupt.is_requested()) {
            let end = start.saturating_add(head.size);
            if identifies {
                self.follow_identities(r, Arc::default(), &[], head.size);
            }
            self.heads.push(head);
            let planes = match is_whole {
                true => core::mem::take(&mut self.planes),
                false => self.planes.part_unless(interrupt, start..end),
            };
            self.lists.push(Arc::new(GaussianList::of_planes_unless(interrupt, planes, true)));
            start = end;
        }
        self.planes = QuantizedFrame::default();
    }

    /// Compares the digest of lists 0 to r, of which the last is new.
    pub(super) fn check_digest(
        &mut self,
        refinement: u8,
        digest: ListDigest,
        stored: u64,
        at: u64,
    ) -> Result<()> {
        let r = usize::from(refinement);
        let mut digests = self.digests.get(..r).unwrap_or_default().to_vec();
        digests.push(digest.clone());
        let computed = lists_digest(&digests);
        if computed != stored {
            return Err(Error::new(at, "7.9.2", ErrorKind::Digest { stored, computed }));
        }
        put(&mut self.digests, r, digest);
        Ok(())
    }

    /// Takes the list that a unit leaves.
    pub(super) fn take(&mut self, refinement: u8, list: Arc<GaussianList>, head: Head) {
        put(&mut self.lists, refinement.into(), list);
        put(&mut self.heads, refinement.into(), head);
    }
}

/// Sets the value at an index, which is at most the length.
pub(super) fn put<T>(values: &mut Vec<T>, index: usize, value: T) {
    match values.get_mut(index) {
        Some(slot) => *slot = value,
        None => values.push(value),
    }
}
