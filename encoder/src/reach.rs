//! Where the Gaussians of a sequence are, and the grid for their positions.
//!
//! Captures have no bounds: most of a scene is near, a part is far, and a few Gaussians are where training left them. The
//! step of the grid comes from the [core] of the scene, whatever lies outside. How far the grid is linear, and how its
//! steps grow outside, is what costs the fewest bits at equal error in pictures.
#![expect(
    clippy::arithmetic_side_effects,
    reason = "exponents of two between 1 and MAX_POSITION_BITS; percentages of lengths of what is in memory"
)]
#![expect(clippy::indexing_slicing, reason = "axes are constants, and rows are those of the frame")]

use crate::quantile::between_ends;
use crate::steps::Steps;
use splatstream_format::syntax::SequenceParameters;
use splatstream_gaussians::GaussianFrame;

/// The most bits of an axis that the syntax carries.
const MAX_POSITION_BITS: u8 = 20;
/// The most segments on a side.
const MAX_SEGMENTS: u64 = 24;
/// Gaussians fainter than this say nothing of where the scene is: a logit.
const VISIBLE_LOGIT: f32 = -2.0;
/// Gaussians on which grids are compared.
const SAMPLE: usize = 1 << 13;
/// A grid that is not linear must save this much, bits per Gaussian.
const WORTHWHILE: f64 = 0.1;

/// Smallest and largest position on each axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Extent {
    /// Smallest.
    pub(crate) low: [f32; 3],
    /// Largest.
    pub(crate) high: [f32; 3],
}

impl Extent {
    /// Of no Gaussian at all.
    pub(crate) const NONE: Self = Self { low: [f32::INFINITY; 3], high: [f32::NEG_INFINITY; 3] };

    /// Grown to hold some Gaussians of a frame.
    pub(crate) fn with(mut self, frame: &GaussianFrame, rows: &[u32]) -> Self {
        for (axis, plane) in frame.position().iter().enumerate() {
            for value in rows.iter().map(|&row| plane[row as usize]) {
                self.low[axis] = self.low[axis].min(value);
                self.high[axis] = self.high[axis].max(value);
            }
        }
        self
    }

    /// As large as so many boxes side by side on each axis, around the same middle.
    pub(crate) fn widened(mut self, boxes: f32) -> Self {
        let side = self.largest_side() as f32;
        for (low, high) in self.low.iter_mut().zip(&mut self.high) {
            (*low, *high) = (*low - 0.5 * (boxes - 1.0) * side, *high + 0.5 * (boxes - 1.0) * side);
        }
        self
    }

    /// The two corners, if there is a Gaussian.
    pub(crate) fn bounds(&self) -> Option<[[f32; 3]; 2]> {
        (self.low[0] <= self.high[0]).then_some([self.low, self.high])
    }

    /// Whether two Gaussians are apart.
    pub(crate) fn has_size(&self) -> bool {
        self.largest_side() > 0.0
    }

    fn largest_side(&self) -> f64 {
        let side = |axis: usize| f64::from(self.high[axis]) - f64::from(self.low[axis]);
        side(0).max(side(1)).max(side(2)).max(0.0)
    }
}

/// The box that most of a scene is in: a cube.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Core {
    pub(crate) middle: [f32; 3],
    /// Half of its side.
    pub(crate) half: f32,
}

impl Core {
    /// The box of what is visible, less 3 % at either end of each axis. Where that is more than four times as large as
    /// the box of the inner 60 %, the scene has surroundings, and the inner box is its core.
    pub(crate) fn of(frame: &GaussianFrame, shown: &[u32]) -> Self {
        let all = || shown.iter().map(|&row| row as usize);
        let mut rows: Vec<usize> = all().filter(|&row| frame.opacity_logit()[row] > VISIBLE_LOGIT).collect();
        if rows.is_empty() {
            rows = all().collect();
        }
        let of_axis = |plane: &Vec<f32>| {
            let mut values: Vec<f32> = rows.iter().map(|&row| plane[row]).collect();
            [3, 20, 80, 97].map(|percent| percentile(&mut values, percent))
        };
        let [x, y, z] = frame.position();
        let (x, (y, z)) = rayon::join(|| of_axis(x), || rayon::join(|| of_axis(y), || of_axis(z)));
        let axes = [x, y, z];
        let halves = |low: usize, high: usize| {
            axes.iter().map(|axis| 0.5 * axis[high] - 0.5 * axis[low]).fold(0.0, f32::max)
        };
        let (outer, inner) = (halves(0, 3), halves(1, 2));
        let (low, high, half) =
            if outer > 4.0 * inner && inner > 0.0 { (1, 2, inner) } else { (0, 3, outer) };
        Self { middle: axes.map(|axis| 0.5 * axis[low] + 0.5 * axis[high]), half }
    }

    /// Around the middle of the usual frame: what nine of ten frames of a sequence need.
    pub(crate) fn of_all(cores: &[Self]) -> Self {
        let of_cores = |part: &dyn Fn(&Self) -> f32, percent: usize| {
            let mut values: Vec<f32> = cores.iter().map(part).collect();
            percentile(&mut values, percent)
        };
        let middle = [0, 1, 2].map(|axis: usize| of_cores(&|core| core.middle[axis], 50));
        let half = |core: &Self| {
            let apart = (0..3).map(|axis| (core.middle[axis] - middle[axis]).abs()).fold(0.0, f32::max);
            core.half + apart
        };
        Self { middle, half: of_cores(&half, 90) }
    }
}

/// What is known of the positions of a sequence.
#[derive(Debug, Clone)]
pub(crate) struct Reach {
    /// Of all frames.
    pub(crate) extent: Extent,
    pub(crate) core: Core,
    /// The side of the core of the first frame.
    pub(crate) side: f32,
    /// Largest distance on an axis from the middle of the core, and square of the opacity, of some Gaussians.
    pub(crate) sample: Vec<([f32; 3], f32)>,
}

/// A grid that may serve.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    bits: u8,
    linear_log2: u8,
    segment_log2: u8,
}

impl Reach {
    /// Positions and opacities of some Gaussians of a frame.
    pub(crate) fn sample(frame: &GaussianFrame, rows: &[u32]) -> Vec<([f32; 3], f32)> {
        let stride = rows.len().div_ceil(SAMPLE).max(1);
        let one = |&row: &u32| {
            let opacity = 1.0 / (1.0 + libm::expf(-frame.opacity_logit()[row as usize]));
            (frame.position().each_ref().map(|plane| plane[row as usize]), opacity * opacity)
        };
        rows.iter().step_by(stride).map(one).collect()
    }

    /// Puts the grid of positions into the parameters of a sequence. Its step is what was asked for.
    pub(crate) fn put_into(&self, sequence: &mut SequenceParameters, steps: &Steps) {
        let finest = f32::from_bits(88 << 23);
        let step = match self.extent.bounds() {
            None => 1.0,
            // Of one point, or of points that far ones outnumber, any step will do.
            Some(_) if self.side <= 0.0 => {
                (self.extent.largest_side() / f64::from(1_u32 << 16)).max(f64::from(finest)) as f32
            }
            Some(_) => (self.side / libm::exp2f(steps.position_bits)).max(finest),
        };
        let step = step.min(f32::from_bits(146 << 23));
        sequence.position_step = step.to_bits();
        let offset = match self.extent.bounds() {
            None => {
                self.set(sequence, Candidate { bits: 1, linear_log2: 0, segment_log2: 0 });
                [0.0; 3]
            }
            Some([low, _]) => match self.choose(f64::from(step)) {
                Choice::Linear(bits) => {
                    let linear_log2 = bits - 1;
                    self.set(sequence, Candidate { bits, linear_log2, segment_log2: linear_log2 });
                    low
                }
                Choice::Companded(grid) => {
                    self.set(sequence, grid);
                    let half = step * (1_u32 << (grid.bits - 1)) as f32;
                    self.core.middle.map(|middle| middle - half)
                }
            },
        };
        sequence.position_offset = offset.map(f32::to_bits);
    }

    fn set(&self, sequence: &mut SequenceParameters, grid: Candidate) {
        let Candidate { bits, linear_log2, segment_log2 } = grid;
        (sequence.position_bits, sequence.linear_log2, sequence.segment_log2) =
            (bits, linear_log2, segment_log2);
    }

    /// The grid that costs least of those that reach every Gaussian; if none does, of those that reach farthest.
    fn choose(&self, step: f64) -> Choice {
        let last = libm::rint(self.extent.largest_side() / step);
        let linear = (1..=MAX_POSITION_BITS).find(|&bits| last < (1_u64 << bits) as f64);
        let half = f64::from(self.core.half) / step;
        let farthest = (0..3).map(|axis| {
            let middle = f64::from(self.core.middle[axis]);
            let (low, high) = (f64::from(self.extent.low[axis]), f64::from(self.extent.high[axis]));
            (middle - low).max(high - middle)
        });
        let farthest = farthest.fold(0.0, f64::max) / step;
        let points = self.points(step, half);
        let mut best: Option<(f64, f64, Candidate)> = None;
        for grid in candidates(half) {
            let missed = (libm::log2(farthest / grid.reach())).max(0.0);
            let cost = cost_of(&points, &grid);
            if best.is_none_or(|(least, cheapest, _)| (missed, cost) < (least, cheapest)) {
                best = Some((missed, cost, grid));
            }
        }
        let everywhere = |bits: u8| Candidate { bits, linear_log2: bits - 1, segment_log2: bits - 1 };
        match (linear, best) {
            (Some(bits), Some((missed, cost, grid))) => {
                let by_line = cost_of(&points, &Candidate { linear_log2: 63, ..everywhere(bits) });
                let pays = missed <= 0.0 && cost + WORTHWHILE < by_line;
                if pays { Choice::Companded(grid.narrowed(farthest)) } else { Choice::Linear(bits) }
            }
            (None, Some((_, _, grid))) => Choice::Companded(grid.narrowed(farthest)),
            (bits, None) => Choice::Linear(bits.unwrap_or(MAX_POSITION_BITS)),
        }
    }

    /// How far the Gaussians of the sample are from the middle of the core on each axis, steps, and what errors there count.
    ///
    /// An error of position shows as the angle at which it is seen, from somewhere in the core or near it, and counts
    /// as the square of that and of the opacity.
    fn points(&self, step: f64, half: f64) -> Vec<([f64; 3], f64)> {
        let point = |(position, opacity): &([f32; 3], f32)| {
            let apart = [0, 1, 2].map(|axis: usize| {
                (f64::from(position[axis]) - f64::from(self.core.middle[axis])).abs() / step
            });
            let distance = apart[0].max(apart[1]).max(apart[2]).max(half);
            (apart, f64::from(*opacity) / (distance * distance))
        };
        self.sample.iter().map(point).collect()
    }
}

/// Bits per Gaussian of positions, but for what is the same for all grids, with the step at which errors in pictures are
/// those of another grid.
fn cost_of(points: &[([f64; 3], f64)], grid: &Candidate) -> f64 {
    let linear = libm::exp2(grid.linear_log2.into());
    // Powers of two: a product is the quotient.
    let of_segment = libm::exp2(-f64::from(grid.segment_log2));
    let (mut error, mut octaves, mut weights) = (0.0, 0, 0.0);
    for &(apart, weight) in points {
        weights += weight;
        for apart in apart {
            let coarser = coarser(apart, linear, of_segment);
            octaves += i64::from(coarser);
            error += weight * power_of_two(2 * coarser);
        }
    }
    1.5 * libm::log2((error / (3.0 * weights)).max(1.0)) - octaves as f64 / points.len().max(1) as f64
}

/// What positions are coded on.
enum Choice {
    /// A linear grid of so many bits.
    Linear(u8),
    Companded(Candidate),
}

impl Candidate {
    /// Codes on either side of the middle.
    fn half(&self) -> u64 {
        1 << (self.bits - 1)
    }

    /// The farthest point on the shorter side, steps.
    fn reach(&self) -> f64 {
        let outside = (self.half() - 1).saturating_sub(1 << self.linear_log2);
        let (segments, rest) = (outside >> self.segment_log2, outside & ((1 << self.segment_log2) - 1));
        let whole = (libm::exp2(segments as f64 + 1.0) - 2.0) * libm::exp2(self.segment_log2.into());
        libm::exp2(self.linear_log2.into()) + whole + rest as f64 * libm::exp2(segments as f64 + 1.0)
    }

    /// With no more bits than a distance needs.
    fn narrowed(self, farthest: f64) -> Self {
        let fits = |bits: &u8| {
            let narrower = Self { bits: *bits, ..self };
            narrower.half() > 1 << self.linear_log2 && narrower.reach() >= farthest
        };
        let least = self.linear_log2 + 2;
        Self { bits: (least..self.bits).find(fits).unwrap_or(self.bits), ..self }
    }
}

/// Grids with as many bits as the syntax allows, linear about as far as the core of a scene.
fn candidates(half: f64) -> impl Iterator<Item = Candidate> {
    let of_core = libm::ceil(libm::log2(half.max(1.0))) as i32;
    (0..=4).flat_map(move |more| {
        let linear_log2 = (of_core + more).clamp(1, i32::from(MAX_POSITION_BITS) - 2) as u8;
        [linear_log2 - 1, linear_log2].into_iter().filter_map(move |segment_log2| {
            let grid = |bits: u8| Candidate { bits, linear_log2, segment_log2 };
            let allowed = |grid: &Candidate| {
                let outside = grid.half().saturating_sub(1 << linear_log2);
                outside.div_ceil(1 << segment_log2) <= MAX_SEGMENTS
            };
            (linear_log2 + 2..=MAX_POSITION_BITS).rev().map(grid).find(allowed)
        })
    })
}

/// log2 of the step at a distance from the middle.
fn coarser(apart: f64, linear: f64, of_segment: f64) -> i32 {
    if apart <= linear { 0 } else { exponent((apart - linear) * of_segment + 2.0) }
}

/// 0 of nothing.
fn percentile(values: &mut [f32], percent: usize) -> f32 {
    between_ends(values, percent, f32::total_cmp).unwrap_or_default()
}

/// 2 to an integer of small magnitude, exactly.
fn power_of_two(exponent: i32) -> f64 {
    f64::from_bits(((exponent + 1023) as u64) << 52)
}

/// The integer part of the binary logarithm of a number from 1 on: its exponent.
fn exponent(value: f64) -> i32 {
    (value.to_bits() >> 52) as i32 - 1023
}
