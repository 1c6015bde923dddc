//! The way of a sequence to a stream: what holds for all frames, the beginning of the stream, its GOPs, its end.

use crate::allocation;
use crate::canonical::{canonicalise, visible};
use crate::error::Error;
use crate::frame::learning;
use crate::gop::SequenceCoder;
use crate::importance::Ranking;
use crate::report::Report;
use crate::sequence::analyse;
use crate::settings::Settings;
use crate::source::FrameSource;
use crate::writer::UnitWriter;
use splatstream_format::Limits;
use std::io::Write;

/// Called after every frame with frames done and frames in all.
pub type Progress<'a> = &'a mut dyn FnMut(u32, u32);

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
    let mut ranking = Ranking::new(settings);
    let settings = &fitted(source, settings, &mut ranking)?;
    let analysis = analyse(source, settings)?;
    let mut report = Report::new(&analysis, settings, ranking.importance());
    let mut writer = UnitWriter::new(sink, settings.profile(), &analysis.parameters);
    writer.start(&analysis, &settings.description)?;
    let network = learning::network(source, settings, &analysis)?;
    let coder = SequenceCoder {
        source,
        settings,
        sequence: analysis.parameters,
        ranking: &mut ranking,
        writer: &mut writer,
        report: &mut report,
        network,
        limits: Limits::of_level(analysis.level),
        recorder: None,
    };
    coder.run(progress)?;
    report.bytes = writer.finish()?;
    Ok(report)
}

/// The settings with steps that reach the quality asked for on the first frame.
fn fitted(
    source: &mut dyn FrameSource,
    settings: &Settings,
    ranking: &mut Ranking,
) -> Result<Settings, Error> {
    let mut settings = settings.clone();
    if let Some(decibels) = settings.psnr
        && !source.is_empty()
    {
        let first = source.frame(0).map_err(|source| Error::Source { frame: 0, source })?;
        let shown = visible(&first, settings.keep_invisible);
        let frame = canonicalise(&first, &shown, true);
        let order = ranking.order_first(&frame);
        let spacing = ranking.spacing(&order, &settings);
        settings.steps = allocation::fit(frame, spacing, &settings, decibels);
    }
    Ok(settings)
}
