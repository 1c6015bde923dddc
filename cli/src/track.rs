//! `splatstream track`: frames that were trained apart to one sequence.

mod report;
mod settings;

use crate::cameras::{BackgroundArg, CameraArgs, UpName, Views};
use crate::console::Console;
use crate::decode::{frame_directory, has_frames};
use crate::failure::Failure;
use crate::frame_files::FrameFiles;
use crate::frame_name::frame_name;
use crate::input_args::InputArgs;
use crate::numbers::{FrameRange, frames, parse_share};
use crate::output_directory::OutputDirectory;
use crate::output_file::check_directory;
use crate::progress::Progress;
use clap::Args;
use report::{Origin, Tracked, TrackedFrame};
use splatstream_capture::{Following, follow, in_common};
use splatstream_chart::Progress as _;
use splatstream_encoder::FrameSource;
use splatstream_files::ply;
use splatstream_format::payload::SceneDescription;
use splatstream_gaussians::GaussianFrame;
use std::path::PathBuf;
use std::time::Instant;

/// Frames that have at least this share of their Gaussians in common with the one before are sequences already.
const MOST: f64 = 0.5;

/// Make one sequence of frames that were trained apart.
///
/// Frames that were trained each by itself have nothing in common that could be predicted, and what stands still flickers. Here
/// the Gaussians of a frame are trained on until they look like the next, in pictures drawn of it, and change no more than that
/// takes. Streams of the result are a third to a half as large. Every so many frames one is kept as it is, as the first of a GOP,
/// so that what comes into view is taken up. So are frames that have most of their Gaussians in common with the one before:
/// encode predicts these better as they are.
#[derive(Args)]
#[command(
    after_help = "Example:\n  splatstream track frames/ -o tracked/ --cameras capture/transforms.json\n  \
    splatstream encode tracked/ -o talk.gss"
)]
pub(crate) struct Track {
    /// Files, or one directory of frames, or one file of many.
    #[arg(value_name = "INPUT", required = true)]
    inputs: Vec<PathBuf>,
    /// A directory for frame_0000.ply and so on.
    #[arg(short, long, value_name = "DIR")]
    out: PathBuf,
    /// Frames in a GOP: frames 0, N, 2 N and so on are kept as they are. What encode is given too.
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = clap::value_parser!(u32).range(2..=65_535))]
    gop: u32,
    /// From where the scene is looked at, since frames are followed as they look from there and from nowhere else: the
    /// cameras that they were trained with (a cameras.json or transforms.json, or a directory with a model of COLMAP),
    /// ring:N for what is seen from all around, or forward:N.
    #[arg(long, value_name = "CAMS.json|ring:N|forward:N")]
    cameras: Views,
    /// What points up in the scene, where the views have to be made; default is -y, as trainers write it.
    #[arg(long, value_enum, allow_hyphen_values = true)]
    up: Option<UpName>,
    /// Pictures that are drawn of each frame.
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    views: u32,
    /// Rows of the pictures.
    #[arg(long, value_name = "ROWS", default_value_t = 180, value_parser = clap::value_parser!(u32).range(32..=8640))]
    height: u32,
    /// Steps of each frame, each on one picture.
    #[arg(long, value_name = "N", default_value_t = 150, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    iterations: u32,
    /// How firmly values stay what they were in the frame before, 0 to 1. More makes smaller streams that follow their
    /// source less.
    #[arg(long, value_name = "SHARE", default_value_t = 0.3, value_parser = parse_share)]
    hold: f64,
    /// A frame that comes no closer to its source than this PSNR in decibels is kept as it is: the scene was cut.
    #[arg(long, value_name = "DB", default_value_t = 20.0)]
    cut: f64,
    /// Track frames too that have most of their Gaussians in common with the one before.
    #[arg(long)]
    all: bool,
    #[command(flatten)]
    background: BackgroundArg,
    /// Frames to make, A..B: from the first of the GOP that A is in, up to and without B. No GOP needs another, so that many
    /// machines can share the work.
    #[arg(long, value_name = "A..B", value_parser = FrameRange::parse)]
    frames: Option<FrameRange>,
    /// Keep frames that are there already, as an earlier run with the same settings left them: the directory has them in
    /// .track-settings.json, and others are refused.
    #[arg(long, conflicts_with = "force")]
    resume: bool,
    /// Replace the frames of an earlier run in the directory: files that have the names that frames are given. They go when all
    /// new ones are whole, and stay where the command fails or is interrupted, which then leaves none of its own: the disk has to
    /// hold both.
    #[arg(long)]
    force: bool,
    /// Chooses the views and the order of pictures.
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    reading: InputArgs,
}

impl Track {
    /// Reads, trains, writes, frame by frame.
    pub(crate) fn run(&self, console: &Console) -> Result<(), Failure> {
        let begin = Instant::now();
        let mut files = FrameFiles::find(&self.inputs, self.reading)?;
        let inputs = self.files_read(&files);
        check_directory(&self.out, "frames of a sequence")?;
        let span = self.span(files.len())?;
        let mut directory = self.directory(&files, &inputs)?;
        let first = span.first - span.first % self.gop;
        let mut report = Tracked::new(self.out.clone());
        let mut settings = Following::default();
        let mut before: Option<GaussianFrame> = None;
        for number in (first..files.len()).take_while(|number| !span.is_over(*number)) {
            let source = files.frame(number).map_err(|error| Failure::other(error.to_string()))?;
            // Nothing goes from GOP to GOP, views neither.
            if number.is_multiple_of(self.gop) {
                (settings, before) = (self.settings(&source)?, None);
            }
            let start = before.take().filter(|before| !before.is_empty());
            let name = format!("{}.ply", frame_name(number));
            let path = directory.path_of(&name);
            let tracked = match self.resume && path.is_file() {
                true => TrackedFrame::kept(),
                false => self.make(start, &source, &settings, (&mut directory, &name), number)?,
            };
            // The next one starts from what is in the file, as it does when it is resumed.
            let made = self.reading.frame(&directory.place_of(&name))?;
            report.add(number, path, made.len(), tracked);
            before = Some(made);
        }
        directory.finish()?;
        files.warnings().iter().for_each(|warning| console.complain(&warning.text()));
        report.finish(begin.elapsed());
        console.report(&report, || report.text())
    }

    /// The directory of the frames, with the settings of this run.
    fn directory(&self, files: &FrameFiles, inputs: &[PathBuf]) -> Result<OutputDirectory, Failure> {
        let settings = self.kept_settings(files)?;
        if self.resume {
            return settings.resume(&self.out, inputs, has_frames);
        }
        let mut directory = frame_directory(&self.out, inputs, self.force)?;
        settings.write(&mut directory)?;
        Ok(directory)
    }

    /// The frames to make, of so many that there are.
    fn span(&self, count: u32) -> Result<FrameRange, Failure> {
        let span = self.frames.unwrap_or(FrameRange::ALL);
        if span.first < count {
            return Ok(span);
        }
        Err(Failure::Usage(format!("there are {}, the last is {}", frames(count), count.saturating_sub(1))))
    }

    /// The files of the frames, and of the cameras.
    fn files_read(&self, files: &FrameFiles) -> Vec<PathBuf> {
        [files.inputs(), self.cameras.files()].concat()
    }

    /// How frames of a GOP are followed; views are those of its first.
    fn settings(&self, first: &GaussianFrame) -> Result<Following, Failure> {
        let nothing = SceneDescription::default();
        let views = CameraArgs { height: Some(self.height), up: self.up };
        // What is seen from all around is looked at from all heights too, not only from where a ring stands.
        let cameras = match &self.cameras {
            Views::Ring(_) => Vec::new(),
            named => views.cameras(Some(named), first, &nothing)?,
        };
        Ok(Following {
            iterations: self.iterations,
            views: self.views,
            height: self.height,
            hold: self.hold as f32,
            cameras,
            up: views.up(&nothing),
            background: self.background.colour(&nothing),
            seed: self.seed,
            ..Following::default()
        })
    }

    /// Writes a frame: the one before it as it looks like the source, or the source.
    fn make(
        &self,
        before: Option<GaussianFrame>,
        source: &GaussianFrame,
        settings: &Following,
        (directory, name): (&mut OutputDirectory, &str),
        number: u32,
    ) -> Result<TrackedFrame, Failure> {
        let begin = Instant::now();
        let mut keep = |origin, common| {
            directory.write(name, &ply::write(source))?;
            Ok(TrackedFrame::source(origin, common))
        };
        let Some(before) = before.filter(|_| !source.is_empty()) else { return keep(Origin::Source, None) };
        let common = in_common(source, &before);
        if common >= MOST && !self.all {
            return keep(Origin::Alike, Some(common));
        }
        // Other views for every frame: what one frame's views do not show, those of the next do.
        let settings = Following { seed: self.seed.wrapping_add(number.into()), ..settings.clone() };
        let progress = Progress::steps(settings.iterations);
        progress.step(format!("frame {number}"));
        let followed = follow(before, source, &settings, &mut |_| progress.advance());
        drop(progress);
        let followed = followed.map_err(|error| Failure::other(format!("frame {number}: {error}")))?;
        let is_cut = followed.psnr_db < self.cut;
        let frame = if is_cut { source } else { &followed.frame };
        directory.write(name, &ply::write(frame))?;
        Ok(TrackedFrame {
            origin: if is_cut { Origin::Cut } else { Origin::Tracked },
            kept: false,
            in_common: Some(common),
            psnr_before_db: Some(followed.psnr_before_db),
            psnr_db: Some(followed.psnr_db),
            seconds: begin.elapsed().as_secs_f64(),
        })
    }
}
