//! The neighbours of moved parents: the nearest of those next to them along the Morton curve.
//!
//! Squares of distances stay below 2^42 (annex F.5). Planes have room for a window before the first parent and after the last, so that
//! no index of a candidate lies outside.

use super::{MOVE_NEIGHBOURS, MOVE_WINDOW, MoveSpace, Place, RUN, at};
use crate::cores;
use crate::position::collect;
use crate::vector::{Task, vectorized};
use splatstream_format::entropy::machine::Machine;

/// Stands for the row of a move that no parent is known to.
pub(super) const NEVER: u32 = u32::MAX;

#[cfg(all(target_arch = "wasm32", target_feature = "simd128", not(feature = "portable")))]
mod simd128;

/// Places on either side of a place, and itself.
const CANDIDATES: usize = 2 * MOVE_WINDOW + 1;
/// The same, and what fills the last vector.
const FILLED: usize = CANDIDATES.next_multiple_of(4);

/// Bits of the index of a candidate, below the squared distance: this is below 2^44, as coordinates are below 2^21.
const INDEX_BITS: u32 = 6;

/// All parents along the curve, as a search looks at them; [`MOVE_WINDOW`] that no move knows stand before and after them.
pub(super) struct Candidates {
    /// Canonical, displaced.
    position: [Vec<u32>; 3],
    /// The row of the first move of the last list that knows the motion of the parent.
    known_from: Vec<u32>,
    /// The place of each parent of the last list.
    place_of: Vec<u32>,
}

/// The neighbours of a moved parent: list and row of each.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Neighbours {
    pub(super) found: [(u32, u32); MOVE_NEIGHBOURS],
    pub(super) count: usize,
}

/// The candidates around a parent that moves.
struct Around<'c> {
    /// Its position and its row.
    own: [u32; 3],
    row: u32,
    /// Those of the candidates, of which the first [`CANDIDATES`] count, and from which row on their motions are known.
    position: [&'c [u32; FILLED]; 3],
    known_from: &'c [u32; FILLED],
}

/// The keys of the nearest candidates, in order; all ones where there are fewer.
struct Nearest {
    keys: [u64; MOVE_NEIGHBOURS],
    /// Whether more of them are equally far than can be taken.
    is_tied: bool,
}

impl Candidates {
    /// The parents of a space; `modes` are those of the last list.
    pub(super) fn new(space: &MoveSpace, modes: &[i32]) -> Self {
        let order = &space.order;
        let last = u32::try_from(space.lists.len().wrapping_sub(1)).unwrap_or(u32::MAX);
        let padded = order.len().saturating_add(2 * MOVE_WINDOW).saturating_add(FILLED - CANDIDATES);
        let mut position = [(); 3].map(|()| vec![0; padded]);
        let mut known_from = vec![NEVER; padded];
        let mut place_of = vec![0; space.lists.last().map_or(0, Vec::len)];
        for (index, place) in (0_u32..).zip(order).filter(|(_, place)| place.list == last) {
            place_of.get_mut(place.row as usize).into_iter().for_each(|slot| *slot = index);
        }
        let [xs, ys, zs] = position.each_mut().map(|plane| plane.get_mut(MOVE_WINDOW..).unwrap_or_default());
        let (interrupt, values) = (&space.interrupt, order.len().saturating_mul(3));
        let positions = xs.chunks_mut(RUN).zip(ys.chunks_mut(RUN)).zip(zs.chunks_mut(RUN));
        cores::for_each(interrupt, values, positions.zip(order.chunks(RUN)), |(((xs, ys), zs), places)| {
            vectorized(Positions { places, planes: [xs, ys, zs] });
        });
        let known = known_from.get_mut(MOVE_WINDOW..).unwrap_or_default();
        cores::for_each(
            interrupt,
            values,
            known.chunks_mut(RUN).zip(order.chunks(RUN)),
            |(known, places)| {
                for (known, place) in known.iter_mut().zip(places) {
                    *known = space.known_from(place, last, modes);
                }
            },
        );
        Self { position, known_from, place_of }
    }

    /// The nearest parents next to that of a row, as far as it knows their motions.
    #[inline(always)]
    fn nearest(&self, row: u32, order: &[Place]) -> Neighbours {
        let index = at(&self.place_of, row as usize) as usize;
        let [Some(xs), Some(ys), Some(zs)] = self.position.each_ref().map(|plane| window(plane, index))
        else {
            return Neighbours::default();
        };
        let Some(known_from) = window(&self.known_from, index) else { return Neighbours::default() };
        let own = self.position.each_ref().map(|plane| at(plane, index.wrapping_add(MOVE_WINDOW)));
        let around = Around { own, row, position: [xs, ys, zs], known_from };
        let first = index.wrapping_sub(MOVE_WINDOW);
        let place = |key: u64| {
            let number = (key & ((1 << INDEX_BITS) - 1)) as usize;
            order.get(first.wrapping_add(number)).map_or((0, 0), |place| (place.list, place.row))
        };
        #[cfg(all(target_arch = "wasm32", target_feature = "simd128", not(feature = "portable")))]
        let nearest = simd128::nearest(&around);
        #[cfg(not(all(target_arch = "wasm32", target_feature = "simd128", not(feature = "portable"))))]
        let nearest = around.nearest();
        if nearest.is_tied {
            let [.., farthest] = nearest.keys;
            return among_equals(&around.keys(), farthest, place);
        }
        let count = nearest.keys.iter().filter(|&&key| key != u64::MAX).count();
        Neighbours { found: nearest.keys.map(place), count }
    }
}

impl Around<'_> {
    /// The key of each candidate: its squared distance, and below it its number.
    #[inline(always)]
    fn keys(&self) -> [u64; CANDIDATES] {
        let mut keys = [u64::MAX; CANDIDATES];
        let [xs, ys, zs] = self.position;
        let points = xs.iter().zip(ys).zip(zs).zip(self.known_from);
        for ((key, number), (((&x, &y), &z), &known_from)) in keys.iter_mut().zip(0..).zip(points) {
            let found = distance(self.own, [x, y, z]) << INDEX_BITS | number;
            *key = if known_from <= self.row { found } else { u64::MAX };
        }
        keys
    }

    #[inline(always)]
    #[cfg_attr(
        all(target_arch = "wasm32", target_feature = "simd128", not(feature = "portable")),
        expect(dead_code, reason = "the vectors of the machine take its place")
    )]
    fn nearest(&self) -> Nearest {
        let keys = self.keys();
        let nearest = smallest(&keys);
        let farthest = nearest.last().copied().unwrap_or(u64::MAX);
        let within = keys.iter().filter(|&&key| key >> INDEX_BITS <= farthest >> INDEX_BITS).count();
        Nearest { keys: nearest, is_tied: farthest != u64::MAX && within > MOVE_NEIGHBOURS }
    }
}

/// The candidates of a place in a plane, and what fills the last vector.
#[inline(always)]
fn window(plane: &[u32], index: usize) -> Option<&[u32; FILLED]> {
    plane.get(index..)?.first_chunk()
}

/// The smallest keys, in order.
#[inline(always)]
fn smallest(keys: &[u64; CANDIDATES]) -> [u64; MOVE_NEIGHBOURS] {
    let mut smallest = [u64::MAX; MOVE_NEIGHBOURS];
    for &key in keys {
        let mut larger = key;
        for slot in &mut smallest {
            (*slot, larger) = (larger.min(*slot), larger.max(*slot));
        }
    }
    smallest
}

/// The nearest where more are as far as the farthest key than can be taken: those of lower lists and rows.
#[cold]
fn among_equals(keys: &[u64; CANDIDATES], farthest: u64, place: impl Fn(u64) -> (u32, u32)) -> Neighbours {
    let within = keys.iter().filter(|&&key| key >> INDEX_BITS <= farthest >> INDEX_BITS);
    let mut all: Vec<(u64, (u32, u32))> = within.map(|&key| (key >> INDEX_BITS, place(key))).collect();
    all.sort_unstable();
    let mut nearest = Neighbours::default();
    for (slot, (_, place)) in nearest.found.iter_mut().zip(all) {
        *slot = place;
        nearest.count = nearest.count.wrapping_add(1);
    }
    nearest
}

#[inline(always)]
fn distance([x, y, z]: [u32; 3], [a, b, c]: [u32; 3]) -> u64 {
    let sides = [x.abs_diff(a), y.abs_diff(b), z.abs_diff(c)].map(u64::from);
    sides.into_iter().fold(0_u64, |sum, side| sum.wrapping_add(side.wrapping_mul(side)))
}

/// Finds the neighbours of the moves of some rows; the first is number `first`.
pub(super) struct Search<'s, W> {
    pub(super) candidates: &'s Candidates,
    pub(super) order: &'s [Place],
    pub(super) rows: &'s [u32],
    pub(super) first: usize,
    /// Which numbers want neighbours.
    pub(super) wanted: &'s W,
    pub(super) neighbours: &'s mut [Neighbours],
}

impl<W: Fn(usize) -> bool> Task for Search<'_, W> {
    #[inline(always)]
    fn run(self, _: impl Machine) {
        let Self { candidates, order, rows, first, wanted, neighbours } = self;
        for (number, (slot, &row)) in (first..).zip(neighbours.iter_mut().zip(rows)) {
            if wanted(number) {
                *slot = candidates.nearest(row, order);
            }
        }
    }
}

/// Takes positions out of Morton codes.
struct Positions<'p> {
    places: &'p [Place],
    planes: [&'p mut [u32]; 3],
}

impl Task for Positions<'_> {
    #[inline(always)]
    fn run(self, _: impl Machine) {
        let [xs, ys, zs] = self.planes;
        for (place, ((x, y), z)) in self.places.iter().zip(xs.iter_mut().zip(ys).zip(zs)) {
            [*x, *y, *z] = [collect(place.code), collect(place.code >> 1), collect(place.code >> 2)];
        }
    }
}

#[cfg(test)]
#[expect(clippy::arithmetic_side_effects, reason = "an overflow is a failed test")]
mod tests {
    use super::super::{HAS_MOVE, REMOVED, SpanRatio};
    use super::*;
    use crate::frame::QuantizedFrame;
    use crate::list::GaussianList;
    use crate::position::morton;
    use proptest::prelude::*;

    /// Few coordinates, so that many parents share a place or lie equally far.
    fn list() -> impl Strategy<Value = Vec<[u32; 3]>> {
        proptest::collection::vec([0_u32..6, 0_u32..6, 0_u32..3], 1..80)
    }

    fn of_points(points: &[[u32; 3]]) -> GaussianList {
        let mut planes = QuantizedFrame::zeroed(points.len(), 0);
        planes.position = [0, 1, 2].map(|axis| points.iter().map(|point| point[axis]).collect());
        GaussianList::of_planes(planes, true)
    }

    /// The definition: all parents in the order of code, list and row; of those around the own one that are known, the
    /// nearest, ties to the lower list and row.
    fn by_hand(lists: &[Vec<[u32; 3]>; 2], kept: &[bool], modes: &[i32], row: u32) -> Vec<(u32, u32)> {
        let mut order: Vec<(u64, u32, u32)> = Vec::new();
        for (list, points) in (0..).zip(lists) {
            order.extend((0..).zip(points).map(|(row, &[x, y, z])| (morton(x, y, z), list, row)));
        }
        order.sort_unstable();
        let own = order.iter().position(|&(_, list, at)| (list, at) == (1, row)).unwrap();
        let known = |&&(_, list, at): &&(u64, u32, u32)| match (list, modes[at as usize % modes.len()]) {
            (0, _) => kept[at as usize],
            (_, REMOVED) => false,
            (_, mode) => mode & HAS_MOVE == 0 || at < row,
        };
        let near = order.iter().enumerate().filter(|(index, _)| index.abs_diff(own) <= MOVE_WINDOW);
        let point = |list: u32, row: u32| lists[list as usize][row as usize];
        let mut found: Vec<(u64, u32, u32)> = near
            .map(|(_, place)| place)
            .filter(known)
            .map(|&(_, list, at)| (distance(point(1, row), point(list, at)), list, at))
            .collect();
        found.sort_unstable();
        found.into_iter().map(|(_, list, at)| (list, at)).take(MOVE_NEIGHBOURS).collect()
    }

    proptest! {
        #[test]
        fn neighbours_are_those_of_the_definition(
            lists in [list(), list()],
            kept in proptest::collection::vec(any::<bool>(), 80),
            modes in proptest::collection::vec(0..=REMOVED, 80),
        ) {
            let mut space = MoveSpace::new(SpanRatio::default(), 8);
            let [first, last] = lists.each_ref().map(|points| of_points(points));
            let kept = &kept[..first.len()];
            let modes = &modes[..last.len()];
            space.push(&first, &first);
            let mut after = first.clone();
            after.retain(kept);
            space.settle(&after, kept);
            space.push(&last, &last);
            let candidates = Candidates::new(&space, modes);
            for (row, _) in (0..).zip(modes).filter(|(_, mode)| **mode & HAS_MOVE != 0) {
                let Neighbours { found, count } = candidates.nearest(row, &space.order);
                let mut found = found[..count].to_vec();
                let mut expected = by_hand(&lists, kept, modes, row);
                found.sort_unstable();
                expected.sort_unstable();
                prop_assert_eq!(found, expected);
            }
        }
    }
}
