//! The way of a sequence to a stream: what was asked for, reached in one pass over the frames or in several.

use crate::checked::{CheckedSource, named};
use crate::error::Error;
use crate::importance::Ranking;
use crate::pass::encode_once;
use crate::progress::Progress;
use crate::report::Report;
use crate::settings::Settings;
use crate::source::FrameSource;
use crate::target;
use std::io::Write;

/// Encodes all frames of `source` to `sink`.
///
/// # Errors
/// Settings or frames that cannot be coded, a source that cannot be read, a sink that cannot be written.
pub fn encode(
    source: &mut dyn FrameSource,
    settings: &Settings,
    sink: &mut dyn Write,
    progress: Progress<'_>,
) -> Result<Report, Error> {
    let mut source = CheckedSource::new(source, settings.drop_invalid);
    let has_target = settings.psnr.is_some() || settings.size.is_some();
    let encoded = match has_target && !source.is_empty() {
        true => target::reach(&mut source, settings, sink, progress),
        false => encode_once(&mut source, settings, Ranking::new(settings), sink, progress),
    };
    let mut report = encoded.map_err(named)?;
    report.leave_out(source.into_dropped());
    Ok(report)
}
