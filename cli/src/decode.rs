//! `splatstream decode`: a stream to frames in files.

mod clamped;
mod format;
mod loss;
mod report;
mod target;

pub(crate) use target::{frame_directory, has_frames};

use crate::console::Console;
use crate::failure::Failure;
use crate::numbers::FrameRange;
use crate::progress::Progress;
use crate::seek::{Seek, gop_of};
use crate::stream_file::{LimitArgs, StreamFile};
use clap::Args;
use format::Format;
use loss::Loss;
use report::{Report, Shown};
use splatstream_decoder::frame_memory::FrameMemory;
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::process::{DecodedFrame, Options};
use splatstream_decoder::stream::{Summary, decode_stream_to};
use splatstream_format::syntax::SequenceParameters;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use target::{Target, Wanted};

/// Decode a stream to files of Gaussians.
///
/// Every frame is compared with the digest in the stream. Decoding goes on after errors: a damaged refinement costs that
/// refinement, for which carried Gaussians of the I frame stand in; damage that costs more costs the rest of its GOP, and
/// decoding resumes at the next one. The report lists what is lost and what is reduced, and the exit code is that of the
/// first error. With --frames, decoding starts at the GOP that holds the first frame, if the stream has an index.
#[derive(Args)]
#[command(after_help = "Examples:\n  splatstream decode talk.gss -o frames/\n  \
    splatstream decode talk.gss -o poster.ply --op s0,t0,r2 --frames 0..1\n  \
    splatstream decode talk.gss -o frames/ --frames 300..310\n  \
    splatstream decode talk.gss -o - --frames 7..8 --format spz | wc -c\n  \
    splatstream decode talk.gss --dry-run --json")]
pub(crate) struct Decode {
    /// The stream; - is standard input.
    #[arg(value_name = "IN.gss")]
    input: PathBuf,
    /// A directory for frame_0000.ply and so on, or a .ply, .spz, .splat, .glb, .sog or .compressed.ply file for one
    /// frame; - is standard output.
    #[arg(short, long = "out", value_name = "DIR_OR_FILE", required_unless_present = "dry_run")]
    out: Option<PathBuf>,
    /// The operating point: highest spatial layer, temporal layer and refinement; default is everything.
    #[arg(long, value_name = "sS,tT,rR")]
    op: Option<OperatingPoint>,
    /// Frames to write, A..B: from A up to and without B.
    #[arg(long, value_name = "A..B", value_parser = FrameRange::parse)]
    frames: Option<FrameRange>,
    /// Format of the files; default is that of the file's name, or ply.
    #[arg(long, value_enum)]
    format: Option<Format>,
    /// Replace the frames of an earlier run in the directory: files that have the names that this command gives. They go when
    /// all new ones are whole, and stay where the command fails or the stream has an error: the disk has to hold both.
    #[arg(long)]
    force: bool,
    /// Show only the Gaussians of the operating point's units, not those that are carried from the I frame.
    #[arg(long)]
    subset: bool,
    /// Do not compare frames with the digests in the stream.
    #[arg(long)]
    no_verify: bool,
    /// Stop at the first error.
    #[arg(long)]
    strict: bool,
    /// Decode and verify only; write nothing.
    #[arg(long, conflicts_with = "out")]
    dry_run: bool,
    #[command(flatten)]
    limits: LimitArgs,
}

/// What has come out of the stream so far.
struct Decoding<'a> {
    frames: FrameRange,
    target: Option<&'a mut Target>,
    progress: Progress,
    gaussians: u64,
    /// Gaussians of the frames before the first one asked for: decoded too.
    passed: u64,
    bytes: u64,
    shown: Shown,
    failed: Option<Failure>,
    /// Time in which files were made and written.
    writing: Duration,
    /// Where frames go that have been written.
    memory: FrameMemory,
}

impl Decode {
    /// Decodes, writes, and reports; an error of the stream comes after what could be written.
    pub(crate) fn run(&self, console: &Console) -> Result<(), Failure> {
        console.claim(self.out.as_deref())?;
        let stream = StreamFile::read(&self.input)?;
        let options = self.options();
        stream.check_point(options.operating_point, &options.limits)?;
        let frames = self.frames.unwrap_or(FrameRange::ALL);
        let announced = stream.frame_count(&options.limits);
        if announced > 0 && frames.count_in(announced) == 0 {
            let path = stream.path.display();
            return Err(Failure::Usage(format!("{path}: no such frames, the stream has {announced}")));
        }
        let mut target = self.target(frames.count_in(announced))?;
        let mut decoding = Decoding::new(frames, target.as_mut(), announced);
        let start = Instant::now();
        let seek = gop_of(&stream, frames.first, &options.limits);
        let summary = decoding.run(&stream.bytes, seek, &options);
        let total = start.elapsed();
        if let Some(failure) = decoding.failed.take() {
            return Err(failure);
        }
        let verdict = summary.verdict();
        if verdict.is_none() && announced > 0 && decoding.shown.len() == 0 {
            let (path, point) = (stream.path.display(), options.operating_point);
            return Err(Failure::Usage(format!(
                "{path}: none of these frames is at the operating point {point}; give others with --frames, or another with --op"
            )));
        }
        let loss = Loss::new(&stream, announced, &options, &summary, frames, &decoding.shown.indices());
        let mut report = Report { seek, ..self.report(decoding, loss, announced, total) };
        match target {
            Some(target) if verdict.is_some() && target.replaces() => report.keep_earlier(),
            target => target.map_or(Ok(()), Target::finish)?,
        }
        report.warnings.iter().for_each(|warning| console.complain(&warning.text()));
        // Of a file that is no stream there is nothing to say but the error.
        console.report_beside(self.out.as_deref(), &report, || {
            if report.frames > 0 || verdict.is_none() { report.text() } else { String::new() }
        })?;
        verdict.map_or(Ok(()), |error| Err(stream.fault(error)))
    }

    fn options(&self) -> Options {
        Options {
            verify: !self.no_verify,
            operating_point: self.op.unwrap_or(OperatingPoint::ALL),
            stop_at_first_error: self.strict,
            subset: self.subset,
            ..self.limits.options()
        }
    }

    /// Where `frames` frames go; none for a dry run.
    fn target(&self, frames: u32) -> Result<Option<Target>, Failure> {
        let wanted =
            |path| Wanted { path, input: &self.input, format: self.format, frames, force: self.force };
        self.out.as_deref().map(|path| Target::new(wanted(path))).transpose()
    }

    fn report(&self, decoding: Decoding<'_>, loss: Loss, announced: u32, total: Duration) -> Report {
        let seconds = total.saturating_sub(decoding.writing).as_secs_f64();
        let decoded = decoding.gaussians + decoding.passed;
        let frames = decoding.shown.len() as u32;
        let has_errors = !loss.errors.is_empty();
        let point = self.op.unwrap_or(OperatingPoint::ALL);
        let reduced = match has_errors {
            true => {
                let most = loss.listed.unwrap_or_else(|| decoding.shown.most(point));
                decoding.shown.reduced(most, &loss.short)
            }
            false => Vec::new(),
        };
        // Without the announced number nobody knows what stood after an error.
        let is_known = frames > 0 && announced > 0 && !self.strict;
        Report {
            output: self.out.clone(),
            keeps_earlier: false,
            frames,
            frames_in_stream: (announced > 0).then_some(announced),
            gaussians: decoding.gaussians,
            bytes: decoding.bytes,
            seconds,
            seconds_total: total.as_secs_f64(),
            gaussians_per_second: decoded as f64 / seconds.max(f64::MIN_POSITIVE),
            verified: !self.no_verify,
            subset: self.subset,
            seek: None,
            warnings: decoding.target.map(|target| target.warnings()).unwrap_or_default(),
            complete: loss.lost.is_empty() && reduced.is_empty() && (is_known || !has_errors),
            reduced,
            shown: decoding.shown,
            loss,
        }
    }
}

impl<'a> Decoding<'a> {
    fn new(frames: FrameRange, target: Option<&'a mut Target>, announced: u32) -> Self {
        Self {
            frames,
            target,
            progress: Progress::frames("decoding", frames.end.map_or(announced, |end| end.min(announced))),
            gaussians: 0,
            passed: 0,
            bytes: 0,
            shown: Shown::default(),
            failed: None,
            writing: Duration::ZERO,
            memory: FrameMemory::default(),
        }
    }

    /// Decodes all of a stream, or from a GOP on.
    fn run(&mut self, bytes: &[u8], seek: Option<Seek>, options: &Options) -> Summary {
        let memory = self.memory.clone();
        let take = |sequence: &SequenceParameters, frame| self.take(sequence, frame);
        decode_stream_to(&memory, bytes, seek.map(|seek| seek.byte), options, take)
    }

    /// Takes a frame out of the decoder; breaks off after the last frame asked for and when a file fails.
    fn take(&mut self, sequence: &SequenceParameters, frame: DecodedFrame) -> ControlFlow<()> {
        let number = frame.index;
        if self.frames.contains(number) {
            self.count(sequence, &frame);
            self.failed = self.write(sequence, frame).err();
        } else {
            self.passed += frame.planes.len() as u64;
            self.memory.recycle_integers(frame.planes);
        }
        self.progress.at(number.saturating_add(1));
        if self.failed.is_some() || self.frames.is_over(number.saturating_add(1)) {
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(())
    }

    /// Writes a frame where frames go.
    fn write(&mut self, sequence: &SequenceParameters, frame: DecodedFrame) -> Result<(), Failure> {
        let number = frame.index;
        let gaussians = to_gaussians(frame.into_shown(), sequence)?;
        let start = Instant::now();
        let written = self.target.as_mut().map_or(Ok(()), |target| target.write(number, &gaussians));
        self.writing += start.elapsed();
        self.memory.recycle(gaussians);
        written
    }

    fn count(&mut self, sequence: &SequenceParameters, frame: &DecodedFrame) {
        self.gaussians += frame.planes.len() as u64;
        self.bytes += frame.bytes;
        self.shown.take(sequence, frame);
    }
}
