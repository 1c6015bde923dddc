//! This codec on a sample: what it says, and what it falls back to.

use super::attempt::Attempt;
use super::sample::Sample;
use super::{Warning, Warnings};
use crate::numbers::{counted, percent};
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::{Summary, decode_stream};
use splatstream_encoder::{FrameReport, Quality, Report, Settings, Structure, encode};
use splatstream_format::syntax::FrameType;
use splatstream_gaussians::GaussianFrame;
use std::ops::ControlFlow;

/// Spatial and temporal layers of a sequence, as `splatstream encode` has them without options.
const SPATIAL: u8 = 3;
const TEMPORAL: u8 = 2;

/// Warnings that say nothing of worse pictures.
const REMARKS: [&str; 3] = ["psnr-exceeded", "size-missed", "short-gops"];

/// How much coarser positions, and how many more new Gaussians, make a remark.
const COARSER: f64 = 2.0;
const MORE_NEW: f64 = 5.0;

/// Codes a sample with the defaults, or every frame by itself.
pub(super) fn attempt(sample: &Sample, intra: bool, plain: Option<&Report>, said: Warnings<'_>) -> Attempt {
    let mut stream = Vec::new();
    let settings = settings(sample, intra);
    match encode(&mut sample.frames.clone(), &settings, &mut stream, &mut |_, _| {}) {
        Err(error) => Attempt { detected: vec![format!("encoder refuses: {error}")], ..Attempt::default() },
        Ok(report) => {
            let (shown, detected) = decoded(&stream, sample.frames.len());
            let (remarks, serious): (Vec<Warning>, Vec<Warning>) =
                said(&report, &settings).into_iter().partition(|warning| REMARKS.contains(&warning.code));
            let of_encoder = |warning: Warning| format!("encoder: {}", warning.message);
            let mut fallback = fallback(&report, sample, plain);
            fallback.extend(remarks.into_iter().map(|warning| warning.message));
            Attempt {
                shown,
                bytes: Some(report.bytes),
                detected: serious.into_iter().map(of_encoder).chain(detected).collect(),
                fallback,
                coded: Some((stream, report)),
            }
        }
    }
}

fn settings(sample: &Sample, intra: bool) -> Settings {
    let frames = sample.frames.len() as u32;
    let psnr = Some(Quality::default().decibels());
    let whole = Settings { psnr, verify: true, ..Settings::default() };
    if intra || frames == 1 {
        return whole;
    }
    let (layers, gop) = if sample.one_chain { (1, frames) } else { (TEMPORAL, whole.gop) };
    Settings { structure: Structure::Predicted { layers }, spatial_layers: SPATIAL, gop, ..whole }
}

/// The frames of a stream by their numbers, and what the decoder says of damage.
pub(super) fn decoded(stream: &[u8], frames: usize) -> (Vec<Option<GaussianFrame>>, Option<String>) {
    let (mut shown, mut broken) = (vec![None; frames], None);
    let summary = decode_stream(stream, &Options::default(), |sequence, frame| {
        if let Some(place) = shown.get_mut(frame.index as usize) {
            match to_gaussians(frame.into_shown(), sequence) {
                Ok(frame) => *place = Some(frame),
                Err(error) => broken = Some(format!("decoder: {error}")),
            }
        }
        ControlFlow::Continue(())
    });
    (shown, broken.or_else(|| detected(&summary)))
}

/// The verdict of the decoder and what it costs; none of a whole stream.
fn detected(summary: &Summary) -> Option<String> {
    let first = summary.verdict()?;
    let lost: u32 = summary.lost.iter().map(|range| range.end() - range.start() + 1).sum();
    let (errors, lost) = (counted(summary.errors.len() as u64, "error"), counted(lost.into(), "frame"));
    Some(format!("decoder: {errors}, the first {}; {lost} lost", first.kind.code()))
}

/// What the report says was done otherwise than on the base.
fn fallback(report: &Report, sample: &Sample, plain: Option<&Report>) -> Vec<String> {
    let mut remarks = Vec::new();
    if report.invisible > 0 {
        remarks.push(format!("{} left out", counted(report.invisible, "invisible Gaussian")));
    }
    let Some(plain) = plain else { return remarks };
    let coarser = f64::from(report.position_step) / sample.unit() / f64::from(plain.position_step);
    if coarser >= COARSER {
        remarks.push(format!("position step {coarser:.0} times as large"));
    }
    let intra = |frame: &&FrameReport| frame.frame_type == FrameType::Intra;
    let [more, usual] = [report, plain].map(|report| report.coded.iter().filter(intra).count());
    if more > usual {
        remarks.push(format!("I frames: {more} of {}", counted(report.frames.into(), "frame")));
    }
    let [more, usual] = [report, plain].map(new_percent);
    if more > usual + MORE_NEW {
        remarks.push(format!("{more:.0} % of the Gaussians of predicted frames are new"));
    }
    remarks
}

/// Share of new Gaussians in predicted frames.
fn new_percent(report: &Report) -> f64 {
    let predicted = || report.coded.iter().filter(|frame| frame.frame_type != FrameType::Intra);
    let new = predicted().map(|frame| u64::from(frame.new)).sum();
    percent(new, predicted().map(|frame| u64::from(frame.gaussians)).sum())
}
