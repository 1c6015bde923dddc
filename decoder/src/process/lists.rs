//! The lists of a frame, as far as its units were decoded.

use super::spares::Spares;
use crate::digest::{ListDigest, lists_digest};
use crate::fault;
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

    /// So many new identities. They count modulo 2^32, so that those of a GOP differ, which has fewer.
    pub(super) fn identify(&mut self, count: u32) -> impl Iterator<Item = u32> + use<> {
        let first = self.next_identity;
        self.next_identity = first.wrapping_add(count);
        (0..count).map(move |number| first.wrapping_add(number))
    }

    /// Takes note of what a unit made of the identities of its parents; without flags in `keep` all have stayed.
    ///
    /// # Errors
    /// A fault: there are no identities of the lists before, or others than parents.
    pub(super) fn follow_identities(
        &mut self,
        r: usize,
        parents: Identities,
        keep: &[bool],
        added: usize,
    ) -> Result<()> {
        let mut identities = parents;
        if !keep.is_empty() && keep.len() != identities.len() {
            return Err(Error::fault("an identity for each parent"));
        }
        if added > 0 || !keep.iter().all(|&keep| keep) {
            let changed = Arc::make_mut(&mut identities);
            crate::frame::retain(changed, keep);
            changed.extend(self.identify(fault::count(added)?));
        }
        put(&mut self.identities, r, identities)
    }

    /// Makes lists of the planes; gives the Gaussians identities if `identifies` says so. Where an interrupt is requested,
    /// the lists mean nothing.
    ///
    /// # Errors
    /// A fault: the planes are not those of the lists.
    pub(super) fn divide(&mut self, identifies: bool, interrupt: &Interrupt) -> Result<()> {
        const APART: Error = Error::fault("the planes of all lists one after the other");
        if !self.lists.is_empty() {
            return Ok(());
        }
        if self.heads.iter().map(|head| head.size).fold(0, usize::saturating_add) != self.planes.len() {
            return Err(APART);
        }
        let mut start = 0_usize;
        // The planes of one list are its own: nothing is copied.
        let is_whole = self.heads.len() == 1;
        let heads = core::mem::take(&mut self.heads).into_iter().enumerate();
        for (r, head) in heads.take_while(|_| !interrupt.is_requested()) {
            let end = start.saturating_add(head.size);
            if identifies {
                self.follow_identities(r, Arc::default(), &[], head.size)?;
            }
            self.heads.push(head);
            let planes = match is_whole {
                true => core::mem::take(&mut self.planes),
                false => self.planes.part_unless(interrupt, start..end).ok_or(APART)?,
            };
            self.lists.push(Arc::new(GaussianList::of_planes_unless(interrupt, planes, true)));
            self.kept.push(Vec::new());
            start = end;
        }
        self.planes = QuantizedFrame::default();
        Ok(())
    }

    /// Compares the digest of lists 0 to r, of which the last is new.
    ///
    /// # Errors
    /// Invalid: another digest. A fault: one of the lists before it has none.
    pub(super) fn check_digest(
        &mut self,
        refinement: u8,
        digest: ListDigest,
        stored: u64,
        at: u64,
    ) -> Result<()> {
        let r = usize::from(refinement);
        let before = self.digests.get(..r).ok_or(UNORDERED)?;
        let digests = [before, core::slice::from_ref(&digest)].concat();
        let computed = lists_digest(&digests);
        if computed != stored {
            return Err(Error::new(at, "7.9.2", ErrorKind::Digest { stored, computed }));
        }
        put(&mut self.digests, r, digest)
    }

    /// Takes the list that a unit leaves, and which parents the unit has kept.
    ///
    /// # Errors
    /// A fault: the lists before it are not there.
    pub(super) fn take(
        &mut self,
        refinement: u8,
        list: Arc<GaussianList>,
        head: Head,
        keep: Vec<bool>,
    ) -> Result<()> {
        let r = usize::from(refinement);
        put(&mut self.lists, r, list)?;
        put(&mut self.heads, r, head)?;
        put(&mut self.kept, r, keep)
    }
}

const UNORDERED: Error = Error::fault("each list after those before it");

/// Sets the value at an index.
///
/// # Errors
/// A fault: values before it are missing.
pub(super) fn put<T>(values: &mut Vec<T>, index: usize, value: T) -> Result<()> {
    let is_next = index == values.len();
    match values.get_mut(index) {
        Some(slot) => *slot = value,
        None if is_next => values.push(value),
        None => return Err(UNORDERED),
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn head(size: usize) -> Head {
        Head { spatial_layer: 0, shift: Shift::default(), size, added: size }
    }

    #[test]
    fn what_does_not_fit_is_a_fault_and_no_other_list() {
        let of_planes = |gaussians: usize| Lists {
            planes: QuantizedFrame::zeroed(gaussians, 0),
            heads: vec![head(2), head(1)],
            ..Lists::default()
        };
        let mut lists = of_planes(3);
        assert_eq!(lists.divide(true, Interrupt::NEVER), Ok(()));
        assert_eq!(lists.identities, [Arc::new(vec![0, 1]), Arc::new(vec![2])]);
        assert!(of_planes(2).divide(false, Interrupt::NEVER).is_err_and(|error| error.is_fault()));

        let list = || Arc::new(GaussianList::empty(0));
        let mut late = Lists::default();
        assert!(late.take(1, list(), head(0), Vec::new()).is_err_and(|error| error.is_fault()));
        assert_eq!(late.take(0, list(), head(0), Vec::new()), Ok(()));
        let digest = list().digest();
        assert!(late.check_digest(1, digest.clone(), 0, 0).is_err_and(|error| error.is_fault()));
        assert!(late.check_digest(0, digest, 0, 0).is_err_and(|error| !error.is_fault()), "a wrong one");
    }

    #[test]
    fn identities_follow_the_parents_that_stay() {
        let mut lists = Lists { next_identity: u32::MAX, ..Lists::default() };
        let parents = Arc::new(vec![7, 8, 9]);
        assert_eq!(lists.follow_identities(0, parents.clone(), &[true, false, true], 2), Ok(()));
        assert_eq!(lists.identities, [Arc::new(vec![7, 9, u32::MAX, 0])]);
        assert!(lists.follow_identities(0, parents, &[true], 0).is_err_and(|error| error.is_fault()));
    }
}
