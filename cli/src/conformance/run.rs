//! `splatstream conformance run`: every vector through a decoder.

use super::{SuiteArgs, refused, text_of};
use crate::console::{Console, to_json};
use crate::failure::Failure;
use crate::output_file::OutputFile;
use crate::progress::Progress;
use clap::Args;
use splatstream_conformance::capabilities::Capabilities;
use splatstream_conformance::command::{Template, split};
use splatstream_conformance::expectations::Expectations;
use splatstream_conformance::limits::{Limits, Size};
use splatstream_conformance::reference;
use splatstream_conformance::report::{Report, junit, markdown, summary};
use splatstream_conformance::run::{Settings, run};
use splatstream_conformance::session::Decoder;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Run a decoder on the vectors and say of every case whether it is right, and where it is not.
///
/// Without --decoder and --stdio, this program's own decoder is tested. The runner hashes what a decoder writes; of wrong
/// values it tells the first one, the unit that carries it and the clause to read.
#[derive(Args)]
#[command(after_help = "Examples:\n  splatstream conformance run\n  \
    splatstream conformance run --decoder './mydec --in {in} --op {op} --mode {mode} --out {out}'\n  \
    splatstream conformance run --stdio 'python3 adapter.py --stdio' --filter 'temporal-*' --jobs 1\n  \
    splatstream conformance run --decoder './mydec {in} {op} {mode} {out}' --capabilities mydec.json \\\n      \
    --expectations mydec.txt --report mydec-report.json --junit mydec.xml\n\n\
    Exit codes: 0 every case passed that the decoder claims, 1 files or settings, 2 usage,\n\
    3 some case failed, or an expectation no longer holds.")]
pub(super) struct Run {
    /// The command of the decoder, once a case: {in} is the stream, {out} an empty folder, {op} like s0,t0,r2, {mode} full
    /// or subset. It is split as a shell would; no shell runs.
    #[arg(long, value_name = "CMD", conflicts_with = "stdio")]
    decoder: Option<String>,
    /// The command of a decoder that answers many cases, line by line.
    #[arg(long, value_name = "CMD")]
    stdio: Option<String>,
    #[command(flatten)]
    suite: SuiteArgs,
    /// What the decoder claims; what it does not claim is not asked. Default is everything.
    #[arg(long, value_name = "FILE.json")]
    capabilities: Option<PathBuf>,
    /// Cases that the decoder is known to fail, one a line: vector[@op[/mode]] outcome  # why.
    #[arg(long, value_name = "FILE.txt")]
    expectations: Option<PathBuf>,
    /// Count a wrong error code as a failure, not as a warning.
    #[arg(long)]
    strict: bool,
    /// Cases at a time [default: one a processor].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Seconds that a case may take.
    #[arg(long, value_name = "SECONDS", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=86400))]
    time: u32,
    /// Memory that a case may take.
    #[arg(long, value_name = "SIZE", default_value_t = Size(Limits::default().memory))]
    memory: Size,
    /// What a case may write.
    #[arg(long, value_name = "SIZE", default_value_t = Size(Limits::default().output))]
    output: Size,
    /// Write the report as JSON.
    #[arg(long, value_name = "FILE.json")]
    report: Option<PathBuf>,
    /// Write the report as JUnit XML.
    #[arg(long, value_name = "FILE.xml")]
    junit: Option<PathBuf>,
    /// Write the report as Markdown.
    #[arg(long, value_name = "FILE.md")]
    markdown: Option<PathBuf>,
}

impl Run {
    /// Runs, writes the reports; fails if the decoder did.
    pub(super) fn run(&self, console: &Console) -> Result<(), Failure> {
        let settings = self.settings()?;
        let expectations =
            self.expectations.as_deref().map(Expectations::read).transpose().map_err(refused)?;
        let suite = self.suite.read()?;
        let cases = self.suite.cases(&suite)?;
        let progress = Progress::cases(u32::try_from(cases.len()).unwrap_or(u32::MAX));
        let mut results = run(&cases, &settings, |_| progress.advance()).map_err(refused)?;
        drop(progress);
        let selection = self.suite.selection();
        let stale = expectations.unwrap_or_default().apply(&mut results, selection.is_everything());
        let report = Report::new(&suite, &settings, &selection, results, stale);
        self.write(&report)?;
        console.report(&report, || summary::text(&report))?;
        if report.is_good() { Ok(()) } else { Err(Failure::Decoder) }
    }

    fn settings(&self) -> Result<Settings, Failure> {
        let decoder = self.decoder()?;
        let capabilities = match &self.capabilities {
            Some(path) => Capabilities::read(path).map_err(refused)?,
            None if self.is_ours() => reference::capabilities(),
            None => Capabilities::everything(&name(decoder.program())),
        };
        let processors = std::thread::available_parallelism().map_or(1, usize::from);
        let limits = Limits {
            time: Duration::from_secs(self.time.into()),
            memory: self.memory.0,
            output: self.output.0,
        };
        let jobs = self.jobs.map_or(processors, usize::from);
        Ok(Settings { decoder, capabilities, limits, strict: self.strict, jobs })
    }

    fn decoder(&self) -> Result<Decoder, Failure> {
        if let Some(command) = &self.decoder {
            return Ok(Decoder::Once(Template::parse(command).map_err(refused)?));
        }
        if let Some(command) = &self.stdio {
            return Ok(Decoder::Persistent(split(command).map_err(refused)?));
        }
        let us = std::env::current_exe()
            .map_err(|error| Failure::other(format!("cannot find this program to test it: {error}")))?;
        let arguments = ["--threads", "1", "conformance", "decode", "--stdio"].map(str::to_owned);
        Ok(Decoder::Persistent([vec![text_of(&us)?], arguments.to_vec()].concat()))
    }

    fn is_ours(&self) -> bool {
        self.decoder.is_none() && self.stdio.is_none()
    }

    fn write(&self, report: &Report) -> Result<(), Failure> {
        if let Some(path) = &self.report {
            OutputFile::write(path, (to_json(report)? + "\n").as_bytes())?;
        }
        if let Some(path) = &self.junit {
            let xml = junit::xml(report).map_err(|error| Failure::file("write", path, &error))?;
            OutputFile::write(path, xml.as_bytes())?;
        }
        if let Some(path) = &self.markdown {
            OutputFile::write(path, markdown::page(report).as_bytes())?;
        }
        Ok(())
    }
}

/// What a decoder is called that did not say: its program, without folders.
fn name(program: &str) -> String {
    Path::new(program)
        .file_name()
        .map_or_else(|| program.to_owned(), |name| name.to_string_lossy().into_owned())
}
