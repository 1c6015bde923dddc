//! `splatstream fit`: pictures and cameras to Gaussians.

mod captures;
mod report;
mod settings;
mod training;

use crate::cameras::BackgroundArg;
use crate::capture_files::files_of;
use crate::console::Console;
use crate::decode::{frame_directory, has_frames};
use crate::failure::Failure;
use crate::frames::{Frames, Opened};
use crate::input_args::InputArgs;
use crate::memory_bound::{MemoryBound, bytes_of_gaussians};
use crate::numbers::{FrameRange, counted, parse_share};
use crate::output_directory::OutputDirectory;
use crate::output_file::{OutputFile, check_directory, refuse_inputs, refuse_standard};
use crate::stream_file::LimitArgs;
use captures::Captures;
use clap::Args;
use report::{Fitted, FittedFrame};
use splatstream_files::ply;
use splatstream_format::payload::SceneDescription;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::Camera;
use splatstream_render::camera::{Capture, CapturedView};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use training::Training;

/// What the bound on memory is of.
const OF_MEMORY: &str = "Most memory that training and decoding a start may take, as in 512M or 4G; pictures and Gaussians that take \
    more, and a stream that asks for more, are refused (exit code 13) [default: three quarters of what this machine has free, \
    and a quarter of that for decoding]";

/// Train a scene of Gaussians from pictures and their cameras.
///
/// A capture is a directory with a transforms.json (nerfstudio, instant-ngp, NeRF) or a model of COLMAP (text or binary, in it,
/// in sparse/0 or in sparse); a directory of captures is a sequence. Every eighth picture is not trained with, and the PSNR
/// that is reported is that of these. The same pictures and settings give the same scene.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  splatstream simulate -o capture/ --height 360\n  splatstream fit capture/ -o scene.ply\n  \
    splatstream fit walk/ -o frames/ --warm                  # each frame starts from the one before, Gaussian by Gaussian\n  \
    splatstream fit capture/ --start scene.gss --iterations 0  # only what a scene is worth beside the pictures",
    mut_arg("max_memory", |memory| memory.help(OF_MEMORY).long_help(OF_MEMORY))
)]
pub(crate) struct Fit {
    /// A capture, a camera file, or a directory of captures.
    #[arg(value_name = "CAPTURE")]
    input: PathBuf,
    /// The scene, .ply; of a sequence a directory for frame_0000.ply and so on. May be left out with --iterations 0.
    #[arg(short, long, value_name = "OUT", required_unless_present = "start")]
    out: Option<PathBuf>,
    /// Steps of each frame, each on one picture.
    #[arg(long, value_name = "N", default_value_t = 3000, value_parser = clap::value_parser!(u32).range(0..=1_000_000))]
    iterations: u32,
    /// Gaussians at most.
    #[arg(long, value_name = "N", default_value_t = 50_000, value_parser = clap::value_parser!(u32).range(100..=10_000_000))]
    gaussians: u32,
    /// Degree of the spherical harmonics.
    #[arg(long, value_name = "0..3", default_value_t = 2, value_parser = clap::value_parser!(u8).range(0..=3))]
    sh_degree: u8,
    /// Rows that pictures are made smaller to.
    #[arg(long, value_name = "ROWS", value_parser = clap::value_parser!(u32).range(16..=8640))]
    height: Option<u32>,
    /// Where the pictures are, if not where the capture says.
    #[arg(long, value_name = "DIR")]
    images: Option<PathBuf>,
    /// Every so many pictures one is kept from training, to be judged by; 0 keeps none.
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u32).range(0..=1000))]
    hold_out: u32,
    /// A scene, sequence or stream to start from, frame by frame, instead of the points of the capture.
    #[arg(long, value_name = "IN")]
    start: Option<PathBuf>,
    /// Random points to start from where the capture has none.
    #[arg(long, value_name = "N", default_value_t = 20_000, value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    random_points: u32,
    /// Start each frame but the first from the one before, and keep its Gaussians: the same number in the same order.
    #[arg(long)]
    warm: bool,
    /// Steps of each frame that starts from the one before.
    #[arg(long, value_name = "N", default_value_t = 300, value_parser = clap::value_parser!(u32).range(0..=1_000_000))]
    warm_iterations: u32,
    /// With --warm: how firmly values stay what they were in the frame before, 0 to 1. More makes smaller streams that
    /// follow the pictures less.
    #[arg(long, value_name = "SHARE", default_value_t = 0.2, value_parser = parse_share)]
    hold: f64,
    /// Train for renderers that make up for their low-pass filter.
    #[arg(long)]
    antialiased: bool,
    #[command(flatten)]
    background: BackgroundArg,
    /// Frames of a sequence, A..B: from A up to and without B.
    #[arg(long, value_name = "A..B", value_parser = FrameRange::parse)]
    frames: Option<FrameRange>,
    /// Seconds of training of each frame, after which it is ended as it is. Then the result depends on the machine.
    #[arg(long, value_name = "S", value_parser = clap::value_parser!(u32).range(1..))]
    time_budget: Option<u32>,
    /// Keep frames of a sequence that are there already, as an earlier run with the same settings left them: the directory has them
    /// in .fit-settings.json, and others are refused.
    #[arg(long, conflicts_with = "force")]
    resume: bool,
    /// Replace the frames of an earlier run in the directory of a sequence: files that have the names that frames are given. They
    /// go when all new ones are whole, and stay where the command fails or is interrupted, which then leaves none of its own: the
    /// disk has to hold both.
    #[arg(long)]
    force: bool,
    /// Chooses the order of pictures and where new Gaussians go.
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    limits: LimitArgs,
    #[command(flatten)]
    reading: InputArgs,
}

/// A pixel of a photograph that is kept, bytes: three channels of eight bits, and those of half its size with which training
/// starts; of a picture that is read, as a file has it and as floats; and of one that is drawn, judged and has slopes.
const OF_PHOTOGRAPH: u64 = 4;
const OF_PICTURE: u64 = 32;
const OF_DRAWING: u64 = 256;

/// Copies of the values of Gaussians: themselves, slopes, their means and those of their squares, a start that holds them, and what
/// is made anew where their number changes. And bytes of each beside, for drawing and for density; and of a point.
const COPIES: u64 = 8;
const OF_GAUSSIAN: u64 = 512;
const OF_POINT: u64 = 128;

impl Fit {
    /// Reads, trains, writes, frame by frame.
    pub(crate) fn run(&self, console: &Console) -> Result<(), Failure> {
        let begin = Instant::now();
        Failure::refuse_standard_input(&self.input)?;
        let captures = Captures::find(&self.input)?;
        self.check(&captures)?;
        let opened = self.start.as_ref().map(|path| Opened::open(path, self.reading)).transpose()?;
        let options = self.limits.options_to_draw();
        let mut starts = opened.as_ref().map(|opened| opened.frames(&options, None)).transpose()?;
        let inputs = starts.as_ref().map(Frames::inputs).unwrap_or_default();
        let mut directory = self.directory(&captures, &inputs)?;
        let span = self.frames.unwrap_or(FrameRange::ALL);
        let mut report = Fitted::new(self.out.clone(), captures.is_sequence());
        let mut before: Option<GaussianFrame> = None;
        for number in (0..captures.len()).take_while(|number| !span.is_over(*number)) {
            let start = starts.as_mut().map(|starts| self.start_of(starts, number)).transpose()?;
            if !span.contains(number) {
                continue;
            }
            let out = self.out.as_deref().map(|out| captures.output(out, number));
            let kept = out.as_deref().filter(|out| self.resume && out.is_file());
            let (frame, fitted) = match kept {
                Some(path) => self.kept(path)?,
                None => self.fit(&captures, number, (out.as_deref(), &inputs), start, before.take())?,
            };
            match (&mut directory, &out) {
                _ if kept.is_some() => {}
                (Some(directory), _) => directory.write(Captures::file(number), &ply::write(&frame))?,
                (None, Some(out)) => OutputFile::write_apart(out, &inputs, &ply::write(&frame))?,
                (None, None) => {}
            }
            // The next one starts from what is in the file, as it does when it is resumed.
            before = match &directory {
                Some(directory) if self.warm => {
                    Some(self.kept(&directory.place_of(Captures::file(number)))?.0)
                }
                _ => None,
            };
            report.add(number, out, fitted);
        }
        if report.is_empty() {
            return Err(Failure::Usage(format!("{}: it has no such frame", self.input.display())));
        }
        directory.map_or(Ok(()), OutputDirectory::finish)?;
        report.finish(begin.elapsed());
        console.report(&report, || report.text())
    }

    /// # Errors
    /// Arguments that do not go together.
    fn check(&self, captures: &Captures) -> Result<(), Failure> {
        if self.resume && !captures.is_sequence() {
            return Err(Failure::Usage("--resume: only the frames of a sequence are kept".to_owned()));
        }
        match &self.out {
            None if self.iterations > 0 => Err(Failure::Usage(
                "there is nowhere to write what is trained: give -o, or --iterations 0 to measure only"
                    .to_owned(),
            )),
            None => Ok(()),
            Some(out) if captures.is_sequence() => check_directory(out, "frames of a sequence"),
            Some(out) => {
                refuse_standard(out)?;
                let is_ply = out.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("ply"));
                if is_ply {
                    return Ok(());
                }
                let out = out.display();
                Err(Failure::Usage(format!(
                    "{out}: the result is a PLY file; give it a name that ends in .ply, and `splatstream encode` makes a \
                     stream of it"
                )))
            }
        }
    }

    /// The directory of a sequence.
    fn directory(&self, captures: &Captures, inputs: &[PathBuf]) -> Result<Option<OutputDirectory>, Failure> {
        let out = self.out.as_deref().filter(|_| captures.is_sequence());
        let Some(out) = out else { return Ok(None) };
        let settings = self.kept_settings(captures)?;
        if self.resume {
            return settings.resume(out, inputs, has_frames).map(Some);
        }
        let mut directory = frame_directory(out, inputs, self.force)?;
        settings.write(&mut directory)?;
        Ok(Some(directory))
    }

    /// The frame of a start that belongs to a capture.
    fn start_of(&self, starts: &mut Frames<'_>, number: u32) -> Result<GaussianFrame, Failure> {
        let lacking = || {
            let path = self.start.as_deref().unwrap_or(Path::new("")).display();
            Failure::other(format!(
                "{path}: it has no frame {number}; give as many as there are captures, or --frames"
            ))
        };
        match starts.next()? {
            Some((found, frame)) if found == number => Ok(frame),
            _ => {
                starts.verdict()?;
                Err(lacking())
            }
        }
    }

    /// A frame that an earlier run has left.
    fn kept(&self, path: &Path) -> Result<(GaussianFrame, FittedFrame), Failure> {
        let frame = self.reading.frame(path)?;
        let fitted = FittedFrame::kept(&frame);
        Ok((frame, fitted))
    }

    /// Refuses a capture whose training takes more memory than there is. `given`: what it starts from, if not from points.
    fn check_memory(
        &self,
        capture: &Capture,
        path: &Path,
        given: Option<&GaussianFrame>,
    ) -> Result<(), Failure> {
        let most = if self.iterations > 0 { self.gaussians.into() } else { 0 };
        let given = given.map_or((0, 0), |given| (given.len() as u64, given.sh_degree()));
        let (gaussians, degree) = (given.0.max(most), given.1.max(self.sh_degree));
        let sizes: Vec<[u64; 2]> = capture.views.iter().map(|view| self.pixels(view)).collect();
        let most = |which: usize| sizes.iter().map(|size| size[which]).max().unwrap_or(0);
        let kept: u64 = sizes.iter().map(|[_, small]| small.saturating_mul(OF_PHOTOGRAPH)).sum();
        let read = most(0).saturating_mul(OF_PICTURE);
        let drawn = most(1).saturating_mul(OF_DRAWING);
        let values = bytes_of_gaussians(gaussians, degree).saturating_mul(COPIES);
        let points = (capture.points.len() as u64).max(self.random_points.into()).saturating_mul(OF_POINT);
        let others = values.saturating_add(gaussians.saturating_mul(OF_GAUSSIAN)).saturating_add(points);
        let asked = kept.saturating_add(read.max(drawn.saturating_add(others)));
        let name = path.display();
        let (views, many) = (counted(sizes.len() as u64, "picture"), counted(gaussians, "Gaussian"));
        MemoryBound::of(self.limits.memory()).check(
            asked,
            &format!("{name}: training {many} with {views}"),
            "fewer --gaussians and a smaller --height take less",
        )
    }

    /// Pixels of a picture, and of that which is made of it.
    fn pixels(&self, CapturedView { camera, .. }: &CapturedView) -> [u64; 2] {
        let of = |camera: &Camera| u64::from(camera.width).saturating_mul(camera.height.into());
        let smaller = self.height.filter(|&height| height < camera.height);
        [of(camera), smaller.map_or_else(|| of(camera), |height| of(&camera.scaled_to_height(height)))]
    }

    /// Trains a frame, whose file replaces no file of the capture and none of `inputs`.
    fn fit(
        &self,
        captures: &Captures,
        number: u32,
        (out, inputs): (Option<&Path>, &[PathBuf]),
        start: Option<GaussianFrame>,
        before: Option<GaussianFrame>,
    ) -> Result<(GaussianFrame, FittedFrame), Failure> {
        let background = self.background.colour(&SceneDescription::default());
        let capture = captures.read(number)?;
        let files = files_of(captures.path(number), &capture, self.images.as_deref());
        // At once, and not after minutes of work.
        out.map_or(Ok(()), |out| refuse_inputs(out, &[inputs, &files].concat()))?;
        self.check_memory(&capture, captures.path(number), start.as_ref().or(before.as_ref()))?;
        let training = Training::open(&capture, captures.path(number), self, background)?;
        training.run(start, before, self.time_budget.map(|seconds| Duration::from_secs(seconds.into())))
    }
}
