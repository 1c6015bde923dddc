//! What operating points look like, for players: pictures of frames of every GOP, against everything decoded.

use crate::cameras::CameraArgs;
use crate::failure::Failure;
use crate::progress::Progress;
use crate::stream_file::StreamFile;
use rayon::prelude::*;
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::decode_stream_inside;
use splatstream_format::Limits;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::metrics::{Comparison, compare};
use splatstream_render::{Camera, Rendering, render};
use splatstream_stream::division::Division;
use splatstream_stream::manifest::{GopInfo, Manifest, QualityInfo};
use std::collections::BTreeMap;
use std::ops::ControlFlow;

/// Rows of the pictures.
const HEIGHT: u32 = 180;

/// Where neither the user nor the stream has cameras.
const VIEWS: usize = 2;

/// PSNR in dB from which on nobody sees a difference; equal pictures have it.
const MOST_DB: f64 = 50.0;

/// The table of a manifest: every operating point of every GOP. The I frame of a GOP and a frame of each temporal layer are
/// drawn, each for all of its kind; at points without a frame the one before stands still.
pub(super) fn measure(
    stream: &StreamFile,
    manifest: &Manifest,
    options: &Options,
) -> Result<Vec<QualityInfo>, Failure> {
    let limits = &options.limits;
    let division = Division::of(&stream.bytes, limits).map_err(|error| stream.fault(error))?;
    let progress = Progress::frames("measuring", manifest.stream.frames.try_into().unwrap_or(u32::MAX));
    let points = points(manifest);
    let background =
        stream.description(limits).and_then(|description| description.background).unwrap_or_default();
    let (mut cameras, mut table) = (Vec::new(), Vec::new());
    for (number, (info, gop)) in (0..).zip(manifest.gops.iter().zip(&division.gops)) {
        let wanted = samples(info);
        let decode = |point| decode(&stream.bytes, gop.start, &wanted, point, options);
        let whole = decode(OperatingPoint::ALL)?;
        if let Some(first) = whole.iter().flatten().next().filter(|_| cameras.is_empty()) {
            cameras = views(stream, first, limits)?;
        }
        let draw = |frame: &Option<GaussianFrame>| drawn(frame.as_ref(), &cameras, background);
        let references: Vec<Vec<Rendering>> = whole.iter().map(draw).collect();
        let row = |point: &OperatingPoint| {
            let pictures = decode(*point)?.iter().map(draw).collect::<Vec<_>>();
            Ok(quality(*point, number, &wanted, (&references, &pictures)))
        };
        table.extend(points.par_iter().map(row).collect::<Result<Vec<_>, Failure>>()?);
        progress.at(info.first_frame.saturating_add(info.frame_count));
    }
    Ok(table)
}

/// All operating points of a stream.
fn points(manifest: &Manifest) -> Vec<OperatingPoint> {
    let info = &manifest.stream;
    let refinements = info.refinements.len() as u8;
    let of_layers = |spatial, temporal| {
        (0..refinements).map(move |refinement| OperatingPoint { spatial, temporal, refinement })
    };
    let of_spatial =
        |spatial| (0..info.temporal_layers).flat_map(move |temporal| of_layers(spatial, temporal));
    (0..info.spatial_layers).flat_map(of_spatial).collect()
}

/// A frame that is drawn, and how many it stands for.
struct Sample {
    frame: u32,
    count: usize,
}

/// The frames of a GOP that are drawn, in order: the middle one of the I frames and of each temporal layer.
fn samples(info: &GopInfo) -> Vec<Sample> {
    let mut kinds: BTreeMap<&str, Vec<u32>> = BTreeMap::new();
    for one in &info.subsegments {
        // Layers of I frames above the base have the same frames.
        if one.representation == "s0" || one.representation.starts_with('t') {
            let frames = one.frames.iter().map(|frame| frame.frame);
            kinds.entry(&one.representation).or_default().extend(frames);
        }
    }
    let sample = |mut frames: Vec<u32>| {
        frames.sort_unstable();
        frames.get(frames.len() / 2).map(|&frame| Sample { frame, count: frames.len() })
    };
    let mut samples: Vec<Sample> = kinds.into_values().filter_map(sample).collect();
    samples.sort_by_key(|sample| sample.frame);
    samples
}

/// What is shown at some times of a GOP at an operating point; nothing before the first frame.
fn decode(
    bytes: &[u8],
    gop: u64,
    samples: &[Sample],
    operating_point: OperatingPoint,
    options: &Options,
) -> Result<Vec<Option<GaussianFrame>>, Failure> {
    let options = Options { operating_point, ..*options };
    let (mut shown, mut failed) = (vec![None; samples.len()], None);
    let _summary = decode_stream_inside(bytes, gop, &options, |sequence, frame| {
        let index = frame.index;
        if samples.iter().all(|sample| index > sample.frame) {
            return ControlFlow::Break(());
        }
        if frame.is_lost {
            return ControlFlow::Continue(());
        }
        match to_gaussians(frame.into_shown(), sequence) {
            Ok(gaussians) => {
                let later = samples.iter().zip(&mut shown).filter(|(sample, _)| index <= sample.frame);
                later.for_each(|(_, shown)| *shown = Some(gaussians.clone()));
                ControlFlow::Continue(())
            }
            Err(error) => {
                failed = Some(error);
                ControlFlow::Break(())
            }
        }
    });
    failed.map_or(Ok(shown), |error| Err(error.into()))
}

/// The cameras of the stream, or some around its first frame.
fn views(stream: &StreamFile, first: &GaussianFrame, limits: &Limits) -> Result<Vec<Camera>, Failure> {
    let arguments = CameraArgs { height: Some(HEIGHT), up: None };
    let all = arguments.cameras(None, first, &stream.description(limits).unwrap_or_default())?;
    // Some that stand far from each other are enough.
    let step = (all.len() / VIEWS).max(1);
    Ok(all.into_iter().step_by(step).take(VIEWS).collect())
}

fn drawn(frame: Option<&GaussianFrame>, cameras: &[Camera], background: [f32; 3]) -> Vec<Rendering> {
    cameras.iter().filter_map(|camera| Some(render(frame?, camera, background))).collect()
}

fn quality(
    point: OperatingPoint,
    gop: u32,
    samples: &[Sample],
    (references, pictures): (&[Vec<Rendering>], &[Vec<Rendering>]),
) -> QualityInfo {
    let pairs = samples.iter().zip(references.iter().zip(pictures));
    let compared: Vec<(f64, f64, Option<f64>)> = pairs
        .filter_map(|(sample, (references, pictures))| {
            let mean = compared(references, pictures)?;
            Some((sample.count as f64, mean.psnr_db.min(MOST_DB), mean.ssim))
        })
        .collect();
    let psnr = mean(compared.iter().map(|(count, psnr, _)| (*count, *psnr)));
    let ssim = mean(compared.iter().filter_map(|(count, _, ssim)| Some((*count, (*ssim)?))));
    QualityInfo {
        point: point.to_string(),
        gop: Some(gop),
        psnr_db: psnr.map(|psnr| (psnr * 1000.0).round() / 1000.0),
        ssim: ssim.map(|ssim| (ssim * 1e5).round() / 1e5),
    }
}

/// The views of a frame against those of another one.
fn compared(references: &[Rendering], pictures: &[Rendering]) -> Option<Comparison> {
    // Of pictures that show nothing nothing can be said.
    let seen = references
        .iter()
        .zip(pictures)
        .filter(|(reference, _)| reference.alpha.iter().any(|&alpha| alpha > 0.0));
    let of_views: Vec<Comparison> = seen
        .map(|(reference, picture)| compare(&reference.colour, &reference.alpha, &picture.colour, None))
        .collect();
    Comparison::mean(&of_views)
}

/// The mean of some values with weights; none of nothing.
fn mean(values: impl Iterator<Item = (f64, f64)>) -> Option<f64> {
    let (weight, sum) =
        values.fold((0.0, 0.0), |(weight, sum), (own, value)| (weight + own, sum + own * value));
    (weight > 0.0).then(|| sum / weight)
}
