//! Decoders with one planted fault each, built on the reference decoder: what the conformance runner has to catch.
//!
//! A runner that has never seen a wrong decoder is not tested. `tests/caught.rs` runs every fault and demands that it is
//! caught for what it is.

mod fault;
mod frames;

use clap::Parser;
use fault::Fault;
use splatstream_conformance::protocol::Request;
use splatstream_conformance::serve::serve;
use splatstream_conformance::vector::Mode;
use std::io;
use std::path::PathBuf;
use std::process::ExitCode;

/// A decoder with a planted fault.
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
    /// full or subset.
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
        serve(io::stdin().lock(), io::stdout().lock(), |request| Ok((fault.answer(request)?, None)))?;
        return Ok(ExitCode::SUCCESS);
    };
    let request = Request { input, op: planted.op, mode: planted.mode, out };
    let code = fault.answer(&request)?;
    Ok(ExitCode::from(u8::try_from(code).unwrap_or(1)))
}
