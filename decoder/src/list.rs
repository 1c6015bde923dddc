//! Clause 7.4: a list of Gaussians, with the fractions that prediction keeps.
//!
//! List h holds the Gaussians that the units of refinement h brought. Inside the prediction loop positions and rotations
//! have six more bits than the canonical planes; [`GaussianList::settle`] derives the canonical planes from them.
//!
//! Positions and rotations have passed their checks before they get fractions, so that no fine one overflows (annex F.4).

use crate::cores;
use crate::digest::{ListDigest, whole_digest_unless};
use crate::displacement::CellField;
use crate::frame::{QuantizedFrame, retain};
use crate::interrupt::Interrupt;

/// Fraction bits of positions and rotations inside the prediction loop.
pub const FRACTION_BITS: u32 = 6;
/// One step of the position grid in fine units.
pub const FINE: i32 = 1 << FRACTION_BITS;

/// Rows are settled one by one as long as the list is so many times as long.
const FEW_ROWS: usize = 8;

/// The canonical integer of a fine one: `Round(fine, 6)`.
#[inline]
pub fn canonical(fine: i32) -> i32 {
    fine.wrapping_add(FINE / 2) >> FRACTION_BITS
}

/// A list of Gaussians, in coded order. All planes have the same length.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct GaussianList {
    /// The canonical planes (7.9).
    pub planes: QuantizedFrame,
    /// Position in 64ths of a grid step: x, y, z.
    pub position_fine: [Vec<i32>; 3],
    /// Quaternion x, y, z in 64ths of rotation_step.
    pub rotation_fine: [Vec<i32>; 3],
    /// True for Gaussians of the intra frame of the GOP.
    pub anchor: Vec<bool>,
    /// What the Gaussians have become since the reference frame. Carried lists have none.
    pub change: Change,
}

/// How the Gaussians of a list differ from what they were in the reference frame. Without planes nothing has changed, as
/// in an I frame.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Change {
    /// Of the fine positions.
    pub motion: [Vec<i32>; 3],
    /// Of the opacities.
    pub fade: Vec<i32>,
}

impl Change {
    /// From one state of some Gaussians to another.
    pub fn between(before: &GaussianList, after: &GaussianList) -> Self {
        let mut change = Self::default();
        change.set_unless(Interrupt::NEVER, before, after);
        change
    }

    /// Becomes the change from one state of some Gaussians to another; memory that it has is used again. Where an interrupt
    /// is requested, it means nothing.
    fn set_unless(&mut self, interrupt: &Interrupt, before: &GaussianList, after: &GaussianList) {
        let [x, y, z] = &before.position_fine;
        let [to_x, to_y, to_z] = &after.position_fine;
        let from = [x, y, z, &before.planes.opacity];
        let to = [to_x, to_y, to_z, &after.planes.opacity];
        let planes = self.planes_mut().zip(from.into_iter().zip(to));
        cores::for_each(interrupt, after.planes.values(), planes, |(plane, (from, to))| {
            plane.clear();
            plane.extend(to.iter().zip(from).map(|(to, from)| to.wrapping_sub(*from)));
        });
    }

    fn planes_mut(&mut self) -> impl Iterator<Item = &mut Vec<i32>> {
        self.motion.iter_mut().chain([&mut self.fade])
    }

    /// Appends Gaussians that have not changed to those there are.
    fn extend(&mut self, count: usize) {
        if !self.fade.is_empty() {
            self.planes_mut().for_each(|plane| plane.extend(core::iter::repeat_n(0, count)));
        }
    }
}

impl GaussianList {
    /// A list without Gaussians, for frames with `sh_planes` SH planes.
    pub fn empty(sh_planes: usize) -> Self {
        Self::of_planes(QuantizedFrame::zeroed(0, sh_planes), false)
    }

    /// Gaussians whose positions and rotations have no fraction yet.
    pub fn of_planes(planes: QuantizedFrame, anchor: bool) -> Self {
        Self::of_planes_unless(Interrupt::NEVER, planes, anchor)
    }

    /// The same; where an interrupt is requested, planes are empty.
    pub(crate) fn of_planes_unless(interrupt: &Interrupt, planes: QuantizedFrame, anchor: bool) -> Self {
        let wanted = || if interrupt.is_requested() { 0 } else { usize::MAX };
        let fine = |value: i32| value.wrapping_mul(FINE);
        let position_fine = planes
            .position
            .each_ref()
            .map(|plane| plane.iter().take(wanted()).map(|&q| fine(q.cast_signed())).collect());
        let rotation_fine =
            planes.rotation.each_ref().map(|plane| plane.iter().take(wanted()).map(|&r| fine(r)).collect());
        let anchor = vec![anchor; planes.len()];
        Self { planes, position_fine, rotation_fine, anchor, change: Change::default() }
    }

    /// A copy that later frames start from: what has changed before is not of it.
    #[must_use]
    pub fn unchanged(&self) -> Self {
        self.unchanged_in(Self::empty(self.planes.sh.len()), Interrupt::NEVER)
    }

    /// The same in the memory of a list that is not needed any more. Where an interrupt is requested, the copy means
    /// nothing.
    pub(crate) fn unchanged_in(&self, mut spare: Self, interrupt: &Interrupt) -> Self {
        spare.planes.sh.resize_with(self.planes.sh.len(), Vec::new);
        let from = self.planes.signed_planes().chain(&self.position_fine).chain(&self.rotation_fine);
        let to = spare.planes.signed_planes_mut();
        let to = to.chain(&mut spare.position_fine).chain(&mut spare.rotation_fine);
        cores::for_each(interrupt, self.planes.values(), to.zip(from), |(to, from)| to.clone_from(from));
        for (to, from) in spare.planes.position.iter_mut().zip(&self.planes.position) {
            to.clone_from(from);
        }
        spare.anchor.clone_from(&self.anchor);
        spare.change.planes_mut().for_each(Vec::clear);
        spare
    }

    /// Takes note of what the Gaussians have become since a state of them. Where an interrupt is requested, the note means
    /// nothing.
    pub(crate) fn follow_change(&mut self, since: &Self, interrupt: &Interrupt) {
        let mut change = core::mem::take(&mut self.change);
        change.set_unless(interrupt, since, self);
        self.change = change;
    }

    /// Gaussians in the list.
    pub fn len(&self) -> usize {
        self.planes.len()
    }

    /// True if there is no Gaussian.
    pub fn is_empty(&self) -> bool {
        self.planes.is_empty()
    }

    /// Derives the canonical positions and rotations from the fine ones.
    pub fn settle(&mut self) {
        self.settle_unless(Interrupt::NEVER);
    }

    /// The same; where an interrupt is requested, the canonical planes mean nothing.
    pub(crate) fn settle_unless(&mut self, interrupt: &Interrupt) {
        let values = self.planes.values();
        let Self { planes, position_fine, rotation_fine, .. } = self;
        let positions = planes.position.iter_mut().zip(position_fine);
        cores::for_each(interrupt, values, positions, |(plane, fine)| {
            for (slot, &mut value) in plane.iter_mut().zip(fine) {
                *slot = canonical(value).cast_unsigned();
            }
        });
        let rotations = planes.rotation.iter_mut().zip(rotation_fine);
        cores::for_each(interrupt, values, rotations, |(plane, fine)| {
            for (slot, &mut value) in plane.iter_mut().zip(fine) {
                *slot = canonical(value);
            }
        });
    }

    /// The same for some Gaussians, given by their rows.
    pub(crate) fn settle_rows(&mut self, rows: &[&[u32]], interrupt: &Interrupt) {
        let count = rows.iter().map(|rows| rows.len()).fold(0, usize::saturating_add);
        if count.saturating_mul(FEW_ROWS) > self.len() {
            return self.settle_unless(interrupt);
        }
        let rows = || rows.iter().flat_map(|rows| rows.iter()).map(|&row| row as usize);
        let Self { planes, position_fine, rotation_fine, .. } = self;
        for (plane, fine) in planes.position.iter_mut().zip(position_fine) {
            for row in rows() {
                if let (Some(slot), Some(&value)) = (plane.get_mut(row), fine.get(row)) {
                    *slot = canonical(value).cast_unsigned();
                }
            }
        }
        for (plane, fine) in planes.rotation.iter_mut().zip(rotation_fine) {
            for row in rows() {
                if let (Some(slot), Some(&value)) = (plane.get_mut(row), fine.get(row)) {
                    *slot = canonical(value);
                }
            }
        }
    }

    /// Clause 7.5: displaces every Gaussian by its cell and returns the stale flag of each; no flags if nothing moves.
    pub fn displace(&mut self, field: &CellField) -> Vec<bool> {
        self.displace_unless(Interrupt::NEVER, field)
    }

    /// The same; where an interrupt is requested, the list means nothing.
    pub(crate) fn displace_unless(&mut self, interrupt: &Interrupt, field: &CellField) -> Vec<bool> {
        if field.is_empty() {
            return Vec::new();
        }
        let stale = field.displace_unless(interrupt, &mut self.position_fine, &mut self.rotation_fine);
        self.settle_unless(interrupt);
        stale
    }

    /// Keeps the Gaussians whose flag is set; an empty list keeps all.
    pub fn retain(&mut self, keep: &[bool]) {
        self.retain_unless(Interrupt::NEVER, keep);
    }

    /// The same; where an interrupt is requested, planes are left as they are.
    pub(crate) fn retain_unless(&mut self, interrupt: &Interrupt, keep: &[bool]) {
        if keep.iter().all(|&keep| keep) {
            return;
        }
        let Self { planes, position_fine, rotation_fine, anchor, change } = self;
        planes.retain_unless(interrupt, keep);
        let others = position_fine.iter_mut().chain(rotation_fine).chain(change.planes_mut());
        others.take_while(|_| !interrupt.is_requested()).for_each(|plane| retain(plane, keep));
        retain(anchor, keep);
    }

    /// Appends new Gaussians.
    pub fn append(&mut self, other: &Self) {
        self.append_unless(Interrupt::NEVER, other);
    }

    /// The same; where an interrupt is requested, planes are missing.
    pub(crate) fn append_unless(&mut self, interrupt: &Interrupt, other: &Self) {
        self.planes.append_unless(interrupt, &other.planes);
        let ours = self.position_fine.iter_mut().chain(&mut self.rotation_fine);
        let theirs = other.position_fine.iter().chain(&other.rotation_fine);
        for (plane, more) in ours.zip(theirs).take_while(|_| !interrupt.is_requested()) {
            plane.extend_from_slice(more);
        }
        self.anchor.extend_from_slice(&other.anchor);
        self.change.extend(other.len());
    }

    /// Clause 7.8.1: the list as it is carried into a frame whose cells are `field`. Gaussians of stale cells are dropped if
    /// `drops_stale` is set, that is if the frame has units that replace them.
    #[must_use]
    pub fn carried(mut self, field: &CellField, drops_stale: bool) -> Self {
        self.carry(field, drops_stale, Interrupt::NEVER);
        self
    }

    /// Carries the list in place; gives which Gaussians stay, nothing if all do. Where an interrupt is requested, the list
    /// means nothing.
    pub(crate) fn carry(&mut self, field: &CellField, drops_stale: bool, interrupt: &Interrupt) -> Vec<bool> {
        let mut keep = self.displace_unless(interrupt, field);
        if !drops_stale {
            return Vec::new();
        }
        keep.iter_mut().for_each(|stale| *stale = !*stale);
        self.retain_unless(interrupt, &keep);
        keep
    }

    /// The digest of the list (7.9.2).
    pub fn digest(&self) -> ListDigest {
        whole_digest_unless(Interrupt::NEVER, &self.planes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_round_up_as_round_of_clause_4_says() {
        let rounded = [-97, -96, -33, -32, -31, 0, 31, 32, 95, 96].map(canonical);
        assert_eq!(rounded, [-2, -1, -1, 0, 0, 0, 0, 1, 1, 2]);
    }

    #[test]
    fn what_is_kept_stays_in_order() {
        let mut planes = QuantizedFrame::zeroed(4, 0);
        planes.opacity = vec![1, 2, 3, 4];
        let mut list = GaussianList::of_planes(planes, true);
        list.retain(&[true, false, false, true]);
        assert_eq!(list.planes.opacity, [1, 4]);
        assert_eq!(list.len(), 2);
        let twice = list.clone();
        list.append(&twice);
        assert_eq!(list.planes.opacity, [1, 4, 1, 4]);
        assert_eq!(list.anchor.len(), 4);
    }
}
