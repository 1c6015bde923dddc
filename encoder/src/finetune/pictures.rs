//! Pictures of the source, and how far those of the decoded frame are from them.
#![expect(clippy::arithmetic_side_effects, reason = "sums and products of floats")]

use splatstream_gaussians::random::SplitMix64;
use splatstream_render::Image;

/// The sum of squared differences of two pictures as a screen shows them, and its slope by each value of the second. Where a
/// value is beyond what a screen shows, it has a slope only back towards that.
pub(super) fn squared_error(reference: &Image, picture: &Image) -> (f64, Image) {
    let mut sum = 0.0;
    let pixel = |(wanted, shown): (&[f32; 3], &[f32; 3])| {
        let mut slopes = [0.0; 3];
        for ((slope, wanted), &shown) in slopes.iter_mut().zip(wanted).zip(shown) {
            let difference = shown.clamp(0.0, 1.0) - wanted.clamp(0.0, 1.0);
            sum += f64::from(difference * difference);
            *slope = 2.0 * difference;
        }
        slopes
    };
    let slopes = reference.pixels().iter().zip(picture.pixels()).map(pixel).collect();
    (sum, Image::new(picture.width(), slopes))
}

/// A picture of 1 and -1, in any order: squares of what a loss with these slopes gains with a value are on average the sum of
/// squares of what each pixel gains.
pub(super) fn signs(width: usize, pixels: usize, seed: u64) -> Image {
    let mut random = SplitMix64::new(seed);
    let mut bits = 0_u64;
    let mut left = 0;
    let mut sign = || {
        if left == 0 {
            (bits, left) = (random.bits(), 64);
        }
        left -= 1;
        bits >>= 1;
        if bits & 1 == 0 { 1.0 } else { -1.0 }
    };
    Image::new(width, (0..pixels).map(|_| [(); 3].map(|()| sign())).collect())
}
