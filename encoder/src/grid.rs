//! Floats onto the grids of the sequence.

use crate::error::Error;
use rayon::prelude::*;
use splatstream_format::syntax::SequenceParameters;
use splatstream_gaussians::GaussianFrame;

/// Parts of a step in which attributes are kept before they are coded, so that they are rounded once.
pub(crate) const PARTS: f32 = 64.0;

/// The largest magnitude of a value, finest steps, for which steps are made finer than asked for: the difference of two, which is
/// what is coded of a value that is predicted, fits 16 bits.
pub(crate) const MAX_DIFFERING: f32 = 16_000.0;
/// The largest magnitude of a log-scale, finest steps: the difference of two is coded where nothing is predicted, too.
pub(crate) const MAX_LOG_SCALE: f32 = MAX_DIFFERING;
/// The largest magnitude of an opacity, finest steps: it fits 16 bits itself.
pub(crate) const MAX_OPACITY: f32 = 32_000.0;
/// Magnitudes of log-scales and opacities beyond which they are mistakes, and not for steps to follow: a frame is refused for
/// them, if steps do not reach so far.
pub(crate) const USUAL: [f32; 2] = [24.0, 100.0];
/// The largest magnitude of a position, scene units: sums of two of them are finite, and so are the squares of what
/// they become in steps.
const MAX_POSITION: f32 = (1_u64 << 38) as f32;
/// The largest magnitude of a coefficient of colour: more than a screen shows several times over. What is beyond is
/// taken for this.
pub(crate) const MAX_COLOUR: f32 = 16.0;

/// The integers of a frame that are coded as they are: all but colour. In the order of the source.
#[derive(Debug, Clone, Default)]
pub(crate) struct Geometry {
    pub(crate) position: [Vec<Place>; 3],
    /// Log-scales, [`PARTS`] of a step.
    pub(crate) log_scale: [Vec<i32>; 3],
    /// Opacity logit, parts of a step.
    pub(crate) opacity: Vec<i32>,
    /// Quaternion x, y, z, parts of a step; none of a sphere.
    pub(crate) rotation: [Vec<i32>; 3],
}

/// Where a coordinate is among the codes of its grid, half steps, cut off: enough to tell which code is nearest to it, and in which
/// cell of every coarser grid it is. The nearest code does not tell that: a coordinate nearest to the first code of a cell
/// may lie before the cell, nearer to the middle of the one before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Place(u32);

impl Place {
    /// The nearest code, or the cell of 2^shift codes that the coordinate is in.
    #[expect(clippy::arithmetic_side_effects, reason = "a code has at most 26 bits, and leaves out fewer")]
    pub(crate) fn code(self, shift: u8) -> u32 {
        if shift == 0 { (self.0 + 1) >> 1 } else { self.0 >> (shift + 1) }
    }

    /// The steps of 2^shift codes that bring a code nearest to the coordinate, halves up.
    #[expect(clippy::arithmetic_side_effects, reason = "a code has at most 26 bits, and leaves out fewer")]
    pub(crate) fn steps_from(self, code: u32, shift: u8) -> i32 {
        (self.0 as i32 - 2 * code as i32 + (1 << shift)) >> (shift + 1)
    }
}

/// The codes of positions: points of a grid that is coarser far from its middle (clause 7.10).
#[derive(Debug, Clone, Copy)]
pub(crate) struct PositionGrid {
    offset: [f64; 3],
    step: f64,
    /// The code in the middle.
    middle: f64,
    last: f64,
    /// Half the length of the linear part, and codes of a segment outside.
    linear: f64,
    segment: f64,
}

impl PositionGrid {
    /// That of a sequence.
    #[expect(clippy::arithmetic_side_effects, reason = "positions have 1 bit or more")]
    pub(crate) fn of(sequence: &SequenceParameters) -> Self {
        let power = |exponent: u8| (1_u64 << exponent) as f64;
        Self {
            offset: sequence.position_offset().map(f64::from),
            step: sequence.position_step().into(),
            middle: power(sequence.position_bits - 1),
            last: power(sequence.position_bits) - 1.0,
            linear: power(sequence.linear_log2),
            segment: power(sequence.segment_log2),
        }
    }

    /// A coordinate as a code and the fraction to the next one.
    pub(crate) fn steps(&self, axis: usize, value: f32) -> f32 {
        self.exact(axis, value) as f32
    }

    #[expect(clippy::indexing_slicing, reason = "axes are 0, 1 and 2; rows are those of the frame")]
    fn exact(&self, axis: usize, value: f32) -> f64 {
        let apart = (f64::from(value) - self.offset[axis]) / self.step - self.middle;
        self.middle + compressed(apart.abs(), self.linear, self.segment).copysign(apart)
    }

    /// Where a coordinate is among the codes.
    pub(crate) fn place(&self, axis: usize, value: f32) -> Place {
        // The map is linear between two codes, so that the nearest code is that of the nearest point.
        Place((2.0 * self.exact(axis, value)).clamp(0.0, 2.0 * self.last) as u32)
    }

    /// Whether a coordinate is farther out than the last code, by more than half of the step there.
    pub(crate) fn is_beyond(&self, axis: usize, value: f32) -> bool {
        let code = self.exact(axis, value);
        !(-0.5..=self.last + 0.5).contains(&code)
    }
}

/// A distance from the middle of the grid, steps, in codes: as it is in the linear part, outside with steps that double
/// from segment to segment.
pub(crate) fn compressed(apart: f64, linear: f64, segment: f64) -> f64 {
    if apart <= linear {
        return apart;
    }
    // Segment k, from 1, begins at linear + segment (2^k - 2) and has steps of 2^k.
    let scaled = (apart - linear) / segment + 2.0;
    let k = libm::floor(libm::log2(scaled)).max(1.0);
    let step = libm::exp2(k);
    linear + segment * (k - 1.0) + (scaled - step) * segment / step
}

/// The nearest integer, ties to even, of a value of 2^22 in magnitude at most; what is beyond is taken for the limit.
///
/// At 1.5 * 2^23 the spacing of f32 is 1: adding it rounds, and the integer stands in the last bits of the sum. All machines do
/// that alike and on whole vectors, where a cast has to look for what no integer is.
#[inline(always)]
pub(crate) fn nearest_integer(value: f32) -> i32 {
    const SHIFTER: f32 = 12_582_912.0;
    const MOST: f32 = 4_194_304.0;
    let value = if value > -MOST { value } else { -MOST };
    let value = if value < MOST { value } else { MOST };
    (value + SHIFTER).to_bits().wrapping_sub(SHIFTER.to_bits()).cast_signed()
}

/// Rounds a canonical frame whose reach has been checked onto the grids.
pub(crate) fn geometry(frame: &GaussianFrame, sequence: &SequenceParameters) -> Geometry {
    let grid = PositionGrid::of(sequence);
    let mut position = [const { Vec::new() }; 3];
    for (axis, (plane, values)) in position.iter_mut().zip(frame.position()).enumerate() {
        *plane = values.par_iter().map(|&value| grid.place(axis, value)).collect();
    }
    let (offset, step) = (sequence.log_scale_offset(), sequence.log_scale_step());
    let log_scale = frame.log_scale().each_ref().map(|plane| parts(plane, offset, step));
    let (offset, step) = (sequence.opacity_offset(), sequence.opacity_step());
    let opacity = parts(frame.opacity_logit(), offset, step);
    let ([_, x, y, z], [a, b, c]) = (frame.rotation(), frame.log_scale());
    let scale = PARTS / sequence.rotation_step();
    // A sphere needs no rotation.
    let turned = |(&value, ((a, b), c)): (&f32, ((&f32, &f32), &f32))| {
        if a == b && b == c { 0 } else { part(value, 0.0, scale) }
    };
    let rotation =
        [x, y, z].map(|plane| plane.par_iter().zip(a.par_iter().zip(b).zip(c)).map(turned).collect());
    Geometry { position, log_scale, opacity, rotation }
}

/// Log-scales and opacity of one Gaussian of such a frame.
#[expect(clippy::indexing_slicing, reason = "rows are those of the frame")]
pub(crate) fn size(frame: &GaussianFrame, row: usize, sequence: &SequenceParameters) -> ([i32; 3], i32) {
    let (offset, scale) = (sequence.log_scale_offset(), PARTS / sequence.log_scale_step());
    let log_scale = frame.log_scale().each_ref().map(|plane| part(plane[row], offset, scale));
    let (offset, scale) = (sequence.opacity_offset(), PARTS / sequence.opacity_step());
    (log_scale, part(frame.opacity_logit()[row], offset, scale))
}

/// Values in parts of a step.
fn parts(values: &[f32], offset: f32, step: f32) -> Vec<i32> {
    let scale = PARTS / step;
    values.par_iter().map(|&value| part(value, offset, scale)).collect()
}

/// A value in parts of a step, of which there are `scale` in 1. In reach it is below 2^21.
#[inline(always)]
fn part(value: f32, offset: f32, scale: f32) -> i32 {
    const MOST: f32 = 2_097_152.0;
    nearest_integer(((value - offset) * scale).clamp(-MOST, MOST))
}

/// Whether the values of some Gaussians of a source frame are such that a decoder can have them. Steps of log-scale and opacity
/// that are too fine for usual values become coarser, so that no frame is refused for these.
///
/// # Errors
/// The first value of an attribute that is too far out, and the one that is farthest out.
#[expect(clippy::indexing_slicing, reason = "axes are 0, 1 and 2; rows are those of the frame")]
pub(crate) fn check_reach(
    frame: &GaussianFrame,
    rows: &[u32],
    (log_scale_step, opacity_step): (f32, f32),
    number: u32,
) -> Result<(), Error> {
    let check = |attribute: &'static str, values: &[f32], step: f32, most: f32| {
        let value = |row: u32| values[row as usize];
        let is_out = |row: &u32| {
            let steps = (value(*row) / step).abs();
            steps > most || steps.is_nan()
        };
        let out = || rows.iter().copied().filter(is_out);
        let Some(first) = out().next() else { return Ok(()) };
        let by_magnitude = |&a: &u32, &b: &u32| value(a).abs().total_cmp(&value(b).abs());
        let farthest = out().max_by(by_magnitude).unwrap_or(first);
        Err(Error::OutOfGrid {
            frame: number,
            attribute,
            row: first as usize,
            value: value(first),
            most: step * most,
            count: out().count(),
            farthest_row: farthest as usize,
            farthest: value(farthest),
        })
    };
    let log_scale_step = log_scale_step.max(USUAL[0] / MAX_LOG_SCALE);
    let opacity_step = opacity_step.max(USUAL[1] / MAX_OPACITY);
    let positions = frame.position().iter().map(|plane| ("position", plane.as_slice(), 1.0, MAX_POSITION));
    let sizes = frame.log_scale().iter();
    let sizes = sizes.map(|plane| ("log_scale", plane.as_slice(), log_scale_step, MAX_LOG_SCALE));
    let opacity = ("opacity", frame.opacity_logit(), opacity_step, MAX_OPACITY);
    let planes: Vec<_> = positions.chain(sizes).chain([opacity]).collect();
    let checked: Vec<Result<(), Error>> =
        planes.into_par_iter().map(|(name, plane, step, most)| check(name, plane, step, most)).collect();
    checked.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use splatstream_decoder::output::Companding;

    fn grid(position_bits: u8, linear_log2: u8, segment_log2: u8) -> (PositionGrid, Companding) {
        let sequence = SequenceParameters {
            position_bits,
            linear_log2,
            segment_log2,
            position_step: 0.25_f32.to_bits(),
            position_offset: [(-0.25 * (1_u32 << (position_bits - 1)) as f32).to_bits(); 3],
            ..SequenceParameters::PLAIN
        };
        (PositionGrid::of(&sequence), Companding::new(&sequence))
    }

    #[test]
    fn every_code_comes_back_from_its_point() {
        for (bits, linear, segment) in [(8, 7, 7), (8, 4, 4), (8, 4, 3), (6, 2, 1), (20, 15, 15), (1, 0, 0)] {
            let (grid, companding) = grid(bits, linear, segment);
            let middle = 1_i64 << (bits - 1);
            for code in (0..1_u32 << bits).step_by(if bits > 8 { 997 } else { 1 }) {
                let point = (companding.expand(code) - middle) as f32 * 0.25;
                assert_eq!(grid.place(0, point).code(0), code, "{bits} {linear} {segment}");
                assert!(!grid.is_beyond(0, point));
            }
        }
    }

    #[test]
    fn coarse_cells_are_those_that_coordinates_are_in() {
        let (grid, _) = grid(8, 7, 7);
        for quarters in 0..200 {
            let value = f64::from(quarters) / 4.0 - 1.0;
            let place = grid.place(0, 0.25 * value as f32 - 32.0);
            assert_eq!(f64::from(place.code(2)), (value.max(0.0) / 4.0).floor());
            // From the middle of the third cell, 10, in steps of a cell.
            assert_eq!(f64::from(place.steps_from(10, 2)), ((value.max(0.0) - 10.0) / 4.0 + 0.5).floor());
        }
    }

    proptest! {
        #[test]
        fn the_nearest_point_is_taken(value in -3_000.0_f32..3_000.0) {
            let (grid, companding) = grid(8, 4, 3);
            let point = |code: u32| (companding.expand(code) - 128) as f32 * 0.25;
            let nearest = (0..256).map(|code| (point(code) - value).abs()).fold(f32::INFINITY, f32::min);
            prop_assert!((point(grid.place(0, value).code(0)) - value).abs() <= nearest * 1.0001);
        }
    }
}
