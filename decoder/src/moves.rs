//! Clause 7.4: how moves are predicted.
//!
//! A parent moves by its cell, as it did before, or as its neighbours do. Neighbours are found as those of new
//! Gaussians are ([`crate::neighbours`]): among the parents next to it along the Morton curve, of which those count
//! whose motion is known when the parent's turn comes. Who counts follows from the modes alone, so that neighbours are
//! found in parallel (`candidates`); the motions follow one after the other, in the order of the parents.
//!
//! No sum overflows (annex F.4), and lists, rows and motions are of one length each: the unit has as many modes and moves as
//! its header counts before anything is predicted, and every place is one that was made for a list that is there.

use crate::cores;
use crate::curve;
use crate::interrupt::Interrupt;
use crate::list::GaussianList;
use crate::vector::vectorized;
use candidates::{Candidates, NEVER, Neighbours, Search};
use splatstream_format::{Error, ErrorKind, Result};

mod candidates;

/// Candidates on either side of a parent along the curve, at most.
pub const MOVE_WINDOW: usize = 16;
/// Neighbours of a moved parent, at most.
pub const MOVE_NEIGHBOURS: usize = 4;

/// Parents, places or moves that one task takes.
const RUN: usize = 2048;
/// Parents that get memory between two looks at the interrupt.
const PART: usize = 1 << 16;

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
}

/// The parents of the increments of a P or B frame, up to the one that is decoded.
#[derive(Debug, Clone, Default)]
pub struct MoveSpace {
    ratio: SpanRatio,
    /// The largest fine coordinate.
    last: i32,
    lists: Vec<Vec<Parent>>,
    /// Which parents of each list but the last stay, empty if all do: the motions of the others are not known.
    kept: Vec<Vec<bool>>,
    /// All parents along the curve.
    order: Vec<Place>,
    /// Ends the work; what it leaves means nothing.
    interrupt: Interrupt,
    /// Memory of other frames.
    spare_lists: Vec<Vec<Parent>>,
    spare_order: Vec<Place>,
}

impl MoveSpace {
    /// Of a frame without increments.
    pub fn new(ratio: SpanRatio, position_bits: u8) -> Self {
        let mut space = Self::default();
        space.restart(ratio, position_bits, Interrupt::NEVER);
        space
    }

    /// Becomes that of another frame without increments.
    pub(crate) fn restart(&mut self, ratio: SpanRatio, position_bits: u8, interrupt: &Interrupt) {
        self.ratio = ratio;
        self.interrupt = interrupt.clone();
        self.last = 1_i32.wrapping_shl(position_bits.into()).wrapping_sub(1).wrapping_shl(6);
        self.spare_lists = core::mem::take(&mut self.lists);
        self.spare_lists.reverse();
        self.kept.clear();
        self.order.clear();
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
        let Self { order, spare_order, spare_lists, ratio, interrupt, .. } = self;
        let requested = &*interrupt;
        // Everything is filled in, so that nothing has to be cleared.
        let mut parents = spare_lists.pop().unwrap_or_default();
        let values = displaced.len().saturating_mul(12);
        while parents.len() < displaced.len() && !requested.is_requested() {
            parents.resize(displaced.len().min(parents.len().saturating_add(PART)), Parent::default());
        }
        parents.truncate(displaced.len());
        let sort = || {
            let positions = displaced.planes.position.each_ref().map(Vec::as_slice);
            let sorted = curve::order(curve::codes(positions, requested).into_iter(), requested);
            if requested.is_requested() {
                return;
            }
            let own = sorted.into_iter().map(|(code, row)| Place { code, list, row });
            merge(order, own, spare_order);
            core::mem::swap(order, spare_order);
        };
        let fill_in = || {
            let runs = parents.chunks_mut(RUN).enumerate();
            cores::for_each(requested, values, runs, |(run, parents)| {
                gather(parents, run.wrapping_mul(RUN), reference, displaced, *ratio);
            });
        };
        cores::join(values, sort, fill_in);
        self.lists.push(parents);
    }

    /// Takes the motions of the parents that were added last: the list after their unit, and which of them it has kept
    /// (empty: all).
    pub fn settle(&mut self, after: &GaussianList, keep: &[bool]) {
        let Some(parents) = self.lists.last_mut() else { return };
        let keeps_all = keep.iter().all(|&keep| keep);
        match keeps_all {
            true => fill(parents, &after.change.motion, 0, |parent, motion| parent.motion = motion),
            false => {
                let [x, y, z] = after.change.motion.each_ref().map(|plane| plane.iter().copied());
                let kept = parents.iter_mut().zip(keep).filter(|(_, keep)| **keep);
                for (((parent, _), (x, y)), z) in kept.zip(x.zip(y)).zip(z) {
                    parent.motion = [x, y, z];
                }
            }
        }
        self.kept.push(if keeps_all { Vec::new() } else { keep.to_vec() });
    }

    /// The parents that were added last, to be moved one after the other.
    ///
    /// `modes` are theirs. Neighbours are found for those moves for which `wanted` says so.
    pub fn moves(&self, modes: &[i32], wanted: impl Fn(usize) -> bool + Sync) -> Moves<'_> {
        let rows: Vec<u32> =
            (0_u32..).zip(modes).filter(|(_, mode)| *mode & HAS_MOVE != 0).map(|(row, _)| row).collect();
        let apart = vec![[0; 3]; self.lists.last().map_or(0, Vec::len)];
        let mut moves = Moves { space: self, rows, neighbours: Vec::new(), apart };
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
        let candidates = Candidates::new(self, modes);
        let mut neighbours = vec![Neighbours::default(); rows.len()];
        let runs = neighbours.chunks_mut(RUN).zip(rows.chunks(RUN)).enumerate();
        let values = rows.len().saturating_mul(MOVE_WINDOW);
        cores::for_each(&self.interrupt, values, runs, |(run, (neighbours, rows))| {
            let first = run.wrapping_mul(RUN);
            vectorized(Search {
                candidates: &candidates,
                order: &self.order,
                rows,
                first,
                wanted,
                neighbours,
            });
        });
        neighbours
    }

    /// From which row on moved parents of the last list can go by the parent at a place.
    #[inline(always)]
    fn known_from(&self, place: &Place, last: u32, modes: &[i32]) -> u32 {
        let row = place.row as usize;
        if place.list != last {
            let kept = self.kept.get(place.list as usize).map(Vec::as_slice).unwrap_or_default();
            return if kept.get(row).copied().unwrap_or(true) { 0 } else { NEVER };
        }
        match at(modes, row) {
            REMOVED => NEVER,
            mode if mode & HAS_MOVE != 0 => place.row.wrapping_add(1),
            _ => 0,
        }
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
    /// How each parent moves apart from its cell, as far as that is known: those that do not move go with it.
    apart: Vec<[i32; 3]>,
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
                join(displacement, self.mean(number, |apart, _| apart), i32::wrapping_add)
            }
            MovePredictor::Both => {
                let rest = |apart, other: &Parent| join(apart, half_trend(other), i32::wrapping_sub);
                let by_neighbours = join(displacement, self.mean(number, rest), i32::wrapping_add);
                join(by_neighbours, half_trend(&parent), i32::wrapping_add)
            }
        };
        join(start, motion, i32::saturating_add).map(|moved| moved.clamp(0, self.space.last))
    }

    /// Takes the fine position that the parent of a move has in the end.
    pub fn set(&mut self, number: usize, position_fine: [i32; 3]) {
        let Parent { start, displacement, .. } = self.parent(number);
        let row = self.rows.get(number).map_or(usize::MAX, |&row| row as usize);
        if let Some(apart) = self.apart.get_mut(row) {
            *apart = join(join(position_fine, start, i32::wrapping_sub), displacement, i32::wrapping_sub);
        }
    }

    fn parent(&self, number: usize) -> Parent {
        let row = self.rows.get(number).map_or(usize::MAX, |&row| row as usize);
        self.space.lists.last().map(|parents| at(parents, row)).unwrap_or_default()
    }

    /// The mean of what `of` makes of how neighbours move apart from their cells: to nearest, halves up. 0 without
    /// neighbours.
    ///
    /// Motions are below 2^26, and trends below 2^29, so that a term is below 2^30.
    fn mean(&self, number: usize, of: impl Fn([i32; 3], &Parent) -> [i32; 3]) -> [i32; 3] {
        let Some(neighbours) = self.neighbours.get(number) else { return [0; 3] };
        let own = u32::try_from(self.space.lists.len().wrapping_sub(1)).unwrap_or(u32::MAX);
        let mut sum = [0_i64; 3];
        for &(list, row) in neighbours.found.iter().take(neighbours.count) {
            let Some(parents) = self.space.lists.get(list as usize) else { continue };
            let Some(other) = parents.get(row as usize) else { continue };
            let apart = match list == own {
                true => at(&self.apart, row as usize),
                false => join(other.motion, other.displacement, i32::wrapping_sub),
            };
            let term = of(apart, other);
            sum.iter_mut().zip(term).for_each(|(sum, term)| *sum = sum.wrapping_add(term.into()));
        }
        // floor((2 sum + count) / (2 count)).
        let mean = |sum: i64| match neighbours.count {
            0 => 0,
            1 => sum,
            2 => sum.wrapping_add(1) >> 1,
            3 => sum.wrapping_mul(2).wrapping_add(3).div_euclid(6),
            _ => sum.wrapping_add(2) >> 2,
        };
        sum.map(|sum| i32::try_from(mean(sum)).unwrap_or(0))
    }
}

/// Half of what a parent's last motion is apart from its cell.
fn half_trend(parent: &Parent) -> [i32; 3] {
    join(parent.trend, parent.displacement, i32::wrapping_sub).map(|apart| round(apart, 1))
}

fn join([a, b, c]: [i32; 3], [d, e, f]: [i32; 3], each: impl Fn(i32, i32) -> i32) -> [i32; 3] {
    [each(a, d), each(b, e), each(c, f)]
}

/// Fills in parents from row `first` on, whose motions in the frame are those of their cells so far.
fn gather(
    parents: &mut [Parent],
    first: usize,
    reference: &GaussianList,
    displaced: &GaussianList,
    ratio: SpanRatio,
) {
    let [x, y, z] = from_row(&reference.position_fine, first);
    let [a, b, c] = from_row(&displaced.position_fine, first);
    let starts = x.iter().zip(y).zip(z).map(|((&x, &y), &z)| [x, y, z]);
    let moved = a.iter().zip(b).zip(c).map(|((&a, &b), &c)| [a, b, c]);
    for ((parent, start), moved) in parents.iter_mut().zip(starts).zip(moved) {
        let displacement = join(moved, start, i32::wrapping_sub);
        *parent = Parent { start, displacement, trend: [0; 3], motion: displacement };
    }
    fill(parents, &reference.change.motion, first, |parent, motion| {
        parent.trend = motion.map(|motion| ratio.scaled(motion));
    });
}

/// Gives each of the parents from row `first` on its values of three planes; nothing where the planes end.
#[inline(always)]
fn fill(parents: &mut [Parent], planes: &[Vec<i32>; 3], first: usize, each: impl Fn(&mut Parent, [i32; 3])) {
    let [x, y, z] = from_row(planes, first);
    for (parent, ((&x, &y), &z)) in parents.iter_mut().zip(x.iter().zip(y).zip(z)) {
        each(parent, [x, y, z]);
    }
}

/// The values of three planes from a row on.
fn from_row(planes: &[Vec<i32>; 3], first: usize) -> [&[i32]; 3] {
    planes.each_ref().map(|plane| plane.get(first..).unwrap_or_default())
}

#[inline(always)]
fn at<T: Copy + Default>(values: &[T], index: usize) -> T {
    values.get(index).copied().unwrap_or_default()
}

/// Two sorted lists as one; the second has the higher number.
fn merge(first: &[Place], second: impl ExactSizeIterator<Item = Place>, merged: &mut Vec<Place>) {
    merged.clear();
    merged.reserve(first.len().saturating_add(second.len()));
    let mut rest = first;
    for place in second {
        let before = rest.iter().take_while(|other| other.code <= place.code).count();
        let (lower, higher) = rest.split_at_checked(before).unwrap_or_default();
        merged.extend_from_slice(lower);
        merged.push(place);
        rest = higher;
    }
    merged.extend_from_slice(rest);
}
