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

/// Frames that the mean of the last is of, nearly: older ones count less and less.
const LAST: u32 = 33;

/// Running means of the places that values were rounded to.
///
/// Where values go far, the mean of all is of what they have long left, and of few frames even that of the last is; where they have
/// come to nearly at once, fewer leave more to chance. Judges say which of the two is the better one.
pub(super) struct Means {
    /// Of the last frames, as steps away from the source.
    pub(super) last: GaussianFrame,
    /// Of all; as long as these are no more than the last ones, the latest alone.
    pub(super) other: GaussianFrame,
    /// Frames that there were.
    pub(super) taken: u32,
}

impl Means {
    /// Of nothing yet.
    pub(super) fn new(latent: &Latent<'_>) -> Self {
        Self { last: latent.offsets.clone(), other: latent.offsets.clone(), taken: 0 }
    }

    /// Takes one more: the values as they are, `decoded`.
    pub(super) fn add(&mut self, latent: &Latent<'_>, decoded: &GaussianFrame) {
        if self.taken == LAST {
            self.other.clone_from(&self.last);
        }
        self.taken += 1;
        let rounded = latent.rounded(decoded);
        let of_other = if self.taken > LAST { self.taken } else { 1 };
        for (mean, frames) in [(&mut self.last, self.taken.min(LAST)), (&mut self.other, of_other)] {
            let part = 1.0 / frames as f32;
            let mut means = mean.planes_mut();
            let own = latent.offsets.planes();
            let planes: Vec<_> = means.iter_mut().zip(rounded.iter().zip(own.iter())).collect();
            planes.into_par_iter().for_each(|(means, (rounded, own))| {
                for (mean, (&rounded, &own)) in means.iter_mut().zip(rounded.iter().zip(own)) {
                    let place = if (rounded - own).abs() < ROUNDED { rounded } else { own };
                    *mean += part * (place - *mean);
                }
            });
        }
    }
}
