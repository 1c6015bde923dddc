//! One run: a scene encoded with a variant at a quality, timed, decoded, judged.

use super::picture_comparison::Judge;
use super::scenes::Scene;
use super::sweep::{Group, Sweep, Variant};
use super::timing::{Spent, Timing};
use crate::Error;
use crate::Progress;
use crate::costs::Costs;
use crate::decoding::each_frame;
use splatstream_decoder::frame_memory::FrameMemory;
use splatstream_decoder::operating_point::{OperatingPoint, OperatingPointInfo, operating_points};
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::process::Options;
use splatstream_encoder::{Quality, Settings, encode};
use splatstream_format::Limits;
use splatstream_format::syntax::{UnitHeader, UnitType};
use splatstream_format::unit::Stream;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::metrics::Comparison;
use std::hint::black_box;

/// A frame at an operating point.
#[derive(Debug, Clone)]
pub(crate) struct FramePoint {
    /// Gaussians shown.
    pub(crate) gaussians: u64,
    /// Bytes of its increments up to the point, headers included.
    pub(crate) increment_bytes: u64,
    /// Bytes of all its units up to the point, headers included.
    pub(crate) bytes: u64,
    /// Figures of each camera.
    pub(crate) views: Vec<Comparison>,
}

/// An operating point of a run.
#[derive(Debug, Clone)]
pub(crate) struct Point {
    /// Its name, share and size.
    pub(crate) info: OperatingPointInfo,
    /// Its frames.
    pub(crate) frames: Vec<FramePoint>,
    /// Means over cameras and frames.
    pub(crate) figures: Comparison,
    /// Seconds to decode it, from bytes in memory to Gaussians in memory.
    pub(crate) decode: Timing,
}

/// A variant at a quality.
#[derive(Debug, Clone)]
pub(crate) struct Run {
    /// Name of the variant.
    pub(crate) variant: String,
    /// Group of the variant.
    pub(crate) group: Group,
    /// The quality as the command line spells it.
    pub(crate) quality: String,
    /// The stream.
    pub(crate) stream: Vec<u8>,
    /// GOPs of the stream.
    pub(crate) gops: u32,
    /// Gaussians coded, over all frames.
    pub(crate) gaussians: u64,
    /// Seconds to encode, from Gaussians in memory to bytes in memory.
    pub(crate) encode: Timing,
    /// Seconds to decode everything.
    pub(crate) decode: Timing,
    /// Operating points, everything last; of a variant that is not the baseline, only that.
    pub(crate) points: Vec<Point>,
    /// Where the bits go.
    pub(crate) costs: Costs,
}

impl Run {
    /// The point with everything in it.
    pub(crate) fn full(&self) -> Option<&Point> {
        self.points.last()
    }
}

/// All runs of a scene.
pub(crate) fn measure(
    scene: &mut Scene,
    sweep: &Sweep,
    judge: &mut Judge<'_>,
    progress: &dyn Progress,
) -> Result<Vec<Run>, Error> {
    sweep.runs().map(|(variant, quality)| run(scene, sweep, variant, quality, judge, progress)).collect()
}

/// Steps of progress that [`measure`] takes.
pub(crate) fn steps(sweep: &Sweep) -> u32 {
    let of_run = |(variant, quality): (&Variant, Quality)| 1 + sweep.points(variant, quality);
    sweep.runs().map(of_run).sum::<usize>() as u32
}

fn run(
    scene: &mut Scene,
    sweep: &Sweep,
    variant: &Variant,
    quality: Quality,
    judge: &mut Judge<'_>,
    progress: &dyn Progress,
) -> Result<Run, Error> {
    let what = format!("{}: {}, {}", scene.name, variant.name, quality.name().to_owned());
    progress.step(format!("{what}: encoding"));
    let settings = variant.at(quality);
    let repeat = sweep.repeats(quality);
    let (stream, gaussians, encode) =
        encoded(&mut scene.frames, &settings, repeat).map_err(|error| error.of_scene(&scene.name))?;
    progress.advance();
    let limits = Limits::default();
    let infos = operating_points(&stream, &limits)?;
    let passed = infos.len().saturating_sub(sweep.points(variant, quality));
    let mut points = Vec::new();
    for &info in infos.iter().skip(passed) {
        progress.step(format!("{what}: decoding {} %, and its pictures", info.percent));
        points.push(point(&stream, info, repeat, judge)?);
        progress.advance();
    }
    let decode = points.last().map(|point| point.decode);
    let decode = decode.ok_or_else(|| Error::other("a stream just encoded has no operating point"))?;
    Ok(Run {
        variant: variant.name.clone(),
        group: variant.group,
        quality: quality.name().to_owned(),
        gops: (scene.frames.len() as u32).div_ceil(settings.gop),
        gaussians,
        encode,
        decode,
        points,
        costs: Costs::of(&stream, &limits)?,
        stream,
    })
}

/// Encodes some frames a few times: the stream, the Gaussians in it, and what an encoding takes.
///
/// # Errors
/// The encoder refuses the frames or the settings.
pub(crate) fn encoded(
    frames: &mut Vec<GaussianFrame>,
    settings: &Settings,
    repeat: u32,
) -> Result<(Vec<u8>, u64, Timing), Error> {
    let mut spent = Vec::new();
    let mut result = (Vec::new(), 0);
    for _ in 0..repeat.max(1) {
        let mut stream = Vec::new();
        let (report, once) = Spent::of(|| encode(frames, settings, &mut stream, &mut |_, _| {}));
        spent.push(once);
        result = (stream, report?.gaussians);
    }
    Ok((result.0, result.1, Timing::of(&spent)))
}

/// What decoding an operating point takes.
///
/// # Errors
/// The stream has a fault.
pub(crate) fn decoded(stream: &[u8], operating_point: OperatingPoint, repeat: u32) -> Result<Timing, Error> {
    let options = Options { operating_point, ..Options::default() };
    let (mut spent, memory) = (Vec::new(), FrameMemory::default());
    for _ in 0..repeat.max(1) {
        let (result, once) = Spent::of(|| {
            each_frame(&memory, stream, &options, |sequence, frame| {
                Ok(black_box(to_gaussians(frame.into_shown(), sequence)?))
            })
        });
        result?;
        spent.push(once);
    }
    Ok(Timing::of(&spent))
}

/// Decodes an operating point and judges its frames.
fn point(
    stream: &[u8],
    info: OperatingPointInfo,
    repeat: u32,
    judge: &mut Judge<'_>,
) -> Result<Point, Error> {
    let decode = decoded(stream, info.point, repeat)?;
    let mut frames = Vec::new();
    let options = Options { operating_point: info.point, ..Options::default() };
    each_frame(&FrameMemory::default(), stream, &options, |sequence, frame| {
        let parameters = sequence.to_bytes()?;
        let key = (parameters, frame.index, frame.digest.unwrap_or_default());
        let gaussians = to_gaussians(frame.into_shown(), sequence)?;
        let views = judge.views_of(key, &gaussians);
        let shown = gaussians.len() as u64;
        frames.push(FramePoint { gaussians: shown, increment_bytes: 0, bytes: 0, views });
        Ok(gaussians)
    })?;
    add_bytes(stream, info.point, &mut frames)?;
    let views: Vec<Comparison> = frames.iter().flat_map(|frame| frame.views.iter().copied()).collect();
    let figures = Comparison::mean(&views).ok_or_else(|| Error::other("there is no camera to look from"))?;
    Ok(Point { info, frames, figures, decode })
}

/// What the units of each frame take.
fn add_bytes(stream: &[u8], point: OperatingPoint, frames: &mut [FramePoint]) -> Result<(), Error> {
    for unit in Stream::open(stream, &Limits::default())?.units() {
        let unit = unit?;
        let Some(frame) = frames.get_mut(unit.header.frame as usize) else { continue };
        let bytes = (UnitHeader::SIZE + unit.payload.len()) as u64;
        match unit.header.unit_type() {
            _ if !point.takes(&unit.header, None) => {}
            UnitType::FrameHeader => frame.bytes += bytes,
            UnitType::Increment => {
                frame.bytes += bytes;
                frame.increment_bytes += bytes;
            }
            _ => {}
        }
    }
    Ok(())
}

/// A run for the tests of tables.
#[cfg(test)]
pub(crate) mod samples {
    use super::*;

    /// A second, of two threads.
    const TIMING: Timing = Timing { median: 1.0, least: 1.0, most: 1.0, processor: Some(2.0) };

    fn figures(psnr_db: f64) -> Comparison {
        Comparison {
            psnr_db,
            psnr_masked_db: None,
            yuv_psnr_db: psnr_db,
            ssim: Some(0.9),
            ssim_masked: None,
            st_lpips: None,
        }
    }

    fn point(refinement: u8, percent: u8, bytes: u64) -> Point {
        let frame = |psnr| FramePoint {
            gaussians: 100,
            increment_bytes: bytes / 4,
            bytes: bytes / 4 + 10,
            views: vec![figures(psnr)],
        };
        Point {
            info: OperatingPointInfo {
                point: OperatingPoint { spatial: 0, temporal: 0, refinement },
                bytes,
                gaussians: 200,
                frames: 2,
                percent,
            },
            frames: vec![frame(30.0), frame(20.0)],
            figures: figures(25.0),
            decode: TIMING,
        }
    }

    /// Two frames at 20 and 100 %.
    pub(crate) fn run() -> Run {
        let costs = Costs {
            bytes: 0,
            gaussians: 0,
            bpg: 0.0,
            attributes: Vec::new(),
            sections: Vec::new(),
            frame_types: Vec::new(),
            units: Vec::new(),
        };
        Run {
            variant: "balanced".to_owned(),
            group: Group::Baseline,
            quality: "high".to_owned(),
            stream: Vec::new(),
            gops: 1,
            gaussians: 200,
            encode: TIMING,
            decode: TIMING,
            points: vec![point(0, 20, 1000), point(1, 100, 4000)],
            costs,
        }
    }
}
