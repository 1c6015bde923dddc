//! How much each Gaussian matters to a set of views.

use crate::camera::Camera;
use crate::rasterise::{Blend, Ink, Lanes, Shapes, TILE, Tile, View, blend_tile};
use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use splatstream_scene::GaussianFrame;

/// What each Gaussian gives to the pictures: transmittance times alpha, summed over the pixels of all views.
/// At least 0, in pixels.
///
/// Equal on every machine and for any number of threads. A Gaussian that no view sees has 0.
pub fn contribution(frame: &GaussianFrame, cameras: &[Camera]) -> Vec<f64> {
    sums::<false>(frame, cameras)
}

/// What the pictures lose without each Gaussian: the squared change of colour if that one alone is taken away and
/// what lies behind it shows, summed over the pixels of all views and the three channels. At least 0.
///
/// With transmittance T in front of it, alpha a, its colour c and the light R that is composited behind it, the colour
/// of a pixel changes by T·a·c − R·a / (1 − a). Equal on every machine and for any number of threads.
pub fn removal(frame: &GaussianFrame, cameras: &[Camera]) -> Vec<f64> {
    sums::<true>(frame, cameras)
}

fn sums<const REMOVAL: bool>(frame: &GaussianFrame, cameras: &[Camera]) -> Vec<f64> {
    let mut sums = vec![0.0; frame.len()];
    let shapes = Shapes::of(frame);
    for camera in cameras {
        let view = &View::new(frame, &shapes, camera);
        let rows = (0..view.rows.len()).into_par_iter().with_max_len(1);
        let shares: Vec<Vec<(u32, f32)>> =
            rows.map(|row| pulp::Arch::new().dispatch(RowShares::<REMOVAL> { view, row })).collect();
        // In the order of the rows, whoever computed them.
        for &(place, share) in shares.iter().flatten() {
            sums[view.splats[place as usize].gaussian as usize] += f64::from(share);
        }
    }
    sums
}

/// What each ellipse is to the tiles of a row: its place in the view, and a sum over the pixels of a tile.
struct RowShares<'a, const REMOVAL: bool> {
    view: &'a View,
    row: usize,
}

impl<const REMOVAL: bool> WithSimd for RowShares<'_, REMOVAL> {
    type Output = Vec<(u32, f32)>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let View { splats, rows } = self.view;
        let entries = rows.entries(self.row, splats);
        let mut shares = Vec::new();
        for column in 0..entries.tiles() {
            let places = entries.of_tile(column);
            if places.is_empty() {
                continue;
            }
            let tile = || Tile::new(self.row, column, rows.size());
            let mut ink = Ink::default();
            if REMOVAL {
                blend_tile(splats, places, &mut tile(), &mut ink);
            }
            let mut counter = Counter::<REMOVAL> { ink, lanes: [0.0; TILE], places, shares: &mut shares };
            blend_tile(splats, places, &mut tile(), &mut counter);
        }
        shares
    }
}

/// Sums what a Gaussian is to a tile.
struct Counter<'a, const REMOVAL: bool> {
    /// For removal: the light of the Gaussians that are still to come.
    ink: Ink,
    lanes: Lanes,
    places: &'a [u32],
    shares: &'a mut Vec<(u32, f32)>,
}

impl<const REMOVAL: bool> Blend for Counter<'_, REMOVAL> {
    #[inline(always)]
    fn line(&mut self, colour: [f32; 3], line: usize, visible: &Lanes, passing: &Lanes) {
        if !REMOVAL {
            for (sum, visible) in self.lanes.iter_mut().zip(visible) {
                *sum += visible;
            }
            return;
        }
        for (behind, colour) in self.ink.light[line].iter_mut().zip(colour) {
            for lane in 0..TILE {
                let own = visible[lane] * colour;
                behind[lane] -= own;
                // What passes is T (1 - a): a pixel that is done has a negative sign there, and nothing visible.
                let change =
                    own - behind[lane] * (visible[lane] / passing[lane].abs().max(f32::MIN_POSITIVE));
                self.lanes[lane] += change * change;
            }
        }
    }

    #[inline(always)]
    fn done(&mut self, entry: usize) {
        let share: f32 = self.lanes.iter().sum();
        if share > 0.0 {
            self.shares.push((self.places[entry], share));
        }
        self.lanes = [0.0; TILE];
    }
}
