//! One pass over a sequence: what holds for all frames, the beginning of the stream, its GOPs, its end.

use crate::error::Error;
use crate::importance::Ranking;
use crate::plan::Plan;
use crate::progress::Progress;
use crate::report::Report;
use crate::settings::Settings;
use crate::source::FrameSource;
use crate::spans::Span;
use crate::verification::Tried;
use crate::writer::Coded;
use splatstream_format::syntax::FrameType;
use std::io::Write;

/// Where the first GOP takes more than this part of what its I frames let expect of I frames alone, these are tried.
const DOUBTFUL: f64 = 0.6;

/// Frames that each stand for themselves, without layers, are preferred to a stream that takes more than this times as
/// many bytes.
const LARGER: f64 = 1.005;

/// Encodes with the steps of the settings: frames stand for themselves where the first GOP is no smaller otherwise. Who gives
/// the steps and no goal has the layers of the settings in any case. `tried`: what fitting has seen with these steps.
///
/// # Errors
/// As [`encode`](fn@crate::encode).
pub(crate) fn encode_smaller(
    source: &mut dyn FrameSource,
    settings: &Settings,
    (ranking, tried): (Ranking, Option<Tried>),
    sink: &mut dyn Write,
    progress: Progress<'_>,
) -> Result<Report, Error> {
    let plan = Plan::new(source, settings, settings.clone(), ranking)?.with_tried(tried);
    let all = 0..source.len();
    let mut alone = None;
    let mut judge = |source: &mut dyn FrameSource, coded: &Coded, report: &Report| {
        alone = is_better_alone(&plan, source, coded, report)?;
        Ok(alone.is_none())
    };
    let judge: Option<crate::spans::Judge<'_>> = match settings.may_predict() {
        true => Some(&mut judge),
        false => None,
    };
    if let Some(report) = plan.encode(source, (all.clone(), None), sink, progress, judge)? {
        return Ok(report);
    }
    let Some(alone) = alone else { return Err(Error::NoFrames) };
    let report = alone.encode(source, (all, None), sink, progress, None)?;
    Ok(Report { stands_alone: true, ..report.unwrap_or_default() })
}

/// The plan with frames that stand for themselves, if the first GOP is smaller with it. `coded` and `report`: the first
/// GOP with `plan`.
///
/// # Errors
/// As [`encode`](fn@crate::encode).
pub(crate) fn is_better_alone(
    plan: &Plan,
    source: &mut dyn FrameSource,
    coded: &Coded,
    report: &Report,
) -> Result<Option<Plan>, Error> {
    if !is_doubtful(report) {
        return Ok(None);
    }
    let alone = plan.alone(source)?;
    let (smaller, _) = alone.code(source, Span { first: 0, end: report.coded.len() as u32 })?;
    Ok((coded.bytes() as f64 > LARGER * smaller.bytes() as f64).then_some(alone))
}

/// Whether frames that each stand for themselves might take fewer bytes than a GOP did.
fn is_doubtful(report: &Report) -> bool {
    let of = |counts: fn(FrameType) -> bool| {
        let frames = report.coded.iter().filter(|frame| counts(frame.frame_type));
        frames.fold((0.0, 0.0), |sum, frame| (sum.0 + frame.bytes as f64, sum.1 + f64::from(frame.gaussians)))
    };
    let (all, intra) = (of(|_| true), of(|kind| kind == FrameType::Intra));
    report.coded.len() > 1 && all.0 * intra.1 > DOUBTFUL * intra.0 * all.1
}

/// Encodes with the steps and the layers of the settings.
pub(crate) fn encode_once(
    source: &mut dyn FrameSource,
    settings: &Settings,
    ranking: Ranking,
    sink: &mut dyn Write,
    progress: Progress<'_>,
) -> Result<Report, Error> {
    let plan = Plan::new(source, settings, settings.clone(), ranking)?;
    let all = 0..source.len();
    let report = plan.encode(source, (all, None), sink, progress, None)?;
    Ok(report.unwrap_or_default())
}
