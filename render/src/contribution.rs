//! How much each Gaussian matters to a set of views.

use crate::camera::Camera;
use crate::rasterise::{Blend, Ink, Lanes, Shapes, TILE, Tile, View, blend_tile};
use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use splatstream_gaussians::GaussianFrame;

/// What each Gaussian gives to the pictures: transmittance times alpha, summed over the pixels of all views.
/// At least 0, in pixels.
///
/// Equal on every machine and for any number of threads. A Gaussian that no view sees has 0.
pub fn contribution(frame: &GaussianFrame, cameras: &[Camera]) -> Vec<f64> {
    sums::<false>(frame, cameras).into_iter().map(|worth| worth.contribution).collect()
}

/// What a Gaussian is to a set of views.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Worth {
    /// What it gives: see [`contribution`].
    pub contribution: f64,
    /// What the pictures lose without it: see [`removal`].
    pub loss: f64,
    /// Its transmittance times alpha, squared and summed over the pixels of all views: what the pictures lose, in one
    /// channel, if its colour changes by 1 there.
    pub energy: f64,
}

/// What the pictures lose without each Gaussian: the squared change of colour if that one alone is taken away and
/// what lies behind it shows, summed over the pixels of all views and the three channels. At least 0.
///
/// With transmittance T in front of it, alpha a, its colour c and the light R that is composited behind it, the colour
/// of a pixel changes by T·a·c − R·a / (1 − a). Equal on every machine and for any number of threads.
pub fn removal(frame: &GaussianFrame, cameras: &[Camera]) -> Vec<f64> {
    worth(frame, cameras).into_iter().map(|worth| worth.loss).collect()
}

/// All measures of each Gaussian, for the price of [`removal`].
pub fn worth(frame: &GaussianFrame, cameras: &[Camera]) -> Vec<Worth> {
    sums::<true>(frame, cameras)
}

/// `loss` and `energy` stay 0 without `REMOVAL`.
#[expect(
    clippy::indexing_slicing,
    reason = "lanes and lines are counted by the tile; places and Gaussians are those that it was made from"
)]
fn sums<const REMOVAL: bool>(frame: &GaussianFrame, cameras: &[Camera]) -> Vec<Worth> {
    let mut sums = vec![Worth::default(); frame.len()];
    let shapes = Shapes::of(frame);
    for camera in cameras {
        let view = &View::new(frame, &shapes, camera);
        let rows = (0..view.rows.len()).into_par_iter().with_max_len(1);
        let shares: Vec<Vec<Share>> =
            rows.map(|row| pulp::Arch::new().dispatch(RowShares::<REMOVAL> { view, row })).collect();
        // In the order of the rows, whoever computed them.
        for share in shares.iter().flatten() {
            let sum = &mut sums[view.splats[share.place as usize].gaussian as usize];
            sum.contribution += f64::from(share.contribution);
            sum.loss += f64::from(share.loss);
            sum.energy += f64::from(share.energy);
        }
    }
    sums
}

/// What an ellipse is to a tile: sums over its pixels.
struct Share {
    /// Which ellipse of the view.
    place: u32,
    contribution: f32,
    loss: f32,
    energy: f32,
}

/// What each ellipse is to the tiles of a row.
struct RowShares<'a, const REMOVAL: bool> {
    view: &'a View,
    row: usize,
}

impl<const REMOVAL: bool> WithSimd for RowShares<'_, REMOVAL> {
    type Output = Vec<Share>;

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
            let mut counter = Counter::<REMOVAL> {
                ink,
                given: [0.0; TILE],
                lost: [0.0; TILE],
                squared: [0.0; TILE],
                places,
                shares: &mut shares,
            };
            blend_tile(splats, places, &mut tile(), &mut counter);
        }
        shares
    }
}

/// Sums what a Gaussian is to a tile.
struct Counter<'a, const REMOVAL: bool> {
    /// For removal: the light of the Gaussians that are still to come.
    ink: Ink,
    given: Lanes,
    lost: Lanes,
    squared: Lanes,
    places: &'a [u32],
    shares: &'a mut Vec<Share>,
}

impl<const REMOVAL: bool> Blend for Counter<'_, REMOVAL> {
    #[inline(always)]
    #[expect(
        clippy::indexing_slicing,
        reason = "lanes and lines are counted by the tile; places and Gaussians are those that it was made from"
    )]
    fn line(&mut self, colour: [f32; 3], line: usize, visible: &Lanes, passing: &Lanes) {
        for (sum, visible) in self.given.iter_mut().zip(visible) {
            *sum += visible;
        }
        if !REMOVAL {
            return;
        }
        for (sum, visible) in self.squared.iter_mut().zip(visible) {
            *sum += visible * visible;
        }
        for (behind, colour) in self.ink.light[line].iter_mut().zip(colour) {
            for lane in 0..TILE {
                let own = visible[lane] * colour;
                behind[lane] -= own;
                // What passes is T (1 - a): a pixel that is done has a negative sign there, and nothing visible.
                let change =
                    own - behind[lane] * (visible[lane] / passing[lane].abs().max(f32::MIN_POSITIVE));
                self.lost[lane] += change * change;
            }
        }
    }

    #[inline(always)]
    #[expect(
        clippy::indexing_slicing,
        reason = "lanes and lines are counted by the tile; places and Gaussians are those that it was made from"
    )]
    fn done(&mut self, entry: usize) {
        let contribution: f32 = self.given.iter().sum();
        if contribution > 0.0 {
            let (loss, energy) = (self.lost.iter().sum(), self.squared.iter().sum());
            self.shares.push(Share { place: self.places[entry], contribution, loss, energy });
        }
        self.given = [0.0; TILE];
        self.lost = [0.0; TILE];
        self.squared = [0.0; TILE];
    }
}
