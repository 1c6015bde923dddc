//! The tables of a GOP with predicted frames, for the terminal.

use super::gop::{Gop, Level};
use super::scene_chart::SceneChart;
use crate::numbers::grouped;
use crate::table::Table;
use splatstream_render::metrics::Comparison;

/// The tables of a scene; nothing if it is no sequence.
pub(super) fn text(chart: &SceneChart) -> String {
    let Some(gop) = &chart.gop else { return String::new() };
    format!(
        "{name}: operating points of the first GOP, {frames} frames at {fps} frames per second\n{modes}\n\
         {name}: refinement levels of its predicted frames; carried: what is missing comes from the intra frame; \
         subset: it stays away\n{levels}\n\
         {name}: predicted frames with and without tools\n{tools}\n{ablation}",
        name = chart.name,
        frames = gop.frames,
        fps = chart.fps,
        modes = modes(gop),
        levels = levels(gop),
        tools = tools(gop),
        ablation = ablation(&chart.name, gop),
    )
}

/// PSNR and SSIM.
fn figures(figures: &Comparison) -> String {
    let ssim = figures.ssim.map_or_else(|| "none".to_owned(), |ssim| format!("{ssim:.4}"));
    format!("{:.2} / {ssim}", figures.psnr_db)
}

fn modes(gop: &Gop) -> String {
    let mut table = Table::new([
        "mode",
        "units",
        "frames",
        "playback",
        "refinement",
        "bytes",
        "Mbit/s",
        "Gaussians",
        "BPG",
        "PSNR / SSIM",
    ]);
    for mode in &gop.modes {
        table.row([
            mode.name.clone(),
            mode.units.clone(),
            mode.frames.clone(),
            mode.playback.to_owned(),
            mode.percent.map_or_else(|| "-".to_owned(), |percent| format!("{percent} %")),
            grouped(mode.bytes),
            format!("{:.2}", mode.mbit_s),
            grouped(mode.gaussians),
            format!("{:.2}", mode.bpg()),
            figures(&mode.figures),
        ]);
    }
    table.text()
}

fn levels(gop: &Gop) -> String {
    let mut table = Table::new([
        "level",
        "bytes of each frame",
        "added",
        "total",
        "Gaussians",
        "BPG",
        "all frames",
        "predicted, carried",
        "predicted, subset",
    ]);
    for level in &gop.levels {
        table.row([
            format!("{} %", level.percent),
            units(level),
            grouped(level.added),
            grouped(level.total),
            grouped(level.gaussians),
            format!("{:.2}", level.bpg),
            figures(&level.all),
            figures(&level.inter),
            figures(&level.subset.figures),
        ]);
    }
    table.text()
}

fn units(level: &Level) -> String {
    let unit = |(name, bytes): &(String, u64)| format!("{name} {}", grouped(*bytes));
    level.units.iter().map(unit).collect::<Vec<_>>().join(", ")
}

fn tools(gop: &Gop) -> String {
    let mut table = Table::new(["tools", "bytes", "bytes per Gaussian", "more", "PSNR / SSIM"]);
    let everything = gop.tools.first();
    for tool in &gop.tools {
        table.row([
            tool.name.to_owned(),
            grouped(tool.bytes),
            format!("{:.3}", tool.bytes_per_gaussian()),
            everything.map_or_else(String::new, |everything| format!("{:.1} %", tool.more_than(everything))),
            figures(&tool.figures),
        ]);
    }
    table.text()
}

/// Nothing if it was not asked for.
fn ablation(name: &str, gop: &Gop) -> String {
    if gop.ablation.is_empty() {
        return String::new();
    }
    let headings =
        ["predictors", "bytes", "network", "learned", "dc bits", "sh bits", "decode ms", "PSNR / SSIM"];
    let mut table = Table::new(headings);
    for row in &gop.ablation {
        table.row([
            row.name.to_owned(),
            grouped(row.bytes),
            grouped(row.network_bytes),
            format!("{:.1} %", row.learned_percent),
            format!("{:.3}", row.dc_bits),
            format!("{:.3}", row.sh_bits),
            format!("{:.1}", row.decode_ms),
            figures(&row.figures),
        ]);
    }
    format!("{name}: predictors of new Gaussians; bits are per new Gaussian\n{}\n", table.text())
}
