//! What operating points look like, and which of them no other beats.

use crate::cameras::of_stream;
use crate::stream_file::StreamFile;
use rayon::prelude::*;
use splatstream_decoder::operating_point::{OperatingPoint, OperatingPointInfo};
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::decode_stream;
use splatstream_encoder::up_of;
use splatstream_format::Limits;
use splatstream_gaussians::{FrameError, GaussianFrame};
use splatstream_render::ReferencePictures;
use splatstream_render::camera::held_out;
use splatstream_stream::structure::Structure;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;

/// Views of each frame, and their height.
const VIEWS: (u32, u32) = (3, 270);

/// Equal pictures count so much beside others, decibels.
const EQUAL: f64 = 100.0;

/// How good the pictures of a point are.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Quality {
    /// PSNR of the frames that are looked at against those of the highest point, decibels; none of points that show the same
    /// pictures as that, or none.
    pub(super) psnr_db: Option<f64>,
    /// Whether no point with as many frames has better pictures for as many bytes.
    pub(super) on_hull: bool,
}

/// The quality of each point, the pictures of the highest one being right. Looked at are the first frame and the last of its GOP
/// that every point has: what a point lacks of predicted frames adds up until there. These are of the lowest temporal layer, so
/// that points that differ in others look the same.
///
/// # Errors
/// A frame whose planes are broken: the decoder is at fault.
pub(super) fn qualities(
    stream: &StreamFile,
    points: &[OperatingPointInfo],
    options: &Options,
) -> Result<Vec<Quality>, FrameError> {
    let layers: BTreeSet<(u8, u8)> = points.iter().map(|info| layers(&info.point)).collect();
    let wanted = frames_of_all(stream, &options.limits);
    let shown = |&(spatial, refinement): &(u8, u8)| {
        let operating_point = OperatingPoint { spatial, temporal: 0, refinement };
        shown(&stream.bytes, &wanted, &Options { operating_point, ..*options })
    };
    let reference = layers.last().map(shown).transpose()?.unwrap_or_default();
    let Some(first) = reference.values().next() else {
        return Ok(vec![Quality::default(); points.len()]);
    };
    let description = stream.description(&options.limits).unwrap_or_default();
    let given = of_stream(&description, VIEWS.1);
    let up = up_of(description.up_axis).unwrap_or_default();
    let cameras = held_out(first, up, &given, VIEWS.0, VIEWS.1);
    let right: BTreeMap<u32, ReferencePictures> = reference
        .iter()
        .map(|(&index, frame)| (index, ReferencePictures::new(frame, cameras.clone())))
        .collect();
    let seen = |layers: &(u8, u8)| Ok((*layers, psnr(&shown(layers)?, &right)));
    let decibels: BTreeMap<(u8, u8), Option<f64>> =
        layers.par_iter().map(seen).collect::<Result<_, FrameError>>()?;
    let decibels: Vec<Option<f64>> = points.iter().map(|info| decibels[&self::layers(&info.point)]).collect();
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

/// Spatial layer and refinement of a point.
const fn layers(point: &OperatingPoint) -> (u8, u8) {
    (point.spatial, point.refinement)
}

/// The first frame of a stream, and the last of its GOP in the lowest temporal layer.
fn frames_of_all(stream: &StreamFile, limits: &Limits) -> BTreeSet<u32> {
    let structure = Structure::of(&stream.bytes, limits);
    let frames = structure.gops.first().map(|gop| gop.frames.as_slice()).unwrap_or_default();
    let mut lowest = frames.iter().filter(|frame| frame.role.temporal_layer == 0).map(|frame| frame.index);
    [lowest.clone().min(), lowest.by_ref().max()].into_iter().flatten().collect()
}

/// Those of some frames of which something is shown.
fn shown(
    stream: &[u8],
    wanted: &BTreeSet<u32>,
    options: &Options,
) -> Result<BTreeMap<u32, GaussianFrame>, FrameError> {
    let mut shown = BTreeMap::new();
    let mut failed = None;
    let _faults = decode_stream(stream, options, |sequence, frame| {
        let index = frame.index;
        if wanted.contains(&index) && !frame.is_lost {
            match to_gaussians(frame.into_shown(), sequence) {
                Ok(frame) => _ = shown.insert(index, frame),
                Err(error) => failed = Some(error),
            }
        }
        if failed.is_some() || wanted.last().is_none_or(|&last| index >= last) {
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(())
    });
    failed.map_or(Ok(shown), Err)
}

/// Mean PSNR of frames against pictures of them; infinite where all are equal, none where there is none.
fn psnr(frames: &BTreeMap<u32, GaussianFrame>, right: &BTreeMap<u32, ReferencePictures>) -> Option<f64> {
    let of_frame = |(index, frame): (&u32, &GaussianFrame)| {
        right.get(index).map(|right| right.psnr(frame).collect::<Vec<_>>())
    };
    let all: Vec<f64> = frames.iter().filter_map(of_frame).flatten().collect();
    if all.iter().all(|decibels| *decibels == f64::INFINITY) {
        return all.first().copied();
    }
    Some(all.iter().map(|decibels| decibels.min(EQUAL)).sum::<f64>() / all.len() as f64)
}
