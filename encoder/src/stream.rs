//! The way of a sequence to a stream: what holds for all frames, the beginning of the stream, its GOPs, its end.

use crate::checked::{CheckedSource, named};
use crate::error::Error;
use crate::frame::learning;
use crate::gop::SequenceCoder;
use crate::importance::Ranking;
use crate::report::Report;
use crate::sequence::analyse;
use crate::settings::Settings;
use crate::source::FrameSource;
use crate::target;
use crate::verification::Verifier;
use crate::writer::{UnitWriter, Written};
use splatstream_format::Limits;
use std::io::Write;

/// Called after every frame with frames done and frames in all. Where the quality or the size of the stream is given,
/// frames may be encoded several times.
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
    let mut source = CheckedSource::new(source, settings.drop_invalid);
    let has_target = settings.psnr.is_some() || settings.size.is_some();
    let encoded = match has_target && !source.is_empty() {
        true => target::reach(&mut source, settings, sink, progress),
        false => encode_once(&mut source, settings, Ranking::new(settings), sink, progress),
    };
    let mut report = encoded.map_err(named)?;
    report.dropped = source.into_dropped();
    report.invisible -= report.dropped.iter().map(|dropped| u64::from(dropped.gaussians)).sum::<u64>();
    Ok(report)
}

/// Encodes with the steps of the settings.
pub(crate) fn encode_once(
    source: &mut dyn FrameSource,
    settings: &Settings,
    mut ranking: Ranking,
    sink: &mut dyn Write,
    progress: Progress<'_>,
) -> Result<Report, Error> {
    let analysis = analyse(source, settings)?;
    let mut report = Report::new(&analysis, settings, ranking.importance());
    let is_verified = settings.verify || settings.psnr.is_some() || settings.size.is_some();
    let verifier = is_verified.then(|| Verifier::new(source.len()));
    let mut writer = UnitWriter::new(sink, settings.profile(), &analysis.parameters).with(verifier);
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
        looked_at: 0,
    };
    coder.run(progress)?;
    let Written { bytes, gops, verifier } = writer.finish()?;
    (report.bytes, report.gops) = (bytes, gops);
    report.pictures = verifier.map(|verifier| verifier.compare(source, settings)).transpose()?;
    Ok(report)
}
