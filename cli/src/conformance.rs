//! `splatstream conformance`: the conformance suite and decoders, ours or another.

mod decode;
mod list;
mod matrix;
mod packages;
mod run;

use crate::console::Console;
use crate::failure::Failure;
use clap::{Args, Subcommand};
use splatstream_conformance::case::Case;
use splatstream_conformance::error::Error;
use splatstream_conformance::selection::Selection;
use splatstream_conformance::suite::Suite;
use splatstream_conformance::vector::Kind;
use std::path::{Path, PathBuf};

/// Test a decoder, this one or another, on the vectors of the conformance suite.
#[derive(Args)]
#[command(after_help = "Examples:\n  splatstream conformance run\n  \
    splatstream conformance run --decoder './mydec {in} {op} {mode} {out}'\n  \
    splatstream conformance list --area temporal\n\n\
    How a decoder is asked and what it writes: conformance/adapters/README.md.")]
pub(crate) struct Conformance {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Run(Box<run::Run>),
    List(list::List),
    Matrix(matrix::Matrix),
    Packages(packages::Packages),
    Decode(decode::Decode),
}

impl Conformance {
    /// Does what the subcommand says.
    pub(crate) fn run(&self, console: &Console) -> Result<(), Failure> {
        match &self.command {
            Command::Run(command) => command.run(console),
            Command::List(command) => command.run(console),
            Command::Matrix(command) => command.run(console),
            Command::Packages(command) => command.run(console),
            Command::Decode(command) => command.run(),
        }
    }
}

/// Where the vectors are, and which of them are meant.
#[derive(Args)]
struct SuiteArgs {
    /// The folder of the vectors, or the one above it [default: conformance/vectors of the repository around the
    /// current folder or around this program].
    #[arg(long, value_name = "DIR")]
    suite: Option<PathBuf>,
    /// Only vectors whose names match a pattern, such as 'temporal-*', or cases, vector@op or vector@op/mode. Several add up.
    #[arg(long, value_name = "GLOB")]
    filter: Vec<String>,
    /// Only vectors of an area.
    #[arg(long, value_name = "AREA")]
    area: Option<String>,
    /// Only vectors of a kind.
    #[arg(long, value_name = "KIND", value_parser = parse_kind)]
    kind: Option<Kind>,
    /// Only streams with a feature, such as b-frames.
    #[arg(long, value_name = "FEATURE")]
    feature: Option<String>,
    /// Only vectors about a rule, such as SS-PR-003.
    #[arg(long, value_name = "RULE")]
    requirement: Option<String>,
}

impl SuiteArgs {
    fn read(&self) -> Result<Suite, Failure> {
        Suite::read(&Self::folder(self.suite.clone())?).map_err(refused)
    }

    /// The files of a suite: records, streams, and what stands beside the folder of the vectors.
    fn files(&self, suite: &Suite) -> Result<Vec<PathBuf>, Failure> {
        let folder = Self::folder(self.suite.clone())?;
        let mut files = Vec::new();
        for beside in [Some(folder.as_path()), folder.parent()].into_iter().flatten() {
            files.extend(["VERSION", "MANIFEST"].map(|name| beside.join(name)));
        }
        for folder in suite.vectors.iter().filter_map(|vector| vector.stream.parent()) {
            let entries = std::fs::read_dir(folder).map_err(|error| Failure::file("read", folder, &error))?;
            files.extend(entries.flatten().map(|entry| entry.path()));
        }
        Ok(files)
    }

    /// The folder of the vectors that was named, or the one of the repository.
    fn folder(named: Option<PathBuf>) -> Result<PathBuf, Failure> {
        let named = named.or_else(Suite::locate).ok_or_else(nowhere)?;
        Failure::refuse_standard_input(&named)?;
        let folder = std::path::absolute(&named).map_err(|error| Failure::file("find", &named, &error))?;
        if !folder.is_dir() {
            let path = named.display();
            let what = if folder.exists() { "this is a file" } else { "there is no such directory" };
            return Err(Failure::other(format!("{path}: {what}\n  {SUITE}")));
        }
        Ok(folder)
    }

    fn selection(&self) -> Selection {
        let Self { filter, area, kind, feature, requirement, .. } = self;
        Selection {
            filter: filter.clone(),
            area: area.clone(),
            kind: *kind,
            feature: feature.clone(),
            requirement: requirement.clone(),
        }
    }

    /// The cases meant.
    fn cases<'a>(&self, suite: &'a Suite) -> Result<Vec<Case<'a>>, Failure> {
        self.selection().of(Case::all(suite)).map_err(refused)
    }
}

/// Where vectors come from.
const SUITE: &str = concat!(
    "give their folder with --suite DIR: conformance/vectors of a checkout of ",
    env!("CARGO_PKG_REPOSITORY"),
    ", or what splatstream-conformance-*.tar.xz of a release unpacks to"
);

/// No vectors were named, and none are near.
fn nowhere() -> Failure {
    Failure::other(format!(
        "no vectors: there is no conformance/vectors in the current folder, in that of this program or above them\n  {SUITE}"
    ))
}

fn parse_kind(text: &str) -> Result<Kind, String> {
    let kinds = [Kind::Valid, Kind::Invalid, Kind::Either];
    kinds
        .into_iter()
        .find(|kind| kind.name() == text)
        .ok_or_else(|| "write valid, invalid or either".to_owned())
}

/// A run that cannot be made, as a failure of the command.
fn refused(error: Error) -> Failure {
    match error {
        Error::File { path, what, source } => Failure::file(what, &path, &source),
        Error::Usage(message) => Failure::Usage(message),
        error => Failure::other(error.to_string()),
    }
}

/// A path as the text of an argument.
fn text_of(path: &Path) -> Result<String, Failure> {
    let text = path.to_str().map(str::to_owned);
    text.ok_or_else(|| Failure::other(format!("{}: the path is not Unicode: move the file", path.display())))
}
