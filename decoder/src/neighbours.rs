//! The neighbours of a new Gaussian: the nearest among those next to it on the Morton curve.
//!
//! An exact search can be made to look at every point (a sphere of points around the one that seeks), so the
//! definition itself is bounded: the points are sorted along the Morton curve, and only [`WINDOW`] points on either
//! side of the index at which the seeking point would stand are candidates. The nearest candidates, ties to the lower
//! index, are the neighbours. Sorting takes a time that grows with n, a search 2 * `WINDOW` distances.
//!
//! Squares of distances stay below 2^42 (annex F.5); indices are those of points, and a run has room for its neighbours.

use crate::cores;
use crate::curve;
use crate::interrupt::Interrupt;
use crate::position::morton;

/// Candidates on either side of a point on the curve, at most.
pub const WINDOW: usize = 16;

/// Bits of the number of a candidate, below its squared distance: this is below 2^44, as coordinates are below 2^21.
const NUMBER_BITS: u32 = 5;

/// Points sought by one task.
const RUN: usize = 1024;

/// A point found. The order is total: distance, then index.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct Neighbour {
    /// Squared distance, in squared grid steps.
    pub distance: u64,
    /// Index in the list of points.
    pub index: u32,
}

/// Finds the neighbours of points in a list of points.
#[derive(Debug, Clone, Default)]
pub struct NeighbourSearch {
    /// The points along the curve; those of one code by index.
    points: Vec<Point>,
}

/// A point with its Morton code.
#[derive(Debug, Clone, Copy)]
struct Point {
    code: u64,
    index: u32,
    at: [u32; 3],
}

impl NeighbourSearch {
    /// A search among points, given by their planes x, y, z of one length. Coordinates are below 2^21.
    pub fn new(points: [&[u32]; 3]) -> Self {
        Self::new_unless(Interrupt::NEVER, points)
    }

    /// The same; where an interrupt is requested, what is found means nothing.
    pub(crate) fn new_unless(interrupt: &Interrupt, points: [&[u32]; 3]) -> Self {
        let [xs, ys, zs] = points;
        let codes = curve::codes(points, interrupt);
        let coordinate = |plane: &[u32], index: u32| plane.get(index as usize).copied().unwrap_or(0);
        let point =
            |(code, index)| Point { code, index, at: [xs, ys, zs].map(|plane| coordinate(plane, index)) };
        let order = curve::order(codes.into_iter(), interrupt);
        Self { points: cores::map(order.len(), order, point) }
    }

    /// Points searched.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// True if there is no point to find.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Replaces `out` by the `count` first neighbours of `point`, or by all candidates there are, nearest first.
    ///
    /// `count` is at most [`WINDOW`], so that `min(count, len)` neighbours are found. Coordinates are below 2^21.
    pub fn nearest(&self, point: [u32; 3], count: usize, out: &mut Vec<Neighbour>) {
        out.clear();
        let candidates = self.candidates(point);
        let mut keys = [u64::MAX; 2 * WINDOW];
        for ((key, candidate), number) in keys.iter_mut().zip(candidates).zip(0..) {
            *key = candidate.seen_from(point).distance << NUMBER_BITS | number;
        }
        let keys = keys.get_mut(..candidates.len()).unwrap_or_default();
        keys.sort_unstable();
        let is_equal = |pair: &[u64]| matches!(pair, [a, b] if a >> NUMBER_BITS == b >> NUMBER_BITS);
        if keys.windows(2).any(is_equal) {
            out.extend(candidates.iter().map(|candidate| candidate.seen_from(point)));
            out.sort_unstable();
            out.truncate(count);
            return;
        }
        let found = keys.iter().take(count).filter_map(|key| {
            let candidate = candidates.get((key & ((1 << NUMBER_BITS) - 1)) as usize)?;
            Some(Neighbour { distance: key >> NUMBER_BITS, index: candidate.index })
        });
        out.extend(found);
    }

    /// The neighbours of many points, min(count, [`len`](Self::len)) of each, one point after the other.
    pub fn nearest_to_all(&self, points: [&[u32]; 3], count: usize) -> Vec<Neighbour> {
        self.nearest_unless(Interrupt::NEVER, points, count)
    }

    /// The same; where an interrupt is requested, the neighbours mean nothing.
    pub(crate) fn nearest_unless(
        &self,
        interrupt: &Interrupt,
        points: [&[u32]; 3],
        count: usize,
    ) -> Vec<Neighbour> {
        let [xs, ys, zs] = points;
        let wanted = count.min(self.len());
        let mut all = Vec::with_capacity(xs.len().wrapping_mul(wanted));
        for run in xs.chunks(RUN) {
            if wanted == 0 || interrupt.is_requested() {
                return all;
            }
            all.resize(all.len().saturating_add(run.len().wrapping_mul(wanted)), Neighbour::default());
        }
        if all.is_empty() {
            return all;
        }
        let values = all.len();
        let runs = all.chunks_mut(RUN.wrapping_mul(wanted));
        let runs = runs.zip(xs.chunks(RUN).zip(ys.chunks(RUN)).zip(zs.chunks(RUN)));
        cores::for_each(interrupt, values, runs, |(run, ((xs, ys), zs))| {
            let mut found = Vec::with_capacity(WINDOW.wrapping_mul(2));
            for (slots, ((&x, &y), &z)) in run.chunks_mut(wanted).zip(xs.iter().zip(ys).zip(zs)) {
                self.nearest([x, y, z], wanted, &mut found);
                slots.iter_mut().zip(&found).for_each(|(slot, &neighbour)| *slot = neighbour);
            }
        });
        all
    }

    /// The points next to a point on the curve.
    fn candidates(&self, [x, y, z]: [u32; 3]) -> &[Point] {
        let code = morton(x, y, z);
        let lower = self.points.partition_point(|point| point.code < code);
        let end = lower.saturating_add(WINDOW).min(self.len());
        self.points.get(lower.saturating_sub(WINDOW)..end).unwrap_or_default()
    }
}

impl Point {
    #[inline(always)]
    fn seen_from(&self, [x, y, z]: [u32; 3]) -> Neighbour {
        let [a, b, c] = self.at;
        let sides = [x.abs_diff(a), y.abs_diff(b), z.abs_diff(c)].map(u64::from);
        let distance = sides.into_iter().fold(0_u64, |sum, side| sum.wrapping_add(side.wrapping_mul(side)));
        Neighbour { distance, index: self.index }
    }
}

#[cfg(test)]
#[expect(clippy::arithmetic_side_effects, reason = "an overflow is a failed test")]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn planes(points: &[[u32; 3]]) -> [Vec<u32>; 3] {
        [0, 1, 2].map(|axis| points.iter().map(|point| point[axis]).collect())
    }

    fn search(points: &[[u32; 3]]) -> NeighbourSearch {
        let [x, y, z] = planes(points);
        NeighbourSearch::new([&x, &y, &z])
    }

    /// The definition, word for word: ranks on the curve by counting, then all candidates sorted.
    fn by_hand(points: &[[u32; 3]], to: [u32; 3], count: usize) -> Vec<Neighbour> {
        let code = |&[x, y, z]: &[u32; 3]| morton(x, y, z);
        let lower = points.iter().filter(|point| code(point) < code(&to)).count();
        let rank = |index: usize| {
            let key = (code(&points[index]), index);
            (0..points.len()).filter(|&other| (code(&points[other]), other) < key).count()
        };
        let near = |&index: &usize| {
            let rank = rank(index);
            rank + WINDOW >= lower && rank < lower + WINDOW
        };
        let squared = |index: usize| {
            let sides = [0, 1, 2].map(|axis| u64::from(points[index][axis].abs_diff(to[axis])));
            sides.iter().map(|side| side * side).sum()
        };
        let found = |index: usize| Neighbour { distance: squared(index), index: index as u32 };
        let mut all: Vec<Neighbour> = (0..points.len()).filter(near).map(found).collect();
        all.sort_unstable();
        all.truncate(count);
        all
    }

    /// Few coordinates, so that many points share a position or lie equally far; or the whole grid with its corners.
    fn point() -> impl Strategy<Value = [u32; 3]> {
        let corner = || prop_oneof![Just(0_u32), Just((1 << 20) - 1), 0_u32..1 << 20];
        prop_oneof![
            [0_u32..4, 0_u32..4, 0_u32..4],
            [corner(), corner(), corner()],
            (0_u32..99).prop_map(|x| [x, 7, 7])
        ]
    }

    proptest! {
        #[test]
        fn neighbours_are_those_of_the_definition(
            points in proptest::collection::vec(point(), 0..100),
            to in proptest::collection::vec(point(), 1..10),
            count in 0_usize..=16,
        ) {
            let search = search(&points);
            let [x, y, z] = planes(&to);
            let mut expected = Vec::new();
            for &to in &to {
                let by_hand = by_hand(&points, to, count);
                prop_assert_eq!(by_hand.len(), count.min(points.len()));
                expected.extend(by_hand);
            }
            prop_assert_eq!(search.nearest_to_all([&x, &y, &z], count), expected);
        }
    }

    #[test]
    fn of_equal_points_the_first_are_found() {
        let points = vec![[5, 6, 7]; 100_000];
        let [x, y, z] = planes(&points);
        let all = search(&points).nearest_to_all([&x, &y, &z], 8);
        let first: Vec<Neighbour> = (0..8).map(|index| Neighbour { distance: 0, index }).collect();
        assert!(all.chunks(8).all(|found| found == first));
    }
}
