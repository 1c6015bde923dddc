//! The numbers behind every figure and table, as CSV: one file a kind, all scenes in it.

use super::measure::{Point, Run};
use super::scene_chart::SceneChart;
use crate::Error;
use crate::columns::{Column, Row, Value, csv, metrics};
use crate::gop::Gop;
use crate::numbers::bits_per_gaussian;
use crate::report::File;
use splatstream_decoder::operating_point::OperatingPointInfo;
use splatstream_render::metrics::Comparison;

/// A file and how it is made.
type CsvFile = (&'static str, fn(&[SceneChart]) -> Result<Vec<u8>, Error>);

const FILES: [CsvFile; 10] = [
    ("points.csv", |scenes| table(scenes, points)),
    ("speed.csv", |scenes| table(scenes, SceneChart::runs_compared)),
    ("front.csv", |scenes| table(scenes, |scene| scene.fronts.concat())),
    ("operating_points.csv", |scenes| table(scenes, |scene| of_gop(scene, |gop| gop.modes.clone()))),
    ("refinements.csv", |scenes| {
        table(scenes, |scene| [of_gop(scene, |gop| gop.levels.clone()), scene.intra_levels()].concat())
    }),
    ("tools.csv", |scenes| table(scenes, |scene| of_gop(scene, |gop| gop.tools.clone()))),
    ("predictors.csv", |scenes| table(scenes, |scene| of_gop(scene, |gop| gop.ablation.clone()))),
    ("bandwidth.csv", |scenes| table(scenes, SceneChart::intra_modes)),
    ("costs.csv", |scenes| table(scenes, costs)),
    ("peers.csv", |scenes| table(scenes, |scene| scene.peers.clone())),
];

/// All files.
pub(super) fn files(scenes: &[SceneChart]) -> Result<Vec<File>, Error> {
    let file = |(name, bytes): CsvFile| Ok(File { name: name.to_owned(), bytes: bytes(scenes)? });
    FILES.into_iter().map(file).collect()
}

/// Names of all files.
pub(super) fn names() -> impl Iterator<Item = &'static str> {
    FILES.iter().map(|(name, _)| *name)
}

fn table<R: Row>(scenes: &[SceneChart], rows: fn(&SceneChart) -> Vec<R>) -> Result<Vec<u8>, Error> {
    csv(scenes.iter().map(|scene| (scene.name.as_str(), rows(scene))))
}

/// Rows of the first GOP; none if the scene has one frame.
fn of_gop<R>(scene: &SceneChart, rows: fn(&Gop) -> Vec<R>) -> Vec<R> {
    scene.gop.as_ref().map_or_else(Vec::new, rows)
}

/// An operating point of a run.
struct PointRow {
    group: &'static str,
    variant: String,
    quality: String,
    info: OperatingPointInfo,
    /// Gaussians of the source over the frames measured, and bits per one of them.
    gaussians_source: u64,
    bpg_source: f64,
    /// None if the scene stands still.
    mbit_s: Option<f64>,
    figures: Comparison,
}

impl Row for PointRow {
    fn columns(_: &[Self]) -> Vec<Column<Self>> {
        let shown = |row: &Self| Value::number(bits_per_gaussian(row.info.bytes, row.info.gaussians), 2);
        let mut columns = vec![
            Column::of_file("group", |row: &Self| Value::words(row.group)),
            Column::of_file("variant", |row: &Self| Value::words(&row.variant)),
            Column::of_file("quality", |row: &Self| Value::words(&row.quality)),
            Column::of_file("op", |row: &Self| Value::words(row.info.point.to_string())),
            Column::of_file("percent", |row: &Self| Value::Percent(row.info.percent)),
            Column::of_file("frames", |row: &Self| Value::Count(row.info.frames.into())),
            Column::of_file("bytes", |row: &Self| Value::Bytes(row.info.bytes)),
            Column::of_file("gaussians_source", |row: &Self| Value::Count(row.gaussians_source)),
            Column::of_file("gaussians_shown", |row: &Self| Value::Count(row.info.gaussians)),
            Column::of_file("bpg_source", |row: &Self| Value::number(row.bpg_source, 2)),
            Column::of_file("bpg_shown", shown),
            Column::of_file("mbit_s", |row: &Self| Value::number(row.mbit_s, 2)),
        ];
        columns.extend(metrics(|row: &Self| &row.figures));
        columns
    }
}

fn points(scene: &SceneChart) -> Vec<PointRow> {
    let row = |run: &Run, point: &Point| PointRow {
        group: run.group.name(),
        variant: run.variant.clone(),
        quality: run.quality.clone(),
        info: point.info,
        gaussians_source: scene.gaussians,
        bpg_source: scene.rate(point),
        mbit_s: scene.bandwidth(point),
        figures: point.figures,
    };
    scene.runs.iter().flat_map(|run| run.points.iter().map(move |point| row(run, point))).collect()
}

/// What an attribute or a kind of unit costs.
struct CostRow {
    quality: String,
    kind: &'static str,
    part: &'static str,
    /// Bits per coded Gaussian.
    bpg: f64,
}

impl Row for CostRow {
    fn columns(_: &[Self]) -> Vec<Column<Self>> {
        vec![
            Column::of_file("quality", |row: &Self| Value::words(&row.quality)),
            Column::of_file("kind", |row: &Self| Value::words(row.kind)),
            Column::of_file("part", |row: &Self| Value::words(row.part)),
            Column::of_file("bpg_coded", |row: &Self| Value::number(row.bpg, 3)),
        ]
    }
}

fn costs(scene: &SceneChart) -> Vec<CostRow> {
    let of_run = |run: &Run| {
        let attributes = run.costs.attributes.iter().map(|cost| ("attribute", cost.attribute, cost.bpg));
        let units = run.costs.units.iter().map(|cost| ("unit", cost.kind, cost.bpg));
        let row = |(kind, part, bpg)| CostRow { quality: run.quality.clone(), kind, part, bpg };
        attributes.chain(units).map(row).collect::<Vec<_>>()
    };
    scene.baseline().flat_map(of_run).collect()
}
