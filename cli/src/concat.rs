//! `splatstream concat`: streams one after the other, as one stream.

use crate::console::Console;
use crate::failure::Failure;
use crate::numbers::{counted, frames};
use crate::output_file::{OutputFile, check_stream_name, refuse_inputs};
use crate::progress::Progress;
use crate::stream_file::{SizeArgs, fault};
use clap::Args;
use serde::Serialize;
use splatstream_encoder::{ConcatError, PartError, StreamPart, concat};
use splatstream_format::Limits;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Join streams to one. Nothing is decoded.
///
/// Shards of `encode --shard` are put in the order of their frames, and give the stream that a single run writes, byte
/// for byte; a shard that is missing, damaged, or of another plan is an error. Other streams follow each other as they
/// are given; they must have the same sequence parameters. These follow from the frames, so that frames which are encoded by
/// themselves have a grid and steps of their own: encode all frames of a programme as one sequence.
#[derive(Args)]
#[command(after_help = "Examples:\n  splatstream concat shards/*.gss -o talk.gss\n  \
    splatstream concat talk.gss talk.gss -o twice.gss")]
pub(crate) struct Concat {
    /// Streams: all shards of a sequence in any order, or streams with the same sequence parameters.
    #[arg(required = true, value_name = "IN.gss")]
    inputs: Vec<PathBuf>,
    /// The stream to write; - is standard output.
    #[arg(short, long = "out", value_name = "OUT.gss")]
    out: PathBuf,
    #[command(flatten)]
    limits: SizeArgs,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Report {
    output: PathBuf,
    bytes: u64,
    frames: u32,
    gops: u32,
    parts: Vec<Part>,
}

/// A stream that was joined with others.
#[derive(Serialize)]
struct Part {
    file: PathBuf,
    bytes: u64,
    /// Its first frame in the stream, and how many it has.
    first_frame: u32,
    frames: u32,
    gops: u32,
    /// Whether it is a shard.
    shard: bool,
}

impl Concat {
    /// Reads every stream twice: to see whether they belong together, and to join them.
    pub(crate) fn run(&self, console: &Console) -> Result<(), Failure> {
        console.claim(Some(&self.out))?;
        check_stream_name(&self.out)?;
        refuse_inputs(&self.out, &self.inputs)?;
        let limits = self.limits.limits();
        let progress = Progress::files("checking", self.inputs.len() as u32);
        let mut parts = Vec::new();
        for (done, path) in (0..).zip(&self.inputs) {
            progress.at(done);
            parts.push(scan(path, &limits)?);
        }
        drop(progress);
        let mut file = OutputFile::create(&self.out, &self.inputs)?;
        let mut open =
            |part: usize| File::open(&self.inputs[part]).map(|file| Box::new(file) as Box<dyn Read>);
        let joined = concat(&parts, &mut open, &mut file, &limits).map_err(|error| self.failure(error))?;
        file.finish()?;
        let mut report = Report {
            output: self.out.clone(),
            bytes: joined.bytes,
            frames: joined.frames,
            gops: joined.gops,
            parts: Vec::new(),
        };
        let mut first_frame = 0;
        for part in joined.order {
            let (file, part) = (self.inputs[part].clone(), &parts[part]);
            let &StreamPart { bytes, frames, gops, .. } = part;
            report.parts.push(Part { file, bytes, first_frame, frames, gops, shard: part.shard.is_some() });
            first_frame += frames;
        }
        console.report_beside(Some(&self.out), &report, || report.text())
    }

    /// The library counts parts; a user has files.
    fn failure(&self, error: ConcatError) -> Failure {
        let name = |part: usize| self.inputs[part].display();
        match error {
            ConcatError::Part { part, error } => of_part(&self.inputs[part], error),
            ConcatError::Differs { part, other, name: element, value, expected } => Failure::other(format!(
                "{}: {element} is {value}, and {expected} in {}: streams are joined only if all sequence parameters are the same, which follow \
                 from the frames\n  encode all frames as one sequence, or its parts with one plan: `splatstream encode --write-plan`",
                name(part),
                name(other)
            )),
            ConcatError::OtherPlan { part, other } => Failure::other(format!(
                "{}: is a shard of another plan than {}\n  encode all shards with one plan and the same options: \
                 `splatstream encode --write-plan`",
                name(part),
                name(other)
            )),
            ConcatError::NoShard { part, other } => Failure::other(format!(
                "{}: is a shard, and {} is none\n  join all shards of the sequence first",
                name(part),
                name(other)
            )),
            ConcatError::Overlap { part, other, .. } if self.inputs.get(part) == self.inputs.get(other) => {
                Failure::other(format!("{}: is given twice\n  give every shard once", name(part)))
            }
            ConcatError::Overlap { part, other, frames } => Failure::other(format!(
                "{}: holds frames {}..={}, which {} holds too\n  give every shard once",
                name(part),
                frames.start,
                frames.end - 1,
                name(other)
            )),
            ConcatError::Missing { frames, sequence_frames } => Failure::other(format!(
                "frames {}..={} of {sequence_frames} are in none of the shards\n  give all shards of the sequence",
                frames.start,
                frames.end - 1
            )),
            ConcatError::Write(splatstream_encoder::Error::Output(cause)) => {
                Failure::file("write", &self.out, &cause)
            }
            error => Failure::other(error.to_string()),
        }
    }
}

fn scan(path: &Path, limits: &Limits) -> Result<StreamPart, Failure> {
    let mut file = File::open(path).map_err(|error| Failure::file("read", path, &error))?;
    StreamPart::scan(&mut file, limits).map_err(|error| of_part(path, error))
}

fn of_part(path: &Path, error: PartError) -> Failure {
    match error {
        PartError::Read(error) => Failure::file("read", path, &error),
        PartError::Stream(error) => fault(path, error),
        error => Failure::other(format!("{}: {error}", path.display())),
    }
}

impl Report {
    fn text(&self) -> String {
        let part = if self.parts.iter().all(|part| part.shard) { "shard" } else { "stream" };
        let mut text = format!(
            "{}: {}, {} in {}, of {}\n",
            self.output.display(),
            counted(self.bytes, "byte"),
            frames(self.frames),
            counted(self.gops.into(), "GOP"),
            counted(self.parts.len() as u64, part),
        );
        for Part { file, bytes, first_frame, frames, .. } in &self.parts {
            let last = (first_frame + frames).saturating_sub(1);
            let (file, bytes) = (file.display(), counted(*bytes, "byte"));
            text += &match frames {
                1 => format!("  {file}: frame {first_frame}, {bytes}\n"),
                _ => format!("  {file}: frames {first_frame}..={last}, {bytes}\n"),
            };
        }
        text
    }
}
