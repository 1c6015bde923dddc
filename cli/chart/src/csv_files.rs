//! The numbers behind every figure and table, as CSV: one file a kind, all scenes in it.

use super::gop_files;
use super::measure::{Point, Run};
use super::scene_chart::SceneChart;
use super::tables::Mode;
use crate::Error;
use crate::numbers::bits_per_gaussian;
use crate::report::File;
use splatstream_render::metrics::Comparison;

pub(super) const FIGURES: [&str; 6] =
    ["psnr_db", "psnr_masked_db", "yuv_psnr_db", "ssim", "ssim_masked", "st_lpips"];

/// Columns of a mode of playback, which figures follow.
pub(super) const MODE: [&str; 10] =
    ["scene", "mode", "units", "frames", "playback", "percent", "gop_bytes", "mbit_s", "fps", "gaussians"];

/// A file and how it is made.
type CsvFile = (&'static str, fn(&[SceneChart]) -> Vec<Vec<String>>);

const FILES: [CsvFile; 9] = [
    ("points.csv", points),
    ("speed.csv", speed),
    ("operating_points.csv", gop_files::modes),
    ("refinements.csv", refinements),
    ("tools.csv", gop_files::tools),
    ("predictors.csv", gop_files::predictors),
    ("bandwidth.csv", bandwidth),
    ("costs.csv", costs),
    ("peers.csv", peers),
];

/// All files.
pub(super) fn files(scenes: &[SceneChart]) -> Result<Vec<File>, Error> {
    let file = |(name, rows): CsvFile| Ok(File { name: name.to_owned(), bytes: csv(&rows(scenes))? });
    FILES.into_iter().map(file).collect()
}

/// Names of all files.
pub(super) fn names() -> impl Iterator<Item = &'static str> {
    FILES.iter().map(|(name, _)| *name)
}

/// Rows as a file.
pub(super) fn csv(rows: &[Vec<String>]) -> Result<Vec<u8>, Error> {
    let failed = |error: String| Error::other(format!("a table cannot be written as CSV: {error}"));
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.write_record(row).map_err(|error| failed(error.to_string()))?;
    }
    writer.into_inner().map_err(|error| failed(error.to_string()))
}

pub(super) fn headings(first: &[&str], last: &[&str]) -> Vec<String> {
    first.iter().chain(last).map(|&name| name.to_owned()).collect()
}

/// A number, or nothing.
pub(super) fn cell(value: Option<f64>) -> String {
    value.filter(|value| value.is_finite()).map(|value| format!("{value:.6}")).unwrap_or_default()
}

pub(super) fn figures(figures: &Comparison) -> [String; 6] {
    [
        cell(Some(figures.psnr_db)),
        cell(figures.psnr_masked_db),
        cell(Some(figures.yuv_psnr_db)),
        cell(figures.ssim),
        cell(figures.ssim_masked),
        cell(figures.st_lpips),
    ]
}

fn points(scenes: &[SceneChart]) -> Vec<Vec<String>> {
    let first = [
        "scene",
        "group",
        "variant",
        "quality",
        "op",
        "percent",
        "frames",
        "bytes",
        "gaussians_source",
        "gaussians_shown",
        "bpg_source",
        "bpg_shown",
        "mbit_s",
    ];
    let mut rows = vec![headings(&first, &FIGURES)];
    for scene in scenes {
        for run in &scene.runs {
            rows.extend(run.points.iter().map(|point| point_row(scene, run, point)));
        }
    }
    rows
}

fn point_row(scene: &SceneChart, run: &Run, point: &Point) -> Vec<String> {
    let info = &point.info;
    let mut row = vec![
        scene.name.clone(),
        run.group.name().to_owned(),
        run.variant.clone(),
        run.quality.clone(),
        info.point.to_string(),
        info.percent.to_string(),
        info.frames.to_string(),
        info.bytes.to_string(),
        scene.gaussians.to_string(),
        info.gaussians.to_string(),
        cell(Some(scene.rate(point))),
        cell(Some(bits_per_gaussian(info.bytes, info.gaussians))),
        cell(Some(scene.bandwidth(point))),
    ];
    row.extend(figures(&point.figures));
    row
}

fn speed(scenes: &[SceneChart]) -> Vec<Vec<String>> {
    let last = [
        "gaussians",
        "encode_s",
        "encode_s_min",
        "encode_s_max",
        "decode_s",
        "decode_s_min",
        "decode_s_max",
        "psnr_db_at_baseline_rate",
        "bd_rate_percent",
    ];
    let mut rows = vec![headings(&["scene", "group", "variant", "quality"], &last)];
    for scene in scenes {
        let standings = scene.standings();
        for run in &scene.runs {
            // Comparisons are of variants: they stand beside the quality at which they were made.
            let at_quality = standings.iter().filter(|_| run.quality == scene.quality);
            let standing = at_quality.into_iter().find(|standing| standing.name == run.variant);
            let mut row = vec![
                scene.name.clone(),
                run.group.name().to_owned(),
                run.variant.clone(),
                run.quality.clone(),
            ];
            row.push(run.gaussians.to_string());
            for timing in [run.encode, run.decode] {
                row.extend([timing.median, timing.least, timing.most].map(|seconds| cell(Some(seconds))));
            }
            row.push(cell(standing.and_then(|standing| standing.psnr_at_rate)));
            row.push(cell(standing.and_then(|standing| standing.bd_rate)));
            rows.push(row);
        }
    }
    rows
}

fn refinements(scenes: &[SceneChart]) -> Vec<Vec<String>> {
    let first = [
        "scene",
        "frames_coded",
        "percent",
        "units",
        "unit_bytes",
        "added_bytes",
        "total_bytes",
        "gaussians",
        "bpg_shown",
    ];
    let last = [&FIGURES[..], &gop_files::OF_PREDICTED].concat();
    let mut rows = vec![headings(&first, &last)];
    for scene in scenes {
        rows.extend(gop_files::levels(scene));
        for row in scene.refinement_rows() {
            let frames: Vec<String> = (0..row.unit_bytes.len()).map(|frame| format!("I{frame}")).collect();
            let units: Vec<String> = row.unit_bytes.iter().map(u64::to_string).collect();
            let mut cells = headings(&[&scene.name, "intra"], &[]);
            cells.extend([row.percent.to_string(), frames.join(" "), units.join(" ")]);
            cells.extend([row.added_bytes, row.total_bytes, row.gaussians].map(|count| count.to_string()));
            cells.push(cell(Some(row.bpg)));
            cells.extend(figures(&row.figures));
            cells.extend(gop_files::OF_PREDICTED.map(|_| String::new()));
            rows.push(cells);
        }
    }
    rows
}

fn bandwidth(scenes: &[SceneChart]) -> Vec<Vec<String>> {
    let mut rows = vec![headings(&MODE, &FIGURES)];
    for scene in scenes {
        for mode in scene.bandwidth_rows() {
            let mut cells = mode_cells(scene, &mode);
            cells.extend(figures(&mode.figures));
            rows.push(cells);
        }
    }
    rows
}

/// The cells of [`MODE`].
pub(super) fn mode_cells(scene: &SceneChart, mode: &Mode) -> Vec<String> {
    let mut cells = headings(&[&scene.name, &mode.name, &mode.units, &mode.frames, mode.playback], &[]);
    cells.push(mode.percent.map(|percent| percent.to_string()).unwrap_or_default());
    cells.extend([mode.bytes.to_string(), cell(Some(mode.mbit_s)), cell(Some(scene.fps))]);
    cells.push(mode.gaussians.to_string());
    cells
}

fn costs(scenes: &[SceneChart]) -> Vec<Vec<String>> {
    let mut rows = vec![headings(&["scene", "quality", "kind", "part"], &["bpg_coded"])];
    for scene in scenes {
        for run in scene.baseline() {
            let attributes = run.costs.attributes.iter().map(|cost| ("attribute", cost.attribute, cost.bpg));
            let units = run.costs.units.iter().map(|cost| ("unit", cost.kind, cost.bpg));
            rows.extend(attributes.chain(units).map(|(kind, part, bpg)| {
                let names = [scene.name.as_str(), &run.quality, kind, part];
                headings(&names, &[&cell(Some(bpg))])
            }));
        }
    }
    rows
}

fn peers(scenes: &[SceneChart]) -> Vec<Vec<String>> {
    let first = [
        "scene",
        "peer",
        "details",
        "bytes",
        "frames",
        "frames_judged",
        "bpg_source",
        "encode_gaussians_per_s",
        "decode_gaussians_per_s",
        "timing",
        "command",
    ];
    let mut rows = vec![headings(&first, &FIGURES)];
    for scene in scenes {
        for peer in &scene.peers {
            let mut cells = vec![scene.name.clone(), peer.peer.clone(), peer.details.clone()];
            cells.extend([peer.bytes.to_string(), peer.frames.to_string(), peer.judged.to_string()]);
            cells.extend([Some(peer.bpg), peer.encode_speed, peer.decode_speed].map(cell));
            cells.extend([peer.timing.clone(), peer.command.clone()]);
            cells.extend(figures(&peer.figures));
            rows.push(cells);
        }
    }
    rows
}
