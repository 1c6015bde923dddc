//! `splatstream simulate`: captures of a scene that is known exactly.

use crate::console::Console;
use crate::failure::Failure;
use crate::frame_name::{frame_name, is_frame_name};
use crate::numbers::{counted, frames};
use crate::output_directory::{OutputDirectory, files_in, is_numbered};
use crate::output_file::check_directory;
use crate::progress::Progress;
use clap::{Args, ValueEnum};
use serde::Serialize;
use splatstream_capture::simulator::{CaptureFiles, Rig, Simulation};
use splatstream_render::Camera;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Make a capture: ray-traced pictures of a moving scene from calibrated cameras, with points.
///
/// Every frame is a directory with images/, transforms.json (nerfstudio) and sparse/0 (COLMAP, text). The scene has glossy
/// and mirroring surfaces, fine textures and a far background, and the same bytes on every machine: what is trained from
/// these pictures can be compared with the truth.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  splatstream simulate -o capture/ --height 360\n  splatstream fit capture/ -o scene.ply\n  \
    splatstream simulate -o walk/ --frames 16 --views 24 --rig forward"
)]
pub(crate) struct Simulate {
    /// A directory for the capture; of several frames, for directories frame_0000 and so on.
    #[arg(short, long, value_name = "DIR")]
    out: PathBuf,
    /// Frames.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    frames: u32,
    /// Frames a second.
    #[arg(long, value_name = "RATE", default_value_t = 30.0, value_parser = parse_rate)]
    fps: f64,
    /// How cameras stand.
    #[arg(long, value_enum, default_value_t = RigName::Orbit)]
    rig: RigName,
    /// Cameras.
    #[arg(long, value_name = "N", default_value_t = 40, value_parser = clap::value_parser!(u32).range(1..=1000))]
    views: u32,
    /// Rows of the pictures, which are 16:9.
    #[arg(long, value_name = "ROWS", default_value_t = 540, value_parser = clap::value_parser!(u32).range(9..=8640))]
    height: u32,
    /// Samples of each pixel on either axis.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=16))]
    samples: u32,
    /// Points, as structure from motion would find them.
    #[arg(long, value_name = "N", default_value_t = 10_000, value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    points: u32,
    /// Replace captures of an earlier run in the directory: files that have the names that this command gives. They go when all
    /// new ones are whole, and stay where the command fails or is interrupted: the disk has to hold both.
    #[arg(long)]
    force: bool,
    /// Chooses colours and where movements start.
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    seed: u64,
}

/// How cameras stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum RigName {
    /// All around the scene, on three heights.
    Orbit,
    /// In front of it, within 30 degrees.
    Forward,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Simulated {
    output: PathBuf,
    frames: u32,
    views: u32,
    width: u32,
    height: u32,
    /// Points of each frame.
    points: usize,
    seconds: f64,
}

impl Simulate {
    /// Traces and writes.
    pub(crate) fn run(&self, console: &Console) -> Result<(), Failure> {
        check_directory(&self.out, "pictures")?;
        let mut directory = OutputDirectory::new(&self.out, earlier_files, "captures", &[], self.force)?;
        let start = Instant::now();
        let width = (self.height * 16).div_ceil(9);
        let rig = match self.rig {
            RigName::Orbit => Rig::Orbit,
            RigName::Forward => Rig::Forward,
        };
        let cameras = rig.cameras(self.views, [width, self.height]);
        let progress = Progress::frames("tracing", self.frames.saturating_mul(self.views));
        for frame in 0..self.frames {
            let done = |view: u32| progress.at(frame.saturating_mul(self.views).saturating_add(view));
            self.write((&mut directory, &self.folder(frame)), f64::from(frame) / self.fps, &cameras, done)?;
        }
        drop(progress);
        directory.finish()?;
        let report = Simulated {
            output: self.out.clone(),
            frames: self.frames,
            views: self.views,
            width,
            height: self.height,
            points: self.points as usize,
            seconds: start.elapsed().as_secs_f64(),
        };
        console.report(&report, || report.text())
    }

    /// Where a frame is in the directory.
    fn folder(&self, frame: u32) -> PathBuf {
        if self.frames == 1 { PathBuf::new() } else { frame_name(frame).into() }
    }

    /// One frame. Cameras and points come last: a capture that was stopped has none, and is not taken for one.
    fn write(
        &self,
        (directory, folder): (&mut OutputDirectory, &Path),
        seconds: f64,
        cameras: &[Camera],
        done: impl Fn(u32),
    ) -> Result<(), Failure> {
        let simulation = Simulation { seed: self.seed, samples: self.samples };
        for (number, camera) in (1..).zip(cameras) {
            let name = folder.join(CaptureFiles::picture_path(camera));
            let path = directory.path_of(&name);
            let failed = |error| Failure::other(format!("{}: cannot write: {error}", path.display()));
            let png = simulation.picture(camera, seconds).to_png().map_err(failed)?;
            directory.write(&name, &png)?;
            done(number);
        }
        let points = simulation.points(cameras, seconds, self.points);
        let mut files = CaptureFiles { cameras, points: &points, seconds }.files();
        files.reverse();
        files.iter().try_for_each(|file| directory.write(folder.join(&file.path), &file.bytes))
    }
}

impl Simulated {
    fn text(&self) -> String {
        format!(
            "{}: {}, {} of {} x {}, {} each; {:.1} seconds\n",
            self.output.display(),
            frames(self.frames),
            counted(u64::from(self.frames) * u64::from(self.views), "picture"),
            self.width,
            self.height,
            counted(self.points as u64, "point"),
            self.seconds,
        )
    }
}

/// The files of captures that an earlier run has left in a directory: of one frame, or of several in directories of
/// theirs.
fn earlier_files(out: &Path) -> Vec<PathBuf> {
    let is_named = |path: &Path, is_known: &dyn Fn(&str) -> bool| {
        path.file_name().and_then(|name| name.to_str()).is_some_and(is_known)
    };
    let is_picture = |name: &str| is_numbered(name, "view_", 3, ".png");
    let entries = std::fs::read_dir(out).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut files = Vec::new();
    let frames = entries.filter(|path| is_named(path, &is_frame_name));
    for folder in frames.chain([out.to_path_buf()]) {
        files.extend(files_in(&folder.join("images"), |path| is_named(path, &is_picture)));
        let others = CaptureFiles { cameras: &[], points: &[], seconds: 0.0 }.files();
        files.extend(others.iter().map(|file| folder.join(&file.path)).filter(|path| path.is_file()));
    }
    files
}

fn parse_rate(text: &str) -> Result<f64, String> {
    let rate = text.parse().ok().filter(|rate| (0.001..=1000.0).contains(rate));
    rate.ok_or_else(|| format!("'{text}' is not a number of frames a second; write 0.001 to 1000"))
}
