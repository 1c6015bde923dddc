//! The columns of the metrics of pictures.

use super::{Column, Value};
use splatstream_render::metrics::Comparison;

/// A metric: name, heading, decimals, and the figure.
type Metric = (&'static str, &'static str, usize, fn(&Comparison) -> Option<f64>);

/// Those that people see; the learned one where it was measured.
const PSNR: Metric = ("psnr_db", "PSNR, dB", 2, |figures| Some(figures.psnr_db));
const SSIM: Metric = ("ssim", "SSIM", 4, |figures| figures.ssim);
const LEARNED: Metric = ("st_lpips", "ST-LPIPS", 4, |figures| figures.st_lpips);
/// Those of files only.
const PSNR_MASKED: Metric = ("psnr_masked_db", "", 2, |figures| figures.psnr_masked_db);
const YUV_PSNR: Metric = ("yuv_psnr_db", "", 2, |figures| Some(figures.yuv_psnr_db));
const SSIM_MASKED: Metric = ("ssim_masked", "", 4, |figures| figures.ssim_masked);

/// All metrics of the pictures of a row. People see PSNR and SSIM, and ST-LPIPS where it was measured.
pub(crate) fn metrics<R: 'static>(of: fn(&R) -> &Comparison) -> Vec<Column<R>> {
    let value = move |metric: Metric| move |row: &R| Value::number((metric.3)(of(row)), metric.2);
    let shown = |metric: Metric| Column::new(metric.0, metric.1, value(metric));
    let in_files = |metric: Metric| Column::of_file(metric.0, value(metric));
    vec![
        shown(PSNR),
        in_files(PSNR_MASKED),
        in_files(YUV_PSNR),
        shown(SSIM),
        in_files(SSIM_MASKED),
        shown(LEARNED).if_measured(),
    ]
}

/// PSNR, SSIM and, in files, ST-LPIPS of other pictures of a row, if it has them.
pub(crate) fn other_metrics<R: 'static>(
    prefix: &'static str,
    of_what: &'static str,
    of: fn(&R) -> Option<&Comparison>,
) -> Vec<Column<R>> {
    let column = |metric: Metric| {
        let value = move |row: &R| Value::number(of(row).and_then(metric.3), metric.2);
        Column::new(format!("{prefix}_{}", metric.0), format!("{}, {of_what}", metric.1), value).if_measured()
    };
    vec![column(PSNR), column(SSIM), column(LEARNED).on(super::PROGRAMS)]
}
