//! `splatstream chart`: what quality costs, measured on this machine, as one page.

mod sweep_args;

use crate::cameras::{CameraArgs, Views};
use crate::compare::pictures::read_weights;
use crate::console::Console;
use crate::encode::warnings::warnings;
use crate::failure::Failure;
use crate::frame_files::{FrameFiles, inputs_of, unread};
use crate::input_args::InputArgs;
use crate::memory_bound::{MemoryArgs, MemoryBound, bytes_of};
use crate::numbers::parse_frame_rate;
use crate::output_directory::refuse_others;
use crate::output_file::{OutputFile, check_directory, make_directory};
use crate::over_limit::allow;
use crate::progress::Progress;
use crate::whole_file::read_text;
use clap::Args;
use serde::Serialize;
use splatstream_chart::charting::{Charting, Subject};
use splatstream_chart::numbers::grouped;
use splatstream_chart::peers::{OpenFrames, Peers};
use splatstream_chart::scenes::{FRAMES, Scene, name_of, tell_apart};
use splatstream_chart::stability::{self, Size, Stability};
use splatstream_chart::{Error, File, Report};
use splatstream_encoder::FrameSource;
use splatstream_format::payload::SceneDescription;
use splatstream_gaussians::GaussianFrame;
use std::path::{Path, PathBuf};
use sweep_args::SweepArgs;

/// Draw rate-distortion and speed-size charts of scenes: one page, SVG and CSV.
///
/// Every scene is encoded with every variant at every quality, decoded, rendered and compared with its source. Presets and
/// fitting to pictures stand on one front of processor time against bits at equal PSNR, and so do choices that decoders feel.
/// A directory of frames is one sequence: of its first GOP with predicted frames, every operating point is measured
/// too, and what the tools of predicted frames are worth. The page holds everything and needs no network.
///
/// With --stability the page shows instead where codecs fail: scenes and sequences made to break them, of the built-in
/// scene or of yours, with PSNR, bits, what was detected and what the encoder fell back to.
#[derive(Args)]
#[command(after_help = "Examples:\n  splatstream chart --builtin --quick -o look/\n  \
    splatstream chart garden.ply frames/ -o report/ --height 720\n  \
    splatstream chart frames/ -o report/ --presets balanced --qualities high --without contexts\n  \
    splatstream chart garden.ply -o report/ --qualities high --finetune 5,20,60,200 --cameras ring:7\n  \
    splatstream chart frames/ -o report/ --quick --ablation --gop 8\n  \
    splatstream chart frames/ -o report/ --frames 8 --peers peers.json --st-lpips weights.npz\n  \
    splatstream chart --stability -o stability/")]
pub(crate) struct Chart {
    /// Scene files, and directories of frames.
    #[arg(value_name = "SCENE_OR_SEQUENCE", required_unless_present_any = ["builtin", "stability"])]
    scenes: Vec<PathBuf>,
    /// A directory for the page, index.html, and the files beside it.
    #[arg(short, long = "out", value_name = "DIR")]
    out: PathBuf,
    /// Chart the built-in scene.
    #[arg(long)]
    builtin: bool,
    /// A cameras.json or transforms.json; ring:N and forward:N make N cameras for the first frame
    /// [default: ring:8, ring:2 if quick].
    #[arg(long, visible_alias = "camera", value_name = "CAMS.json|ring:N|forward:N")]
    cameras: Option<Views>,
    #[command(flatten)]
    drawing: CameraArgs,
    /// Frames of each sequence, from the first [default: 4, or --gop if that is more].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    frames: Option<u32>,
    /// Frames in the GOP whose operating points are measured: the first of each sequence, with predicted frames.
    #[arg(long, value_name = "N", default_value_t = FRAMES)]
    #[arg(value_parser = clap::value_parser!(u32).range(2..=64))]
    gop: u32,
    /// Of that GOP, measure each predictor of new Gaussians alone and together, and the network without each of its
    /// parts; trains it for every row.
    #[arg(long)]
    ablation: bool,
    /// Instead, show where codecs fail: cases made to break them, stronger and stronger.
    #[arg(long, conflicts_with_all = ["cameras", "ablation", "peers", "st_lpips"])]
    stability: bool,
    /// All strengths of the cases, on larger scenes.
    #[arg(long, requires = "stability", conflicts_with = "quick")]
    full: bool,
    #[command(flatten)]
    memory: MemoryArgs,
    #[command(flatten)]
    reading: InputArgs,
    #[command(flatten)]
    sweep: SweepArgs,
    /// Results of other codecs on the same scenes.
    #[arg(long, value_name = "PEERS.json")]
    peers: Option<PathBuf>,
    /// Weights of the learned metric; without them it is not measured.
    #[arg(long, value_name = "WEIGHTS.npz")]
    st_lpips: Option<PathBuf>,
    /// Frames per second, for bandwidths: 30, 29.97 or 30000/1001.
    #[arg(long, value_name = "RATE", default_value = "30", value_parser = parse_frame_rate)]
    fps: (u32, u32),
}

/// Rows of pictures of a quick chart.
const QUICK_HEIGHT: u32 = 120;

/// What takes memory, and how it takes less.
const WHAT: &str = "measuring these scenes";
const LESS: &str = "fewer scenes, fewer --frames, fewer --cameras and a smaller --height take less";

/// A frame that another codec decoded may take one in so many of the bytes that are left while it is read, and what is read is not
/// more: drawing it takes the rest.
const OF_PEER: u64 = 2;

/// Bytes of memory that a byte of a peers file takes: its text, and its names and figures, of which a short one has some 200 bytes.
const OF_PEERS_TEXT: u64 = 8;

/// What `--json` prints.
#[derive(Serialize)]
struct Written<S> {
    page: PathBuf,
    files: Vec<String>,
    #[serde(flatten)]
    summary: S,
}

impl Chart {
    /// Measures every scene, then writes.
    pub(crate) fn run(&self, console: &Console) -> Result<(), Failure> {
        check_directory(&self.out, "charts")?;
        refuse_others(&self.out, &["index.html"], &["points.csv", "stability.csv"])?;
        make_directory(&self.out)?;
        let inputs = self.inputs()?;
        if self.stability {
            let report = self.failures()?;
            let written = self.write(report, &inputs)?;
            let page = written.page.display();
            return console
                .report(&written, || format!("{}open {page} in a browser\n", written.summary.text()));
        }
        let report = self.charts()?;
        let written = self.write(report, &inputs)?;
        console.report(&written, || {
            let (page, files) = (written.page.display(), grouped(written.files.len() as u64));
            let text = written.summary.text();
            format!("{text}open {page} in a browser; {files} CSV and SVG files are beside it\n")
        })
    }

    /// The files that it reads, as far as they are named here.
    fn inputs(&self) -> Result<Vec<PathBuf>, Failure> {
        let mut inputs = inputs_of(&self.scenes)?;
        inputs.extend(self.cameras.iter().flat_map(Views::files));
        inputs.extend(self.peers.iter().chain(&self.st_lpips).cloned());
        Ok(inputs)
    }

    fn charts(&self) -> Result<Report<splatstream_chart::summary::Summary>, Failure> {
        let with_cameras = |scene: Scene| Ok(Subject { cameras: self.cameras(&scene)?, scene });
        let mut bound = self.memory.bound();
        let subjects: Vec<Subject> =
            self.scenes(&mut bound)?.into_iter().map(with_cameras).collect::<Result<_, Failure>>()?;
        let peers = self.peers.as_deref().map(|path| read_peers(path, &mut bound)).transpose()?;
        let mut charting = Charting {
            sweep: self.sweep.sweep(self.fps),
            fps: f64::from(self.fps.0) / f64::from(self.fps.1),
            gop: self.gop,
            ablation: self.ablation,
            learned: self.st_lpips.as_deref().map(read_weights).transpose()?,
            peers: None,
            command: command_line(),
        };
        let footprint = charting.footprint(&subjects);
        bound.check(footprint.bytes(), WHAT, LESS)?;
        bound.keep(footprint.beside);
        charting.bound(bound.left());
        // Beside the sources, their pictures and our streams. Nothing is encoded meanwhile.
        let reading = self.reading.within(bound.left() / OF_PEER);
        let open = move |decoded: &Path| -> Result<Box<dyn FrameSource>, String> {
            let files = FrameFiles::find(&[decoded.to_path_buf()], reading);
            Ok(Box::new(files.map_err(|error| error.to_string())?.once()))
        };
        charting.peers = match (&self.peers, &peers) {
            (Some(path), Some(text)) => Some(peers_of(path, text, &open)?),
            _ => None,
        };
        let progress = Progress::steps(charting.steps(&subjects));
        Ok(charting.run(subjects, &progress)?)
    }

    fn failures(&self) -> Result<Report<stability::Summary>, Failure> {
        let size = Size::of(self.sweep.quick, self.full);
        // The built-in scene, unless there are others; then only if it is asked for.
        let builtin = self.builtin || self.scenes.is_empty();
        let mut bound = self.memory.bound();
        let mut scenes: Vec<Scene> = builtin.then(|| stability::builtin(size)).into_iter().collect();
        for path in &self.scenes {
            scenes.push(self.read_scene(path, self.frames.unwrap_or(size.frames()), &mut bound)?);
        }
        tell_apart(&mut scenes);
        let stability = Stability {
            size,
            height: self.drawing.height,
            warnings: &|report, settings| {
                let said = warnings(report, settings, &|frame| format!("frame {frame}"));
                said.into_iter().map(stability::Warning::from).collect()
            },
            command: command_line(),
        };
        bound.check(stability.memory(&scenes), WHAT, LESS)?;
        Ok(stability.run(&scenes, Progress::steps)?)
    }

    /// The scenes, of which the bound takes note.
    fn scenes(&self, bound: &mut MemoryBound) -> Result<Vec<Scene>, Failure> {
        let mut scenes = Vec::new();
        // Whoever asks for a long GOP wants it whole.
        let frames = self.frames.or((self.gop > FRAMES).then_some(self.gop));
        if self.builtin {
            let scene = Scene::builtin(self.sweep.quick, frames);
            scene.frames.iter().for_each(|frame| bound.keep(bytes_of(frame)));
            scenes.push(scene);
        }
        for path in &self.scenes {
            scenes.push(self.read_scene(path, frames.unwrap_or(FRAMES), bound)?);
        }
        tell_apart(&mut scenes);
        Ok(scenes)
    }

    fn cameras(&self, scene: &Scene) -> Result<Vec<splatstream_render::Camera>, Failure> {
        let quick = self.sweep.quick;
        let views = self.cameras.clone().unwrap_or(Views::Ring(if quick { 2 } else { 8 }));
        let height = self.drawing.height.or(quick.then_some(QUICK_HEIGHT));
        let first = scene.frames.first().ok_or_else(|| Failure::other("there is no frame"))?;
        CameraArgs { height, ..self.drawing.clone() }.cameras(
            Some(&views),
            first,
            &SceneDescription::default(),
        )
    }

    /// The first frames of a file or of a directory of frames, of which the bound takes note.
    fn read_scene(&self, path: &Path, frames: u32, bound: &mut MemoryBound) -> Result<Scene, Failure> {
        let mut files = FrameFiles::find(&[path.to_path_buf()], self.reading.within(bound.left()))?;
        let count = files.len().min(frames);
        let mut frames: Vec<GaussianFrame> = Vec::new();
        for number in 0..count {
            let frame = files.frame(number).map_err(|error| unread(error.as_ref()))?;
            bound.keep(bytes_of(&frame));
            let rest = bytes_of(&frame).saturating_mul((count - number - 1).into());
            bound.check(rest, WHAT, LESS)?;
            frames.push(frame);
        }
        if frames.iter().all(GaussianFrame::is_empty) {
            return Err(Failure::other(format!("{}: there is no Gaussian in it", path.display())));
        }
        let path_of_scene = Some(path.to_path_buf());
        Ok(Scene { name: name_of(path), path: path_of_scene, frames, frames_of_source: files.len() })
    }

    /// Writes the files of a report, the page last; none replaces one of `inputs`.
    fn write<S>(&self, report: Report<S>, inputs: &[PathBuf]) -> Result<Written<S>, Failure> {
        for File { name, bytes } in report.files.iter().chain(&report.pictures) {
            let path = self.out.join(name);
            path.parent().map_or(Ok(()), make_directory)?;
            OutputFile::write_apart(&path, inputs, bytes)?;
        }
        let page = self.out.join("index.html");
        OutputFile::write_apart(&page, inputs, report.page.as_bytes())?;
        let files = report.files.into_iter().map(|file| file.name).collect();
        Ok(Written { page, files, summary: report.summary })
    }
}

/// The text of a peers file, of which the bound takes note, and of what it becomes.
fn read_peers(path: &Path, bound: &mut MemoryBound) -> Result<String, Failure> {
    let text = read_text(path)?;
    let bytes = (text.len() as u64).saturating_mul(OF_PEERS_TEXT);
    bound.check(bytes, "the peers file", "fewer results take less")?;
    bound.keep(bytes);
    Ok(text)
}

/// Results of other codecs.
fn peers_of<'a>(path: &Path, text: &str, open: OpenFrames<'a>) -> Result<Peers<'a>, Failure> {
    let directory = path.parent().unwrap_or(Path::new("")).to_path_buf();
    Peers::new(text.as_bytes(), directory, open)
        .map_err(|error| Failure::other(format!("{}: {error}", path.display())))
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        match error {
            Error::Stream(error) => Self::stream(Path::new("the stream just encoded"), error),
            Error::Memory { message, asked } => {
                Self::Memory(format!("{message}\n  {}; {LESS}", allow(asked)))
            }
            Error::Other(message) => Self::other(message),
        }
    }
}

/// The command as it was given, for people to repeat.
fn command_line() -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./:=,%+@".contains(c);
    let quoted = |argument: String| {
        if !argument.is_empty() && argument.chars().all(plain) {
            argument
        } else {
            format!("'{}'", argument.replace('\'', r"'\''"))
        }
    };
    let arguments =
        std::env::args_os().skip(1).map(|argument| quoted(argument.to_string_lossy().into_owned()));
    std::iter::once("splatstream".to_owned()).chain(arguments).collect::<Vec<_>>().join(" ")
}
