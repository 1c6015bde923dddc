//! How much pictures change where attributes do, without drawing them again.
//!
//! What pictures lose without a Gaussian and the energy of its weight are known of each. Of both follow the errors that
//! small changes of its attributes make, as for [predicted frames](crate::frame::visible_difference).

use crate::attribute::ATTRIBUTES;
use crate::frame::axis_matching::Pose;
use crate::frame::visible_difference::{Seen, Shown, pixel};
use splatstream_gaussians::GaussianFrame;
use splatstream_render::Camera;
use splatstream_render::contribution::Worth;

/// Errors measured in pictures of real scenes, as parts of those estimated: overlapping Gaussians make up for some errors of
/// each other, and changes of the order in depth add to others.
const MEASURED: [f64; ATTRIBUTES.len()] = [1.5, 2.4, 0.38, 0.7, 1.0, 1.0];

/// What pictures show of some Gaussians.
pub(crate) struct Sensitivity {
    seen: Vec<Seen>,
}

impl Sensitivity {
    /// Of Gaussians with these measures, as cameras see them.
    pub(crate) fn new(frame: &GaussianFrame, shown: Vec<Worth>, cameras: &[Camera]) -> Self {
        let seen = |(row, worth): (usize, Worth)| Seen {
            loss: worth.loss as f32,
            energy: worth.energy as f32,
            pixel: pixel(frame, row, cameras),
        };
        Self { seen: shown.into_iter().enumerate().map(seen).collect() }
    }

    /// The squared errors of pictures that follow from the differences between two versions of the Gaussians, by
    /// [attribute](ATTRIBUTES).
    #[expect(
        clippy::indexing_slicing,
        reason = "both frames have a row for each Gaussian; axes are constants"
    )]
    pub(crate) fn errors(&self, from: &GaussianFrame, to: &GaussianFrame) -> [f64; ATTRIBUTES.len()] {
        let mut errors = [0.0; ATTRIBUTES.len()];
        for (row, seen) in self.seen.iter().enumerate() {
            let pose = |frame: &GaussianFrame| Pose {
                log_scale: frame.log_scale().each_ref().map(|plane| plane[row]),
                rotation: frame.rotation().each_ref().map(|plane| plane[row]),
            };
            let (own, other) = (pose(from), pose(to));
            let shown = Shown::new(seen, &own);
            let position = from.position().each_ref().map(|plane| plane[row]);
            let moved = [0, 1, 2].map(|axis: usize| to.position()[axis][row] - position[axis]);
            let grown = [0, 1, 2].map(|axis: usize| {
                let difference = own.log_scale[axis] - other.log_scale[axis];
                difference * difference * shown.grown(axis)
            });
            let [before, after] = [from, to].map(|frame| frame.opacity_logit()[row]);
            let squares = |from: &[Vec<f32>], to: &[Vec<f32>]| -> f32 {
                from.iter().zip(to).map(|(a, b)| (a[row] - b[row]) * (a[row] - b[row])).sum()
            };
            let of_row = [
                shown.moved(shown.widths(moved)),
                grown.iter().sum(),
                shown.turned(other.rotation),
                (after - before) * (after - before) * shown.faded(before, after),
                squares(from.dc(), to.dc()) * shown.coloured(),
                squares(from.sh(), to.sh()) * shown.coloured(),
            ];
            errors.iter_mut().zip(of_row).for_each(|(sum, error)| *sum += f64::from(error));
        }
        for (error, scale) in errors.iter_mut().zip(MEASURED) {
            *error *= scale;
        }
        errors
    }
}
