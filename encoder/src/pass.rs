//! One pass over a sequence: what holds for all frames, the beginning of the stream, its GOPs, its end.

use crate::error::Error;
use crate::importance::Ranking;
use crate::plan::Plan;
use crate::progress::Progress;
use crate::report::Report;
use crate::settings::Settings;
use crate::source::FrameSource;
use crate::verification::Tried;
use crate::writer::Coded;
use std::io::Write;

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
        alone = plan.better_alone(source, coded, report)?;
        Ok(alone.is_none())
    };
    let judge: Option<crate::spans::Judge<'_>> = match settings.may_predict() {
        true => Some(&mut judge),
        false => None,
    };
    if let Some(report) = plan.encode_judged(source, (all.clone(), None), sink, progress, judge)? {
        return Ok(report);
    }
    let alone = alone.ok_or(Error::Fault("a plan was refused, and there is no other"))?;
    let report = alone.encode(source, (all, None), sink, progress)?;
    Ok(Report { stands_alone: true, ..report })
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
    plan.encode(source, (all, None), sink, progress)
}
