//! Ellipses blended into a small picture, nearest first, and gone through again from behind.
#![expect(clippy::arithmetic_side_effects, reason = "floats; places of pixels in memory")]
#![expect(
    clippy::indexing_slicing,
    reason = "pixels are those of the picture, places those of the Gaussians"
)]

use super::SmallView;
use super::ellipses::Projected;
use super::order::Order;
use super::picture::{Picture, Touch};
use super::rows::{Row, Rows, lanes};
use crate::contribution::Share;
use crate::rasterise::TILE;
use core::ops::Range;

/// Touches of pixels that are kept at most: a scene of millions of faint Gaussians has thousands in each pixel.
pub(super) const MOST: usize = 1 << 22;

/// Gaussians that are brought together at once, so that waits for memory overlap.
const AHEAD: usize = 4 * TILE;

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
    picture: Picture,
    /// Touches that are kept at most, and those of 64 ellipses more.
    most: usize,
    touches: Vec<Touch>,
    shown: Vec<Shown>,
    /// What lies behind, composited.
    light: Vec<[f32; 4]>,
}

impl Trace {
    /// Begins a picture of a view.
    pub(super) fn start(&mut self, SmallView { camera, .. }: &SmallView, most: usize) {
        self.most = most;
        self.picture.start([camera.width as usize, camera.height as usize]);
        self.light.clear();
        self.light.resize(self.picture.passing().len(), [0.0; 4]);
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
            parts.push((end, self.picture.passing().to_vec()));
            end = self.forward(scene, end..all);
        }
        self.backward(shares);
        while let Some((end, _)) = parts.pop() {
            let start = match parts.last() {
                None => {
                    self.picture.clear();
                    0
                }
                Some((start, passing)) => {
                    self.picture.set(passing);
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
            let projected = Projected::new(&lanes(rows), left.is_antialiased(), view);
            for (lane, &(_, place)) in places.iter().enumerate().filter(|&(lane, _)| projected.is_seen(lane))
            {
                let before = self.touches.len();
                self.picture.blend(&projected.ellipse(lane), &mut self.touches);
                let end = self.touches.len();
                if end > before {
                    self.shown.push(Shown { place, colour: projected.colour(lane), end });
                }
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
            for &Touch { pixel, ratio, visible } in &touches[start..end] {
                contribution += visible;
                energy += visible * visible;
                let behind = &mut light[pixel as usize];
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
