//! `splatstream conformance packages`: every package through an unpackager, or its stream through a packager.

use super::{SuiteArgs, refused, text_of};
use crate::console::Console;
use crate::failure::Failure;
use clap::Args;
use serde::Serialize;
use splatstream_conformance::cancel::Cancel;
use splatstream_conformance::command::Template;
use splatstream_conformance::limits::Limits;
use splatstream_conformance::packages::{PackageResult, beside, run, run_packager};
use std::path::PathBuf;

/// Run an unpackager on the packages of annex C, or a packager on their streams, and say of each whether it is right.
#[derive(Args)]
#[command(
    after_help = "Example:\n  splatstream conformance packages --unpackager './myunpack {in} {out}'\n\n\
    {in} is the directory of a package, {out} the stream to write; of a packager, {in} is a stream and {out} the\n\
    directory to write, from which this program's unpackager must get the same bytes. Exit codes of the command as\n\
    of `unpackage`: 0, or 10 to 14 by the class of the error. Without a command, this program's unpackager is tested."
)]
pub(super) struct Packages {
    /// The command of the unpackager, once a package.
    #[arg(long, value_name = "CMD")]
    unpackager: Option<String>,
    /// The command of a packager, once a stream.
    #[arg(long, value_name = "CMD", conflicts_with = "unpackager")]
    packager: Option<String>,
    /// The folder of the packages [default: conformance/packages of the repository].
    #[arg(long, value_name = "DIR")]
    packages: Option<PathBuf>,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Report {
    passed: usize,
    failed: usize,
    packages: Vec<PackageResult>,
}

impl Packages {
    /// Runs; fails if the unpackager did.
    pub(super) fn run(&self, console: &Console) -> Result<(), Failure> {
        let folder = match &self.packages {
            Some(folder) => folder.clone(),
            None => beside(&SuiteArgs::folder(None)?),
        };
        Failure::refuse_standard_input(&folder)?;
        let folder = std::path::absolute(&folder).map_err(|error| Failure::file("find", &folder, &error))?;
        let unpackager = Template::parse(&self.command()?).map_err(refused)?;
        let (limits, cancel) = (Limits::default(), Cancel::default());
        let packages = match &self.packager {
            Some(packager) => {
                let packager = Template::parse(packager).map_err(refused)?;
                run_packager(&folder, packager, unpackager, &limits, &cancel)
            }
            None => run(&folder, unpackager, &limits, &cancel),
        };
        let packages = packages.map_err(refused)?;
        let passed = packages.iter().filter(|package| package.passed).count();
        let report = Report { passed, failed: packages.len() - passed, packages };
        console.report(&report, || report.text())?;
        match report.failed {
            0 => Ok(()),
            failed => Err(Failure::Decoder(format!("{failed} packages failed"))),
        }
    }

    fn command(&self) -> Result<String, Failure> {
        if let Some(command) = &self.unpackager {
            return Ok(command.clone());
        }
        let this = std::env::current_exe();
        let this = this.map_err(|error| Failure::other(format!("cannot find this program: {error}")))?;
        Ok(format!("'{}' unpackage {{in}} -o {{out}}", text_of(&this)?.replace('\'', "'\\''")))
    }
}

impl Report {
    fn text(&self) -> String {
        let mut text = String::new();
        for package in self.packages.iter().filter(|package| !package.passed) {
            let requirements = package.requirements.join(" ");
            text += &format!("{}: {} ({requirements})\n", package.package, package.message);
        }
        text + &format!("{} of {} packages passed\n", self.passed, self.packages.len())
    }
}
