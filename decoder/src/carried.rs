//! Clause 7.8.1: carried lists, the Gaussians of the I frame of a GOP as the cells of later frames move them.
//!
//! A frame needs its carried lists only where it lacks exact ones. So a list stays as it is while nobody asks for it, and
//! the motions that it has yet to make are kept with it. Once a list has been computed for a frame, the frames that refer
//! to that frame go on from there; the motions that are kept are bounded by their cells.

use crate::digest::{lists_digest, whole_digest_unless};
use crate::displacement::CellField;
use crate::interrupt::Interrupt;
use crate::list::GaussianList;
use std::sync::Arc;

/// Cells of the motions that may be kept for later: as many as a frame may have at the highest level.
const MAX_WAITING_CELLS: usize = 1 << 20;

/// Motions that may be kept for later. Each frame of a higher temporal layer makes the motions that wait for itself, so
/// this bounds its work; a GOP of fewer frames never pays for lists that nobody asks for.
const MAX_WAITING_MOTIONS: usize = 32;

/// The carried lists of a frame.
#[derive(Debug, Clone, Default)]
pub(crate) struct Carried {
    lists: Vec<CarriedList>,
    /// The motions that some list has yet to make, oldest first.
    motions: Vec<Motion>,
}

/// A list and how many of the motions it has made.
#[derive(Debug, Clone)]
struct CarriedList {
    list: Arc<GaussianList>,
    /// Of its Gaussians, if they are asked for.
    identities: Arc<Vec<u32>>,
    done: usize,
}

/// The step from the reference frame to a frame.
#[derive(Debug, Clone)]
struct Motion {
    field: Arc<CellField>,
    drops_stale: bool,
}

impl Carried {
    /// Those of an I frame that shows these lists; `identities` are empty unless they are asked for.
    pub(crate) fn new(
        lists: impl IntoIterator<Item = Arc<GaussianList>>,
        identities: &[Arc<Vec<u32>>],
    ) -> Self {
        let identities = identities.iter().cloned().chain(core::iter::repeat_with(Arc::default));
        let carried = |(list, identities)| CarriedList { list, identities, done: 0 };
        Self { lists: lists.into_iter().zip(identities).map(carried).collect(), motions: Vec::new() }
    }

    /// How many lists there are.
    pub(crate) fn len(&self) -> usize {
        self.lists.len()
    }

    /// Those of a frame that refers to this one. `from` is the first list that the frame needs: it and those after it are
    /// computed here first, so that they are computed once for all frames that refer to this one.
    pub(crate) fn moved(
        &mut self,
        field: &Arc<CellField>,
        drops_stale: bool,
        from: usize,
        interrupt: &Interrupt,
    ) -> Self {
        let needed = if self.motions.len() < MAX_WAITING_MOTIONS { from } else { 0 };
        self.compute_from(needed, interrupt);
        self.forget();
        let mut moved = self.clone();
        if field.is_empty() {
            return moved;
        }
        moved.motions.push(Motion { field: Arc::clone(field), drops_stale });
        let waiting = moved.motions.iter().map(|motion| motion.field.len()).fold(0, usize::saturating_add);
        let first = if waiting > MAX_WAITING_CELLS { 0 } else { from };
        moved.compute_from(first, interrupt);
        moved.forget();
        moved
    }

    /// The lists from `first` on, each with the identities of its Gaussians, which are empty unless they are asked for.
    pub(crate) fn lists_from(
        &mut self,
        first: usize,
        interrupt: &Interrupt,
    ) -> impl Iterator<Item = (&GaussianList, &[u32])> {
        self.compute_from(first, interrupt);
        let lists = self.lists.iter().skip(first);
        lists.map(|carried| (carried.list.as_ref(), carried.identities.as_slice()))
    }

    /// The digest of all lists.
    pub(crate) fn digest(&mut self, interrupt: &Interrupt) -> u64 {
        let digest = |(list, _): (&GaussianList, _)| whole_digest_unless(interrupt, &list.planes);
        let digests: Vec<_> = self.lists_from(0, interrupt).map(digest).collect();
        lists_digest(&digests)
    }

    /// Makes the motions that the lists from `first` on have yet to make, as long as no interrupt is requested.
    fn compute_from(&mut self, first: usize, interrupt: &Interrupt) {
        (first..self.len())
            .take_while(|_| !interrupt.is_requested())
            .for_each(|h| self.compute(h, interrupt));
    }

    /// Makes the motions that list h has yet to make; where an interrupt is requested, the list means nothing.
    fn compute(&mut self, h: usize, interrupt: &Interrupt) {
        let Some(carried) = self.lists.get_mut(h) else { return };
        let waiting = self.motions.get(carried.done..).unwrap_or_default();
        if waiting.is_empty() {
            return;
        }
        let memory = GaussianList::empty(carried.list.planes.sh.len());
        let mut list = carried.list.unchanged_in(memory, interrupt);
        for motion in waiting.iter().take_while(|_| !interrupt.is_requested()) {
            let keep = list.carry(&motion.field, motion.drops_stale, interrupt);
            if !keep.is_empty() && !carried.identities.is_empty() {
                crate::frame::retain(Arc::make_mut(&mut carried.identities), &keep);
            }
        }
        (carried.list, carried.done) = (Arc::new(list), self.motions.len());
    }

    /// Forgets the motions that every list has made.
    fn forget(&mut self) {
        let done = self.lists.iter().map(|carried| carried.done).min().unwrap_or(self.motions.len());
        self.motions.drain(..done.min(self.motions.len()));
        self.lists.iter_mut().for_each(|carried| carried.done = carried.done.saturating_sub(done));
    }
}

#[cfg(test)]
#[expect(clippy::arithmetic_side_effects, reason = "an overflow is a failed test")]
mod tests {
    use super::*;
    use crate::cell::Cell;
    use crate::frame::QuantizedFrame;

    /// Shifts everything by eight steps along an axis; a part of the grid is stale.
    fn field(axis: usize) -> Arc<CellField> {
        let cell = |x: u32| {
            let mut translation = [0; 3];
            translation[axis] = 64;
            (u64::from(x), Cell { coordinates: [x, 0, 0], stale: x == 1, translation, ..Cell::default() })
        };
        Arc::new(CellField::new(7, 8, 128, vec![cell(0), cell(1)]))
    }

    fn list(x: u32) -> GaussianList {
        let mut planes = QuantizedFrame::zeroed(2, 0);
        planes.position[0] = vec![x, 255 - x];
        GaussianList::of_planes(planes, true)
    }

    #[test]
    fn a_list_that_waits_becomes_what_a_list_that_moves_at_once_is() {
        let mut waiting = Carried::new([Arc::new(list(3)), Arc::new(list(90))], &[]);
        let mut direct = [list(3), list(90)];
        for (axis, drops_stale, from) in [(0, false, 2), (1, false, 1), (2, true, 2), (0, true, 2)] {
            waiting = waiting.moved(&field(axis), drops_stale, from, Interrupt::NEVER);
            direct = direct.map(|list| list.carried(&field(axis), drops_stale));
        }
        assert!(waiting.lists_from(0, Interrupt::NEVER).map(|(list, _)| list).eq(&direct));
        assert_eq!(
            waiting.digest(Interrupt::NEVER),
            lists_digest(&direct.each_ref().map(GaussianList::digest))
        );
        assert_eq!(direct.map(|list| list.len()), [1, 1], "what was stale is gone");
    }

    #[test]
    fn few_motions_wait() {
        let mut carried = Carried::new([Arc::new(list(3)), Arc::new(list(9))], &[]);
        for _ in 0..3 * MAX_WAITING_MOTIONS {
            carried = carried.moved(&field(0), false, 2, Interrupt::NEVER);
            assert!(carried.motions.len() <= MAX_WAITING_MOTIONS);
        }
    }

    #[test]
    fn motions_that_all_lists_have_made_are_forgotten() {
        let mut carried = Carried::new([Arc::new(list(3)), Arc::new(list(9))], &[]);
        for _ in 0..5 {
            carried = carried.moved(&field(0), false, 1, Interrupt::NEVER);
        }
        assert_eq!((carried.motions.len(), carried.lists[0].done), (5, 0));
        carried = carried.moved(&field(0), false, 0, Interrupt::NEVER);
        assert!(carried.motions.is_empty());
    }
}
