//! `splatstream chart --stability`: scenes and sequences made to break codecs, and where each tool fails.
//!
//! A [case](cases) turns a [base](base) into a [sample](sample) of a strength; each [tool](tools) codes it; the result is
//! judged by its pictures from cameras around the inner scene, against what the same tool gives for the base itself.
//! What is missed without a word of the tool is a silent failure.

mod base;
mod cases;
mod dice;
mod edits;
mod figures;
mod files;
mod loss;
mod measure;
mod ours;
mod page;
mod peers;
mod rows;
mod sample;
mod scenes;
mod sequences;
mod sog;
mod summary;
mod tools;

use super::Chart;
use super::scenes::{Scene, tell_apart};
use crate::console::Console;
use crate::failure::Failure;
use crate::output_file::{OutputFile, make_directory};
use crate::progress::Progress;
use base::{Base, Size};
use rows::BaseReport;
use summary::Summary;

/// Rows of a picture, unless the user says otherwise.
const HEIGHT: u32 = 120;

/// Measures every case on every base, then writes the page.
pub(super) fn run(chart: &Chart, console: &Console) -> Result<(), Failure> {
    make_directory(&chart.out)?;
    let size = Size::of(chart.sweep.quick, chart.full);
    let bases = bases(chart, size)?;
    let height = chart.drawing.height.unwrap_or(HEIGHT);
    let progress = Progress::steps(bases.iter().map(|base| measure::steps(base, size)).sum());
    let reports: Vec<BaseReport> =
        bases.iter().map(|base| measure::measure(base, size, height, &progress)).collect();
    drop(progress);
    let figures = figures::figures(&reports);
    let mut written = vec![files::write(&reports, &chart.out)?];
    for figure in &figures {
        let name = format!("{}.svg", figure.id);
        OutputFile::write(&chart.out.join(&name), figure.file().as_bytes())?;
        written.push(name);
    }
    let page = page::html(&reports, &figures, &super::command_line());
    OutputFile::write(&chart.out.join("index.html"), page.as_bytes())?;
    let summary = Summary::new(&chart.out, &reports, written);
    console.report(&summary, || summary.text())
}

/// The built-in scene, unless there are others; then only if it is asked for.
fn bases(chart: &Chart, size: Size) -> Result<Vec<Base>, Failure> {
    let mut scenes = Vec::new();
    if chart.builtin || chart.scenes.is_empty() {
        scenes.push(base::builtin(size));
    }
    for path in &chart.scenes {
        scenes.push(Scene::read(path, Some(chart.frames.unwrap_or(size.frames())))?);
    }
    tell_apart(&mut scenes);
    Ok(scenes.iter().map(|scene| Base::new(scene, size)).collect())
}
