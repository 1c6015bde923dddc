//! Floats onto the grids of the sequence.

use crate::error::Error;
use crate::settings::Steps;
use rayon::prelude::*;
use splatstream_decoder::attribute::rotation_shift;
use splatstream_format::syntax::SequenceParameters;
use splatstream_scene::GaussianFrame;

/// The most bits of an axis that the syntax carries.
const MAX_POSITION_BITS: u32 = 20;
/// The largest magnitude of a log-scale, steps: the difference of two fits 16 bits on the coarsest layer's grid too.
const MAX_LOG_SCALE: f32 = 16_000.0;
/// The same of an opacity.
const MAX_OPACITY: f32 = 32_000.0;
/// The largest magnitude of a position, scene units: with the largest step, 20 bits hold twice as much.
const MAX_POSITION: f32 = (1_u64 << 38) as f32;

/// The integers of a frame that are coded as they are: all but colour. In the order of the source.
#[derive(Debug, Clone, Default)]
pub(crate) struct Geometry {
    /// Grid position.
    pub(crate) position: [Vec<u32>; 3],
    /// Log-scales.
    pub(crate) log_scale: [Vec<i32>; 3],
    /// Opacity logit.
    pub(crate) opacity: Vec<i32>,
    /// Quaternion x, y, z as coded: nearly round Gaussians on a coarser grid.
    pub(crate) rotation: [Vec<i32>; 3],
}

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

    /// The two corners, if there is a Gaussian.
    pub(crate) fn bounds(&self) -> Option<[[f32; 3]; 2]> {
        (self.low[0] <= self.high[0]).then_some([self.low, self.high])
    }

    fn largest_side(&self) -> f32 {
        let side = |axis: usize| (self.high[axis] - self.low[axis]).max(0.0);
        side(0).max(side(1)).max(side(2))
    }
}

/// The largest side of the box that holds the inner 98 % on each axis.
pub(crate) fn inner_side(frame: &GaussianFrame) -> f32 {
    let side = |plane: &Vec<f32>| {
        let mut sorted = plane.clone();
        sorted.sort_unstable_by(f32::total_cmp);
        let at =
            |percent: usize| sorted.get((sorted.len().max(1) - 1) * percent / 100).copied().unwrap_or(0.0);
        at(99) - at(1)
    };
    frame.position().iter().map(side).fold(0.0, f32::max)
}

/// Offset, step and bits of the position grid.
///
/// The step is what was asked for unless the extent then needs more than 20 bits an axis.
pub(crate) fn position_grid(extent: Extent, inner_side: f32, steps: &Steps) -> ([f32; 3], f32, u8) {
    if extent.bounds().is_none() {
        return ([0.0; 3], 1.0, 1);
    }
    let side = extent.largest_side();
    let cells = ((1_u32 << MAX_POSITION_BITS) - 1) as f32;
    let asked = inner_side / libm::exp2f(steps.position_bits);
    let least = (side / cells).max(f32::from_bits(88 << 23));
    let step = asked.max(least).min(f32::from_bits(146 << 23));
    let last = libm::rintf(side / step);
    let bits =
        (1..=MAX_POSITION_BITS).find(|&bits| last < (1_u32 << bits) as f32).unwrap_or(MAX_POSITION_BITS);
    (extent.low, step, bits as u8)
}

/// The nearest integer, ties to even, of a value below 2^22 in magnitude.
///
/// At 1.5 * 2^23 the spacing of f32 is 1: adding it rounds, on any machine and faster than a call.
#[inline]
pub(crate) fn nearest_integer(value: f32) -> i32 {
    const SHIFTER: f32 = 12_582_912.0;
    ((value + SHIFTER) - SHIFTER) as i32
}

/// Which Gaussians take only every second point of a grid.
#[derive(Debug, Clone, Default)]
pub(crate) struct Spacing(Option<Vec<bool>>);

impl Spacing {
    /// Every second point for the last `coarse` of `order`.
    pub(crate) fn of_last(order: &[u32], coarse: usize) -> Self {
        let mut doubled = vec![false; order.len()];
        for &row in order.iter().rev().take(coarse) {
            doubled[row as usize] = true;
        }
        Self(Some(doubled))
    }

    /// Whether a Gaussian takes every second point only.
    pub(crate) fn is_coarse(&self, row: usize) -> bool {
        self.0.as_ref().is_some_and(|doubled| doubled[row])
    }

    /// The nearest point that a Gaussian may take, in steps.
    #[inline]
    pub(crate) fn nearest(&self, row: usize, steps: f32) -> i32 {
        match &self.0 {
            Some(doubled) if doubled[row] => 2 * nearest_integer(0.5 * steps),
            _ => nearest_integer(steps),
        }
    }
}

/// Rounds a canonical frame whose reach has been checked onto the grids.
pub(crate) fn geometry(frame: &GaussianFrame, sequence: &SequenceParameters, spacing: &Spacing) -> Geometry {
    let last = ((1_u32 << sequence.position_bits) - 1) as f32;
    let step = sequence.position_step();
    let mut position = [const { Vec::new() }; 3];
    for (axis, (plane, values)) in position.iter_mut().zip(frame.position()).enumerate() {
        let offset = sequence.position_offset()[axis];
        *plane = values
            .par_iter()
            .map(|&value| nearest_integer(((value - offset) / step).clamp(0.0, last)) as u32)
            .collect();
    }
    let mut log_scale = [const { Vec::new() }; 3];
    for (plane, values) in log_scale.iter_mut().zip(frame.log_scale()) {
        *plane = rounded(values, sequence.log_scale_offset(), sequence.log_scale_step(), spacing);
    }
    let (offset, step) = (sequence.opacity_offset(), sequence.opacity_step());
    let opacity = rounded(frame.opacity_logit(), offset, step, &Spacing::default());
    let [_, x, y, z] = frame.rotation();
    let shifts = rotation_shifts(&log_scale, sequence);
    let rotation = [x, y, z].map(|plane| rotation_plane(plane, &shifts, sequence.rotation_step(), spacing));
    Geometry { position, log_scale, opacity, rotation }
}

/// Whether the values of some Gaussians of a source frame are such that every layer can carry them.
///
/// # Errors
/// The first value of an attribute that is too far out.
pub(crate) fn check_reach(
    frame: &GaussianFrame,
    rows: &[u32],
    steps: &Steps,
    number: u32,
) -> Result<(), Error> {
    let check = |attribute: &'static str, values: &[f32], step: f32, most: f32| {
        let is_out = |row: &&u32| {
            let steps = (values[**row as usize] / step).abs();
            steps > most || steps.is_nan()
        };
        rows.iter().find(is_out).map_or(Ok(()), |&row| {
            let (row, value) = (row as usize, values[row as usize]);
            Err(Error::OutOfGrid { frame: number, attribute, row, value, step })
        })
    };
    for plane in frame.position() {
        check("position", plane, 1.0, MAX_POSITION)?;
    }
    for plane in frame.log_scale() {
        check("log_scale", plane, steps.log_scale, MAX_LOG_SCALE)?;
    }
    check("opacity", frame.opacity_logit(), steps.opacity, MAX_OPACITY)
}

fn rounded(values: &[f32], offset: f32, step: f32, spacing: &Spacing) -> Vec<i32> {
    let nearest = |(row, &value): (usize, &f32)| spacing.nearest(row, (value - offset) / step);
    values.par_iter().enumerate().map(nearest).collect()
}

/// For each Gaussian the bits left out of its rotation; none for a sphere, which needs no rotation.
fn rotation_shifts(log_scale: &[Vec<i32>; 3], sequence: &SequenceParameters) -> Vec<Option<u32>> {
    let [largest, middle, smallest] = log_scale;
    largest
        .iter()
        .zip(middle)
        .zip(smallest)
        .map(|((&a, &b), &c)| {
            let round = a == b && b == c;
            (!round).then(|| rotation_shift(a - c, sequence.rotation_threshold))
        })
        .collect()
}

fn rotation_plane(values: &[f32], shifts: &[Option<u32>], step: f32, spacing: &Spacing) -> Vec<i32> {
    values
        .iter()
        .zip(shifts)
        .enumerate()
        .map(|(row, (&value, shift))| match shift {
            Some(shift) => spacing.nearest(row, value / (step * (1_u32 << shift) as f32)),
            None => 0,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Quality;

    #[test]
    fn the_grid_holds_the_extent_with_the_step_asked_for() {
        let extent = Extent { low: [-1.0, 0.0, 2.0], high: [3.0, 1.0, 2.5] };
        let (offset, step, bits) = position_grid(extent, 2.0, &Quality::High.steps());
        // The sides of the box have 4 * 2^13.4 / 2 = 21,618 cells.
        assert_eq!((offset, step, bits), ([-1.0, 0.0, 2.0], 2.0 / libm::exp2f(13.4), 15));
    }

    #[test]
    fn a_far_outlier_makes_the_step_coarser_and_no_more_bits() {
        let extent = Extent { low: [0.0; 3], high: [1.0e6, 1.0, 1.0] };
        let (_, step, bits) = position_grid(extent, 1.0, &Quality::High.steps());
        assert_eq!(bits, 20);
        assert!(step > 0.9 && 1.0e6 / step < (1 << 20) as f32);
    }

    #[test]
    fn one_point_and_no_point_have_a_grid() {
        let point = Extent { low: [5.0; 3], high: [5.0; 3] };
        assert_eq!(position_grid(point, 0.0, &Quality::High.steps()).2, 1);
        assert_eq!(position_grid(Extent::NONE, 0.0, &Quality::High.steps()).2, 1);
    }
}
