//! Decoders with one planted error each, built on the reference decoder: they test the conformance runner. `tests/caught.rs`
//! runs each of them and checks that it is found, and found for its own error.

mod fault;
mod frames;
mod streams;

use clap::Parser;
use fault::Fault;
use splatstream_conformance::protocol::Request;
use splatstream_conformance::serve::serve;
use splatstream_conformance::vector::Mode;
use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;

/// A decoder with a planted error.
#[derive(Parser)]
#[command(after_help = "Example:\n  \
    splatstream conformance run --decoder 'planted one-lsb-in-last-frame --in {in} --op {op} --mode {mode} --out {out}'")]
struct Planted {
    /// What it does wrong.
    #[arg(value_enum)]
    fault: Fault,
    /// The stream.
    #[arg(long = "in", required_unless_present = "stdio")]
    input: Option<PathBuf>,
    /// The operating point.
    #[arg(long, default_value = splatstream_conformance::protocol::EVERYTHING)]
    op: String,
    /// full, subset or inside.
    #[arg(long, default_value = "full")]
    mode: Mode,
    /// A folder for the planes.
    #[arg(long, required_unless_present = "stdio")]
    out: Option<PathBuf>,
    /// Answer requests from standard input.
    #[arg(long)]
    stdio: bool,
}

fn main() -> io::Result<ExitCode> {
    let planted = Planted::parse();
    let fault = planted.fault;
    let (Some(input), Some(out)) = (planted.input, planted.out) else {
        serve(io::stdin().lock(), io::stdout().lock(), |request| fault.answer(request))?;
        return Ok(ExitCode::SUCCESS);
    };
    let request = Request { input, op: planted.op, mode: planted.mode, out };
    let (code, diagnosis) = fault.answer(&request)?;
    if let Some(diagnosis) = diagnosis {
        writeln!(io::stderr(), "{}", serde_json::to_string(&diagnosis)?)?;
    }
    Ok(ExitCode::from(u8::try_from(code).unwrap_or(1)))
}
