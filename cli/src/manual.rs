//! `splatstream manual`: the manual pages, one for each command.

use crate::console::Console;
use crate::failure::Failure;
use crate::output_file::{OutputFile, check_directory, make_directory};
use clap::{Args, Command, CommandFactory};
use clap_mangen::Man;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Write the manual pages: splatstream.1 and one for each command.
#[derive(Args)]
#[command(after_help = "Example:\n  splatstream manual -o ~/.local/share/man/man1 && man splatstream-encode")]
pub(crate) struct Manual {
    /// The directory for the pages.
    #[arg(short, long = "out", value_name = "DIR")]
    out: PathBuf,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Report {
    output: PathBuf,
    pages: Vec<String>,
}

impl Manual {
    /// Makes the pages from the options themselves.
    pub(crate) fn run(&self, console: &Console) -> Result<(), Failure> {
        check_directory(&self.out, "manual pages")?;
        make_directory(&self.out)?;
        let mut command = crate::Cli::command().disable_help_subcommand(true);
        command.build();
        let mut pages = Vec::new();
        write(&command, &self.out, &mut pages)?;
        let report = Report { output: self.out.clone(), pages };
        console.report(&report, || {
            format!("{} manual pages are in {}", report.pages.len(), report.output.display())
        })
    }
}

/// Writes the page of a command and those of its subcommands, whose names begin with its own.
fn write(command: &Command, directory: &Path, pages: &mut Vec<String>) -> Result<(), Failure> {
    let name = command.get_display_name().unwrap_or_else(|| command.get_name()).to_owned();
    let mut page = Vec::new();
    let failed = |error| Failure::other(format!("cannot make the page of {name}: {error}"));
    Man::new(command.clone().name(name.clone())).render(&mut page).map_err(failed)?;
    let file = format!("{name}.1");
    OutputFile::write(&directory.join(&file), &page)?;
    pages.push(file);
    command.get_subcommands().try_for_each(|below| write(below, directory, pages))
}
