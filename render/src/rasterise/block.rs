//! Sixteen Gaussians at a time: their values and colours.
#![expect(clippy::arithmetic_side_effects, reason = "floats; counts of Gaussians in memory")]
#![expect(clippy::indexing_slicing, reason = "rows are those of the frame; lanes and axes are constants")]

use super::lanes::{Lanes, TILE};
use splatstream_gaussians::{GaussianFrame, SH_C0, sh_basis, sh_coefficients};
use std::ops::Range;

/// Neighbours in a frame, side by side.
pub(super) struct Block {
    first: usize,
    /// How many there are: further lanes repeat the last.
    count: usize,
}

impl Block {
    /// Those of at most sixteen rows, and at least one.
    #[inline(always)]
    pub(super) fn new(rows: Range<usize>) -> Self {
        Self { first: rows.start, count: rows.len() }
    }

    /// Each with its lane.
    #[inline(always)]
    pub(super) fn rows(&self) -> impl Iterator<Item = (usize, usize)> {
        (self.first..self.first + self.count).enumerate()
    }

    /// Red, green and blue of each, as they are seen from a position.
    #[inline(always)]
    pub(super) fn colours(&self, frame: &GaussianFrame, position: [f32; 3]) -> [Lanes; 3] {
        let constant = SH_C0 as f32;
        // Loops, here and below: closures of `map` are not compiled for the machine unless they are inlined.
        let mut colours = [[0.0; TILE]; 3];
        for (colour, plane) in colours.iter_mut().zip(frame.dc()) {
            let dc = self.of(plane);
            for lane in 0..TILE {
                colour[lane] = 0.5 + constant * dc[lane];
            }
        }
        let coefficients = sh_coefficients(frame.sh_degree());
        if coefficients > 0 {
            let bases = bases(self.directions(frame, position));
            let planes = frame.sh().chunks_exact(3);
            for (planes, basis) in planes.zip(bases.iter().take(coefficients)) {
                for (colour, plane) in colours.iter_mut().zip(planes) {
                    let plane = self.of(plane);
                    for lane in 0..TILE {
                        colour[lane] += basis[lane] * plane[lane];
                    }
                }
            }
        }
        for value in colours.as_flattened_mut() {
            *value = value.max(0.0);
        }
        colours
    }

    /// Where they lie, of length 1; 0 for one that is at the position itself.
    #[inline(always)]
    fn directions(&self, frame: &GaussianFrame, position: [f32; 3]) -> [Lanes; 3] {
        let [x, y, z] = frame.position();
        let mut offsets = [self.of(x), self.of(y), self.of(z)];
        for (offset, position) in offsets.iter_mut().zip(position) {
            offset.iter_mut().for_each(|offset| *offset -= position);
        }
        let mut inverse = [0.0; TILE];
        for lane in 0..TILE {
            let [x, y, z] = [offsets[0][lane], offsets[1][lane], offsets[2][lane]];
            let of_length = 1.0 / (x * x + y * y + z * z).sqrt();
            inverse[lane] = of_length;
        }
        for offset in &mut offsets {
            for lane in 0..TILE {
                let is_apart = inverse[lane] > 0.0 && inverse[lane] < f32::INFINITY;
                offset[lane] = if is_apart { offset[lane] * inverse[lane] } else { 0.0 };
            }
        }
        offsets
    }

    /// Their values in a plane of the frame.
    #[inline(always)]
    pub(super) fn of(&self, plane: &[f32]) -> Lanes {
        let values = &plane[self.first..self.first + self.count];
        let mut lanes = [values[self.count - 1]; TILE];
        match self.count == TILE {
            true => lanes.copy_from_slice(values),
            false => lanes.iter_mut().zip(values).for_each(|(lane, value)| *lane = *value),
        }
        lanes
    }
}

/// The SH basis in sixteen directions.
#[inline(always)]
fn bases([x, y, z]: [Lanes; 3]) -> [Lanes; 15] {
    let mut bases = [[0.0; TILE]; 15];
    for lane in 0..TILE {
        let of_lane = sh_basis([x[lane], y[lane], z[lane]].map(f64::from));
        for (basis, value) in bases.iter_mut().zip(of_lane) {
            basis[lane] = value as f32;
        }
    }
    bases
}
