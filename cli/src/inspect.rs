//! `splatstream inspect`: what is in a stream, where, and which clause says so.

mod costs;
mod deps;
mod element;
mod hex;
mod hull;
mod points;
mod tree;
mod units;

use crate::console::Console;
use crate::failure::Failure;
use crate::stream_file::{LimitArgs, StreamFile, fault};
use clap::Args;
use splatstream_format::Error;
use std::path::PathBuf;

/// Show the elements of a stream: offset, value, meaning, clause. Works on damaged streams.
///
/// Offsets are those of bytes; 0x1a4+3 is bit 3 of byte 0x1a4. The clauses are those of the specification. Elements and
/// units are written while the stream is read, so that it can come by a pipe and have any length.
#[derive(Args)]
#[command(after_help = "Examples:\n  splatstream inspect talk.gss | less\n  \
    splatstream inspect talk.gss --units\n  splatstream inspect talk.gss --ops --json\n  \
    splatstream inspect talk.gss --deps --dot | dot -Tsvg > talk.svg\n  \
    splatstream inspect talk.gss --hex 3")]
pub(crate) struct Inspect {
    /// The stream; - is standard input.
    #[arg(value_name = "IN.gss")]
    input: PathBuf,
    #[command(flatten)]
    view: View,
    /// With --deps: as a graph for Graphviz.
    #[arg(long, requires = "deps")]
    dot: bool,
    #[command(flatten)]
    limits: LimitArgs,
}

#[derive(Args)]
#[group(multiple = false)]
struct View {
    /// Every element of every unit (this is what is shown if nothing is asked for).
    #[arg(long)]
    tree: bool,
    /// One line per unit.
    #[arg(long)]
    units: bool,
    /// The operating points: bytes, Gaussians, bits per Gaussian and PSNR of each, and the hull of those that no other
    /// beats.
    #[arg(long)]
    ops: bool,
    /// The units of each GOP and frame, and what each needs to be decoded.
    #[arg(long)]
    deps: bool,
    /// What each attribute and each kind of unit costs.
    #[arg(long)]
    stats: bool,
    /// The bytes of one unit beside its elements; units count from 0.
    #[arg(long, value_name = "UNIT")]
    hex: Option<usize>,
}

impl Inspect {
    /// Shows one view; the first error of the stream comes after what can be shown.
    pub(crate) fn run(&self, console: &Console) -> Result<(), Failure> {
        // What an argument requires is not asked for where it conflicts with one that is there.
        if self.dot && !self.view.deps {
            return Err(Failure::Usage("--dot is a form of --deps: give both".to_owned()));
        }
        let options = self.limits.options_to_draw();
        let limits = options.limits;
        let stream = || StreamFile::read(&self.input);
        let error = match &self.view {
            View { units: true, .. } => units::show(&self.input, &limits, console),
            View { ops: true, .. } => points::show(&stream()?, &options, console),
            View { deps: true, .. } => deps::show(&stream()?, self.dot, &limits, console),
            View { stats: true, .. } => costs::show(&stream()?, &limits, console),
            View { hex: Some(unit), .. } => hex::show(&stream()?, *unit, &limits, console),
            View { .. } => tree::show(&self.input, &limits, console),
        }?;
        error.map_or(Ok(()), |error| Err(fault(&self.input, error)))
    }
}

/// What a view gives back: the first error of the stream, shown after the view.
type Shown = Result<Option<Error>, Failure>;

/// The span of bytes from `at` on.
fn span(at: u64, bytes: u64) -> String {
    format!("{at:#x}..{:#x}", at.saturating_add(bytes))
}
