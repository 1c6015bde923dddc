//! Ellipses blended into a small picture, nearest first, and gone through again from behind.
#![expect(clippy::arithmetic_side_effects, reason = "floats; places of pixels in memory")]
#![expect(
    clippy::indexing_slicing,
    reason = "pixels are those of the picture, places those of the Gaussians"
)]

use super::SmallView;
use super::ellipses::{Ellipse, Projected, REACH};
use super::order::Order;
use super::rows::{Row, Rows, lanes};
use crate::contribution::Share;
use crate::rasterise::{MAX_ALPHA, TILE, exp2};
use core::ops::Range;
use std::f32::consts::LOG2_E;

/// Touches of pixels that are kept at most: a scene of millions of faint Gaussians has thousands in each pixel.
pub(super) const MOST: usize = 1 << 22;

/// A pixel is done where less of the light would pass than this: the rest changes no order.
const MIN_PASSING: f32 = 1e-3;

/// Gaussians that are brought together at once, so that waits for memory overlap.
const AHEAD: usize = 4 * TILE;

/// Pixels whose alphas are computed side by side, whether all are wanted or not.
const LANES: usize = 8;

/// What an ellipse adds to a pixel.
struct Touch {
    pixel: u32,
    alpha: f32,
    /// Transmittance times alpha.
    visible: f32,
}

/// An ellipse that shows.
struct Shown {
    place: u32,
    colour: [f32; 3],
    /// Where its touches end.
    end: usize,
}

/// What is blended into a picture.
pub(super) struct Scene<'a> {
    pub(super) left: &'a Rows,
    pub(super) order: &'a Order,
    pub(super) view: &'a SmallView,
}

/// A picture, and what it was blended from.
#[derive(Default)]
pub(super) struct Trace {
    size: [usize; 2],
    /// Touches that are kept at most, and those of 64 ellipses more.
    most: usize,
    /// The light that still passes each pixel; 0 where the pixel is done.
    passing: Vec<f32>,
    touches: Vec<Touch>,
    shown: Vec<Shown>,
    /// What lies behind, composited.
    light: Vec<[f32; 4]>,
}

impl Trace {
    /// Begins a picture of a view.
    pub(super) fn start(&mut self, SmallView { camera, .. }: &SmallView, most: usize) {
        self.size = [camera.width as usize, camera.height as usize];
        self.most = most;
        let pixels = self.size[0] * self.size[1];
        self.passing.clear();
        self.passing.resize(pixels, 1.0);
        self.light.clear();
        self.light.resize(pixels, [0.0; 4]);
    }

    /// Blends all ellipses, and says what each is to the picture.
    ///
    /// Where there are more touches than there is room for, the light that passes is kept instead, and what was blended
    /// before is blended again when all behind it is known.
    #[inline(always)]
    pub(super) fn blend(&mut self, scene: &Scene<'_>, shares: &mut [Share]) {
        let all = scene.order.len();
        let mut end = self.forward(scene, 0..all);
        // Where each part ends, and what passes it.
        let mut parts = Vec::new();
        while end < all {
            parts.push((end, self.passing.clone()));
            end = self.forward(scene, end..all);
        }
        self.backward(shares);
        while let Some((end, _)) = parts.pop() {
            let start = match parts.last() {
                None => {
                    self.passing.fill(1.0);
                    0
                }
                Some((start, passing)) => {
                    self.passing.clone_from(passing);
                    *start
                }
            };
            self.forward(scene, start..end);
            self.backward(shares);
        }
    }

    /// Blends ellipses at some places of the order, until there is no room; gives the place after the last.
    #[inline(always)]
    fn forward(&mut self, scene: &Scene<'_>, order: Range<usize>) -> usize {
        self.touches.clear();
        self.shown.clear();
        for (number, some) in scene.order.nearest(order.clone()).chunks(AHEAD).enumerate() {
            if self.touches.len() >= self.most {
                return order.start + number * AHEAD;
            }
            self.some(scene, some);
        }
        order.end
    }

    /// Blends up to [`AHEAD`] Gaussians at some places.
    #[inline(always)]
    fn some(&mut self, Scene { left, view, .. }: &Scene<'_>, some: &[(u32, u32)]) {
        let mut rows = [[Row::default(); TILE]; AHEAD / TILE];
        left.bring(some, rows.as_flattened_mut());
        for (places, rows) in some.chunks(TILE).zip(&rows) {
            let projected = Projected::new(&lanes(rows), left.is_antialiased(), &view.camera, view.fine);
            let seen = (0..places.len()).filter(|&lane| projected.is_seen(lane, &view.camera, view.near));
            for lane in seen {
                let ellipse = projected.ellipse(lane, places[lane].1);
                let before = self.touches.len();
                self.ellipse(&ellipse);
                let end = self.touches.len();
                if end > before {
                    self.shown.push(Shown { place: ellipse.place, colour: ellipse.colour, end });
                }
            }
        }
    }

    /// Blends an ellipse.
    #[inline(always)]
    fn ellipse(&mut self, ellipse: &Ellipse) {
        let [x, y] = ellipse.centre;
        let [width, height] = self.size;
        let extent = (REACH / ellipse.yy).sqrt();
        let last = (y + extent - 0.5).floor().min(height as f32 - 1.0);
        // A float below 0 would become line 0.
        if last < 0.0 {
            return;
        }
        for line in (y - extent - 0.5).ceil().max(0.0) as usize..=last as usize {
            let dy = line as f32 + 0.5 - y;
            let rest = ellipse.yy * dy * dy;
            let half = ((REACH - rest) / ellipse.xx).max(0.0).sqrt();
            let middle = x - ellipse.skew * dy - 0.5;
            let right = (middle + half).floor().min(width as f32 - 1.0);
            if right < 0.0 {
                continue;
            }
            let left = (middle - half).ceil().max(0.0) as usize;
            for first in (left..=right as usize).step_by(LANES) {
                let alphas = alphas(ellipse, first as f32 - middle, rest);
                let count = LANES.min(right as usize + 1 - first);
                self.pixels(line * width + first, &alphas[..count]);
            }
        }
    }

    /// Takes the light that an ellipse stops in some pixels side by side.
    #[inline(always)]
    fn pixels(&mut self, first: usize, alphas: &[f32]) {
        let pixels = self.passing[first..].iter_mut().zip(first as u32..);
        for ((passing, pixel), &alpha) in pixels.zip(alphas) {
            let before = *passing;
            if before > 0.0 {
                let visible = before * alpha;
                let after = before - visible;
                *passing = if after < MIN_PASSING { 0.0 } else { after };
                self.touches.push(Touch { pixel, alpha, visible });
            }
        }
    }

    /// Sums what each ellipse is to the picture, the farthest first.
    ///
    /// With transmittance T in front of it, alpha a, its colour c and the light R behind, a pixel changes by
    /// T·a·c − R·a / (1 − a) without it.
    #[inline(always)]
    fn backward(&mut self, shares: &mut [Share]) {
        let Self { touches, shown, light, .. } = self;
        let mut end = touches.len();
        for (number, Shown { place, colour, .. }) in shown.iter().enumerate().rev() {
            let start = number.checked_sub(1).map_or(0, |before| shown[before].end);
            // Four channels, of which one stays 0, fill a vector.
            let colour = [colour[0], colour[1], colour[2], 0.0];
            let (mut contribution, mut energy, mut lost) = (0.0, 0.0, [0.0; 4]);
            for &Touch { pixel, alpha, visible } in &touches[start..end] {
                contribution += visible;
                energy += visible * visible;
                let behind = &mut light[pixel as usize];
                let ratio = alpha / (1.0 - alpha);
                for channel in 0..4 {
                    let own = visible * colour[channel];
                    let change = own - behind[channel] * ratio;
                    lost[channel] += change * change;
                    behind[channel] += own;
                }
            }
            let loss = lost[0] + lost[1] + lost[2];
            shares[*place as usize] = Share { contribution, loss, energy };
            end = start;
        }
    }
}

/// Alphas of an ellipse in pixels side by side, of which the first is so far from where the line is nearest to the middle.
/// `rest`: the exponent there.
#[inline(always)]
fn alphas(ellipse: &Ellipse, first: f32, rest: f32) -> [f32; LANES] {
    let mut alphas = [0.0; LANES];
    for (lane, alpha) in alphas.iter_mut().enumerate() {
        let apart = first + lane as f32;
        // Lanes that are not wanted may lie so far out that 2 to their exponent is no number.
        let square = (ellipse.xx * apart * apart + rest).min(2.0 * REACH);
        *alpha = (ellipse.peak * exp2(-0.5 * LOG2_E * square)).min(MAX_ALPHA);
    }
    alphas
}
