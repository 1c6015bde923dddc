//! `splatstream conformance decode`: our decoder as the conformance suite asks decoders.

use crate::failure::Failure;
use clap::Args;
use splatstream_conformance::protocol::{Diagnosis, Request};
use splatstream_conformance::reference;
use splatstream_conformance::serve::serve;
use splatstream_conformance::vector::Mode;
use splatstream_decoder::operating_point::OperatingPoint;
use std::io::{self, ErrorKind};
use std::path::PathBuf;

/// Decode as the conformance protocol asks: planes of integers to files, the verdict as exit code.
///
/// This is what `conformance run` tests if no other decoder is given, and an example for an adapter.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    splatstream conformance decode --in in.gss --op s0,t0,r2 --mode full --out planes/\n  \
    printf 'in.gss\\ts3,t3,r9\\tfull\\tplanes\\n' | splatstream conformance decode --stdio\n\n\
    Exit codes: 0 accept, 10 malformed, 11 invalid, 12 unsupported, 13 over a limit, 14 truncated; the last line on\n\
    standard error then is JSON with class, code, clause and byte.")]
pub(super) struct Decode {
    /// The stream.
    #[arg(long = "in", value_name = "IN.gss", required_unless_present = "stdio")]
    input: Option<PathBuf>,
    /// The operating point.
    #[arg(long, value_name = "sS,tT,rR", default_value = splatstream_conformance::protocol::EVERYTHING)]
    op: OperatingPoint,
    /// full, or subset: only what the units of the operating point hold.
    #[arg(long, value_name = "MODE", default_value = "full")]
    mode: Mode,
    /// A folder for fNNNN.ATTRIBUTE.i32, fNNNN.f32 and uNNNN.entropy; it is made if it is not there.
    #[arg(long, value_name = "DIR", required_unless_present = "stdio")]
    out: Option<PathBuf>,
    /// Answer requests from standard input, a line each: IN tab OP tab MODE tab OUT.
    #[arg(long, conflicts_with_all = ["input", "op", "mode", "out"])]
    stdio: bool,
}

impl Decode {
    /// Answers one request, or all of standard input.
    pub(super) fn run(&self) -> Result<(), Failure> {
        let (Some(input), Some(out)) = (&self.input, &self.out) else {
            return serve(io::stdin().lock(), io::stdout().lock(), reference::answer)
                .map_err(|error| failure(&error));
        };
        let request =
            Request { input: input.clone(), op: self.op.to_string(), mode: self.mode, out: out.clone() };
        let (exit_code, diagnosis) =
            reference::answer(&request).map_err(|error| Failure::other(error.to_string()))?;
        diagnosis.map_or(Ok(()), |diagnosis| Err(verdict(exit_code, &diagnosis)))
    }
}

fn verdict(exit_code: i32, diagnosis: &Diagnosis) -> Failure {
    match serde_json::to_string(diagnosis) {
        Ok(line) => Failure::Verdict { exit_code: u8::try_from(exit_code).unwrap_or(1), line },
        Err(error) => Failure::other(format!("cannot tell the verdict: {error}; please report this")),
    }
}

fn failure(error: &io::Error) -> Failure {
    match error.kind() {
        ErrorKind::InvalidData | ErrorKind::InvalidInput => Failure::Usage(error.to_string()),
        _ => Failure::other(format!("cannot answer: {error}")),
    }
}
