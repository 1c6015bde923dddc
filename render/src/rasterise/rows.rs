//! Which ellipses touch which tiles.
#![expect(
    clippy::arithmetic_side_effects,
    reason = "rows and tiles of a picture, and counts of what is in memory"
)]

use super::Sight;
use super::lanes::TILE;
use super::project::{LOG2_255, Splat};
use rayon::prelude::*;

/// The ellipses that touch each row of tiles, nearest first.
pub(crate) struct TileRows {
    /// Width and height of the picture, pixels.
    size: [usize; 2],
    rows: Vec<Vec<u32>>,
}

/// The ellipses of each tile of a row, nearest first.
pub(crate) struct RowEntries {
    /// Where each tile's entries start, and where the last one's end.
    starts: Vec<u32>,
    entries: Vec<u32>,
}

impl TileRows {
    /// Sorts the ellipses of a view into rows.
    #[expect(
        clippy::indexing_slicing,
        reason = "rows and tiles are cut to the picture before, and entries are counted before they are placed"
    )]
    pub(crate) fn new(splats: &[Splat], sight: &Sight<'_>) -> Self {
        let camera = sight.camera;
        let count = (camera.height as usize).div_ceil(TILE);
        let mut rows = vec![Vec::new(); count];
        let mut is_drawn = vec![false; count];
        sight.strips.rows(count).for_each(|row| is_drawn[row] = true);
        let of_splat = |splat: &Splat| tiles_across(splat.centre[1], splat.extent[1], count);
        let across: Vec<(u32, u32)> = splats.par_iter().with_min_len(4096).map(of_splat).collect();
        // Bands of rows, so that threads share no row.
        let band = count.div_ceil(2 * rayon::current_num_threads()).max(1);
        rows.par_chunks_mut(band).enumerate().for_each(|(number, rows)| {
            let first = number * band;
            for (place, &(top, bottom)) in (0..).zip(&across) {
                let top = (top as usize).max(first);
                for row in top..(bottom as usize + 1).min(first + rows.len()) {
                    if is_drawn[row] {
                        rows[row - first].push(place);
                    }
                }
            }
        });
        Self { size: [camera.width as usize, camera.height as usize], rows }
    }

    /// Width and height of the picture, pixels.
    pub(crate) fn size(&self) -> [usize; 2] {
        self.size
    }

    /// The ellipses of a row, nearest first.
    #[expect(clippy::indexing_slicing, reason = "a row of the picture")]
    pub(crate) fn of_row(&self, row: usize) -> &[u32] {
        &self.rows[row]
    }

    /// Rows of tiles.
    pub(crate) fn len(&self) -> usize {
        self.rows.len()
    }

    /// Sorts the ellipses of a row into its tiles.
    #[inline(always)]
    #[expect(
        clippy::indexing_slicing,
        reason = "rows and tiles are cut to the picture before, and entries are counted before they are placed"
    )]
    pub(crate) fn entries(&self, row: usize, splats: &[Splat]) -> RowEntries {
        let tiles = self.size[0].div_ceil(TILE);
        let top = (row * TILE) as f32 + 0.5;
        let mut starts = vec![0; tiles + 1];
        let mut spans = Vec::with_capacity(self.rows[row].len());
        for &place in &self.rows[row] {
            let (left, right) = span(&splats[place as usize], top, top + (TILE - 1) as f32);
            let (left, right) = (left.max(0), right.min(tiles as i32 - 1));
            for tile in left..=right {
                starts[tile as usize + 1] += 1;
            }
            spans.push((left, right));
        }
        for tile in 0..tiles {
            starts[tile + 1] += starts[tile];
        }
        let mut next = starts.clone();
        let mut entries = vec![0; starts[tiles] as usize];
        for (&place, &(left, right)) in self.rows[row].iter().zip(&spans) {
            for tile in left..=right {
                let slot = &mut next[tile as usize];
                entries[*slot as usize] = place;
                *slot += 1;
            }
        }
        RowEntries { starts, entries }
    }
}

/// First and last of so many rows of tiles that a centre and its reach touch.
fn tiles_across(centre: f32, extent: f32, count: usize) -> (u32, u32) {
    // What is projected ends at 0 or above, so that truncation is the floor.
    let tile = |at: f32| ((at.max(0.0) / TILE as f32) as usize).min(count) as u32;
    (tile(centre - extent), tile(centre + extent))
}

/// First and last tile that an ellipse touches between two lines of pixel centres.
///
/// The part of an ellipse in a band is convex: it reaches furthest at its own extreme point, or at the
/// line nearest to that.
#[inline(always)]
fn span(splat: &Splat, top: f32, bottom: f32) -> (i32, i32) {
    let [x, y] = splat.centre;
    let (least, most) = (top - y, bottom - y);
    // Where along y the ellipse reaches furthest to the right: covariance over variance, times that reach.
    let extreme = -splat.skew * splat.extent[1] * (splat.extent[1] / splat.extent[0]);
    let reach = |sign: f32| {
        let dy = (sign * extreme).clamp(least, most);
        // xx·(dx + skew·dy)² + yy·dy² + peak + log2 255 = 0
        let rest = splat.yy * dy * dy + splat.peak + LOG2_255;
        sign * (-rest / splat.xx).max(0.0).sqrt() - splat.skew * dy
    };
    // Rounding may hide a pixel: a little more does no harm, for alpha decides in the end.
    let slack = 0.05 + 1e-3 * splat.extent[0];
    let tile = |at: f32| (at / TILE as f32).floor().clamp(-1.0, 1e6) as i32;
    (tile(x + reach(-1.0) - slack), tile(x + reach(1.0) + slack))
}

impl RowEntries {
    /// Tiles in the row.
    pub(crate) fn tiles(&self) -> usize {
        self.starts.len() - 1
    }

    /// The ellipses of a tile, nearest first.
    #[expect(
        clippy::indexing_slicing,
        reason = "rows and tiles are cut to the picture before, and entries are counted before they are placed"
    )]
    pub(crate) fn of_tile(&self, column: usize) -> &[u32] {
        &self.entries[self.starts[column] as usize..self.starts[column + 1] as usize]
    }
}
