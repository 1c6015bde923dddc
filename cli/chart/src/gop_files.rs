//! The tables of a GOP with predicted frames, as rows of CSV files.

use super::csv_files::{FIGURES, MODE, cell, figures, headings, mode_cells};
use super::scene_chart::SceneChart;

/// Columns of refinement levels that only predicted frames have.
pub(super) const OF_PREDICTED: [&str; 8] = [
    "inter_psnr_db",
    "inter_ssim",
    "inter_st_lpips",
    "subset_bytes",
    "subset_gaussians",
    "subset_psnr_db",
    "subset_ssim",
    "subset_st_lpips",
];

/// Ways to play the GOP.
pub(super) fn modes(scenes: &[SceneChart]) -> Vec<Vec<String>> {
    let mut rows = vec![headings(&[&MODE[..], &["bpg_shown"]].concat(), &FIGURES)];
    for scene in scenes {
        for mode in scene.gop.iter().flat_map(|gop| &gop.modes) {
            let mut cells = mode_cells(scene, mode);
            cells.push(cell(Some(mode.bpg())));
            cells.extend(figures(&mode.figures));
            rows.push(cells);
        }
    }
    rows
}

/// Refinement levels of the GOP of a scene.
pub(super) fn levels(scene: &SceneChart) -> Vec<Vec<String>> {
    let levels = scene.gop.iter().flat_map(|gop| &gop.levels);
    let row = |level: &super::gop::Level| {
        let names: Vec<&str> = level.units.iter().map(|(name, _)| name.as_str()).collect();
        let bytes: Vec<String> = level.units.iter().map(|(_, bytes)| bytes.to_string()).collect();
        let mut cells = headings(&[&scene.name, "predicted"], &[]);
        cells.extend([level.percent.to_string(), names.join(" "), bytes.join(" ")]);
        cells.extend([level.added, level.total, level.gaussians].map(|count| count.to_string()));
        cells.push(cell(Some(level.bpg)));
        cells.extend(figures(&level.all));
        let (inter, subset) = (&level.inter, &level.subset);
        cells.extend([Some(inter.psnr_db), inter.ssim, inter.st_lpips].map(cell));
        cells.extend([subset.bytes, subset.gaussians].map(|count| count.to_string()));
        let figures = &subset.figures;
        cells.extend([Some(figures.psnr_db), figures.ssim, figures.st_lpips].map(cell));
        cells
    };
    levels.map(row).collect()
}

/// What tools of predicted frames are worth.
pub(super) fn tools(scenes: &[SceneChart]) -> Vec<Vec<String>> {
    let first = ["scene", "tools", "inter_bytes", "inter_gaussians", "bytes_per_gaussian", "more_percent"];
    let mut rows = vec![headings(&first, &FIGURES)];
    for scene in scenes {
        let tools = scene.gop.as_ref().map_or(&[][..], |gop| gop.tools.as_slice());
        for tool in tools {
            let more = tools.first().map(|everything| tool.more_than(everything));
            let mut cells = headings(&[&scene.name, tool.name], &[]);
            cells.extend([tool.bytes.to_string(), tool.gaussians.to_string()]);
            cells.extend([Some(tool.bytes_per_gaussian()), more].map(cell));
            cells.extend(figures(&tool.figures));
            rows.push(cells);
        }
    }
    rows
}

/// What predictors and parts of the network are worth.
pub(super) fn predictors(scenes: &[SceneChart]) -> Vec<Vec<String>> {
    let first = [
        "scene",
        "predictors",
        "inter_bytes",
        "network_bytes",
        "new_gaussians",
        "learned_percent",
        "dc_bits",
        "sh_bits",
        "decode_ms",
    ];
    let mut rows = vec![headings(&first, &FIGURES)];
    for scene in scenes {
        for row in scene.gop.as_ref().map_or(&[][..], |gop| gop.ablation.as_slice()) {
            let mut cells = headings(&[&scene.name, row.name], &[]);
            cells.extend([row.bytes, row.network_bytes, row.new].map(|count| count.to_string()));
            let numbers = [row.learned_percent, row.dc_bits, row.sh_bits, row.decode_ms];
            cells.extend(numbers.map(|number| cell(Some(number))));
            cells.extend(figures(&row.figures));
            rows.push(cells);
        }
    }
    rows
}
