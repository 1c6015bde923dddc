//! What operating points look like, and which of them no other beats.

use crate::cameras::of_stream;
use crate::stream_file::StreamFile;
use rayon::prelude::*;
use splatstream_chart::first_frame::first_frame;
use splatstream_decoder::operating_point::{OperatingPoint, OperatingPointInfo};
use splatstream_decoder::process::Options;
use splatstream_encoder::up_of;
use splatstream_gaussians::FrameError;
use splatstream_render::ReferencePictures;
use splatstream_render::camera::held_out;

/// Views of the first frame, and their height.
const VIEWS: (u32, u32) = (3, 270);

/// How good the pictures of a point are.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Quality {
    /// PSNR of the first frame against that of the highest point, decibels; none of points that show the same pictures
    /// as that, or none.
    pub(super) psnr_db: Option<f64>,
    /// Whether no point with as many frames has better pictures for as many bytes.
    pub(super) on_hull: bool,
}

/// The quality of each point, the pictures of the highest one being right.
///
/// # Errors
/// A frame whose planes are broken: the decoder is at fault.
pub(super) fn qualities(
    stream: &StreamFile,
    points: &[OperatingPointInfo],
    options: &Options,
) -> Result<Vec<Quality>, FrameError> {
    let bytes = stream.bytes.as_slice();
    let highest = points.iter().max_by_key(|info| {
        let OperatingPoint { spatial, temporal, refinement } = info.point;
        (spatial, refinement, temporal)
    });
    let first = |info: &OperatingPointInfo| first_frame(bytes, info.point, options);
    let Some(reference) = highest.map(first).transpose()?.flatten() else {
        return Ok(vec![Quality::default(); points.len()]);
    };
    let description = stream.description(&options.limits).unwrap_or_default();
    let given = of_stream(&description, VIEWS.1);
    let up = up_of(description.up_axis).unwrap_or_default();
    let cameras = held_out(&reference, up, &given, VIEWS.0, VIEWS.1);
    let right = ReferencePictures::new(&reference, cameras);
    let seen = |info: &OperatingPointInfo| {
        let frame = first(info)?;
        Ok(frame.map(|frame| right.psnr(&frame).sum::<f64>() / right.len().max(1) as f64))
    };
    let decibels: Vec<Option<f64>> = points.par_iter().map(seen).collect::<Result<_, FrameError>>()?;
    let is_beaten = |index: usize| {
        let (info, own) = (&points[index], decibels[index].unwrap_or(0.0));
        points.iter().zip(&decibels).enumerate().any(|(other, (rival, decibels))| {
            let its = decibels.unwrap_or(0.0);
            let is_as_good = rival.bytes <= info.bytes && its >= own;
            let is_alike = rival.bytes == info.bytes && its == own;
            rival.frames == info.frames && is_as_good && (!is_alike || other < index)
        })
    };
    let quality = |index: usize| Quality {
        psnr_db: decibels[index].filter(|decibels| decibels.is_finite()),
        on_hull: decibels[index].is_some() && !is_beaten(index),
    };
    Ok((0..points.len()).map(quality).collect())
}
