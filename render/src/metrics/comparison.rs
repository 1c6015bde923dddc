//! The figures of a report.

use super::{LOSSLESS_DB, Mask, SsimMap, StLpips, psnr, psnr_masked, yuv_psnr};
use crate::image::Image;
use serde::Serialize;

/// How good a picture is, compared with its reference. All figures are finite: PSNR is at most [`LOSSLESS_DB`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// PSNR over red, green and blue, dB.
    pub psnr_db: f64,
    /// The same over the pixels that the scene covers in the reference; None if it covers none.
    pub psnr_masked_db: Option<f64>,
    /// PSNR of Y'CbCr, weighted 6:1:1, dB; see [`super::YuvPsnr::weighted`].
    pub yuv_psnr_db: f64,
    /// Structural similarity, -1 to 1; None if a side is shorter than 11 pixels.
    pub ssim: Option<f64>,
    /// The same over the pixels that the scene covers in the reference; None if it covers none of those that
    /// have a value.
    pub ssim_masked: Option<f64>,
    /// The learned distance, 0 for equal pictures; None if it was not asked for, or if a side is shorter than 21
    /// pixels.
    pub st_lpips: Option<f64>,
}

/// Compares a picture with its reference rendering, whose coverage is `alpha`, row by row. The learned metric
/// takes far longer than the others together.
///
/// # Panics
/// If the sizes differ.
#[must_use]
pub fn compare(reference: &Image, alpha: &[f32], image: &Image, learned: Option<&StLpips>) -> Comparison {
    let mask = Mask::covered(alpha);
    let map = SsimMap::between(reference, image);
    let limited = |decibel: f64| decibel.min(LOSSLESS_DB);
    Comparison {
        psnr_db: limited(psnr(reference, image)),
        psnr_masked_db: psnr_masked(reference, image, &mask).map(limited),
        yuv_psnr_db: yuv_psnr(reference, image).weighted(),
        ssim: map.as_ref().map(SsimMap::mean),
        ssim_masked: map.as_ref().and_then(|map| map.masked_mean(&mask)),
        st_lpips: learned.and_then(|learned| learned.distance(reference, image)),
    }
}

impl Comparison {
    /// The figures of several pictures, views or frames: the mean of each figure, of PSNR the mean of the dB
    /// values, not of the errors. A figure that some pictures lack is the mean over those that have it. None if
    /// there are no pictures.
    #[must_use]
    pub fn mean(pictures: &[Self]) -> Option<Self> {
        let mean = |figure: fn(&Self) -> Option<f64>| {
            let figures = || pictures.iter().filter_map(figure);
            let count = figures().count();
            (count > 0).then(|| figures().sum::<f64>() / count as f64)
        };
        Some(Self {
            psnr_db: mean(|picture| Some(picture.psnr_db))?,
            psnr_masked_db: mean(|picture| picture.psnr_masked_db),
            yuv_psnr_db: mean(|picture| Some(picture.yuv_psnr_db))?,
            ssim: mean(|picture| picture.ssim),
            ssim_masked: mean(|picture| picture.ssim_masked),
            st_lpips: mean(|picture| picture.st_lpips),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_is_over_the_pictures_that_have_a_figure() {
        let picture = Image::new(20, vec![[0.5; 3]; 400]);
        let worse = Image::new(20, vec![[0.6; 3]; 400]);
        let equal = compare(&picture, &[1.0; 400], &picture, None);
        let unmasked = compare(&picture, &[0.0; 400], &worse, None);
        assert_eq!((equal.psnr_db, equal.ssim), (LOSSLESS_DB, Some(1.0)));
        let mean = Comparison::mean(&[equal, unmasked]).unwrap();
        assert_eq!(mean.psnr_db, 0.5 * (LOSSLESS_DB + unmasked.psnr_db));
        assert_eq!((mean.psnr_masked_db, mean.st_lpips), (Some(LOSSLESS_DB), None));
        assert_eq!(Comparison::mean(&[]), None);
    }
}
