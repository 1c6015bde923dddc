//! Standard output and standard error.
//!
//! Output goes through `write!` and not `println!`: a reader that has gone away (`| head`) is no error and
//! no panic.

use crate::failure::{Failure, FailureReport};
use crate::standard::is_standard;
use serde::Serialize;
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

/// Where results and complaints go.
pub(crate) struct Console {
    json: bool,
    /// Whether only warnings and errors are for people.
    quiet: bool,
    /// Whether there is JSON on standard output already: it is one value.
    has_printed: AtomicBool,
}

impl Console {
    /// Results as JSON, or as text for people, who may want none.
    pub(crate) fn new(json: bool, quiet: bool) -> Self {
        Self { json, quiet, has_printed: AtomicBool::new(false) }
    }

    /// Whether results are printed as JSON.
    pub(crate) const fn is_json(&self) -> bool {
        self.json
    }

    /// Prints the result of a command, in the form asked for; no text prints nothing.
    pub(crate) fn report(
        &self,
        report: &impl Serialize,
        text: impl FnOnce() -> String,
    ) -> Result<(), Failure> {
        self.has_printed.store(true, Ordering::Relaxed);
        let mut output = match (self.json, self.quiet) {
            (true, _) => to_json(report)?,
            (false, true) => return Ok(()),
            (false, false) => text(),
        };
        if !output.is_empty() && !output.ends_with('\n') {
            output.push('\n');
        }
        written(io::stdout().lock().write_all(output.as_bytes()))
    }

    /// Refuses JSON and a file on standard output at once.
    pub(crate) fn claim(&self, out: Option<&Path>) -> Result<(), Failure> {
        match out {
            Some(out) if self.json && is_standard(out) => Err(Failure::Usage(format!(
                "{}: --json prints on standard output too; give a file, or leave --json out",
                out.display()
            ))),
            _ => Ok(()),
        }
    }

    /// As [`Console::report`], for a command that writes to `out`: beside a file on standard output the report goes to
    /// standard error.
    pub(crate) fn report_beside(
        &self,
        out: Option<&Path>,
        report: &impl Serialize,
        text: impl FnOnce() -> String,
    ) -> Result<(), Failure> {
        if out.is_some_and(is_standard) {
            self.note(|| text().trim_end().to_owned());
            return Ok(());
        }
        self.report(report, text)
    }

    /// The same for a result of any length, which is written as it comes; JSON without indentation. What is found while it is written
    /// is found without a report, too.
    pub(crate) fn stream(
        &self,
        report: &impl Serialize,
        text: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<(), Failure> {
        self.has_printed.store(true, Ordering::Relaxed);
        if self.quiet && !self.json {
            return written(text(&mut io::sink()));
        }
        let mut out = BufWriter::with_capacity(1 << 16, io::stdout().lock());
        let result = match self.json {
            true => {
                serde_json::to_writer(&mut out, report).map_err(io::Error::from).and_then(|()| writeln!(out))
            }
            false => text(&mut out),
        };
        written(result.and_then(|()| out.flush()))
    }

    /// Says why a command failed; with `--json` also on standard output, unless a report is there that says it.
    pub(crate) fn fail(&self, failure: &Failure) {
        if self.json && !self.has_printed.load(Ordering::Relaxed) {
            // Whoever reads neither is told by the exit code.
            let _nobody_listens = self.report(&FailureReport::from(failure), String::new);
        }
        self.complain(&failure.to_string());
    }

    /// Says on standard error how a command goes.
    pub(crate) fn note(&self, message: impl FnOnce() -> String) {
        if !self.quiet {
            self.complain(&message());
        }
    }

    /// Writes to standard error. If nobody listens there, nobody can be told.
    pub(crate) fn complain(&self, message: &str) {
        let _nobody_listens = writeln!(io::stderr().lock(), "{message}");
    }
}

/// What became of writing to standard output. A reader that has gone away is no failure.
pub(crate) fn written(result: io::Result<()>) -> Result<(), Failure> {
    match result {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(Failure::other(format!("cannot write to standard output: {error}")))
        }
        _ => Ok(()),
    }
}

/// A report as the JSON that `--json` prints.
pub(crate) fn to_json(report: &impl Serialize) -> Result<String, Failure> {
    serde_json::to_string_pretty(report)
        .map_err(|error| Failure::other(format!("the report cannot be written as JSON: {error}")))
}
