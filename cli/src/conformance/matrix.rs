//! `splatstream conformance matrix`: decoders side by side.

use super::refused;
use crate::console::Console;
use crate::failure::Failure;
use crate::numbers::counted;
use crate::output_file::{OutputFile, check_ending, refuse_standard};
use clap::Args;
use serde::Serialize;
use splatstream_conformance::matrix;
use splatstream_conformance::report::Report;
use std::path::PathBuf;

/// Make a page of features and decoders from reports of runs.
///
/// A Yes is written only where the report says that every valid case of the whole suite with the feature was run and passed.
#[derive(Args)]
#[command(after_help = "Example:\n  splatstream conformance matrix ours.json theirs.json -o DECODERS.md")]
pub(super) struct Matrix {
    /// Reports that `conformance run --report` wrote.
    #[arg(value_name = "REPORT.json", required = true)]
    reports: Vec<PathBuf>,
    /// The page.
    #[arg(short, long = "out", value_name = "FILE.md")]
    out: PathBuf,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Written<'a> {
    output: &'a PathBuf,
    decoders: Vec<&'a str>,
}

impl Matrix {
    /// Reads the reports and writes the page.
    pub(super) fn run(&self, console: &Console) -> Result<(), Failure> {
        refuse_standard(&self.out)?;
        check_ending(&self.out, "md", "a page in Markdown")?;
        let reports = self
            .reports
            .iter()
            .map(|path| Report::read(path))
            .collect::<Result<Vec<_>, _>>()
            .map_err(refused)?;
        OutputFile::write_apart(&self.out, &self.reports, matrix::page(&reports).as_bytes())?;
        let decoders = reports.iter().map(|report| report.decoder.name.as_str()).collect();
        let written = Written { output: &self.out, decoders };
        console.report(&written, || {
            format!("{}: {}", self.out.display(), counted(reports.len() as u64, "decoder"))
        })
    }
}
