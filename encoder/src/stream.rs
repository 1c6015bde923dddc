//! The way of a sequence to a stream, or to the plan of one: what was asked for, reached in one pass over the frames or in
//! several.

use crate::checked::{CheckedSource, named};
use crate::error::Error;
use crate::importance::Ranking;
use crate::pass::encode_once;
use crate::plan::Plan;
use crate::progress::Progress;
use crate::prune::{PrunedSource, refuse_pruning};
use crate::report::Report;
use crate::sequence::check;
use crate::settings::Settings;
use crate::source::FrameSource;
use crate::target;
use std::io::Write;

/// Encodes all frames of `source` to `sink`. GOPs are coded several at a time, as many as there are threads and as the
/// [memory](Settings::gop_memory) is for; their bytes are those of any other number of threads. But for a stream whose
/// [size](Settings::size) is given, of which a copy is kept, memory does not grow with the number of frames.
///
/// # Errors
/// Settings or frames that cannot be coded, a source that cannot be read, a sink that cannot be written.
pub fn encode(
    source: &mut dyn FrameSource,
    settings: &Settings,
    sink: &mut dyn Write,
    progress: Progress<'_>,
) -> Result<Report, Error> {
    let mut source = CheckedSource::new(source, settings);
    let mut report = match settings.prune {
        None => encode_checked(&mut source, settings, sink, progress)?,
        Some(least) => {
            // Before anything is weighed for what no stream can carry.
            check(settings)?;
            let mut pruned = PrunedSource::new(&mut source, settings, least);
            let mut report = encode_checked(&mut pruned, settings, sink, progress)?;
            report.leave_pruned_out(pruned.into_pruned());
            report
        }
    };
    report.leave_out(source.into_dropped());
    Ok(report)
}

fn encode_checked(
    source: &mut dyn FrameSource,
    settings: &Settings,
    sink: &mut dyn Write,
    progress: Progress<'_>,
) -> Result<Report, Error> {
    let encoded = match settings.has_target() && !source.is_empty() {
        true => target::reach(source, settings, sink, progress),
        false => encode_once(source, settings, Ranking::new(settings), sink, progress),
    };
    encoded.map_err(named)
}

/// Looks at every frame once, finds steps for the quality or the size that is asked for, and codes the first GOP, which
/// shows whether frames are predicted at all.
///
/// For a [size](Settings::size) the whole sequence is encoded, several times: with a plan, only the last of these
/// encodings is shared among machines.
///
/// # Errors
/// Settings or frames that cannot be coded, a source that cannot be read.
pub fn plan(source: &mut dyn FrameSource, settings: &Settings) -> Result<Plan, Error> {
    let mut source = CheckedSource::new(source, settings).with_digests();
    let plan = planned(&mut source, settings).map_err(named)?;
    Ok(plan.with_frame_digests(source.into_digests()))
}

fn planned(source: &mut dyn FrameSource, asked: &Settings) -> Result<Plan, Error> {
    check(asked)?;
    refuse_pruning(asked)?;
    if !asked.has_target() || source.is_empty() {
        return Plan::new(source, asked, asked.clone(), Ranking::new(asked));
    }
    let (settings, ranking, found) = target::fit(source, asked)?;
    let may_predict = settings.may_predict();
    let mut plan = Plan::new(source, asked, settings, ranking)?;
    let Some(first) = plan.spans(0..source.len()).next() else { return Ok(plan) };
    if may_predict {
        let (coded, report) = plan.code(source, first)?;
        if let Some(alone) = plan.better_alone(source, &coded, &report)? {
            plan = alone;
        }
    }
    Ok(plan.with_target(found))
}
