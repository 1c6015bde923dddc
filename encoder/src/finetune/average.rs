//! What values were rounded to while they were under way, on average.
//!
//! A value that pictures want between two steps never comes to rest: rounded to either side, the slope takes it back to the
//! other. At any moment a frame has such values where chance left them, with up to twice the squared error of nearest
//! ones. Most of the time each is on the side that it is nearer to, and the mean of its places, rounded, is there. The mean
//! has less of the chance of the views that slopes are taken of as well.
//!
//! Source: Nagel et al., "Overcoming oscillations in quantization-aware training", 2022, on values that go to and fro; Polyak,
//! Juditsky, "Acceleration of stochastic approximation by averaging", 1992.
#![expect(clippy::arithmetic_side_effects, reason = "sums and products of floats; a count of iterations")]

use super::latent::Latent;
use rayon::prelude::*;
use splatstream_gaussians::GaussianFrame;

/// Steps between what a value is and what a decoder has, beyond which it was not rounded: its attribute ends there, or is
/// the same with another sign. Then the value itself counts.
const ROUNDED: f32 = 1.5;

/// Frames that the mean is of, nearly: older ones count less and less. More of them hide what values have come to where they
/// go far, fewer leave more to chance.
const FRAMES: u32 = 33;

/// The running mean of the places that values were rounded to since it was begun.
pub(super) struct Average {
    /// Steps away from the source, as those of latent values.
    pub(super) offsets: GaussianFrame,
    /// Frames that it is of, up to [`FRAMES`].
    pub(super) taken: u32,
}

impl Average {
    /// Of nothing yet.
    pub(super) fn new(latent: &Latent<'_>) -> Self {
        Self { offsets: latent.offsets.clone(), taken: 0 }
    }

    /// Takes one more: the values as they are, `decoded`.
    pub(super) fn add(&mut self, latent: &Latent<'_>, decoded: &GaussianFrame) {
        self.taken = (self.taken + 1).min(FRAMES);
        let part = 1.0 / self.taken as f32;
        let rounded = latent.rounded(decoded);
        let mut means = self.offsets.planes_mut();
        let own = latent.offsets.planes();
        let planes: Vec<_> = means.iter_mut().zip(rounded.iter().zip(own.iter())).collect();
        planes.into_par_iter().for_each(|(means, (rounded, own))| {
            for (mean, (&rounded, &own)) in means.iter_mut().zip(rounded.iter().zip(own)) {
                let place = if (rounded - own).abs() < ROUNDED { rounded } else { own };
                *mean += part * (place - *mean);
            }
        });
    }

    /// What judges are to see: the values themselves where there are no others to take the mean with.
    pub(super) fn candidate(&self, latent: &Latent<'_>) -> GaussianFrame {
        if self.taken > 1 { self.offsets.clone() } else { latent.offsets.clone() }
    }
}
