//! A sequence as the paper streams it: its first GOP in profile Dynamic, at every operating point that a client would
//! choose, and what the tools of predicted frames are worth on it.

mod ablation;
mod decoded;
mod subset;
mod tools;

use super::picture_comparison::Judge;
use super::scenes::Scene;
use crate::Error;
use crate::Progress;
use crate::levels::{Level, PredictedLevel, Subset};
use crate::modes::{Mode, Playback};
pub(crate) use ablation::AblationRow;
pub(crate) use decoded::shown;
use decoded::{Shown, label};
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_encoder::{Anchor, Settings, Structure, encode};
use splatstream_gaussians::GaussianFrame;
use std::io;
pub(crate) use tools::ToolRow;

/// Spatial layers: the paper's 540, 720 and 1080 lines.
const SPATIAL: u8 = 3;

/// Temporal layers: the base layer, and the frames that double its rate.
const TEMPORAL: u8 = 2;

/// Steps of progress that [`measure`] takes.
pub(crate) const fn steps(ablation: bool) -> u32 {
    if ablation { 3 + ablation::ROWS } else { 3 }
}

/// What was measured of a GOP.
#[derive(Debug, Clone)]
pub(crate) struct Gop {
    /// Frames of it.
    pub(crate) frames: usize,
    /// Ways to play it, in the order of the paper's table.
    pub(crate) modes: Vec<Mode>,
    /// Refinement levels of all its frames.
    pub(crate) levels: Vec<Level>,
    /// What predicted frames take with all tools, and without each.
    pub(crate) tools: Vec<ToolRow>,
    /// What each predictor and each part of the network is worth, if that was asked for.
    pub(crate) ablation: Vec<AblationRow>,
}

/// The settings of the GOP: those of the baseline, with the structure of the paper's experiment, whatever would be
/// smaller.
pub(crate) fn settings(baseline: Settings, frames: u32) -> Settings {
    let structure = Structure::Predicted { layers: TEMPORAL };
    Settings { structure, anchor: Anchor::Whole, spatial_layers: SPATIAL, gop: frames, ..baseline }
}

/// Whether a scene has a second frame in its first GOP.
pub(crate) fn is_sequence(scene: &Scene, gop: u32) -> bool {
    scene.frames.len().min(gop as usize) > 1
}

/// Measures the first GOP of a sequence.
pub(crate) fn measure(
    scene: &Scene,
    settings: &Settings,
    (fps, ablation): (f64, bool),
    judge: &mut Judge<'_>,
    progress: &dyn Progress,
) -> Result<Gop, Error> {
    let of_gop = scene.frames.iter().take(settings.gop as usize).cloned();
    let mut frames: Vec<GaussianFrame> = of_gop.collect();
    progress.step(format!("{}: operating points of the first GOP", scene.name));
    let settings = &fitted(&mut frames, settings)?;
    let stream = encoded(&mut frames, settings)?;
    let whole = OperatingPoint { spatial: SPATIAL - 1, temporal: TEMPORAL - 1, refinement: 0 };
    let refinements = settings.refinements.iter().zip(0..);
    let levels = refinements.map(|(&percent, refinement)| {
        Ok((percent, shown(&stream, OperatingPoint { refinement, ..whole }, judge)?))
    });
    let levels: Vec<(u8, Shown)> = levels.collect::<Result<_, Error>>()?;
    let modes = modes(&stream, &levels, fps, judge)?;
    progress.advance();
    progress.step(format!("{}: predicted frames by themselves", scene.name));
    let subsets = subset::subsets(&frames, settings, judge)?;
    progress.advance();
    progress.step(format!("{}: tools of predicted frames", scene.name));
    let tools = tools::rows(&mut frames, settings, judge)?;
    progress.advance();
    let ablation =
        if ablation { ablation::rows(&mut frames, settings, judge, progress)? } else { Vec::new() };
    let rows = levels.iter().zip(subsets).map(|((percent, shown), subset)| level(*percent, shown, subset));
    Ok(Gop { frames: frames.len(), modes, levels: rows.collect::<Result<_, _>>()?, tools, ablation })
}

/// Settings with the steps that the GOP reaches its PSNR with: everything is measured with the same.
fn fitted(frames: &mut Vec<GaussianFrame>, settings: &Settings) -> Result<Settings, Error> {
    let report = encode(frames, settings, &mut io::sink(), &mut |_, _| {})?;
    let steps = report.steps.unwrap_or(settings.steps);
    let laws = report.laws.unwrap_or(settings.laws);
    Ok(Settings { steps, laws, psnr: None, ..settings.clone() })
}

fn encoded(frames: &mut Vec<GaussianFrame>, settings: &Settings) -> Result<Vec<u8>, Error> {
    let mut stream = Vec::new();
    encode(frames, settings, &mut stream, &mut |_, _| {})?;
    Ok(stream)
}

/// The ways to play a GOP: its intra frame layer by layer, then its base layer, then all of it.
fn modes(stream: &[u8], levels: &[(u8, Shown)], fps: f64, judge: &mut Judge<'_>) -> Result<Vec<Mode>, Error> {
    let frames = levels.first().map_or(0, |(_, shown)| shown.frames.len());
    let last = (levels.len() as u8).saturating_sub(1);
    let mut modes = Vec::new();
    for spatial in 0..SPATIAL {
        let point = OperatingPoint { spatial, temporal: 0, refinement: last };
        let intra = shown(stream, point, judge)?.intra_alone();
        let names = ["Startup", "Low spatial quality", "Full spatial anchor"];
        let units: Vec<String> = (0..=spatial).map(|layer| format!("I0 s{layer}")).collect();
        let name = names.get(usize::from(spatial)).copied().unwrap_or("Spatial layer");
        modes.push(mode(name.to_owned(), units.join(" + "), None, &intra, (frames, fps))?);
    }
    let base = shown(stream, OperatingPoint { spatial: SPATIAL - 1, temporal: 0, refinement: last }, judge)?;
    // A GOP of two frames has no predicted frame in its base layer.
    if base.frames.len() > 1 {
        let name = "Low-frame-rate temporal".to_owned();
        modes.push(mode(name, base.units(last), Some(100), &base, (frames, fps))?);
    }
    for ((percent, shown), refinement) in levels.iter().zip(0..) {
        let name = format!("Full frame rate at {percent} %");
        modes.push(mode(name, shown.units(refinement), Some(*percent), shown, (frames, fps))?);
    }
    Ok(modes)
}

fn mode(
    name: String,
    units: String,
    percent: Option<u8>,
    shown: &Shown,
    (frames, fps): (usize, f64),
) -> Result<Mode, Error> {
    let playback = match shown.frames.len() {
        1 => "intra only",
        some if some < frames => "base temporal layer",
        _ => "full temporal layer",
    };
    let (bytes, gaussians) = (shown.bytes(), shown.gaussians());
    Ok(Mode {
        name,
        units,
        frames: shown.frames.iter().map(|frame| frame.number).collect(),
        playback,
        percent,
        bytes,
        // However few frames are shown, they last as long as the GOP.
        sequence: Some(Playback::new(bytes, frames, (frames, fps))),
        gaussians,
        figures: shown.figures(|_| true)?,
    })
}

fn level(percent: u8, shown: &Shown, subset: Subset) -> Result<Level, Error> {
    let mut predicted: Vec<_> = shown.frames.iter().filter(|frame| !frame.is_intra()).collect();
    // P before B: the order of the stream, and of the paper's columns.
    predicted.sort_by_key(|frame| (frame.frame_type.code(), frame.number));
    Ok(Level {
        percent,
        units: predicted.iter().map(|frame| (label(frame), frame.bytes)).collect(),
        total_bytes: shown.bytes(),
        gaussians: shown.gaussians(),
        figures: shown.figures(|_| true)?,
        predicted: Some(PredictedLevel { figures: shown.figures(|frame| !frame.is_intra())?, subset }),
    })
}
