//! How much each Gaussian shows in a set of views.

use crate::camera::Camera;
use crate::rasterise::{Blend, Splats, TILE, Tile, TileRows, blend_tile, project};
use rayon::prelude::*;
use splatstream_scene::GaussianFrame;

/// The contribution of each Gaussian: transmittance times alpha, summed over the pixels of all views. At
/// least 0; in pixels.
///
/// Equal on every machine and for any number of threads. A Gaussian that no view sees has 0.
pub fn contribution(frame: &GaussianFrame, cameras: &[Camera]) -> Vec<f64> {
    let mut sums = vec![0.0; frame.len()];
    for camera in cameras {
        let splats = project(frame, camera);
        let rows = TileRows::new(&splats, camera);
        let shares: Vec<Vec<(u32, f32)>> = (0..rows.len())
            .into_par_iter()
            .with_max_len(1)
            .map(|row| {
                pulp::Arch::new().dispatch(
                    #[inline(always)]
                    || row_shares(&splats, &rows, row),
                )
            })
            .collect();
        // In the order of the rows, whoever computed them.
        for &(place, share) in shares.iter().flatten() {
            sums[splats.all()[place as usize].gaussian as usize] += f64::from(share);
        }
    }
    sums
}

/// What each ellipse adds to the pictures of a row's tiles.
#[inline(always)]
fn row_shares(splats: &Splats, rows: &TileRows, row: usize) -> Vec<(u32, f32)> {
    let entries = rows.entries(row, splats);
    let mut shares = Vec::new();
    for column in 0..entries.tiles() {
        let places = entries.of_tile(column);
        let mut tile = Tile::new(row, column, rows.size());
        let mut counter = Counter { lanes: [0.0; TILE], places, shares: &mut shares };
        blend_tile(splats, places, &mut tile, &mut counter);
    }
    shares
}

/// Sums what a Gaussian adds to a tile.
struct Counter<'a> {
    lanes: [f32; TILE],
    places: &'a [u32],
    shares: &'a mut Vec<(u32, f32)>,
}

impl Blend for Counter<'_> {
    #[inline(always)]
    fn line(&mut self, _splat: usize, _line: usize, visible: &[f32; TILE]) {
        for (sum, visible) in self.lanes.iter_mut().zip(visible) {
            *sum += visible;
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
