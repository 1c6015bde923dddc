//! Clause 8.4: which lane codes which entries of a block.
//!
//! Lane j codes a segment of its own, entries `j * length` to `(j + 1) * length - 1`. All lanes go forward together, one
//! entry in each step: what a symbol needs of the entries before it is in its own lane, so that no lane waits for
//! another.

use super::MAX_LANES;
use super::machine::WIDE;
use core::ops::Range;

/// The segments of a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Segments {
    count: usize,
    lanes: usize,
    length: usize,
}

impl Segments {
    /// The segments of a block of `count` entries and 2^`lanes_log2` lanes, at most 32.
    pub fn new(count: usize, lanes_log2: u8) -> Self {
        let lanes = 1_usize.wrapping_shl(lanes_log2.into()).min(MAX_LANES);
        Self { count, lanes, length: count.div_ceil(lanes).max(1) }
    }

    /// Entries of a segment, 1 or more; the last segments may have fewer or none.
    pub const fn length(&self) -> usize {
        self.length
    }

    /// Lanes of the block, with or without entries.
    pub const fn lanes(&self) -> usize {
        self.lanes
    }

    /// Whether an entry is the first of its lane: nothing before it is known to it.
    pub fn is_first(&self, entry: usize) -> bool {
        entry.checked_rem(self.length) == Some(0)
    }

    /// Lanes that have an entry in a step: the first ones.
    #[inline]
    pub fn active(&self, step: usize) -> usize {
        self.count.saturating_sub(step).div_ceil(self.length)
    }

    /// Steps in which every lane has an entry: the first ones.
    pub const fn whole(&self) -> usize {
        self.count.saturating_sub(self.lanes.wrapping_sub(1).wrapping_mul(self.length))
    }

    /// The entries of a lane in the steps from `start` on, `steps` of them or as many as there are.
    #[inline]
    pub fn entries(&self, lane: usize, start: usize, steps: usize) -> Range<usize> {
        let first = lane.wrapping_mul(self.length);
        let end = first.wrapping_add(self.length.min(start.wrapping_add(steps))).min(self.count);
        first.wrapping_add(start).min(end)..end
    }
}

/// The entries of eight lanes of a plane, from a step on.
#[derive(Debug)]
pub struct LaneEntries<'l, T> {
    lanes: &'l [Range<usize>; WIDE],
    start: usize,
    plane: &'l mut [T],
}

impl<'l, T> LaneEntries<'l, T> {
    /// Of lanes with their entries in `plane`, from step `start` on.
    #[inline(always)]
    pub fn new(lanes: &'l [Range<usize>; WIDE], start: usize, plane: &'l mut [T]) -> Self {
        Self { lanes, start, plane }
    }

    /// Those of one lane; none where there is no such lane.
    #[inline(always)]
    pub fn of_lane(&mut self, lane: usize) -> &mut [T] {
        let entries = self.lanes.get(lane).map(|lane| lane.start.wrapping_add(self.start)..lane.end);
        entries.and_then(|entries| self.plane.get_mut(entries)).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_lane_has_a_segment_and_the_last_ones_may_be_short() {
        let order = |count, lanes_log2| {
            let segments = Segments::new(count, lanes_log2);
            let of_step =
                |step| (0..segments.active(step)).map(move |lane| (lane, lane * segments.length() + step));
            (0..segments.length()).flat_map(of_step).collect::<Vec<_>>()
        };
        assert_eq!(order(5, 1), [(0, 0), (1, 3), (0, 1), (1, 4), (0, 2)]);
        assert_eq!(order(3, 2), [(0, 0), (1, 1), (2, 2)]);
        assert_eq!(order(5, 2), [(0, 0), (1, 2), (2, 4), (0, 1), (1, 3)]);
        assert_eq!(order(3, 0), [(0, 0), (0, 1), (0, 2)]);
        assert_eq!(order(0, 3), []);
    }

    #[test]
    fn an_entry_is_the_first_of_its_lane_or_follows_one() {
        let segments = Segments::new(10, 2);
        let first: Vec<usize> = (0..10).filter(|&entry| segments.is_first(entry)).collect();
        assert_eq!((segments.length(), first), (3, vec![0, 3, 6, 9]));
    }
}
