//! Peak signal to noise ratio, over a frame or the part of it that a scene covers.
#![expect(clippy::arithmetic_side_effects, reason = "counts of pixels of a picture in memory")]
#![expect(
    clippy::indexing_slicing,
    reason = "components are 0, 1 and 2; a mask is as large as its picture; lanes are in runs of them"
)]

use super::{assert_same_size, shown};
use crate::image::Image;
use rayon::prelude::*;

/// The figure, dB, that reports give instead of an infinite or a higher one, so that means are finite and JSON
/// has a number. One step of 8 bits in one channel of one pixel in 51,000 amounts to as much.
pub const LOSSLESS_DB: f64 = 100.0;

/// The pixels that count, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Mask {
    included: Vec<bool>,
}

impl Mask {
    /// Pixels of the reference rendering with an alpha above 0.
    #[must_use]
    pub fn covered(alpha: &[f32]) -> Self {
        Self { included: alpha.iter().map(|&alpha| alpha > 0.0).collect() }
    }

    /// Of pixels chosen otherwise.
    pub(super) fn of(included: Vec<bool>) -> Self {
        Self { included }
    }

    /// For each pixel, row by row: whether it counts.
    #[must_use]
    pub fn included(&self) -> &[bool] {
        &self.included
    }

    /// The number of pixels that count.
    #[must_use]
    pub fn count(&self) -> usize {
        self.included.iter().filter(|&&included| included).count()
    }
}

/// PSNR over red, green and blue, dB: the mean square error is over all three channels of all pixels, the peak
/// is 1. Infinite for equal pictures.
///
/// # Panics
/// If the sizes differ.
#[must_use]
pub fn psnr(reference: &Image, image: &Image) -> f64 {
    assert_same_size(reference, image);
    let sum = squared_error(reference.pixels(), image.pixels());
    decibel(sum / (3 * reference.pixels().len()) as f64)
}

/// As [`psnr`], but the mean is over the pixels of the mask only. None if the mask is empty.
///
/// # Panics
/// If the sizes differ.
#[must_use]
pub fn psnr_masked(reference: &Image, image: &Image, mask: &Mask) -> Option<f64> {
    assert_eq!(
        mask.included.len(),
        reference.pixels().len(),
        "the mask is of another size than the pictures"
    );
    assert_same_size(reference, image);
    let count = mask.count();
    let pixels = reference.pixels().iter().zip(image.pixels()).zip(&mask.included);
    // Pixels that do not count are made equal.
    let counted: Vec<[f32; 3]> =
        pixels.map(|((&before, &after), &counts)| if counts { before } else { after }).collect();
    (count > 0).then(|| decibel(squared_error(&counted, image.pixels()) / (3 * count) as f64))
}

/// PSNR of luma and the two colour differences, dB; infinite where a component is equal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct YuvPsnr {
    /// Luma, Y'.
    pub y: f64,
    /// Blue difference, Cb.
    pub u: f64,
    /// Red difference, Cr.
    pub v: f64,
}

impl YuvPsnr {
    /// (6 Y + U + V) / 8, dB, of the three figures, each at most [`LOSSLESS_DB`]: grey pictures that differ in
    /// luma only would be infinitely good otherwise.
    ///
    /// Source: the weights customary for video since the development of HEVC.
    #[must_use]
    pub fn weighted(&self) -> f64 {
        let [y, u, v] = [self.y, self.u, self.v].map(|figure| figure.min(LOSSLESS_DB));
        (6.0 * y + u + v) / 8.0
    }
}

/// PSNR in full-range Y'CbCr of ITU-R BT.709, of components in 0..1 and -0.5..0.5 at the resolution of the
/// picture, not rounded: Y' = 0.2126 R' + 0.7152 G' + 0.0722 B', Cb = (B' - Y') / 1.8556,
/// Cr = (R' - Y') / 1.5748. The peak is 1 for each.
///
/// # Panics
/// If the sizes differ.
#[must_use]
pub fn yuv_psnr(reference: &Image, image: &Image) -> YuvPsnr {
    let count = reference.pixels().len() as f64;
    // The components are linear, hence the component of a difference is the difference of the components.
    let [y, u, v] = totals(reference, image, |[red, green, blue]| {
        let luma = 0.2126 * red + 0.7152 * green + 0.0722 * blue;
        [luma, (blue - luma) / 1.8556, (red - luma) / 1.5748].map(|component| component * component)
    })
    .map(|sum| decibel(sum / count));
    YuvPsnr { y, u, v }
}

/// The sum of the squared differences of all channels, as a screen shows them.
fn squared_error(before: &[[f32; 3]], after: &[[f32; 3]]) -> f64 {
    let [before, after] = [before, after].map(|pixels| pixels.as_flattened().par_chunks(RUN));
    let sums: Vec<f64> = before.zip(after).map(|run| pulp::Arch::new().dispatch(Run(run))).collect();
    // Runs in their order, whoever compared them.
    sums.into_iter().sum()
}

/// Channels that one thread compares at a time.
const RUN: usize = 1 << 14;

/// Channels that are compared side by side, as wide registers hold them: channel i goes to sum i mod 16, and those are
/// added in their order, so that the result is equal on every machine.
const LANES: usize = 16;

/// The sum of the squared differences of two runs of channels. Not a closure: the compiler calls those that it could
/// inline, which loses the wide registers.
struct Run<'a>((&'a [f32], &'a [f32]));

impl pulp::WithSimd for Run<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> f64 {
        let (before, after) = self.0;
        let (befores, afters) = (before.chunks_exact(LANES), after.chunks_exact(LANES));
        let rest = befores.remainder().iter().zip(afters.remainder());
        let mut sums = [0.0; LANES];
        for (before, after) in befores.zip(afters) {
            for lane in 0..LANES {
                sums[lane] += square(before[lane], after[lane]);
            }
        }
        let rest = rest.map(|(&before, &after)| square(before, after)).sum::<f64>();
        sums.iter().sum::<f64>() + rest
    }
}

/// The square of what a channel differs by, as a screen shows it.
#[inline(always)]
fn square(before: f32, after: f32) -> f64 {
    let difference = f64::from(shown(before)) - f64::from(shown(after));
    difference * difference
}

/// PSNR, dB, of a mean square error where the peak is 1.
fn decibel(mean_square_error: f64) -> f64 {
    // Not `-10.0 *`, which makes a negative zero of no signal at all.
    0.0 - 10.0 * libm::log10(mean_square_error)
}

/// The sums over all pixels of three functions of the difference of their channels.
fn totals(reference: &Image, image: &Image, error: impl Fn([f64; 3]) -> [f64; 3] + Sync) -> [f64; 3] {
    assert_same_size(reference, image);
    let width = reference.width();
    let rows = reference.pixels().par_chunks(width).zip(image.pixels().par_chunks(width));
    let of_pixel = |(&before, &after): (&[f32; 3], &[f32; 3])| {
        let (before, after) = (before.map(shown), after.map(shown));
        error([0, 1, 2].map(|channel| f64::from(before[channel]) - f64::from(after[channel])))
    };
    let sums: Vec<[f64; 3]> =
        rows.map(|(before, after)| add(before.iter().zip(after).map(of_pixel))).collect();
    // Rows in their order, whoever computed them.
    add(sums.into_iter())
}

fn add(terms: impl Iterator<Item = [f64; 3]>) -> [f64; 3] {
    terms.fold([0.0; 3], |sum, term| [0, 1, 2].map(|component| sum[component] + term[component]))
}
