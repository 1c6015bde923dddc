//! The rows as a CSV file.

use super::rows::{BaseReport, strength};
use super::sample::Quality;
use crate::chart::csv_files::{cell, csv, headings};
use crate::failure::Failure;
use crate::output_file::OutputFile;
use std::path::Path;

/// Its name.
pub(super) const FILE: &str = "stability.csv";

const COLUMNS: [&str; 13] = [
    "scene",
    "case",
    "axis",
    "strength",
    "tool",
    "psnr_db",
    "psnr_masked_db",
    "psnr_db_plain",
    "psnr_masked_db_plain",
    "bpg_source",
    "detected",
    "fallback",
    "verdict",
];

/// Writes it; gives its name.
pub(super) fn write(reports: &[BaseReport], out: &Path) -> Result<String, Failure> {
    let mut rows = vec![headings(&COLUMNS, &[])];
    for report in reports {
        for case in &report.cases {
            rows.extend(case.rows.iter().map(|row| {
                let of_quality = |quality: Option<Quality>| {
                    [quality.map(|quality| quality.psnr), quality.map(|quality| quality.covered)].map(cell)
                };
                let ([psnr, covered], bpg) = (of_quality(row.quality), cell(row.bpg));
                let [psnr_plain, covered_plain] = of_quality(Some(row.wanted));
                let first = [&report.name, case.case.id, case.case.axis, &strength(row.strength)];
                let figures = [&psnr, &covered, &psnr_plain, &covered_plain, &bpg].map(String::as_str);
                let words = [&row.detected, &row.fallback, row.verdict.name()];
                headings(&[&first[..], &[row.tool.name()]].concat(), &[&figures[..], &words].concat())
            }));
        }
    }
    OutputFile::write(&out.join(FILE), &csv(&rows)?)?;
    Ok(FILE.to_owned())
}
