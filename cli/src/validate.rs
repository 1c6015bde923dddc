//! `splatstream validate`: whether a stream obeys the specification, every frame decoded.

use crate::console::Console;
use crate::failure::{Failure, StreamFault, faults_text};
use crate::numbers::{counted, frames};
use crate::progress::Progress;
use crate::stream_file::{LimitArgs, StreamFile};
use clap::Args;
use serde::Serialize;
use splatstream_decoder::frame_memory::FrameMemory;
use splatstream_decoder::stream::{Summary, decode_stream_to};
use splatstream_format::Class;
use std::ops::ControlFlow;
use std::path::PathBuf;

/// Check a stream against the specification: decode all of it and compare every digest.
#[derive(Args)]
#[command(after_help = "Example:\n  splatstream validate talk.gss && echo good\n\n\
    Exit codes: 0 accept, 10 malformed, 11 invalid, 12 unsupported, 13 over a limit, 14 truncated.")]
pub(crate) struct Validate {
    /// The stream; - is standard input.
    #[arg(value_name = "IN.gss")]
    input: PathBuf,
    #[command(flatten)]
    limits: LimitArgs,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Verdict {
    outcome: &'static str,
    class: Option<&'static str>,
    code: Option<&'static str>,
    clause: Option<&'static str>,
    byte: Option<u64>,
    message: Option<String>,
    frames: u32,
    gaussians: u64,
    /// Every error, in the order of the stream; the first is the verdict.
    errors: Vec<StreamFault>,
}

impl Validate {
    /// Decodes all of the stream, also after errors; the exit code is the verdict, the first of them.
    pub(crate) fn run(&self, console: &Console) -> Result<(), Failure> {
        let stream = StreamFile::read(&self.input)?;
        let options = self.limits.options();
        let frames = stream.frame_count(&options.limits);
        let progress = Progress::frames("checking", frames);
        let mut gaussians = 0;
        let memory = FrameMemory::default();
        let summary = decode_stream_to(&memory, &stream.bytes, None, &options, |_, frame| {
            gaussians += frame.planes.len() as u64;
            progress.at(frame.index.saturating_add(1));
            memory.recycle_integers(frame.planes);
            ControlFlow::Continue(())
        });
        drop(progress);
        let verdict = Verdict::new(&summary, gaussians);
        console.report(&verdict, || verdict.text(&self.input))?;
        summary.verdict().map_or(Ok(()), |error| Err(stream.fault(error)))
    }
}

impl Verdict {
    fn new(summary: &Summary, gaussians: u64) -> Self {
        let error = summary.verdict();
        let class = error.map(|error| error.class());
        Self {
            outcome: outcome(class),
            class: class.map(Class::name),
            code: error.map(|error| error.kind.code()),
            clause: error.map(|error| error.clause),
            byte: error.map(|error| error.at),
            message: error.map(|error| error.kind.to_string()),
            frames: summary.frames,
            gaussians,
            errors: summary.errors.iter().copied().map(StreamFault::from).collect(),
        }
    }

    fn text(&self, path: &std::path::Path) -> String {
        let (path, frames) = (path.display(), frames(self.frames));
        let gaussians = counted(self.gaussians, "Gaussian");
        match self.class {
            None => format!("{path}: accept ({frames}, {gaussians}, every digest agrees)"),
            Some(class) => {
                format!("{path}: {class}, {frames} decoded\n{}", faults_text(&self.errors))
            }
        }
    }
}

/// The outcome of the conformance protocol.
fn outcome(class: Option<Class>) -> &'static str {
    match class {
        None => "accept",
        Some(Class::Malformed | Class::Invalid) => "reject",
        Some(class) => class.name(),
    }
}
