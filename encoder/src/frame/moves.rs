//! Predicted frames: which parents move, how their moves are predicted, and what is left of them.
//!
//! Runs of parents in which most have to move are moved as a whole: a zero among moves costs less than saying which of
//! them stay. Each block of moves takes the predictor that leaves the fewest bits. As in a decoder, the motion of a
//! parent is predicted from what is known of those before it, so that the blocks follow one after the other.
#![expect(
    clippy::arithmetic_side_effects,
    reason = "positions on the grid have at most 26 bits, steps are powers of two"
)]

use super::survivors::{Aim, REMOVED};
use splatstream_decoder::list::{FINE, GaussianList, canonical};
use splatstream_decoder::moves::{MovePredictor, MoveSpace, Moves};
use splatstream_format::syntax::NO_PREDICTOR;

/// log2 of the moves that share a predictor, and of all of them where one suits them all.
const BLOCK_LOG2: u8 = 6;
const WHOLE_LOG2: u8 = 16;

/// Parents that are moved together or each by itself.
const RUN: usize = 64;

/// How often a run is looked at again: what a move takes depends on how many there are.
const ROUNDS: usize = 3;

/// Where more than this share of a run, in quarters, has to move, all of it is moved.
const RUN_QUARTERS: usize = 3;

/// The largest difference, steps, that is left of a coordinate that is moved.
const LEFT: f32 = 0.7;

/// Bits of a coordinate that is left as predicted, of one step, and what each doubling adds.
const ZERO_BITS: f32 = 0.5;
const FIRST_BITS: f32 = 2.2;
const DOUBLING_BITS: f32 = 1.6;

/// Bits by which a block names its predictor.
const NAMED_BITS: f32 = 1.5;

/// The moves of a unit.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct MovePlan {
    /// Of each parent, whether it moves.
    pub(crate) moved: Vec<bool>,
    /// Residuals of those that do.
    pub(crate) planes: [Vec<i32>; 3],
    /// log2 of the moves that share a predictor; [`NO_PREDICTOR`] where none is needed.
    pub(crate) block_log2: u8,
    /// The codes of the predictors.
    pub(crate) predictors: Vec<i32>,
}

/// The grid of the moves of a unit.
#[derive(Debug, Clone, Copy)]
struct MoveGrid {
    /// The step of moves, fine units, and in grid steps.
    step: i32,
    size: f32,
    /// The largest fine coordinate.
    last: i32,
    /// What a bit is worth, squared steps.
    price: f32,
}

impl MoveGrid {
    /// How far a fine coordinate is shown from where it shall be, steps: without its fraction.
    fn apart(self, fine: i32, place: f32) -> f32 {
        (place - canonical(fine) as f32) / self.size
    }

    /// What brings a predicted coordinate near to where it shall be: nothing, the nearest step or the one before it, whichever costs
    /// least in bits and in the error that it leaves.
    fn residual(self, predicted: i32, place: f32) -> i32 {
        let apart = self.apart(predicted, place);
        let nearest = crate::grid::nearest_integer(apart);
        let cost = |steps: i32| {
            let rest = apart - steps as f32;
            rest * rest / self.price + bits_of(steps)
        };
        let mut wanted = nearest;
        for steps in [0, nearest - nearest.signum()] {
            if (apart - steps as f32).abs() <= LEFT && cost(steps) < cost(wanted) {
                wanted = steps;
            }
        }
        // A fraction of a step is left between the outermost point and the end of the grid.
        wanted.clamp(-(predicted / self.step), (self.last - predicted) / self.step)
    }
}

/// Moves the parents that were [added](MoveSpace::push) last.
///
/// `displaced`: as their cells bring them; `aims`: where they shall be, those without one are removed. `shift` and `bits`
/// are `position_shift` of the unit and `position_bits`; `price` is what a bit is worth, squared steps. Without
/// `predicts` cells alone predict.
pub(crate) fn plan(
    space: &MoveSpace,
    displaced: &GaussianList,
    aims: &[Option<Aim>],
    (shift, bits): (u8, u8),
    price: f32,
    predicts: bool,
) -> MovePlan {
    let step = FINE << shift;
    let grid = MoveGrid { step, size: (1_u32 << shift) as f32, last: ((1 << bits) - 1) * FINE, price };
    let moved = moving((displaced, &trends(space, aims.len(), predicts)), aims, grid, predicts);
    let modes: Vec<i32> = aims
        .iter()
        .zip(&moved)
        .map(|(aim, &moved)| if aim.is_none() { REMOVED } else { moved.into() })
        .collect();
    let mut moves = space.moves(&modes, |_| predicts);
    let count = moves.rows().len();
    let mut plan = MovePlan { moved, block_log2: NO_PREDICTOR, ..MovePlan::default() };
    plan.planes.iter_mut().for_each(|plane| plane.reserve(count));
    let tried = if predicts { &MovePredictor::ALL[..] } else { &MovePredictor::ALL[..1] };
    let mut last = MovePredictor::Cells;
    let block = 1_usize << BLOCK_LOG2;
    for start in (0..count).step_by(block) {
        let numbers = start..count.min(start + block);
        let mut cheapest = (f32::INFINITY, MovePredictor::Cells);
        for &predictor in tried {
            let named = if predictor == last { 0.0 } else { NAMED_BITS };
            let residuals = numbers.clone().map(|number| residual(&mut moves, number, predictor, aims, grid));
            let cost = named + residuals.flatten().map(bits_of).sum::<f32>();
            if cost < cheapest.0 {
                cheapest = (cost, predictor);
            }
        }
        let (_, predictor) = cheapest;
        last = predictor;
        plan.predictors.push(predictor.code());
        for number in numbers {
            let residual = residual(&mut moves, number, predictor, aims, grid);
            plan.planes.iter_mut().zip(residual).for_each(|(plane, value)| plane.push(value));
        }
    }
    plan.name_predictors();
    plan
}

impl MovePlan {
    /// Says which predictors the blocks have, as shortly as it can be said.
    fn name_predictors(&mut self) {
        let first = self.predictors.first().copied().unwrap_or(0);
        let alike = self.predictors.iter().all(|&code| code == first);
        if alike && first == MovePredictor::Cells.code() {
            self.predictors.clear();
            return;
        }
        self.block_log2 = BLOCK_LOG2;
        if alike {
            self.block_log2 = WHOLE_LOG2;
            let blocks = self.planes[0].len().div_ceil(1 << WHOLE_LOG2);
            self.predictors = vec![first; blocks];
        }
    }
}

/// The residual of a move under a predictor; its parent goes where that brings it.
#[expect(clippy::indexing_slicing, reason = "rows are those of the list; axes are constants")]
fn residual(
    moves: &mut Moves<'_>,
    number: usize,
    predictor: MovePredictor,
    aims: &[Option<Aim>],
    grid: MoveGrid,
) -> [i32; 3] {
    let row = moves.rows()[number] as usize;
    let predicted = moves.predicted(number, predictor);
    let Some(aim) = aims[row] else { return [0; 3] };
    let residual = [0, 1, 2].map(|axis: usize| grid.residual(predicted[axis], aim.place[axis]));
    moves.set(number, [0, 1, 2].map(|axis: usize| predicted[axis] + residual[axis] * grid.step));
    residual
}

/// Which parents move: those of which a move brings more than its bits are worth and, where moves are predicted, all of
/// runs of which most do.
fn moving(
    (displaced, trends): (&GaussianList, &[[i32; 3]]),
    aims: &[Option<Aim>],
    grid: MoveGrid,
    predicts: bool,
) -> Vec<bool> {
    let mut moved = Vec::with_capacity(aims.len());
    for (start, aims) in (0..).step_by(RUN).zip(aims.chunks(RUN)) {
        let won = |(row, aim): (usize, &Option<Aim>)| {
            aim.map_or(f32::MIN, |aim| bargain((displaced, trends.get(row)), row, aim, grid))
        };
        let bargains: Vec<f32> = (start..).zip(aims).map(won).collect();
        let mut moving: Vec<bool> = bargains.iter().map(|&bits| bits > 0.0).collect();
        for _ in 0..ROUNDS {
            let named = naming_bits(moving.iter().filter(|&&moving| moving).count(), aims.len());
            moving = bargains.iter().map(|&bits| bits > named).collect();
        }
        let able = aims.iter().flatten().filter(|aim| aim.moves).count();
        if predicts && 4 * moving.iter().filter(|&&moving| moving).count() > RUN_QUARTERS * able {
            moving = aims.iter().map(|aim| aim.is_some_and(|aim| aim.moves)).collect();
        }
        moved.extend(moving);
    }
    moved
}

/// Where parents would be if they went on as before; nothing where moves are not predicted.
fn trends(space: &MoveSpace, parents: usize, predicts: bool) -> Vec<[i32; 3]> {
    if !predicts {
        return Vec::new();
    }
    let all = space.moves(&vec![1; parents], |_| false);
    (0..parents).map(|number| all.predicted(number, MovePredictor::Previous)).collect()
}

/// What a move of a parent is worth, in bits, beyond those that it takes from where its cell brings it or from where it would go on
/// to, whichever is the better. What is far off is moved in any case.
#[expect(clippy::indexing_slicing, reason = "rows are those of the list; axes are constants")]
fn bargain(
    (displaced, trend): (&GaussianList, Option<&[i32; 3]>),
    row: usize,
    aim: Aim,
    grid: MoveGrid,
) -> f32 {
    if !aim.moves {
        return f32::MIN;
    }
    let now = displaced.position_fine.each_ref().map(|plane| plane[row]);
    let won = |from: &[i32; 3]| -> f32 {
        let of_axis = |axis: usize| {
            let (apart, place) = (grid.apart(now[axis], aim.place[axis]), aim.place[axis]);
            let residual = grid.residual(from[axis], place);
            let rest = grid.apart(from[axis], place) - residual as f32;
            (apart * apart - rest * rest) / grid.price - bits_of(residual)
        };
        of_axis(0) + of_axis(1) + of_axis(2)
    };
    if aim.is_far { f32::MAX } else { trend.map_or(f32::MIN, won).max(won(&now)) }
}

/// Bits by which saying that a parent moves costs more than saying that it stays, where so many of some do.
fn naming_bits(moving: usize, of: usize) -> f32 {
    let (moving, staying) = (moving as f32 + 0.5, (of - moving) as f32 + 0.5);
    libm::log2f(staying / moving)
}

/// Bits of a coordinate, nearly.
fn bits_of(value: i32) -> f32 {
    match value.unsigned_abs() {
        0 => ZERO_BITS,
        size => FIRST_BITS + DOUBLING_BITS * libm::log2f(size as f32),
    }
}
