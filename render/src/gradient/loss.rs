//! The loss of a picture against a reference, and its slope by each pixel.

use super::{GradientError, same_size, similarity};
use crate::image::Image;

/// The loss of 3D Gaussian splatting: (1 − β)·L1 + β·(1 − SSIM). 0 for equal pictures, up to about 1 for pictures within
/// 0..1.
///
/// L1 is the mean difference over pixels and channels, its slope 0 where there is none. SSIM has a Gaussian window of 11 x 11
/// pixels, sigma 1.5, K1 = 0.01, K2 = 0.03, L = 1, and a value at every pixel of every channel: outside, both pictures are
/// black, as in that paper's program. [`ssim`](crate::metrics::ssim) measures instead where the whole window lies in the
/// picture. Pictures are not clamped to 0..1, so that what is too bright has a slope.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loss {
    /// β, the weight of structural similarity, 0 to 1.
    pub similarity: f32,
}

impl Default for Loss {
    /// β of 3D Gaussian splatting, 0.2.
    fn default() -> Self {
        Self { similarity: 0.2 }
    }
}

/// What a loss makes of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Judged {
    /// The loss.
    pub value: f64,
    /// The mean difference.
    pub l1: f64,
    /// The mean structural similarity, -1 to 1.
    pub ssim: f64,
    /// What the loss gains with each channel of each pixel of the picture.
    pub slopes: Image,
}

impl Loss {
    /// Judges a picture.
    ///
    /// # Errors
    /// Pictures of different sizes.
    ///
    /// ```
    /// use splatstream_render::Image;
    /// use splatstream_render::gradient::Loss;
    ///
    /// let grey = Image::new(16, vec![[0.5; 3]; 256]);
    /// let equal = Loss::default().between(&grey, &grey)?;
    /// assert!(equal.value.abs() < 1e-6 && equal.l1 == 0.0);
    /// let black = Image::new(16, vec![[0.0; 3]; 256]);
    /// let judged = Loss { similarity: 0.0 }.between(&grey, &black)?;
    /// assert!((judged.value - 0.5).abs() < 1e-6);
    /// assert!(judged.slopes.pixels().iter().flatten().all(|slope| *slope == -1.0 / 768.0));
    /// # Ok::<(), splatstream_render::gradient::GradientError>(())
    /// ```
    pub fn between(&self, reference: &Image, picture: &Image) -> Result<Judged, GradientError> {
        same_size(picture, reference)?;
        let values = reference.pixels().as_flattened().len() as f64;
        let beta = f64::from(self.similarity);
        let weights = [(1.0 - beta) / values, -beta / values].map(|weight| weight as f32);
        let (sums, slopes) = similarity::compare(reference, picture, weights);
        let [l1, ssim] = sums.map(|sum| sum / values);
        let value = (1.0 - beta) * l1 + beta * (1.0 - ssim);
        Ok(Judged { value, l1, ssim, slopes })
    }
}
