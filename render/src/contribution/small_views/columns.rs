//! What projection takes of each Gaussian that is left, one value beside the same of the next: views read it from start to end.
#![expect(clippy::arithmetic_side_effects, reason = "floats; counts of Gaussians in memory")]
#![expect(clippy::indexing_slicing, reason = "places are those of the Gaussians; axes are constants")]

use crate::rasterise::{Lanes, Shapes, TILE};
use rayon::prelude::*;
use splatstream_gaussians::{GaussianFrame, SH_C0};

/// Values of a Gaussian: position, the three semi-axes, opacity, and the colour without what depends on where it is seen
/// from, at least 0.
pub(super) const VALUES: usize = 3 + 9 + 1 + 3;

/// Some Gaussians of a frame.
pub(super) struct Columns {
    /// Their rows in the frame, rising; none if it is all of them.
    rows: Option<Vec<u32>>,
    count: usize,
    is_antialiased: bool,
    /// By value, sixteen Gaussians side by side; the last one is repeated to fill them.
    values: [Vec<Lanes>; VALUES],
}

impl Columns {
    /// All of a frame.
    pub(super) fn of(frame: &GaussianFrame) -> Self {
        let shapes = Shapes::of(frame);
        let value = |value: usize, row: usize| match value {
            0..3 => frame.position()[value][row],
            3..12 => shapes.axes(row)[(value - 3) / 3][(value - 3) % 3],
            12 => shapes.opacity()[row],
            _ => (0.5 + SH_C0 as f32 * frame.dc()[value - 13][row]).max(0.0),
        };
        let count = frame.len();
        let lanes = |number: usize, of: usize| {
            core::array::from_fn(|lane| value(of, (number * TILE + lane).min(count - 1)))
        };
        let plane = |of: usize| (0..count.div_ceil(TILE)).into_par_iter().map(|at| lanes(at, of)).collect();
        Self { rows: None, count, is_antialiased: frame.antialiased(), values: core::array::from_fn(plane) }
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.count
    }

    /// Whether the frame was made for the compensation of the low-pass filter.
    pub(super) fn is_antialiased(&self) -> bool {
        self.is_antialiased
    }

    /// Takes away all but those of some rows of the frame, which rise.
    pub(super) fn leave(&mut self, rows: &[u32]) {
        let places: Vec<u32> = match &self.rows {
            None => rows.to_vec(),
            Some(before) => {
                let mut known = before.iter().zip(0..);
                rows.iter().filter_map(|row| known.find(|known| known.0 == row)).map(|(_, at)| at).collect()
            }
        };
        self.count = places.len();
        self.values.par_iter_mut().for_each(|plane| {
            let values = plane.as_flattened();
            let lanes =
                |some: &[u32]| core::array::from_fn(|lane| values[some[lane.min(some.len() - 1)] as usize]);
            *plane = places.chunks(TILE).map(lanes).collect();
        });
        self.rows = Some(rows.to_vec());
    }

    /// Sixteen of them after each other, of which the first has this number divided by sixteen; all values.
    #[inline(always)]
    pub(super) fn lanes(&self, number: usize) -> [&Lanes; VALUES] {
        self.values.each_ref().map(|plane| &plane[number])
    }
}
