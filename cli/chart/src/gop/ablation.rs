//! What each predictor of new Gaussians is worth, and each part of the network: one row a way to encode the GOP.

use super::decoded::shown;
use crate::Error;
use crate::Progress;
use crate::columns::{Column, Row, Value, metrics};
use crate::picture_comparison::Judge;
use crate::statistics::stream_statistics;
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_decoder::predictor::Predictor;
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::decode_stream;
use splatstream_encoder::transformer::Architecture;
use splatstream_encoder::{NetworkSource, PredictorChoice, Predictors, Settings, ShChoice, encode};
use splatstream_format::Limits;
use splatstream_format::entropy::layout::{Attribute, Section};
use splatstream_format::syntax::{FrameType, UnitType};
use splatstream_gaussians::GaussianFrame;
use splatstream_render::metrics::Comparison;
use std::ops::ControlFlow;
use std::time::Instant;

/// Rows that [`rows`] gives.
pub(crate) const ROWS: u32 = 22;

/// The GOP with one choice of predictors.
#[derive(Debug, Clone)]
pub(crate) struct AblationRow {
    /// What new Gaussians are predicted by.
    pub(crate) name: &'static str,
    /// Bytes of predicted frames.
    pub(crate) bytes: u64,
    /// Bytes of the network.
    pub(crate) network_bytes: u64,
    /// Gaussians new in units with predictors or without, of all frames.
    pub(crate) new: u64,
    /// Those that the network predicts, percent.
    pub(crate) learned_percent: f64,
    /// Bits a new Gaussian of dc and of sh, models included.
    pub(crate) dc_bits: f64,
    pub(crate) sh_bits: f64,
    /// Decoding the GOP, milliseconds, the best of three.
    pub(crate) decode_ms: f64,
    /// Means over predicted frames.
    pub(crate) figures: Comparison,
}

impl Row for AblationRow {
    fn columns(_: &[Self]) -> Vec<Column<Self>> {
        let learned = |row: &Self| Value::Number(row.learned_percent, 1, " %");
        let mut columns = vec![
            Column::new("predictors", "Predictors", |row: &Self| Value::words(row.name)),
            Column::new("inter_bytes", "Size", |row: &Self| Value::Bytes(row.bytes)),
            Column::new("network_bytes", "Network", |row: &Self| Value::Bytes(row.network_bytes)),
            Column::of_file("new_gaussians", |row: &Self| Value::Count(row.new)),
            Column::new("learned_percent", "Learned", learned),
            Column::new("dc_bits", "Bits of dc", |row: &Self| Value::number(row.dc_bits, 3)),
            Column::new("sh_bits", "Bits of sh", |row: &Self| Value::number(row.sh_bits, 3)),
            Column::new("decode_ms", "Decoding", |row: &Self| Value::Number(row.decode_ms, 1, " ms")),
        ];
        columns.extend(metrics(|row: &Self| &row.figures));
        columns
    }
}

/// A name, and how it changes the settings.
type Variant = (&'static str, Settings);

/// Each predictor alone, and together; then the network with parts left out or changed.
fn variants(settings: &Settings) -> Vec<Variant> {
    // Entries of codebooks stand for whole values, not for what a prediction leaves.
    let with =
        |predictors: Predictors| Settings { predictors, sh: ShChoice::Coefficients, ..settings.clone() };
    let whole = Architecture::default();
    let network = |architecture: Architecture| Settings {
        network: Some(NetworkSource::Trained(architecture)),
        ..with(Predictors::always(Predictor::Transformer))
    };
    let neighbours = |neighbours: u8, settings: Settings| Settings { neighbours, ..settings };
    let transformer = || network(whole);
    let classic = Predictors::one(Predictor::Knn).and(Predictors::one(Predictor::Bilateral));
    let trained = Settings { network: Some(NetworkSource::Fitted), ..with(Predictors::ALL) };
    vec![
        ("none", with(Predictors::NONE)),
        ("knn", with(Predictors::always(Predictor::Knn))),
        ("bilateral", with(Predictors::always(Predictor::Bilateral))),
        ("transformer", transformer()),
        ("transformer, bilateral base", network(Architecture { knn_base: false, ..whole })),
        (
            "transformer, registered network",
            Settings { network: Some(NetworkSource::Registered), ..transformer() },
        ),
        ("auto without transformer", with(classic)),
        ("auto", trained.clone()),
        ("auto, an index for each", Settings { predictor_choice: PredictorChoice::Difference, ..trained }),
        ("bilateral, 4 neighbours", neighbours(4, with(Predictors::always(Predictor::Bilateral)))),
        ("bilateral, 16 neighbours", neighbours(16, with(Predictors::always(Predictor::Bilateral)))),
        ("transformer, 4 neighbours", neighbours(4, transformer())),
        ("transformer, 16 neighbours", neighbours(16, transformer())),
        ("width 8", network(Architecture { width_log2: 3, ..whole })),
        ("width 32", network(Architecture { width_log2: 5, feed_forward_width: 64, ..whole })),
        ("full attention", network(Architecture { full_attention: true, ..whole })),
        ("without relative-position bias", network(Architecture { fourier_count: 0, ..whole })),
        ("with gate", network(Architecture { gated: true, ..whole })),
        ("with rank embedding", network(Architecture { rank_count: 8, ..whole })),
        ("with normalisation", network(Architecture { normalised: true, ..whole })),
        ("without geometry network", network(Architecture { geometry_width: 0, ..whole })),
        ("without feed-forward block", network(Architecture { feed_forward_width: 0, ..whole })),
    ]
}

/// Every variant of the GOP.
pub(super) fn rows(
    frames: &mut Vec<GaussianFrame>,
    settings: &Settings,
    judge: &mut Judge<'_>,
    progress: &dyn Progress,
) -> Result<Vec<AblationRow>, Error> {
    let mut rows = Vec::new();
    for (name, settings) in variants(settings) {
        progress.step(format!("predictors: {name}"));
        rows.push(row(name, frames, &settings, judge)?);
        progress.advance();
    }
    Ok(rows)
}

fn row(
    name: &'static str,
    frames: &mut Vec<GaussianFrame>,
    settings: &Settings,
    judge: &mut Judge<'_>,
) -> Result<AblationRow, Error> {
    let mut stream = Vec::new();
    let report = encode(frames, settings, &mut stream, &mut |_, _| {})?;
    let statistics = stream_statistics(&stream, &Limits::default())?;
    let new: u64 = report.coded.iter().map(|frame| u64::from(frame.new)).sum();
    let learned: u64 = report.coded.iter().map(|frame| frame.predicted[3]).sum();
    let bits = |attribute: Attribute| -> f64 {
        let costs = statistics.sections.iter();
        let costs = costs.filter(|cost| cost.section == Section::New && cost.attribute == attribute);
        costs.map(|cost| cost.symbol_bits + cost.model_bits as f64).sum::<f64>() / new.max(1) as f64
    };
    let weights = statistics.units.iter().filter(|cost| cost.unit_type == UnitType::Weights);
    let inter = report.coded.iter().filter(|frame| frame.frame_type != FrameType::Intra);
    Ok(AblationRow {
        name,
        bytes: inter.map(|frame| frame.bytes).sum(),
        network_bytes: weights.map(|cost| cost.bytes).sum(),
        new,
        learned_percent: 100.0 * learned as f64 / new.max(1) as f64,
        dc_bits: bits(Attribute::Dc),
        sh_bits: bits(Attribute::Sh),
        decode_ms: decode_ms(&stream)?,
        figures: shown(&stream, OperatingPoint::ALL, judge)?.figures(|frame| !frame.is_intra())?,
    })
}

/// The best of three: noise only adds.
fn decode_ms(stream: &[u8]) -> Result<f64, Error> {
    let options = Options { verify: false, ..Options::default() };
    let mut best = f64::MAX;
    for _ in 0..3 {
        let start = Instant::now();
        let summary = decode_stream(stream, &options, |_, _| ControlFlow::Continue(()));
        summary.verdict().map_or(Ok(()), |error| Err(Error::Stream(error)))?;
        best = best.min(start.elapsed().as_secs_f64() * 1000.0);
    }
    Ok(best)
}
