//! `splatstream completions`: what a shell needs to complete commands, options and their values.

use crate::console::Console;
use crate::failure::Failure;
use clap::{Args, CommandFactory};
use clap_complete::{Shell, generate};
use serde::Serialize;

/// Print the script with which a shell completes commands, options and values.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    splatstream completions bash > ~/.local/share/bash-completion/completions/splatstream\n  \
    splatstream completions fish > ~/.config/fish/completions/splatstream.fish")]
pub(crate) struct Completions {
    /// The shell.
    #[arg(value_name = "SHELL")]
    shell: Shell,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Report {
    shell: String,
    script: String,
}

impl Completions {
    /// Makes the script from the options themselves.
    pub(crate) fn run(&self, console: &Console) -> Result<(), Failure> {
        let mut script = Vec::new();
        generate(self.shell, &mut crate::Cli::command(), "splatstream", &mut script);
        let script = String::from_utf8_lossy(&script).into_owned();
        let report = Report { shell: self.shell.to_string(), script };
        console.report(&report, || report.script.trim_end().to_owned())
    }
}
