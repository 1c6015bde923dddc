//! What projection takes of each Gaussian that is left, side by side: one line of a processor's cache, since Gaussians are
//! looked at in the order of their depth, which leaps through memory.
#![expect(
    clippy::indexing_slicing,
    reason = "places are those of the Gaussians; axes and lanes are constants"
)]

use crate::rasterise::{Lanes, TILE, opacity, semi_axes};
use rayon::prelude::*;
use splatstream_gaussians::{GaussianFrame, SH_C0};

/// Values of a Gaussian: position, the three semi-axes, opacity, and the colour without what depends on where it is seen
/// from, at least 0.
pub(super) const VALUES: usize = 3 + 9 + 1 + 3;

/// The least number of Gaussians whose rows are made by one thread.
const RUN: usize = 1 << 12;

/// The values of one Gaussian.
#[derive(Clone, Copy, Default)]
#[repr(align(64))]
pub(super) struct Row([f32; VALUES]);

/// Some Gaussians of a frame.
pub(super) struct Rows {
    /// Which they are in the frame, rising; none if it is all of them.
    numbers: Option<Vec<u32>>,
    is_antialiased: bool,
    all: Vec<Row>,
}

impl Rows {
    /// All of a frame.
    pub(super) fn of(frame: &GaussianFrame) -> Self {
        let row = |row: usize| {
            let [x, y, z] = frame.position().each_ref().map(|plane| plane[row]);
            let [a, b, c] = semi_axes(frame, row).map(|axis| axis.to_array());
            let colour = |plane: &Vec<f32>| (0.5 + SH_C0 as f32 * plane[row]).max(0.0);
            let [red, green, blue] = frame.dc().each_ref().map(colour);
            let opacity = opacity(frame, row);
            let axes = [a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]];
            let [ax, ay, az, bx, by, bz, cx, cy, cz] = axes;
            Row([x, y, z, ax, ay, az, bx, by, bz, cx, cy, cz, opacity, red, green, blue])
        };
        let all = (0..frame.len()).into_par_iter().with_min_len(RUN).map(row).collect();
        Self { numbers: None, is_antialiased: frame.antialiased(), all }
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.all.len()
    }

    /// Whether the frame was made for the compensation of the low-pass filter.
    pub(super) fn is_antialiased(&self) -> bool {
        self.is_antialiased
    }

    /// Takes away all but those of some rows of the frame, which rise.
    pub(super) fn leave(&mut self, rows: &[u32]) {
        let before = self.numbers.take().unwrap_or_else(|| (0..self.all.len() as u32).collect());
        let mut wanted = rows.iter().peekable();
        let mut is_wanted = |number: &u32| {
            while wanted.next_if(|&wanted| wanted < number).is_some() {}
            wanted.next_if(|&wanted| wanted == number).is_some()
        };
        let places: Vec<usize> =
            (0..).zip(&before).filter(|(_, number)| is_wanted(number)).map(|(place, _)| place).collect();
        let left = places.par_iter().with_min_len(RUN).map(|&place| self.all[place]).collect();
        (self.numbers, self.all) = (Some(places.iter().map(|&place| before[place]).collect()), left);
    }

    /// Positions and opacities, by rising place.
    #[inline(always)]
    pub(super) fn positions(&self) -> impl Iterator<Item = ([f32; 3], f32)> {
        self.all.iter().map(|&Row([x, y, z, .., opacity, _, _, _])| ([x, y, z], opacity))
    }

    /// The rows at some places.
    #[inline(always)]
    pub(super) fn bring(&self, places: &[(u32, u32)], rows: &mut [Row]) {
        for (row, &(_, place)) in rows.iter_mut().zip(places) {
            *row = self.all[place as usize];
        }
    }
}

/// All values of sixteen Gaussians side by side.
#[inline(always)]
pub(super) fn lanes(rows: &[Row; TILE]) -> [Lanes; VALUES] {
    let mut lanes = [[0.0; TILE]; VALUES];
    for (lane, Row(values)) in rows.iter().enumerate() {
        for (lanes, &value) in lanes.iter_mut().zip(values) {
            lanes[lane] = value;
        }
    }
    lanes
}
