//! `splatstream validate`: whether a stream obeys the specification, every frame decoded.

use crate::console::Console;
use crate::failure::Failure;
use crate::numbers::grouped;
use crate::progress::Progress;
use crate::stream_file::{LimitArgs, StreamFile};
use clap::Args;
use serde::Serialize;
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::decode_stream;
use splatstream_format::{Class, Error};
use std::ops::ControlFlow;
use std::path::PathBuf;

/// Check a stream against the specification: decode all of it and compare every digest.
#[derive(Args)]
#[command(after_help = "Example:\n  splatstream validate talk.gss && echo good\n\n\
    Exit codes: 0 accept, 10 malformed, 11 invalid, 12 unsupported, 13 over a limit, 14 truncated.")]
pub(crate) struct Validate {
    /// The stream.
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
}

impl Validate {
    /// Decodes strictly; the exit code is the verdict.
    pub(crate) fn run(&self, console: &Console) -> Result<(), Failure> {
        let stream = StreamFile::read(&self.input)?;
        let limits = self.limits.limits();
        let frames = stream.sequence(&limits).map_or(0, |sequence| sequence.frame_count);
        let progress = Progress::frames("checking", frames);
        let mut gaussians = 0;
        let options = Options { limits, ..Options::default() };
        let summary = decode_stream(&stream.bytes, &options, |_, frame| {
            gaussians += frame.planes.len() as u64;
            progress.at(frame.number.saturating_add(1));
            ControlFlow::Continue(())
        });
        drop(progress);
        let verdict = Verdict::new(summary.end, summary.frames, gaussians);
        console.report(&verdict, || verdict.text(&self.input))?;
        summary.end.map_or(Ok(()), |error| Err(stream.fault(error)))
    }
}

impl Verdict {
    fn new(error: Option<Error>, frames: u32, gaussians: u64) -> Self {
        let class = error.map(|error| error.class());
        Self {
            outcome: outcome(class),
            class: class.map(Class::name),
            code: error.map(|error| error.kind.code()),
            clause: error.map(|error| error.clause),
            byte: error.map(|error| error.at),
            message: error.map(|error| error.kind.to_string()),
            frames,
            gaussians,
        }
    }

    fn text(&self, path: &std::path::Path) -> String {
        let (path, frames, gaussians) =
            (path.display(), grouped(self.frames.into()), grouped(self.gaussians));
        match self.class {
            None => format!("{path}: accept ({frames} frames, {gaussians} Gaussians, every digest agrees)"),
            Some(class) => format!("{path}: {class}, {frames} frames decoded up to there"),
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
