//! Clause 7.17: the nearest neighbours of a point, ties to the lower index.
//!
//! A k-d tree in flat arrays: level by level, each node's points are halved at the median of the longest side
//! of their box. Points in one place are told apart by index, so the halving never fails and the depth is
//! log2 of the count; a node knows its smallest index, so that of many points at one distance only those that
//! come first are looked at. What is found depends on the points alone, not on how the tree was built. The worst
//! that points can do is to lie on a sphere around the one that seeks: it looks at all of them.

use rayon::prelude::*;

/// Points of a leaf, at most.
const LEAF: usize = 16;

/// Points sought by one task.
const RUN: usize = 1024;

/// A point found. The order is total: distance, then index.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct Neighbour {
    /// Squared distance, in squared lattice steps.
    pub distance: u64,
    /// Place in the list of points.
    pub index: u32,
}

/// Finds the nearest of a list of points. Clause 7.17.
#[derive(Debug, Clone, Default)]
pub struct NeighbourSearch {
    /// The points, those of a leaf together.
    points: Vec<Point>,
    /// The children of node n are 2n + 1 and 2n + 2; the last level are the leaves.
    nodes: Vec<Node>,
    /// Where the points of each leaf begin, and the end.
    starts: Vec<u32>,
    /// Nodes that are not leaves.
    inner: usize,
}

#[derive(Debug, Clone, Copy)]
struct Point {
    at: [u32; 3],
    index: u32,
}

/// The box around points, and the smallest of their indices.
#[derive(Debug, Clone, Copy)]
struct Node {
    low: [u32; 3],
    high: [u32; 3],
    first: u32,
}

impl NeighbourSearch {
    /// A search among points, given by their planes x, y, z of one length.
    ///
    /// Coordinates are below 2^31, so that squared distances stay below 2^64.
    pub fn new(points: [&[u32]; 3]) -> Self {
        let [xs, ys, zs] = points;
        let planes = xs.iter().zip(ys).zip(zs).zip(0_u32..);
        let mut points: Vec<Point> =
            planes.map(|(((&x, &y), &z), index)| Point { at: [x, y, z], index }).collect();
        if points.is_empty() {
            return Self::default();
        }
        let leaves = points.len().div_ceil(LEAF).next_power_of_two();
        let inner = leaves.wrapping_sub(1);
        let mut nodes = Vec::with_capacity(inner.wrapping_add(leaves));
        let mut level = vec![points.as_mut_slice()];
        while level.len() < leaves {
            let boxes: Vec<Node> = level.par_iter().map(|run| Node::around(run)).collect();
            level = level.into_par_iter().zip(&boxes).flat_map_iter(|(run, node)| node.halve(run)).collect();
            nodes.extend(boxes);
        }
        nodes.extend(level.iter().map(|run| Node::around(run)));
        let starts = core::iter::once(0).chain(level.iter().scan(0_u32, |end, run| {
            *end = end.wrapping_add(run.len() as u32);
            Some(*end)
        }));
        let starts = starts.collect();
        Self { points, nodes, starts, inner }
    }

    /// Points searched.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// True if there is no point to find.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Replaces `out` by the `count` first neighbours of `point`, or by all there are, nearest first.
    ///
    /// `point` has coordinates below 2^31.
    pub fn nearest(&self, point: [u32; 3], count: usize, out: &mut Vec<Neighbour>) {
        out.clear();
        let wanted = count.min(self.len());
        if wanted > 0 {
            let bound = Neighbour { distance: u64::MAX, index: u32::MAX };
            self.visit(0, &mut Search { point, wanted, bound, found: out });
        }
    }

    /// The neighbours of many points, min(count, [`len`](Self::len)) of each, one point after the other.
    pub fn nearest_to_all(&self, points: [&[u32]; 3], count: usize) -> Vec<Neighbour> {
        let [xs, ys, zs] = points;
        let wanted = count.min(self.len());
        let mut all = vec![Neighbour::default(); xs.len().wrapping_mul(wanted)];
        if wanted == 0 {
            return all;
        }
        all.par_chunks_mut(RUN.wrapping_mul(wanted))
            .zip(xs.par_chunks(RUN).zip(ys.par_chunks(RUN)).zip(zs.par_chunks(RUN)))
            .for_each(|(run, ((xs, ys), zs))| {
                let mut found = Vec::with_capacity(wanted);
                for (slots, ((&x, &y), &z)) in run.chunks_mut(wanted).zip(xs.iter().zip(ys).zip(zs)) {
                    self.nearest([x, y, z], wanted, &mut found);
                    slots.iter_mut().zip(&found).for_each(|(slot, &neighbour)| *slot = neighbour);
                }
            });
        all
    }

    /// Looks below a node, the nearer child first. As deep as the tree: at most 32 calls.
    fn visit(&self, node: usize, search: &mut Search<'_>) {
        if let Some(leaf) = node.checked_sub(self.inner) {
            self.leaf(leaf).iter().for_each(|point| search.offer(point));
            return;
        }
        let left = node.wrapping_mul(2).wrapping_add(1);
        let Some([first, second]) = self.nodes.get(left..).and_then(<[Node]>::first_chunk) else { return };
        let mut near = (search.best_of(first), left);
        let mut far = (search.best_of(second), left.wrapping_add(1));
        if far.0 < near.0 {
            core::mem::swap(&mut near, &mut far);
        }
        for (best, child) in [near, far] {
            if best < search.bound {
                self.visit(child, search);
            }
        }
    }

    fn leaf(&self, leaf: usize) -> &[Point] {
        let Some(&[start, end]) = self.starts.get(leaf..).and_then(<[u32]>::first_chunk) else { return &[] };
        self.points.get(start as usize..end as usize).unwrap_or_default()
    }
}

impl Node {
    fn around(points: &[Point]) -> Self {
        let empty = Self { low: [u32::MAX; 3], high: [0; 3], first: u32::MAX };
        points.iter().fold(empty, |node, point| Self {
            low: join(node.low, point.at, Ord::min),
            high: join(node.high, point.at, Ord::max),
            first: node.first.min(point.index),
        })
    }

    /// Divides the points of the node at the median of its longest side.
    fn halve<'a>(&self, points: &'a mut [Point]) -> [&'a mut [Point]; 2] {
        let [x, y, z] = join(self.high, self.low, u32::wrapping_sub);
        let middle = points.len() / 2;
        if middle > 0 {
            let along = if x >= y.max(z) {
                |point: &Point| (point.at[0], point.index)
            } else if y >= z {
                |point: &Point| (point.at[1], point.index)
            } else {
                |point: &Point| (point.at[2], point.index)
            };
            points.select_nth_unstable_by_key(middle, along);
        }
        points.split_at_mut_checked(middle).unwrap_or_default().into()
    }
}

/// The neighbours of a point found so far.
struct Search<'a> {
    point: [u32; 3],
    wanted: usize,
    /// The last of `found` once they are as many as wanted: only what comes before it is of use.
    bound: Neighbour,
    found: &'a mut Vec<Neighbour>,
}

impl Search<'_> {
    /// What no point of a node comes before: the distance of its box, and its smallest index.
    #[inline(always)]
    fn best_of(&self, node: &Node) -> Neighbour {
        let below = join(node.low, self.point, u32::saturating_sub);
        let above = join(self.point, node.high, u32::saturating_sub);
        Neighbour { distance: square(join(below, above, Ord::max)), index: node.first }
    }

    #[inline(always)]
    fn offer(&mut self, point: &Point) {
        let distance = square(join(self.point, point.at, u32::abs_diff));
        let neighbour = Neighbour { distance, index: point.index };
        if neighbour < self.bound {
            self.insert(neighbour);
        }
    }

    fn insert(&mut self, neighbour: Neighbour) {
        if self.found.len() == self.wanted {
            self.found.pop();
        }
        self.found.push(neighbour);
        let mut rest = self.found.as_mut_slice();
        while let [shorter @ .., last] = rest {
            match shorter.last_mut() {
                Some(before) if *before > *last => core::mem::swap(before, last),
                _ => break,
            }
            rest = shorter;
        }
        if self.found.len() == self.wanted {
            self.bound = self.found.last().copied().unwrap_or_default();
        }
    }
}

#[inline(always)]
fn join([a, b, c]: [u32; 3], [d, e, f]: [u32; 3], each: impl Fn(u32, u32) -> u32) -> [u32; 3] {
    [each(a, d), each(b, e), each(c, f)]
}

/// The squared length of a difference.
#[inline(always)]
fn square(difference: [u32; 3]) -> u64 {
    difference.map(u64::from).into_iter().fold(0, |sum, side| sum.wrapping_add(side.wrapping_mul(side)))
}

#[cfg(test)]
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

    fn by_hand(points: &[[u32; 3]], to: [u32; 3], count: usize) -> Vec<Neighbour> {
        let distance = |&at: &[u32; 3]| square(join(at, to, u32::abs_diff));
        let all = points.iter().zip(0..).map(|(at, index)| Neighbour { distance: distance(at), index });
        let mut all: Vec<Neighbour> = all.collect();
        all.sort_unstable();
        all.truncate(count);
        all
    }

    /// Few places, so that many points share one or lie as far; or the whole lattice with its corners.
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
        fn neighbours_are_those_of_an_exhaustive_search(
            points in proptest::collection::vec(point(), 0..200),
            to in proptest::collection::vec(point(), 1..20),
            count in 0_usize..=16,
        ) {
            let search = search(&points);
            let [x, y, z] = planes(&to);
            let all = search.nearest_to_all([&x, &y, &z], count);
            let mut expected = Vec::new();
            let mut found = Vec::new();
            for &to in &to {
                search.nearest(to, count, &mut found);
                prop_assert_eq!(&found, &by_hand(&points, to, count));
                expected.extend_from_slice(&found);
            }
            prop_assert_eq!(all, expected);
        }
    }

    #[test]
    fn equal_points_cost_no_more_than_others() {
        let points = vec![[5, 6, 7]; 100_000];
        let [x, y, z] = planes(&points);
        let all = search(&points).nearest_to_all([&x, &y, &z], 8);
        let first: Vec<Neighbour> = (0..8).map(|index| Neighbour { distance: 0, index }).collect();
        assert!(all.chunks(8).all(|found| found == first));
    }
}
