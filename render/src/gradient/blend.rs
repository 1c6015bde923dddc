//! Blending backwards: from slopes by pixels to slopes by ellipses.
//!
//! A pixel is C = Σ Tᵢ αᵢ cᵢ + T b, with Tᵢ the light that passes all nearer ellipses. With g the slope of the loss by C and
//! Bᵢ what is blended behind ellipse i, background and all, the slope by αᵢ is g·(Tᵢ cᵢ − Bᵢ / (1 − αᵢ)). Tiles are blended
//! again, nearest first: g·Bᵢ is g·C less what has come so far, one number for each pixel, and nothing else need be kept.
//!
//! log2 of α is `peak + xx·u² + yy·y²` with u = dx + skew·y, so that all slopes of an ellipse follow from six sums over its
//! pixels of the slope by that exponent, times powers of u and y, and three sums for its colour.
#![expect(clippy::arithmetic_side_effects, reason = "counts of ellipses and places of pixels in memory")]
#![expect(
    clippy::indexing_slicing,
    reason = "tiles lie within the picture, lanes and lines within tiles, places are those of the splats"
)]

use crate::image::Image;
use crate::rasterise::{Blend, LOG2_MAX_ALPHA, Lanes, Splat, TILE, Tile, View, blend_tile};
use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use std::f32::consts::LN_2;

/// Sums over the pixels of an ellipse: visible times slope of red, green and blue; the slope by the exponent, and that
/// times u, u², y, y² and u·y.
pub(super) type Sums<T> = [T; 9];

/// Rows of tiles whose sums are kept at a time, at least.
const BATCH: usize = 16;

/// Ellipses whose sums a thread adds up at once.
const CHUNK: usize = 4096;

/// The sums of each ellipse of a view, by the slopes of a loss by each pixel of its picture.
pub(super) fn backward(view: &View, picture: &Image, slopes: &Image) -> Vec<Sums<f64>> {
    let mut sums = vec![[0.0; 9]; view.splats.len()];
    let rows: Vec<usize> = (0..view.rows.len()).collect();
    for batch in rows.chunks(BATCH.max(4 * rayon::current_num_threads())) {
        let slots = || vec![0; view.splats.len()];
        let replay = |slots: &mut Vec<u32>, &row: &usize| {
            pulp::Arch::new().dispatch(ReplayRow { view, row, picture, slopes, slots })
        };
        let shares: Vec<Vec<Sums<f32>>> = batch.par_iter().with_max_len(1).map_init(slots, replay).collect();
        // Every ellipse adds its rows from the top down, however many there are in a batch and whoever adds them.
        sums.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, sums)| {
            for (&row, shares) in batch.iter().zip(&shares) {
                add_row(view.rows.of_row(row), shares, chunk * CHUNK, sums);
            }
        });
    }
    sums
}

/// Adds the sums of the ellipses of a row that are among those from `first` on.
fn add_row(places: &[u32], shares: &[Sums<f32>], first: usize, sums: &mut [Sums<f64>]) {
    let [start, end] =
        [first, first + sums.len()].map(|end| places.partition_point(|&place| (place as usize) < end));
    for (&place, share) in places[start..end].iter().zip(&shares[start..end]) {
        for (sum, &share) in sums[place as usize - first].iter_mut().zip(share) {
            *sum += f64::from(share);
        }
    }
}

/// Blends a row of tiles again; returns the sums of each of its ellipses, nearest first.
struct ReplayRow<'a> {
    view: &'a View,
    row: usize,
    picture: &'a Image,
    slopes: &'a Image,
    /// Where an ellipse of the row stands in it; of others anything.
    slots: &'a mut [u32],
}

impl WithSimd for ReplayRow<'_> {
    type Output = Vec<Sums<f32>>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let View { splats, rows } = self.view;
        let places = rows.of_row(self.row);
        for (slot, &place) in (0..).zip(places) {
            self.slots[place as usize] = slot;
        }
        let mut sums = vec![[0.0; 9]; places.len()];
        let entries = rows.entries(self.row, splats);
        for column in 0..entries.tiles() {
            let places = entries.of_tile(column);
            if places.is_empty() {
                continue;
            }
            let mut replay = Replay {
                origin: [(column * TILE) as f32 + 0.5, (self.row * TILE) as f32 + 0.5],
                slopes: [[[0.0; TILE]; 3]; TILE],
                behind: [[0.0; TILE]; TILE],
                splat: splats[places[0] as usize],
                lanes: [[0.0; TILE]; 9],
                places,
                slots: self.slots,
                sums: &mut sums,
            };
            replay.load(self.picture, self.slopes, [column * TILE, self.row * TILE]);
            blend_tile(splats, places, &mut Tile::new(self.row, column, rows.size()), &mut replay);
        }
        sums
    }
}

/// A tile that is blended again.
struct Replay<'a> {
    /// Centre of the top left pixel.
    origin: [f32; 2],
    /// Slopes of the loss by red, green and blue of each line.
    slopes: [[Lanes; 3]; TILE],
    /// Slope times colour, of what lies behind the ellipses that have been blended.
    behind: [Lanes; TILE],
    /// The ellipse that is blended, and its sums for each column of pixels.
    splat: Splat,
    lanes: Sums<Lanes>,
    /// Ellipses of the tile.
    places: &'a [u32],
    slots: &'a [u32],
    sums: &'a mut [Sums<f32>],
}

impl Replay<'_> {
    /// Takes the pixels of the tile whose top left one is at `left` and `top`.
    #[inline(always)]
    fn load(&mut self, picture: &Image, slopes: &Image, [left, top]: [usize; 2]) {
        let lines =
            |image: &'_ Image| image.width() * top..image.pixels().len().min(image.width() * (top + TILE));
        let pixels = picture.pixels()[lines(picture)].chunks(picture.width());
        let slopes = slopes.pixels()[lines(slopes)].chunks(slopes.width());
        for (line, (pixels, slopes)) in pixels.zip(slopes).enumerate() {
            for (lane, (pixel, slope)) in pixels[left..].iter().zip(&slopes[left..]).take(TILE).enumerate() {
                for channel in 0..3 {
                    self.slopes[line][channel][lane] = slope[channel];
                    self.behind[line][lane] += slope[channel] * pixel[channel];
                }
            }
        }
    }
}

impl Blend for Replay<'_> {
    #[inline(always)]
    fn begin(&mut self, splat: &Splat) {
        self.splat = *splat;
        self.lanes = [[0.0; TILE]; 9];
    }

    #[inline(always)]
    fn line(&mut self, colour: [f32; 3], line: usize, visible: &Lanes, passing: &Lanes) {
        let Splat { centre, xx, skew, yy, peak, .. } = self.splat;
        let y = self.origin[1] + line as f32 - centre[1];
        let along = self.origin[0] - centre[0] + skew * y;
        // The exponent at which alpha is clamped, less what does not change along the line.
        let most = LOG2_MAX_ALPHA - (yy * y * y + peak);
        let slopes = self.slopes[line];
        let mut behind = self.behind[line];
        // One quantity after the other, each of sixteen pixels: so they stay in registers, side by side.
        let own = lanes(|lane| {
            slopes[0][lane] * colour[0] + slopes[1][lane] * colour[1] + slopes[2][lane] * colour[2]
        });
        for lane in 0..TILE {
            behind[lane] -= visible[lane] * own[lane];
        }
        self.behind[line] = behind;
        let u = lanes(|lane| along + lane as f32);
        let level = lanes(|lane| {
            // What passes is T (1 - a): of a pixel that is done it has a negative sign, and nothing is visible.
            let passing = passing[lane].abs().max(f32::MIN_POSITIVE);
            let slope = visible[lane] * (own[lane] - behind[lane] / passing);
            if xx * (u[lane] * u[lane]) < most { slope } else { 0.0 }
        });
        let level_u = lanes(|lane| level[lane] * u[lane]);
        let terms = [
            lanes(|lane| visible[lane] * slopes[0][lane]),
            lanes(|lane| visible[lane] * slopes[1][lane]),
            lanes(|lane| visible[lane] * slopes[2][lane]),
            level,
            level_u,
            lanes(|lane| level_u[lane] * u[lane]),
            level.map(|level| level * y),
            level.map(|level| level * (y * y)),
            level_u.map(|level_u| level_u * y),
        ];
        for (sums, terms) in self.lanes.iter_mut().zip(&terms) {
            for lane in 0..TILE {
                sums[lane] += terms[lane];
            }
        }
    }

    #[inline(always)]
    fn done(&mut self, _splat: &Splat, entry: usize) {
        let slot = self.slots[self.places[entry] as usize];
        let sums = &mut self.sums[slot as usize];
        for (number, (sum, lanes)) in sums.iter_mut().zip(&self.lanes).enumerate() {
            // The exponent is that of 2.
            let unit = if number < 3 { 1.0 } else { LN_2 };
            *sum += unit * total(lanes);
        }
    }
}

/// A value for each pixel of a line.
#[inline(always)]
fn lanes(value: impl FnMut(usize) -> f32) -> Lanes {
    std::array::from_fn(value)
}

/// The sum of a line, in pairs.
#[inline(always)]
fn total(lanes: &Lanes) -> f32 {
    let mut sums = *lanes;
    for half in [8, 4, 2, 1] {
        for lane in 0..half {
            sums[lane] += sums[lane + half];
        }
    }
    sums[0]
}
