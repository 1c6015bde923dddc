//! `splatstream extract`: the stream that holds just one operating point.

use crate::console::Console;
use crate::failure::Failure;
use crate::numbers::{grouped, percent};
use crate::output_file::{OutputFile, check_stream_name, refuse_inputs};
use crate::stream_file::{LimitArgs, StreamFile};
use clap::Args;
use serde::Serialize;
use splatstream_decoder::operating_point::{OperatingPoint, extract};
use std::path::PathBuf;
use std::slice;

/// Write the part of a stream that an operating point needs. Nothing is decoded.
#[derive(Args)]
#[command(after_help = "Example:\n  splatstream extract talk.gss --op s0,t0,r1 -o talk-small.gss")]
pub(crate) struct Extract {
    /// The stream; - is standard input.
    #[arg(value_name = "IN.gss")]
    input: PathBuf,
    /// The operating point: highest spatial layer, temporal layer and refinement, counted from 0.
    #[arg(long, value_name = "sS,tT,rR")]
    op: OperatingPoint,
    /// The stream to write; - is standard output.
    #[arg(short, long = "out", value_name = "OUT.gss")]
    out: PathBuf,
    #[command(flatten)]
    limits: LimitArgs,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Report {
    output: PathBuf,
    op: String,
    bytes: u64,
    bytes_in: u64,
}

impl Extract {
    /// Copies the units of the operating point.
    pub(crate) fn run(&self, console: &Console) -> Result<(), Failure> {
        console.claim(Some(&self.out))?;
        check_stream_name(&self.out)?;
        refuse_inputs(&self.out, slice::from_ref(&self.input))?;
        let stream = StreamFile::read(&self.input)?;
        let limits = self.limits.limits();
        stream.check_point(self.op, &limits)?;
        let extracted = extract(&stream.bytes, self.op, &limits).map_err(|error| stream.fault(error))?;
        OutputFile::write_apart(&self.out, slice::from_ref(&self.input), &extracted)?;
        let report = Report {
            output: self.out.clone(),
            op: self.op.to_string(),
            bytes: extracted.len() as u64,
            bytes_in: stream.bytes.len() as u64,
        };
        console.report_beside(Some(&self.out), &report, || report.text())
    }
}

impl Report {
    fn text(&self) -> String {
        let share = percent(self.bytes, self.bytes_in);
        let (bytes, all) = (grouped(self.bytes), grouped(self.bytes_in));
        format!("{}: {}, {bytes} of {all} bytes ({share:.1} %)", self.output.display(), self.op)
    }
}
