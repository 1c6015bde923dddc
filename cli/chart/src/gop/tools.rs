//! What the tools of predicted frames are worth: the GOP without each.

use super::decoded::shown;
use crate::Error;
use crate::columns::{Column, Row, Value, metrics};
use crate::picture_comparison::Judge;
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_encoder::{PredictorChoice, Predictors, Settings, Tools, encode};
use splatstream_format::syntax::FrameType;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::metrics::Comparison;

/// A GOP with some tools.
#[derive(Debug, Clone)]
pub(crate) struct ToolRow {
    /// What it is with or without.
    pub(crate) name: &'static str,
    /// Bytes of predicted frames.
    pub(crate) bytes: u64,
    /// Gaussians of predicted frames.
    pub(crate) gaussians: u64,
    /// Bytes per Gaussian more than with all tools, percent.
    pub(crate) more_percent: f64,
    /// Means over predicted frames, everything decoded.
    pub(crate) figures: Comparison,
}

/// The row with all tools.
const EVERYTHING: &str = "everything";

impl ToolRow {
    /// Bytes per Gaussian of predicted frames.
    pub(crate) fn bytes_per_gaussian(&self) -> f64 {
        self.bytes as f64 / self.gaussians.max(1) as f64
    }
}

impl Row for ToolRow {
    fn columns(_: &[Self]) -> Vec<Column<Self>> {
        let per_gaussian = |row: &Self| Value::number(row.bytes_per_gaussian(), 3);
        let mut columns = vec![
            Column::new("tools", "Tools", |row: &Self| Value::words(row.name)),
            Column::new("inter_bytes", "Size", |row: &Self| Value::Bytes(row.bytes)),
            Column::of_file("inter_gaussians", |row: &Self| Value::Count(row.gaussians)),
            Column::new("bytes_per_gaussian", "Bytes per Gaussian", per_gaussian),
            Column::new("more_percent", "More", |row: &Self| Value::difference(row.more_percent, " %")),
        ];
        columns.extend(metrics(|row: &Self| &row.figures));
        columns
    }

    fn stands_out(&self) -> bool {
        self.name == EVERYTHING
    }
}

/// Everything first.
pub(super) fn rows(
    frames: &mut Vec<GaussianFrame>,
    settings: &Settings,
    judge: &mut Judge<'_>,
) -> Result<Vec<ToolRow>, Error> {
    let with = |tools: Tools| Settings { tools, ..settings.clone() };
    let by = |predictor_choice| Settings { predictor_choice, ..settings.clone() };
    let variants = [
        (EVERYTHING, by(PredictorChoice::Bits)),
        ("without cell-motion", with(Tools { cell_motion: false, ..settings.tools })),
        ("without survivors", with(Tools { survivors: false, ..settings.tools })),
        ("predictor none", Settings { predictors: Predictors::NONE, ..settings.clone() }),
        ("chosen by l1", by(PredictorChoice::Difference)),
    ];
    let rows = variants.iter().map(|(name, settings)| row(name, frames, settings, judge));
    let mut rows: Vec<ToolRow> = rows.collect::<Result<_, _>>()?;
    let everything = rows.first().map_or(0.0, ToolRow::bytes_per_gaussian).max(f64::MIN_POSITIVE);
    for row in &mut rows {
        row.more_percent = 100.0 * (row.bytes_per_gaussian() / everything - 1.0);
    }
    Ok(rows)
}

fn row(
    name: &'static str,
    frames: &mut Vec<GaussianFrame>,
    settings: &Settings,
    judge: &mut Judge<'_>,
) -> Result<ToolRow, Error> {
    let mut stream = Vec::new();
    let report = encode(frames, settings, &mut stream, &mut |_, _| {})?;
    let inter = report.coded.iter().filter(|frame| frame.frame_type != FrameType::Intra);
    let figures = shown(&stream, OperatingPoint::ALL, judge)?.figures(|frame| !frame.is_intra())?;
    Ok(ToolRow {
        name,
        bytes: inter.clone().map(|frame| frame.bytes).sum(),
        gaussians: inter.map(|frame| u64::from(frame.gaussians)).sum(),
        more_percent: 0.0,
        figures,
    })
}
