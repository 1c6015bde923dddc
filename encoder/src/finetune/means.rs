//! What values were rounded to while they were under way, on average.
//!
//! A value that pictures want between two steps never comes to rest: rounded to either side, the slope takes it back to the
//! other. At any moment a frame has such values where chance left them, with up to twice the squared error of nearest
//! ones. Most of the time each is on the side that it is nearer to, and the mean of its places, rounded, is there. The mean
//! has less of the chance of the views that slopes are taken of as well.
//!
//! Source: Nagel et al., "Overcoming oscillations in quantization-aware training", 2022, on values that go to and fro; Polyak,
//! Juditsky, "Acceleration of stochastic approximation by averaging", 1992.

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
}

impl Means {
    /// Of nothing yet.
    pub(super) fn new(latent: &Latent<'_>) -> Self {
        Self { last: latent.offsets.clone(), other: latent.offsets.clone() }
    }

    /// Takes one more, of which there are `frames` with it: the values as they are, `decoded`.
    pub(super) fn add(&mut self, latent: &Latent<'_>, decoded: &GaussianFrame, frames: u32) {
        // Up to these both means are of the same frames.
        if frames == LAST + 1 {
            self.other.clone_from(&self.last);
        }
        let of_last = 1.0 / frames.min(LAST) as f32;
        let of_other = if frames > LAST { 1.0 / frames as f32 } else { 1.0 };
        let rounded = latent.rounded(decoded);
        let own = latent.offsets.planes();
        let (mut last, mut other) = (self.last.planes_mut(), self.other.planes_mut());
        let means = last.iter_mut().zip(other.iter_mut());
        let planes: Vec<_> = means.zip(rounded.iter().zip(own.iter())).collect();
        planes.into_par_iter().for_each(|((last, other), (rounded, own))| {
            let means = last.iter_mut().zip(other.iter_mut());
            for ((last, other), (&rounded, &own)) in means.zip(rounded.iter().zip(own)) {
                let place = if (rounded - own).abs() < ROUNDED { rounded } else { own };
                *last += of_last * (place - *last);
                *other += of_other * (place - *other);
            }
        });
    }
}
