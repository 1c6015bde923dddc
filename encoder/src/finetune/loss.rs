//! What a picture misses of what it should show, and how that changes with each of its values.

use crate::error::Error;
use splatstream_render::Image;
use splatstream_render::gradient::{Judged, Loss};

/// What fitting to pictures makes small.
///
/// Pictures count as a screen shows them: what is beyond its range is no error, but has the slope that leads back to what is
/// wanted. Whatever is made small, the quality that is asked for and reported is a PSNR.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum FinetuneLoss {
    /// The squared error, summed over a picture: what PSNR is made of.
    #[default]
    SquaredError,
    /// The loss of the paper, (1 − β)·L1 + β·(1 − SSIM), a mean over a picture, so that pictures of any number of lines count
    /// equally.
    L1Ssim {
        /// β, the weight of structural similarity, 0 to 1. That of 3D Gaussian splatting is 0.2; the paper gives none.
        similarity: f32,
    },
}

impl FinetuneLoss {
    /// L1 and SSIM with the weights of 3D Gaussian splatting.
    #[must_use]
    pub fn l1_ssim() -> Self {
        Self::L1Ssim { similarity: Loss::default().similarity }
    }
}

impl FinetuneLoss {
    /// What a picture misses, and its slope by each value.
    ///
    /// # Errors
    /// Pictures of different sizes.
    pub(super) fn of(self, wanted: &Image, picture: &Image) -> Result<(f64, Image), Error> {
        match self {
            Self::SquaredError => Ok(squared_error(wanted, picture)),
            Self::L1Ssim { similarity } => {
                let loss = Loss { similarity };
                let Judged { value, slopes, .. } = loss.between(&shown(wanted), &shown(picture))?;
                Ok((value, slopes))
            }
        }
    }
}

/// A picture as a screen shows it.
fn shown(picture: &Image) -> Image {
    let pixels = picture.pixels().iter().map(|pixel| pixel.map(|value| value.clamp(0.0, 1.0)));
    Image::new(picture.width(), pixels.collect())
}

/// The sum of squared differences of two pictures as a screen shows them, and its slope by each value of the second. What is
/// beyond a screen's range has the slope that leads back to what is wanted.
fn squared_error(wanted: &Image, picture: &Image) -> (f64, Image) {
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
    let slopes = wanted.pixels().iter().zip(picture.pixels()).map(pixel).collect();
    (sum, Image::new(picture.width(), slopes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_those_that_a_screen_shows() {
        let wanted = Image::new(2, vec![[0.5, 0.0, 1.0], [1.0; 3]]);
        let picture = Image::new(2, vec![[0.75, 0.0, 3.0], [1.0, 1.0, 0.5]]);
        let (sum, slopes) = squared_error(&wanted, &picture);
        assert_eq!(sum, 0.0625 + 0.25);
        assert_eq!(slopes.pixels(), [[0.5, 0.0, 0.0], [0.0, 0.0, -1.0]]);
        let beyond = Image::new(2, vec![[0.5, -1.0, 2.0], [3.0; 3]]);
        let (missed, _) = FinetuneLoss::l1_ssim().of(&wanted, &beyond).unwrap();
        assert!(missed.abs() < 1e-6, "{missed}");
    }
}
