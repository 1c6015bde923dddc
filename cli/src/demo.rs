//! `splatstream demo`: everything once, without any input.

mod everything;
mod pictures;
mod report;

use crate::console::{Console, to_json};
use crate::failure::Failure;
use crate::frame_name::frame_name;
use crate::memory_bound::{MemoryArgs, MemoryBound, bytes_of_gaussians};
use crate::numbers::{counted, frames as frames_in_words};
use crate::output_directory::refuse_others;
use crate::output_file::{OutputFile, check_directory, make_directory};
use crate::progress::Progress;
use clap::Args;
use everything::Everything;
use pictures::Album;
use report::{Demonstration, Encoding, Point, Scene};
use splatstream_chart::numbers::bits_per_gaussian;
use splatstream_decoder::operating_point::{OperatingPointInfo, operating_points};
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::decode_stream;
use splatstream_encoder::{Preset, Quality, Report, Settings, Structure, encode};
use splatstream_files::builtin::{BuiltinScene, Tracking};
use splatstream_files::ply;
use splatstream_format::Limits;
use splatstream_format::payload::{SceneDescription, UpAxis};
use splatstream_gaussians::GaussianFrame;
use splatstream_web::page_with;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Try everything without any input: make a moving scene, encode it, decode it at every operating point, verify, draw.
///
/// The stream has two spatial layers, two temporal layers with predicted frames, and three refinements. Writes the frames of
/// the source, the stream, the decoded frames, a picture of each operating point, a web page that plays it, and a report.
#[derive(Args)]
#[command(after_help = "Example:\n  splatstream demo --out first-look")]
pub(crate) struct Demo {
    /// Where the files go.
    #[arg(short, long, value_name = "DIR", default_value = "splatstream-demo")]
    out: PathBuf,
    /// Gaussians of the scene.
    #[arg(long, value_name = "N", default_value_t = BuiltinScene::default().gaussians)]
    #[arg(value_parser = clap::value_parser!(u32).range(100..=1_000_000))]
    gaussians: u32,
    /// Frames of the scene.
    #[arg(long, value_name = "N", default_value_t = BuiltinScene::default().frames)]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=10_000))]
    frames: u32,
    /// Make each frame as if it had been trained by itself: no Gaussian keeps its row from frame to frame.
    #[arg(long)]
    untracked: bool,
    #[command(flatten)]
    memory: MemoryArgs,
}

/// The stream's name in the directory of the demo.
const STREAM: &str = "demo.gss";
/// The name of the page that plays it.
const PAGE: &str = "demo.html";

/// Frames of a GOP.
const GOP: u32 = 8;

/// Copies of the values of a frame that are there where it is decoded, compared, drawn and written, and bytes of pictures.
const SHOWN: u64 = 12;
const PICTURES: u64 = 64 << 20;

impl Demo {
    /// Makes, encodes, decodes, verifies, reports.
    pub(crate) fn run(&self, console: &Console) -> Result<(), Failure> {
        check_directory(&self.out, "files of the demo")?;
        // The stream is the first file that is written.
        let later = [
            PAGE,
            "report.json",
            "report.txt",
            "source/frame_0000.ply",
            "decoded/frame_0000.ply",
            "pictures/source.png",
        ];
        refuse_others(&self.out, &later, &[STREAM])?;
        let tracking = if self.untracked { Tracking::Untracked } else { Tracking::Tracked };
        let scene = BuiltinScene {
            gaussians: self.gaussians,
            frames: self.frames,
            tracking,
            ..BuiltinScene::default()
        };
        let settings = self.settings(scene.sh_degree)?;
        make_directory(&self.out)?;
        let mut frames: Vec<GaussianFrame> = (0..scene.frames).map(|number| scene.frame(number)).collect();
        let (stream, encoding, digests) = self.encode(&mut frames, &settings)?;
        let source = self.write_source(&scene, frames)?;
        let mut everything = Everything::start(self.out.join("decoded"), source.frames.first())?;
        let points = self.points(&stream, &source.frames, &mut everything)?;
        let errors = everything.verified(&digests)?;
        let page = page_with("SplatStream demo", &stream);
        OutputFile::write(&self.out.join(PAGE), page.as_bytes())?;
        let demonstration = Demonstration {
            directory: self.out.clone(),
            page: PAGE,
            scene: source.summary,
            encoding,
            operating_points: points,
            errors,
        };
        let text = demonstration.text();
        OutputFile::write(&self.out.join("report.json"), to_json(&demonstration)?.as_bytes())?;
        OutputFile::write(&self.out.join("report.txt"), text.as_bytes())?;
        console.report(&demonstration, || text)
    }

    /// The settings of the stream, with the memory that the source leaves.
    fn settings(&self, sh_degree: u8) -> Result<Settings, Failure> {
        let settings = settings(self.frames);
        let (gaussians, frames) = (u64::from(self.gaussians), u64::from(self.frames));
        let mut bound: MemoryBound = self.memory.bound();
        let all = bytes_of_gaussians(gaussians.saturating_mul(frames), sh_degree);
        // The source; a stream takes no more than a fifth of it, and its page a third more than that.
        bound.keep(all.saturating_add(all / 2));
        let what =
            format!("a demo of {} of {} each", frames_in_words(self.frames), counted(gaussians, "Gaussian"));
        let shown = bytes_of_gaussians(gaussians, sh_degree).saturating_mul(SHOWN).saturating_add(PICTURES);
        let asked = settings.memory(gaussians, sh_degree, self.frames).max(shown);
        bound.check(asked, &what, "fewer --gaussians and fewer --frames take less")?;
        Ok(Settings { max_memory: bound.left(), ..settings })
    }

    /// Writes the frames as PLY.
    fn write_source(&self, scene: &BuiltinScene, frames: Vec<GaussianFrame>) -> Result<Source, Failure> {
        let directory = self.out.join("source");
        make_directory(&directory)?;
        let mut ply_bytes = 0;
        for (number, frame) in frames.iter().enumerate() {
            let bytes = ply::write(frame);
            ply_bytes += bytes.len() as u64;
            OutputFile::write(&frame_path(&directory, number), &bytes)?;
        }
        let gaussians = frames.iter().map(|frame| frame.len() as u64).sum();
        let summary = Scene { frames: scene.frames, gaussians, sh_degree: scene.sh_degree, ply_bytes };
        Ok(Source { frames, summary })
    }

    fn encode(
        &self,
        frames: &mut Vec<GaussianFrame>,
        settings: &Settings,
    ) -> Result<(Vec<u8>, Encoding, Vec<u64>), Failure> {
        let progress = Progress::frames("encoding", self.frames);
        let start = Instant::now();
        let mut stream = Vec::new();
        let Report { bytes, gaussians, digests, .. } =
            encode(frames, settings, &mut stream, &mut |done, _| progress.at(done))
                .map_err(|error| Failure::other(error.to_string()))?;
        let seconds = start.elapsed().as_secs_f64();
        OutputFile::write(&self.out.join(STREAM), &stream)?;
        let rate = gaussians as f64 / seconds.max(f64::MIN_POSITIVE);
        let bpg = bits_per_gaussian(bytes, gaussians);
        Ok((stream, Encoding { bytes, gaussians, bpg, seconds, gaussians_per_second: rate }, digests))
    }

    /// Decodes and draws every operating point; the last is everything.
    fn points(
        &self,
        stream: &[u8],
        source: &[GaussianFrame],
        everything: &mut Everything<'_>,
    ) -> Result<Vec<Point>, Failure> {
        let infos = operating_points(stream, &Limits::default()).map_err(|error| self.fault(error))?;
        let mut album = Album::start(&self.out)?;
        let progress = Progress::frames("decoding", infos.len() as u32 * self.frames);
        let (mut points, mut moment) = (Vec::new(), None);
        for (done, info) in infos.iter().enumerate() {
            progress.at(done as u32 * self.frames);
            let is_last = done + 1 == infos.len();
            let last = is_last.then_some(&mut *everything);
            let (shown, seconds) = self.decode(stream, info, moment, last)?;
            // The smallest point has fewest frames: all others have its last one.
            moment = moment.or(shown.as_ref().map(|(number, _)| *number));
            let drawn = shown.map(|(number, frame)| album.draw(info.point, number, &frame, source));
            points.push(Point::new(info, seconds, drawn.transpose()?.flatten()));
        }
        Ok(points)
    }

    /// Decodes one operating point, every digest compared; gives the frame that is drawn, the last one if none is named, and
    /// the seconds of decoding. Frames of the last operating point are verified and written too.
    fn decode(
        &self,
        stream: &[u8],
        info: &OperatingPointInfo,
        moment: Option<u32>,
        mut everything: Option<&mut Everything<'_>>,
    ) -> Result<(Option<(u32, GaussianFrame)>, f64), Failure> {
        let (mut shown, mut failed, mut apart) = (None, None, Duration::ZERO);
        let options = Options { operating_point: info.point, ..Options::default() };
        let start = Instant::now();
        let summary = decode_stream(stream, &options, |sequence, frame| {
            let (number, digest) = (frame.index, frame.digest);
            let take = || {
                let gaussians = to_gaussians(frame.into_shown(), sequence)?;
                let start = Instant::now();
                if let Some(everything) = &mut everything {
                    everything.take(number, digest, &gaussians)?;
                }
                apart += start.elapsed();
                if moment.is_none_or(|moment| moment == number) {
                    shown = Some((number, gaussians));
                }
                Ok(())
            };
            failed = take().err();
            if failed.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        let seconds = start.elapsed().saturating_sub(apart).as_secs_f64();
        match (failed, summary.verdict()) {
            (Some(failure), _) => Err(failure),
            (None, Some(error)) => Err(self.fault(error)),
            (None, None) => Ok((shown, seconds)),
        }
    }

    fn fault(&self, error: splatstream_format::Error) -> Failure {
        Failure::stream(&self.out.join(STREAM), error)
    }
}

/// All that a stream of so many frames can have, with little search.
pub(crate) fn settings(frames: u32) -> Settings {
    let structure = match frames {
        1 => Structure::Intra,
        _ => Structure::Predicted { layers: 2 },
    };
    Settings {
        structure,
        spatial_layers: 2,
        refinements: vec![10, 30, 100],
        gop: GOP,
        preset: Preset::Fast,
        psnr: Some(Quality::High.decibels()),
        description: SceneDescription { up_axis: UpAxis::MinusY, ..SceneDescription::default() },
        ..Settings::default()
    }
}

/// The scene that is encoded.
struct Source {
    frames: Vec<GaussianFrame>,
    summary: Scene,
}

fn frame_path(directory: &Path, number: usize) -> PathBuf {
    directory.join(format!("{}.ply", frame_name(number as u32)))
}
