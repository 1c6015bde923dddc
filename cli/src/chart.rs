//! `splatstream chart`: what quality costs, measured on this machine, as one page.

mod csv_files;
mod figures;
mod gop;
mod gop_files;
mod gop_text;
mod judge;
mod measure;
mod page;
mod peers;
mod pictures;
mod scene_chart;
mod scenes;
mod stability;
mod standing;
mod summary;
mod svg;
mod sweep;
mod tables;

use crate::cameras::{CameraArgs, Views};
use crate::compare::pictures::read_weights;
use crate::console::Console;
use crate::failure::Failure;
use crate::numbers::parse_frame_rate;
use crate::output_file::{OutputFile, check_directory, make_directory};
use crate::progress::Progress;
use crate::setting_names::spelled;
use clap::Args;
use judge::Judge;
use page::Page;
use peers::Peers;
use scene_chart::SceneChart;
use scenes::Scene;
use splatstream_format::payload::SceneDescription;
use splatstream_render::metrics::StLpips;
use std::path::PathBuf;
use summary::Summary;
use sweep::{Sweep, SweepArgs};

/// Draw rate-distortion and speed-accuracy charts of scenes: one page, SVG and CSV.
///
/// Every scene is encoded with every variant at every quality, decoded, rendered and compared with its source.
/// A directory of frames is one sequence: of its first GOP with predicted frames, every operating point is measured
/// too, and what the tools of predicted frames are worth. The page holds everything and needs no network.
///
/// With --stability the page shows instead where codecs fail: scenes and sequences made to break them, of the built-in
/// scene or of yours, with PSNR, bits, what was detected and what the encoder fell back to.
#[derive(Args)]
#[command(after_help = "Examples:\n  splatstream chart --builtin --quick -o look/\n  \
    splatstream chart garden.ply frames/ -o report/ --height 720\n  \
    splatstream chart frames/ -o report/ --presets balanced --qualities high --without contexts\n  \
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
    #[arg(long, value_name = "N", default_value_t = gop::FRAMES)]
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

/// What the charts of all scenes have in common.
struct Charting<'a> {
    sweep: Sweep,
    fps: f64,
    learned: Option<StLpips>,
    peers: Option<Peers>,
    progress: &'a Progress,
}

impl Chart {
    /// Measures every scene, then writes.
    pub(crate) fn run(&self, console: &Console) -> Result<(), Failure> {
        check_directory(&self.out, "charts")?;
        if self.stability {
            return stability::run(self, console);
        }
        make_directory(&self.out)?;
        let mut scenes = self.scenes()?;
        let sweep = self.sweep.sweep(self.fps);
        let peers = self.peers.as_deref().map(Peers::read).transpose()?;
        let peer_steps = |scene: &Scene| peers.as_ref().map_or(0, |peers| peers.count(scene));
        let gop_steps =
            |scene: &Scene| if gop::is_sequence(scene, self.gop) { gop::steps(self.ablation) } else { 0 };
        let of_scene = |scene: &Scene| {
            scene.frames.len() as u32 + measure::steps(&sweep) + gop_steps(scene) + peer_steps(scene)
        };
        let progress = Progress::steps(scenes.iter().map(of_scene).sum());
        let learned = self.st_lpips.as_deref().map(read_weights).transpose()?;
        let fps = f64::from(self.fps.0) / f64::from(self.fps.1);
        let charting = Charting { sweep, fps, learned, peers, progress: &progress };
        let charts: Vec<SceneChart> =
            scenes.iter_mut().map(|scene| self.chart(scene, &charting)).collect::<Result<_, _>>()?;
        let summary = self.write(&charts, &charting)?;
        drop(progress);
        console.report(&summary, || summary.text())
    }

    fn scenes(&self) -> Result<Vec<Scene>, Failure> {
        let mut scenes = Vec::new();
        // Whoever asks for a long GOP wants it whole.
        let frames = self.frames.or((self.gop > gop::FRAMES).then_some(self.gop));
        if self.builtin {
            scenes.push(Scene::builtin(self.sweep.quick, frames));
        }
        for path in &self.scenes {
            scenes.push(Scene::read(path, frames)?);
        }
        scenes::tell_apart(&mut scenes);
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

    /// Measures a scene; its pictures are written on the way.
    fn chart(&self, scene: &mut Scene, charting: &Charting<'_>) -> Result<SceneChart, Failure> {
        let Charting { sweep, progress, .. } = charting;
        progress.step(format!("{}: pictures of the source", scene.name));
        let cameras = self.cameras(scene)?;
        let mut judge = Judge::new(&scene.frames, cameras, charting.learned.as_ref(), || progress.advance());
        let runs = measure::measure(scene, sweep, &mut judge, progress)?;
        let mut chart = SceneChart::new(scene, judge.cameras(), runs, spelled(sweep.quality()), charting.fps);
        if gop::is_sequence(scene, self.gop) {
            let settings = gop::settings(sweep.headline(), self.gop);
            chart.gop =
                Some(gop::measure(scene, &settings, (charting.fps, self.ablation), &mut judge, progress)?);
        }
        if let Some(peers) = &charting.peers {
            progress.step(format!("{}: pictures of other codecs", scene.name));
            (chart.peers, chart.missing) = peers.judged(scene, &judge, || progress.advance());
        }
        if let Some(run) = chart.headline() {
            chart.pictures = pictures::pictures(&scene.name, run, &judge, &self.out)?;
        }
        Ok(chart)
    }

    fn write(&self, charts: &[SceneChart], charting: &Charting<'_>) -> Result<Summary, Failure> {
        let mut files = csv_files::write(charts, &self.out)?;
        let figures: Vec<_> = charts
            .iter()
            .map(|scene| page::SceneFigures {
                rates: figures::rate_figures(scene),
                speeds: figures::speed_figures(scene),
                costs: figures::cost_figures(scene),
            })
            .collect();
        for figure in figures.iter().flat_map(page::SceneFigures::all) {
            let name = format!("{}.svg", figure.id);
            OutputFile::write(&self.out.join(&name), figure.file().as_bytes())?;
            files.push(name);
        }
        let page = Page { charts, figures: &figures, sweep: &charting.sweep, command: &command_line() };
        OutputFile::write(&self.out.join("index.html"), page.html().as_bytes())?;
        Ok(Summary::new(&self.out, charts, files))
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
