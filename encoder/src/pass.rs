//! One pass over a sequence: what holds for all frames, the beginning of the stream, its GOPs, its end.

use crate::error::Error;
use crate::frame::learning;
use crate::gop::SequenceCoder;
use crate::importance::Ranking;
use crate::progress::Progress;
use crate::report::Report;
use crate::sequence::analyse;
use crate::settings::Settings;
use crate::source::FrameSource;
use crate::verification::Verifier;
use crate::writer::{Record, UnitWriter};
use splatstream_format::Limits;
use splatstream_format::syntax::FrameType;
use std::io::Write;

/// Where a sequence takes more than this part of what its I frames let expect of I frames alone, these are tried.
const DOUBTFUL: f64 = 0.6;

/// Frames that each stand for themselves, without layers, are preferred to a stream that takes more than this times as
/// many bytes.
const LARGER: f64 = 1.005;

/// Encodes with the steps of the settings: no larger than if each frame stood for itself. Who gives the steps and no goal
/// has the layers of the settings in any case.
///
/// # Errors
/// As [`encode`](crate::encode).
pub(crate) fn encode_smaller(
    source: &mut dyn FrameSource,
    settings: &Settings,
    ranking: Ranking,
    progress: Progress<'_>,
) -> Result<(Vec<u8>, Report), Error> {
    let mut bytes = Vec::new();
    let report = encode_once(source, settings, ranking.clone(), &mut bytes, progress)?;
    if !is_doubtful(&report, settings) {
        return Ok((bytes, report));
    }
    let mut smaller = Vec::new();
    let mut report_alone = encode_once(source, &settings.clone().alone(), ranking, &mut smaller, progress)?;
    if bytes.len() as f64 <= LARGER * smaller.len() as f64 {
        return Ok((bytes, report));
    }
    report_alone.stands_alone = true;
    Ok((smaller, report_alone))
}

/// Whether frames that each stand for themselves might take fewer bytes than a sequence did.
fn is_doubtful(report: &Report, settings: &Settings) -> bool {
    let of = |counts: fn(FrameType) -> bool| {
        let frames = report.coded.iter().filter(|frame| counts(frame.frame_type));
        frames.fold((0.0, 0.0), |sum, frame| (sum.0 + frame.bytes as f64, sum.1 + f64::from(frame.gaussians)))
    };
    let (all, intra) = (of(|_| true), of(|kind| kind == FrameType::Intra));
    let may_predict = settings.temporal_layers() > 0 && settings.tools.survivors && report.frames > 1;
    may_predict && all.0 * intra.1 > DOUBTFUL * intra.0 * all.1
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
    let mut record = Record::new(settings.profile(), &analysis.parameters);
    record.verifier = is_verified.then(|| Verifier::new(source.len()));
    let mut writer = UnitWriter::new(sink, &mut record);
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
    writer.finish()?;
    (report.bytes, report.gops) = (record.offset, record.gops);
    report.pictures = record.verifier.map(|verifier| verifier.compare(source, settings)).transpose()?;
    Ok(report)
}
