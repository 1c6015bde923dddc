//! The rows as a CSV file.

use super::rows::{BaseReport, strength};
use super::sample::Quality;
use crate::Error;
use crate::csv_files::{cell, csv, headings};
use crate::report::File;

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

/// The file.
pub(super) fn file(reports: &[BaseReport]) -> Result<File, Error> {
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
    Ok(File { name: FILE.to_owned(), bytes: csv(&rows)? })
}
