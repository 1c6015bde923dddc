//! What the paper shows at a refinement level: of each frame only so many Gaussians, the largest and most opaque first.

use super::decoded::mean;
use super::encoded;
use crate::Error;
use crate::decoding::each_frame;
use crate::levels::Subset;
use crate::picture_comparison::Judge;
use splatstream_decoder::frame_memory::FrameMemory;
use splatstream_decoder::operating_point::{OperatingPointInfo, operating_points};
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::process::Options;
use splatstream_encoder::{Importance, Settings, Structure};
use splatstream_format::Limits;
use splatstream_gaussians::GaussianFrame;

/// The subset at each refinement level: every frame intra, ordered by opacity times volume.
pub(super) fn subsets(
    frames: &[GaussianFrame],
    settings: &Settings,
    judge: &Judge<'_>,
) -> Result<Vec<Subset>, Error> {
    let mut inter = frames.get(1..).unwrap_or_default().to_vec();
    let importance = Some(Importance::Volume);
    let settings =
        Settings { structure: Structure::Intra, spatial_layers: 1, importance, ..settings.clone() };
    let stream = encoded(&mut inter, &settings)?;
    let points = operating_points(&stream, &Limits::default())?;
    points.into_iter().map(|point| subset(&stream, point, judge)).collect()
}

fn subset(stream: &[u8], info: OperatingPointInfo, judge: &Judge<'_>) -> Result<Subset, Error> {
    let mut views = Vec::new();
    let options = Options { operating_point: info.point, ..Options::default() };
    each_frame(&FrameMemory::default(), stream, &options, |sequence, frame| {
        // The stream lacks the first frame of the sequence.
        let number = frame.index + 1;
        let shown = to_gaussians(frame.into_shown(), sequence)?;
        views.extend(judge.views(number, &shown));
        Ok(shown)
    })?;
    Ok(Subset { bytes: info.bytes, gaussians: info.gaussians, figures: mean(views.into_iter())? })
}
