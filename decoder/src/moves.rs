//! Clause 7.4: how moves are predicted.
//!
//! A parent moves by its cell, as it did before, or as its neighbours do. Neighbours are found as those of new
//! Gaussians are ([`crate::neighbours`]): among the parents next to it along the Morton curve, of which those count
//! whose motion is known when the parent's turn comes. Who counts follows from the modes alone, so that neighbours are
//! found in parallel; the motions follow one after the other, in the order of the parents.

use crate::curve;
use crate::list::GaussianList;
use crate::position::morton;
use rayon::prelude::*;
use splatstream_format::{Error, ErrorKind, Result};

/// Candidates on either side of a parent along the curve, at most.
pub const MOVE_WINDOW: usize = 16;
/// Neighbours of a moved parent, at most.
pub const MOVE_NEIGHBOURS: usize = 4;

/// Places of the order searched by one task.
const RUN: usize = 2048;

/// Bits of a mode that say whether a parent moves, and whether it goes.
const HAS_MOVE: i32 = 1;
const REMOVED: i32 = 4;

/// How the position of a moved parent is predicted: the element `move_predictor`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MovePredictor {
    /// By its cell.
    #[default]
    Cells,
    /// It moves as it did to the reference frame.
    Previous,
    /// By its cell, and as its neighbours move apart from their cells.
    Neighbours,
    /// Half as it did, half as its neighbours move.
    Both,
}

impl MovePredictor {
    /// Every predictor, in the order of the codes.
    pub const ALL: [Self; 4] = [Self::Cells, Self::Previous, Self::Neighbours, Self::Both];

    /// The predictor of a code; `at` goes into the error.
    ///
    /// # Errors
    /// Invalid if the code is not in 0..=3.
    pub fn from_code(code: i32, at: u64) -> Result<Self> {
        let kind = ErrorKind::OutOfRange { element: "move_predictor", value: code.into(), min: 0, max: 3 };
        let known = usize::try_from(code).ok().and_then(|code| Self::ALL.get(code)).copied();
        known.ok_or(Error::new(at, "7.4", kind))
    }

    /// The code of the predictor, 0 to 3.
    pub const fn code(self) -> i32 {
        match self {
            Self::Cells => 0,
            Self::Previous => 1,
            Self::Neighbours => 2,
            Self::Both => 3,
        }
    }

    /// Whether it looks at neighbours.
    pub const fn has_neighbours(self) -> bool {
        matches!(self, Self::Neighbours | Self::Both)
    }
}

/// How many times as long the step to a frame is as that to its reference frame: a power of two.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SpanRatio {
    /// log2 of the ratio, -3 to 3.
    log2: i32,
}

impl SpanRatio {
    /// The ratio of two spans, given by their log2.
    pub fn new(of_frame_log2: u8, of_reference_log2: u8) -> Self {
        Self { log2: i32::from(of_frame_log2).wrapping_sub(of_reference_log2.into()) }
    }

    /// `scaled` of clause 7.4: a change over the span of the reference frame, brought to that of the frame.
    #[inline(always)]
    pub fn scaled(self, change: i32) -> i32 {
        let bits = self.log2.unsigned_abs();
        if self.log2 >= 0 { change.wrapping_shl(bits) } else { round(change, bits) }
    }
}

/// `Round(value, bits)` of clause 4.
#[inline(always)]
fn round(value: i32, bits: u32) -> i32 {
    value.wrapping_add(1_i32.wrapping_shl(bits) >> 1).wrapping_shr(bits)
}

/// What is known of a parent, all in 64ths of a step of the position grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Parent {
    /// Its position in the reference frame.
    start: [i32; 3],
    /// How its cell displaces it.
    displacement: [i32; 3],
    /// Its last motion, scaled to the span of this frame.
    trend: [i32; 3],
    /// Its motion in this frame, once it is known.
    motion: [i32; 3],
}

/// A parent on the Morton curve.
#[derive(Debug, Clone, Copy)]
struct Place {
    code: u64,
    list: u32,
    row: u32,
    /// Canonical, displaced.
    at: [u32; 3],
    /// Whether its motion is known, in a list before the last.
    known: bool,
}

/// The parents of the increments of a P or B frame, up to the one that is decoded.
#[derive(Debug, Clone, Default)]
pub struct MoveSpace {
    ratio: SpanRatio,
    /// The largest fine coordinate.
    last: i32,
    lists: Vec<Vec<Parent>>,
    /// All parents along the curve.
    order: Vec<Place>,
}

impl MoveSpace {
    /// Of a frame without increments.
    pub fn new(ratio: SpanRatio, position_bits: u8) -> Self {
        let last = 1_i32.wrapping_shl(position_bits.into()).wrapping_sub(1).wrapping_shl(6);
        Self { ratio, last, ..Self::default() }
    }

    /// Increments whose parents have been added.
    pub fn len(&self) -> usize {
        self.lists.len()
    }

    /// True if no parents have been added.
    pub fn is_empty(&self) -> bool {
        self.lists.is_empty()
    }

    /// Adds the parents of the next increment: as they are in the reference frame, and displaced by their cells. Their
    /// motions are not known yet.
    pub fn push(&mut self, reference: &GaussianList, displaced: &GaussianList) {
        let list = u32::try_from(self.lists.len()).unwrap_or(u32::MAX);
        let vector = |planes: &[Vec<i32>; 3], row: usize| planes.each_ref().map(|plane| at(plane, row));
        let parent = |row: usize| {
            let start = vector(&reference.position_fine, row);
            let moved = vector(&displaced.position_fine, row);
            let trend = vector(&reference.change.motion, row).map(|motion| self.ratio.scaled(motion));
            let displacement = join(moved, start, i32::wrapping_sub);
            Parent { start, displacement, trend, motion: displacement }
        };
        let parents: Vec<Parent> = (0..displaced.len()).into_par_iter().map(parent).collect();
        let position = |index: usize| displaced.planes.position.each_ref().map(|plane| at(plane, index));
        let code = |index: usize| {
            let [x, y, z] = position(index);
            morton(x, y, z)
        };
        let place = |(code, row)| Place { code, list, row, at: position(row as usize), known: false };
        let own: Vec<Place> = curve::order((0..displaced.len()).map(code)).into_iter().map(place).collect();
        self.order = merged(&self.order, &own);
        self.lists.push(parents);
    }

    /// Takes the motions of the parents that were added last: the list after their unit, and which of them it has kept
    /// (empty: all).
    pub fn settle(&mut self, after: &GaussianList, keep: &[bool]) {
        let Some(parents) = self.lists.last_mut() else { return };
        let is_kept = |row: usize| keep.get(row).copied().unwrap_or(true);
        let mut next = 0_usize;
        for (row, parent) in parents.iter_mut().enumerate() {
            if is_kept(row) {
                parent.motion = after.change.motion.each_ref().map(|plane| at(plane, next));
                next = next.wrapping_add(1);
            }
        }
        let list = u32::try_from(self.lists.len().wrapping_sub(1)).unwrap_or(u32::MAX);
        for place in self.order.iter_mut().filter(|place| place.list == list) {
            place.known = is_kept(place.row as usize);
        }
    }

    /// The parents that were added last, to be moved one after the other.
    ///
    /// `modes` are theirs. Neighbours are found for those moves for which `wanted` says so.
    pub fn moves(&self, modes: &[i32], wanted: impl Fn(usize) -> bool + Sync) -> Moves<'_> {
        let rows: Vec<u32> =
            (0_u32..).zip(modes).filter(|(_, mode)| *mode & HAS_MOVE != 0).map(|(row, _)| row).collect();
        let motion = self.lists.last().into_iter().flatten().map(|parent| parent.motion).collect();
        let mut moves = Moves { space: self, rows, neighbours: Vec::new(), motion };
        if (0..moves.rows.len()).any(&wanted) {
            moves.neighbours = self.neighbours(modes, &moves.rows, &wanted);
        }
        moves
    }

    /// The neighbours of each move that `wanted` names.
    fn neighbours(
        &self,
        modes: &[i32],
        rows: &[u32],
        wanted: &(impl Fn(usize) -> bool + Sync),
    ) -> Vec<Neighbours> {
        let list = u32::try_from(self.lists.len().wrapping_sub(1)).unwrap_or(u32::MAX);
        let starts: Vec<usize> = (0..self.order.len()).step_by(RUN).collect();
        let of_run = |&start: &usize| -> Vec<(usize, Neighbours)> {
            let run = self.order.get(start..).unwrap_or_default().iter().take(RUN);
            let own = (start..).zip(run).filter(|(_, place)| place.list == list);
            let moved = own.filter(|(_, place)| at(modes, place.row as usize) & HAS_MOVE != 0);
            let found = moved.filter_map(|(index, place)| {
                let number = rows.binary_search(&place.row).ok().filter(|&number| wanted(number))?;
                Some((number, self.nearest(index, place, list, modes)))
            });
            found.collect()
        };
        let found: Vec<Vec<(usize, Neighbours)>> = starts.par_iter().map(of_run).collect();
        let mut neighbours = vec![Neighbours::default(); rows.len()];
        for (number, of_move) in found.into_iter().flatten() {
            if let Some(slot) = neighbours.get_mut(number) {
                *slot = of_move;
            }
        }
        neighbours
    }

    /// The nearest known parents next to a place.
    fn nearest(&self, index: usize, place: &Place, list: u32, modes: &[i32]) -> Neighbours {
        let end = index.saturating_add(MOVE_WINDOW).saturating_add(1).min(self.order.len());
        let candidates = self.order.get(index.saturating_sub(MOVE_WINDOW)..end).unwrap_or_default();
        let mut nearest = Neighbours::default();
        for candidate in candidates {
            let known = match candidate.list == list {
                false => candidate.known,
                true => match at(modes, candidate.row as usize) {
                    REMOVED => false,
                    mode if mode & HAS_MOVE != 0 => candidate.row < place.row,
                    // The parent itself is moved.
                    _ => true,
                },
            };
            if known {
                nearest.add((distance(place.at, candidate.at), candidate.list, candidate.row));
            }
        }
        nearest
    }
}

/// The neighbours of a moved parent: squared distance, list and row, in this order.
#[derive(Debug, Clone, Copy, Default)]
struct Neighbours {
    found: [(u64, u32, u32); MOVE_NEIGHBOURS],
    count: usize,
}

impl Neighbours {
    /// Takes a candidate if it is among the nearest.
    #[inline(always)]
    fn add(&mut self, mut candidate: (u64, u32, u32)) {
        self.count = self.count.wrapping_add(1);
        for (index, slot) in self.found.iter_mut().enumerate() {
            if index.wrapping_add(1) >= self.count {
                *slot = candidate;
                return;
            }
            if candidate < *slot {
                core::mem::swap(&mut candidate, slot);
            }
        }
        self.count = MOVE_NEIGHBOURS;
    }
}

/// The moves of one increment. The position of each parent is predicted once those before it are known.
#[derive(Debug, Clone)]
pub struct Moves<'s> {
    space: &'s MoveSpace,
    /// The row of each move among the parents.
    rows: Vec<u32>,
    /// Those of each move; none if no predictor looks at them.
    neighbours: Vec<Neighbours>,
    /// The motion of each parent as far as it is known: of those that do not move, that of their cells.
    motion: Vec<[i32; 3]>,
}

impl Moves<'_> {
    /// The row of each move among the parents.
    pub fn rows(&self) -> &[u32] {
        &self.rows
    }

    /// The predicted fine position of the parent of a move; those of the moves before it have been [set](Self::set).
    pub fn predicted(&self, number: usize, predictor: MovePredictor) -> [i32; 3] {
        let parent = self.parent(number);
        let Parent { start, displacement, trend, .. } = parent;
        let motion = match predictor {
            MovePredictor::Cells => displacement,
            MovePredictor::Previous => trend,
            MovePredictor::Neighbours => {
                let apart = |motion, other: &Parent| join(motion, other.displacement, i32::wrapping_sub);
                join(displacement, self.mean(number, apart), i32::wrapping_add)
            }
            MovePredictor::Both => {
                let apart = |motion, other: &Parent| {
                    join(
                        join(motion, other.displacement, i32::wrapping_sub),
                        half_trend(other),
                        i32::wrapping_sub,
                    )
                };
                let by_neighbours = join(displacement, self.mean(number, apart), i32::wrapping_add);
                join(by_neighbours, half_trend(&parent), i32::wrapping_add)
            }
        };
        join(start, motion, i32::saturating_add).map(|moved| moved.clamp(0, self.space.last))
    }

    /// Takes the fine position that the parent of a move has in the end.
    pub fn set(&mut self, number: usize, position_fine: [i32; 3]) {
        let start = self.parent(number).start;
        let row = self.rows.get(number).map_or(usize::MAX, |&row| row as usize);
        if let Some(motion) = self.motion.get_mut(row) {
            *motion = join(position_fine, start, i32::wrapping_sub);
        }
    }

    fn parent(&self, number: usize) -> Parent {
        let row = self.rows.get(number).map_or(usize::MAX, |&row| row as usize);
        self.space.lists.last().map(|parents| at(parents, row)).unwrap_or_default()
    }

    /// The mean of what `of` makes of the neighbours' motions: to nearest, halves up. 0 without neighbours.
    ///
    /// Motions are below 2^26, and trends below 2^29, so that a term is below 2^30.
    fn mean(&self, number: usize, of: impl Fn([i32; 3], &Parent) -> [i32; 3]) -> [i32; 3] {
        let Some(neighbours) = self.neighbours.get(number) else { return [0; 3] };
        let own = u32::try_from(self.space.lists.len().wrapping_sub(1)).unwrap_or(u32::MAX);
        let mut sum = [0_i64; 3];
        for &(_, list, row) in neighbours.found.iter().take(neighbours.count) {
            let Some(parents) = self.space.lists.get(list as usize) else { continue };
            let other = at(parents, row as usize);
            let motion = if list == own { at(&self.motion, row as usize) } else { other.motion };
            let term = of(motion, &other);
            sum.iter_mut().zip(term).for_each(|(sum, term)| *sum = sum.wrapping_add(term.into()));
        }
        let count = i64::try_from(neighbours.count).unwrap_or(0);
        let twice = count.wrapping_mul(2);
        sum.map(|sum| {
            let mean = sum.wrapping_mul(2).wrapping_add(count).checked_div_euclid(twice).unwrap_or(0);
            i32::try_from(mean).unwrap_or(0)
        })
    }
}

/// Half of what a parent's last motion is apart from its cell.
fn half_trend(parent: &Parent) -> [i32; 3] {
    join(parent.trend, parent.displacement, i32::wrapping_sub).map(|apart| round(apart, 1))
}

fn join([a, b, c]: [i32; 3], [d, e, f]: [i32; 3], each: impl Fn(i32, i32) -> i32) -> [i32; 3] {
    [each(a, d), each(b, e), each(c, f)]
}

#[inline(always)]
fn at<T: Copy + Default>(values: &[T], index: usize) -> T {
    values.get(index).copied().unwrap_or_default()
}

#[inline(always)]
fn distance([x, y, z]: [u32; 3], [a, b, c]: [u32; 3]) -> u64 {
    let sides = [x.abs_diff(a), y.abs_diff(b), z.abs_diff(c)].map(u64::from);
    sides.into_iter().fold(0_u64, |sum, side| sum.wrapping_add(side.wrapping_mul(side)))
}

/// Two sorted lists as one; the second has the higher numbers of lists.
fn merged(first: &[Place], second: &[Place]) -> Vec<Place> {
    let mut merged = Vec::with_capacity(first.len().saturating_add(second.len()));
    let (mut first, mut second) = (first.iter().peekable(), second.iter().peekable());
    while let (Some(a), Some(b)) = (first.peek(), second.peek()) {
        let next = if a.code <= b.code { first.next() } else { second.next() };
        merged.extend(next.copied());
    }
    merged.extend(first.chain(second).copied());
    merged
}
