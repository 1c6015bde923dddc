//! A part of the curve, whose Gaussians are removed one after the other.
#![expect(
    clippy::indexing_slicing,
    reason = "indices are those of the part, neighbourhoods end within zeros, and each level of scores has a queue"
)]
#![expect(clippy::arithmetic_side_effects, reason = "indices in a part, which has fewer than 2^16")]

use super::is_seen;
use splatstream_render::contribution::Worth;

/// Gaussians in a part, at most: their data fit into the cache of a core, and few of them have neighbours in other parts.
pub(super) const PART: usize = 1 << 13;

/// Neighbours on each side.
pub(super) const REACH: usize = 4;

/// What is lost without a Gaussian that has no neighbour left, as a multiple of its energy: the mean squared difference of two colours
/// is of this order.
const ALONE: f64 = 1.5;

/// Low bits of a score that its level ignores: sixteen levels lie between two powers of two.
const DROPPED_BITS: u32 = 19;

/// Levels of scores, which are not negative.
const LEVELS: usize = 1 << (31 - DROPPED_BITS);

/// No index.
const NONE: u16 = u16::MAX;

/// Gaussians along a part of the curve, some of which have been removed.
pub(super) struct Part<'a> {
    worth: &'a [Worth],
    /// What pictures show of each, 0 if it has been removed; padded with [`REACH`] zeros at both ends.
    given: Vec<f32>,
    /// The sum of `given` over the neighbours of each, before any was removed.
    around: Vec<f32>,
}

impl<'a> Part<'a> {
    /// A part of at most [`PART`] Gaussians, none of which has been removed.
    pub(super) fn new(worth: &'a [Worth]) -> Self {
        let zeros = || [0.0; REACH].into_iter();
        let given: Vec<f32> =
            zeros().chain(worth.iter().map(|worth| worth.contribution as f32)).chain(zeros()).collect();
        let around = (0..worth.len()).map(|index| sum_around(&given, index)).collect();
        Self { worth, given, around }
    }

    /// Removes all Gaussians that pictures show. Returns, in the order of removal, the level of the score, the number of Gaussians
    /// removed before at that level, and the index.
    ///
    /// Scores only rise, so that one queue per level suffices: the first of the lowest queue is removed, unless neighbours
    /// were removed since it was queued and its score has reached a higher level. Gaussians that follow each other in a
    /// queue lie far apart, so that removal leaves no holes.
    pub(super) fn removals(mut self) -> Vec<(u16, u16, u16)> {
        let mut queues = Queues::new(self.worth.len());
        for index in far_apart(self.worth.len()).filter(|&index| is_seen(&self.worth[usize::from(index)])) {
            queues.push(self.level(index), index);
        }
        let mut removals = Vec::with_capacity(self.worth.len());
        for level in 0..LEVELS as u16 {
            let mut turn = 0;
            while let Some(index) = queues.pop(level) {
                let now = self.level(index);
                if now > level {
                    queues.push(now, index);
                } else {
                    self.given[usize::from(index) + REACH] = 0.0;
                    removals.push((level, turn, index));
                    turn += 1;
                }
            }
        }
        removals
    }

    /// The level of the score of a Gaussian: the geometric mean of what pictures show of it and of what they lose without it.
    ///
    /// The background shows only after most neighbours were removed, hence the third power of their share.
    fn level(&self, index: u16) -> u16 {
        let index = usize::from(index);
        let Worth { contribution, loss, energy } = self.worth[index];
        let around = self.around[index];
        let missing =
            if around > 0.0 { 1.0 - f64::from(sum_around(&self.given, index) / around) } else { 0.0 };
        let lost = loss + missing.powi(3) * (ALONE * energy - loss).max(0.0);
        // NaN gets the highest level, whatever its sign.
        (((contribution * lost).sqrt() as f32).abs().to_bits() >> DROPPED_BITS) as u16
    }
}

/// A queue for each level, as a linked list of indices.
struct Queues {
    /// The first and the last index of each queue.
    first: Vec<u16>,
    last: Vec<u16>,
    /// The index that follows each in its queue.
    next: Vec<u16>,
}

impl Queues {
    /// Empty queues for so many indices.
    fn new(indices: usize) -> Self {
        let [first, last] = [(); 2].map(|()| vec![NONE; LEVELS]);
        Self { first, last, next: vec![NONE; indices] }
    }

    /// Appends an index to the queue of a level.
    fn push(&mut self, level: u16, index: u16) {
        self.next[usize::from(index)] = NONE;
        match core::mem::replace(&mut self.last[usize::from(level)], index) {
            NONE => self.first[usize::from(level)] = index,
            before => self.next[usize::from(before)] = index,
        }
    }

    /// Removes the first index from the queue of a level.
    fn pop(&mut self, level: u16) -> Option<u16> {
        let first = &mut self.first[usize::from(level)];
        let index = Some(*first).filter(|&index| index != NONE)?;
        *first = self.next[usize::from(index)];
        if *first == NONE {
            self.last[usize::from(level)] = NONE;
        }
        Some(index)
    }
}

/// The sum of `given` over the neighbours of a Gaussian.
fn sum_around(given: &[f32], index: usize) -> f32 {
    let window = &given[index..=index + 2 * REACH];
    let sum = |side: &[f32]| side.iter().sum::<f32>();
    sum(&window[..REACH]) + sum(&window[REACH + 1..])
}

/// All indices in bit-reversed order, so that each is far from those before it.
fn far_apart(count: usize) -> impl Iterator<Item = u16> {
    let bits = count.next_power_of_two().trailing_zeros().max(1);
    let indices = (0..1_u16 << bits).map(move |number| number.reverse_bits() >> (16 - bits));
    indices.filter(move |&index| usize::from(index) < count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn indices_come_once_each_and_halves_between_them() {
        assert_eq!(far_apart(5).collect::<Vec<_>>(), [0, 4, 2, 1, 3]);
        assert_eq!(far_apart(1).collect::<Vec<_>>(), [0]);
        assert_eq!(far_apart(0).count(), 0);
    }

    #[test]
    fn a_queue_is_first_in_first_out() {
        let mut queues = Queues::new(8);
        [(3, 5), (1, 0), (3, 2), (3, 7)].into_iter().for_each(|(level, index)| queues.push(level, index));
        assert_eq!(
            [queues.pop(3), queues.pop(3), queues.pop(1), queues.pop(1)],
            [Some(5), Some(2), Some(0), None]
        );
        queues.push(3, 5);
        assert_eq!([queues.pop(3), queues.pop(3), queues.pop(3)], [Some(7), Some(5), None]);
    }
}
