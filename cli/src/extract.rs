//! `splatstream extract`: the stream that holds just one operating point.

use crate::console::Console;
use crate::failure::Failure;
use crate::numbers::frames;
use crate::output_file::{OutputFile, check_stream_name, refuse_inputs};
use crate::short_frames::{layers_of, short_frames};
use crate::stream_file::{SizeArgs, StreamFile};
use clap::Args;
use serde::Serialize;
use splatstream_chart::numbers::{grouped, percent};
use splatstream_decoder::operating_point::{OperatingPoint, extract};
use splatstream_format::Limits;
use splatstream_stream::ending::complete_gops;
use splatstream_stream::structure::{Frame, Structure};
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::slice;

/// Write the part of a stream that an operating point needs. Nothing is decoded.
#[derive(Args)]
#[command(after_help = "Examples:\n  splatstream extract talk.gss --op s0,t0,r1 -o talk-small.gss\n  \
    splatstream extract cut.gss --incomplete -o whole.gss  # of a stream that was cut: its complete GOPs")]
pub(crate) struct Extract {
    /// The stream; - is standard input.
    #[arg(value_name = "IN.gss")]
    input: PathBuf,
    /// The operating point: highest spatial layer, temporal layer and refinement, counted from 0.
    #[arg(long, value_name = "sS,tT,rR", required_unless_present = "incomplete")]
    op: Option<OperatingPoint>,
    /// Of a stream that is cut, or damaged further on: write the GOPs before that, with an end made for them.
    #[arg(long)]
    incomplete: bool,
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
    op: String,
    bytes: u64,
    bytes_in: u64,
    /// Frames in it, of those that the stream says it has.
    frames: u32,
    frames_in_stream: Option<u32>,
    /// Frames that the stream says it has and that are not there; first and last of each run.
    lost: Vec<(u32, u32)>,
    /// Frames of which a unit that was written is damaged.
    damaged: Vec<u32>,
    /// Frames that lack units of the point.
    reduced: BTreeSet<u32>,
    complete: bool,
}

impl Extract {
    /// Copies the units of the operating point.
    pub(crate) fn run(&self, console: &Console) -> Result<(), Failure> {
        console.claim(Some(&self.out))?;
        check_stream_name(&self.out)?;
        refuse_inputs(&self.out, slice::from_ref(&self.input))?;
        let stream = StreamFile::read(&self.input)?;
        let limits = self.limits.limits();
        let point = self.op.unwrap_or_else(|| stream.highest_point(&limits));
        stream.check_point(point, &limits)?;
        let shortened = self.incomplete.then(|| complete_gops(&stream.bytes, &limits)).transpose();
        let shortened = shortened.map_err(|error| stream.fault(error))?;
        let bytes = shortened.as_ref().unwrap_or(&stream.bytes);
        let extracted = extract(bytes, point, &limits).map_err(|error| stream.fault(error))?;
        OutputFile::write_apart(&self.out, slice::from_ref(&self.input), &extracted)?;
        let report = Report::new(self, &stream, point, &extracted, &limits);
        console.report_beside(Some(&self.out), &report, || report.text())
    }
}

fn frames_of(structure: &Structure) -> impl Iterator<Item = &Frame> {
    structure.gops.iter().flat_map(|gop| &gop.frames)
}

fn is_damaged(frame: &Frame) -> bool {
    frame.span.damaged || frame.increments.iter().any(|increment| increment.span.damaged)
}

impl Report {
    fn new(
        command: &Extract,
        stream: &StreamFile,
        point: OperatingPoint,
        extracted: &[u8],
        limits: &Limits,
    ) -> Self {
        let (whole, part) = (Structure::of(&stream.bytes, limits), Structure::of(extracted, limits));
        let announced = Some(stream.frame_count_of(&whole, limits)).filter(|&count| count > 0);
        let there = frames_of(&whole).map(|frame| frame.index).collect();
        let lost = whole.missing(&there, announced, layers_of(OperatingPoint::ALL));
        let damaged: Vec<u32> =
            frames_of(&part).filter(|frame| is_damaged(frame)).map(|frame| frame.index).collect();
        let reduced = short_frames(&stream.bytes, &whole, point, !lost.is_empty(), limits);
        let is_there = lost.is_empty() && damaged.is_empty() && reduced.is_empty();
        Self {
            output: command.out.clone(),
            op: point.to_string(),
            bytes: extracted.len() as u64,
            bytes_in: stream.bytes.len() as u64,
            frames: frames_of(&part).count() as u32,
            frames_in_stream: announced,
            complete: is_there && part.error.is_none() && announced.is_some(),
            lost,
            damaged,
            reduced,
        }
    }

    fn text(&self) -> String {
        let share = percent(self.bytes, self.bytes_in);
        let (bytes, all) = (grouped(self.bytes), grouped(self.bytes_in));
        let shown = match self.frames_in_stream {
            Some(count) => format!("{} of {}", self.frames, frames(count)),
            None => frames(self.frames),
        };
        let mut text = format!(
            "{}: {}, {shown}, {bytes} of {all} bytes ({share:.1} %)\n",
            self.output.display(),
            self.op,
        );
        for (first, last) in &self.lost {
            text += &format!("  lost         frames {first}..={last}\n");
        }
        for frame in &self.damaged {
            text += &format!("  damaged      frame {frame}\n");
        }
        for frame in &self.reduced {
            text += &format!("  frame {frame} lacks units that the stream says it has\n");
        }
        text
    }
}
