//! How far apart two pictures are.
//!
//! Every metric takes the channels clamped to 0..1 first, as a screen does; a NaN counts as 0. Sums run in
//! `f64` in a fixed order, so that results are equal for any number of threads.

mod bjontegaard;
mod comparison;
mod psnr;
mod ssim;
mod st_lpips;
mod temporal;

pub use bjontegaard::{RatePoint, bd_psnr, bd_rate, quality_at_rate, rate_at_quality};
pub use comparison::{Comparison, compare};
pub use psnr::{LOSSLESS_DB, Mask, YuvPsnr, psnr, psnr_masked, yuv_psnr};
pub(crate) use ssim::{RADIUS, TAPS, window};
pub use ssim::{SsimMap, ssim};
pub use st_lpips::{Features, StLpips, WeightsError};
pub use temporal::still;

use crate::image::Image;

/// What a screen shows of a channel.
#[inline(always)]
#[expect(clippy::manual_clamp, reason = "unlike `clamp`, this makes a number of NaN")]
fn shown(channel: f32) -> f32 {
    channel.max(0.0).min(1.0)
}

/// # Panics
/// If the sizes differ.
fn assert_same_size(reference: &Image, image: &Image) {
    let size = |image: &Image| (image.width(), image.height());
    assert_eq!(size(reference), size(image), "two pictures of different sizes are compared");
}
