//! What fills the holes of a prefix: log-scales and opacities raised where later refinements are missing (7.8.3).

use crate::error::Error;
use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::list::GaussianList;
use splatstream_decoder::output::to_gaussians;
use splatstream_format::syntax::SequenceParameters;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::ReferencePictures;
use splatstream_render::camera::{Up, spiral};

/// Views that a prefix is judged in, and their lines: holes are large. Fuzzing wants streams, not pictures.
const VIEWS: u32 = 2;
const LINES: u32 = if cfg!(fuzzing) { 12 } else { 120 };
/// Offsets of log-scale and of opacity that are tried, and up to so many of them.
const UNITS: [f32; 2] = [0.12, 0.15];
const MOST: i8 = 6;

/// Judges prefixes of one frame.
pub(crate) struct Compensator {
    views: ReferencePictures,
}

impl Compensator {
    /// For prefixes of a frame that all of its Gaussians make.
    pub(crate) fn new(frame: &GaussianFrame, up: Up) -> Self {
        Self { views: ReferencePictures::new(frame, spiral(frame, up, VIEWS, LINES)) }
    }

    /// Offsets of log-scale and opacity for the Gaussians of some lists: as far as each step up brings the pictures
    /// nearer to those of the whole frame, first of the scale, then of the opacity.
    ///
    /// # Errors
    /// Lists whose planes make no frame.
    #[expect(clippy::indexing_slicing, reason = "both arrays have two entries")]
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "offsets are below 6 times the largest single one, values on the grid far below 2^31"
    )]
    pub(crate) fn offsets(
        &self,
        lists: &[&QuantizedFrame],
        sequence: &SequenceParameters,
    ) -> Result<(i8, i8), Error> {
        let steps = [sequence.log_scale_step(), sequence.opacity_step()];
        let [scale, opacity] = [0, 1].map(|which: usize| {
            libm::roundf(UNITS[which] / steps[which]).clamp(1.0, f32::from(i8::MAX / MOST)) as i8
        });
        let mut best = (self.error(lists, (0, 0), sequence)?, (0, 0));
        for (scale, opacity) in [(scale, 0), (0, opacity)] {
            for _ in 0..MOST {
                let tried = (best.1.0 + scale, best.1.1 + opacity);
                let error = self.error(lists, tried, sequence)?;
                if error >= best.0 {
                    break;
                }
                best = (error, tried);
            }
        }
        Ok(best.1)
    }

    /// Decibels below the whole frame, so that less is better.
    fn error(
        &self,
        lists: &[&QuantizedFrame],
        offsets: (i8, i8),
        sequence: &SequenceParameters,
    ) -> Result<f64, Error> {
        Ok(-self.views.psnr(&compensated(lists, offsets, sequence)?).sum::<f64>())
    }
}

/// What receivers of some lists see, with offsets of log-scale and opacity.
///
/// # Errors
/// Lists whose planes make no frame.
#[expect(
    clippy::arithmetic_side_effects,
    reason = "offsets are below 2^7, values on the grid far below 2^31"
)]
pub(crate) fn compensated(
    lists: &[&QuantizedFrame],
    (scale, opacity): (i8, i8),
    sequence: &SequenceParameters,
) -> Result<GaussianFrame, Error> {
    let mut planes = QuantizedFrame::zeroed(0, usize::from(sequence.sh_dimension()));
    lists.iter().for_each(|list| planes.append(list));
    planes.log_scale.iter_mut().flatten().for_each(|value| *value += i32::from(scale));
    planes.opacity.iter_mut().for_each(|value| *value += i32::from(opacity));
    Ok(to_gaussians(planes, sequence)?)
}

/// All Gaussians of some lists, as they are output.
///
/// # Errors
/// Lists whose planes make no frame.
pub(crate) fn shown(lists: &[GaussianList], sequence: &SequenceParameters) -> Result<GaussianFrame, Error> {
    let lists: Vec<&QuantizedFrame> = lists.iter().map(|list| &list.planes).collect();
    compensated(&lists, (0, 0), sequence)
}
