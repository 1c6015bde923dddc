//! `splatstream conformance run`: every vector through a decoder.

use super::{SuiteArgs, refused, text_of};
use crate::console::{Console, to_json};
use crate::failure::Failure;
use crate::numbers::counted;
use crate::output_file::{OutputFile, check_ending, refuse_inputs, refuse_standard};
use crate::progress::Progress;
use crate::unfinished;
use clap::Args;
use splatstream_chart::Progress as _;
use splatstream_conformance::cancel::Cancel;
use splatstream_conformance::capabilities::Capabilities;
use splatstream_conformance::command::{Template, shell_word, split_persistent};
use splatstream_conformance::expectations::Expectations;
use splatstream_conformance::limits::{Limits, Size};
use splatstream_conformance::reference;
use splatstream_conformance::report::{Report, junit, markdown, summary};
use splatstream_conformance::run::{Settings, run};
use splatstream_conformance::session::Decoder;
use splatstream_conformance::suite::Suite;
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
    3 some case failed, or an expectation no longer holds, 130 interrupted.")]
pub(super) struct Run {
    /// The command of the decoder, once a case: {in} is the stream, {out} an empty folder, {op} like s0,t0,r2, {mode} full,
    /// subset or inside. Both paths are absolute. It is split as a shell would; no shell runs, so write sh -c '...' for pipes.
    #[arg(long, value_name = "CMD", conflicts_with = "stdio")]
    decoder: Option<String>,
    /// The command of a decoder that answers many cases, line by line; --jobs N starts N of them.
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
    /// Demand the code of each error, and the right one: without it a wrong code is a warning.
    #[arg(long)]
    strict: bool,
    /// Cases at a time [default: one a processor].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Seconds that a case may take. A slow decoder needs 60 or more.
    #[arg(long, value_name = "SECONDS", default_value = "10", value_parser = parse_seconds)]
    time: Duration,
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
        self.check_outputs()?;
        let settings = self.settings()?;
        if let Some(word) = shell_word(settings.decoder.words()) {
            console
                .complain(&format!("warning: '{word}' is for a shell, and no shell runs; use sh -c '...'"));
        }
        let suite = self.suite.read()?;
        let inputs = self.inputs(&suite)?;
        self.outputs().try_for_each(|path| refuse_inputs(path, &inputs))?;
        if let Some(complaint) = suite.complaint() {
            console.complain(&format!("warning: {complaint}"));
        }
        let expectations = self.expectations(&suite)?;
        let cases = self.suite.cases(&suite)?;
        if cases.iter().all(|case| settings.capabilities.missing(case).is_some()) {
            return Err(Failure::other("the capabilities claim none of the selected cases"));
        }
        stop_on_signals(&settings.cancel)?;
        let progress = Progress::cases(u32::try_from(cases.len()).unwrap_or(u32::MAX));
        let mut results = run(&cases, &settings, |_| progress.advance()).map_err(refused)?;
        drop(progress);
        let selection = self.suite.selection();
        let stale = expectations.apply(&mut results);
        let report = Report::new(&suite, &settings, &selection, results, stale);
        self.write(&report, &inputs)?;
        console.report(&report, || summary::text(&report))?;
        self.verdict(&report)
    }

    fn expectations(&self, suite: &Suite) -> Result<Expectations, Failure> {
        let read = |path: &PathBuf| Expectations::read(path, suite).map_err(refused);
        self.expectations.as_ref().map_or_else(|| Ok(Expectations::default()), read)
    }

    /// Whether the decoder did what it claims, and where to read more.
    fn verdict(&self, report: &Report) -> Result<(), Failure> {
        let path = self.report.as_ref().or(self.markdown.as_ref()).or(self.junit.as_ref());
        if let Some(selected) = report.interrupted {
            let written = path.map_or_else(String::new, |path| format!("; report: {}", path.display()));
            let (done, selected) = (report.cases.len(), counted(selected, "case"));
            return Err(Failure::Interrupted(format!("interrupted after {done} of {selected}{written}")));
        }
        match path {
            _ if report.is_good() => Ok(()),
            Some(path) => Err(Failure::Decoder(format!("the decoder failed: see {}", path.display()))),
            None => {
                Err(Failure::Decoder("the decoder failed; --report FILE.json keeps all of it".to_owned()))
            }
        }
    }

    fn settings(&self) -> Result<Settings, Failure> {
        let decoder = self.decoder()?;
        let capabilities = match &self.capabilities {
            Some(path) => Capabilities::read(path).map_err(refused)?,
            None if self.is_ours() => reference::capabilities(),
            None => Capabilities::everything(&name(decoder.words())),
        };
        if let Decoder::Once(template) = &decoder {
            template.check_claim(&capabilities).map_err(refused)?;
        }
        let processors = std::thread::available_parallelism().map_or(1, usize::from);
        let limits = Limits { time: self.time, memory: self.memory.0, output: self.output.0 };
        let jobs = self.jobs.map_or(processors, usize::from);
        let (strict, cancel) = (self.strict, Cancel::default());
        Ok(Settings { decoder, capabilities, limits, strict, jobs, cancel })
    }

    fn decoder(&self) -> Result<Decoder, Failure> {
        if let Some(command) = &self.decoder {
            return Ok(Decoder::Once(Template::parse(command).map_err(refused)?));
        }
        if let Some(command) = &self.stdio {
            return Ok(Decoder::Persistent(split_persistent(command).map_err(refused)?));
        }
        let us = std::env::current_exe()
            .map_err(|error| Failure::other(format!("cannot find this program to test it: {error}")))?;
        let arguments = ["--threads", "1", "conformance", "decode", "--stdio"].map(str::to_owned);
        Ok(Decoder::Persistent([vec![text_of(&us)?], arguments.to_vec()].concat()))
    }

    fn is_ours(&self) -> bool {
        self.decoder.is_none() && self.stdio.is_none()
    }

    /// Reports go to files of their formats.
    fn check_outputs(&self) -> Result<(), Failure> {
        self.outputs().try_for_each(|path| refuse_standard(path))?;
        let named = [
            (&self.report, "json", "a report in JSON"),
            (&self.junit, "xml", "a report in XML"),
            (&self.markdown, "md", "a report in Markdown"),
        ];
        named.into_iter().try_for_each(|(path, ending, what)| {
            path.as_ref().map_or(Ok(()), |path| check_ending(path, ending, what))
        })
    }

    /// The reports.
    fn outputs(&self) -> impl Iterator<Item = &PathBuf> {
        [&self.report, &self.junit, &self.markdown].into_iter().flatten()
    }

    /// The files that it reads: those of the suite, and what is said of the decoder.
    fn inputs(&self, suite: &Suite) -> Result<Vec<PathBuf>, Failure> {
        let named = [&self.capabilities, &self.expectations].into_iter().flatten().cloned();
        Ok(self.suite.files(suite)?.into_iter().chain(named).collect())
    }

    fn write(&self, report: &Report, inputs: &[PathBuf]) -> Result<(), Failure> {
        if let Some(path) = &self.report {
            OutputFile::write_apart(path, inputs, (to_json(report)? + "\n").as_bytes())?;
        }
        if let Some(path) = &self.junit {
            let xml = junit::xml(report).map_err(|error| Failure::file("write", path, &error))?;
            OutputFile::write_apart(path, inputs, xml.as_bytes())?;
        }
        if let Some(path) = &self.markdown {
            OutputFile::write_apart(path, inputs, markdown::page(report).as_bytes())?;
        }
        Ok(())
    }
}

/// What a decoder is called that did not say: its program, without folders.
fn name(words: &[String]) -> String {
    let program = words.first().map_or("", String::as_str);
    Path::new(program)
        .file_name()
        .map_or_else(|| program.to_owned(), |name| name.to_string_lossy().into_owned())
}

/// Lets whoever interrupts or ends this program end the run instead: what was found so far is told, and nothing is left.
fn stop_on_signals(cancel: &Cancel) -> Result<(), Failure> {
    let cancel = cancel.clone();
    unfinished::stop_by(move || cancel.set())
}

/// A time in seconds, which need not be whole.
fn parse_seconds(text: &str) -> Result<Duration, String> {
    let seconds = text.parse::<f64>().ok().filter(|seconds| (0.001..=86_400.0).contains(seconds));
    seconds.map(Duration::from_secs_f64).ok_or_else(|| "write seconds, 0.001 to 86400".to_owned())
}
