//! The way of a sequence to a stream: what was asked for, reached in one pass over the frames or in several.

use crate::checked::{CheckedSource, named};
use crate::error::Error;
use crate::importance::Ranking;
use crate::pass::encode_once;
use crate::progress::Progress;
use crate::prune::PrunedSource;
use crate::report::Report;
use crate::sequence;
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
            sequence::check(settings)?;
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
