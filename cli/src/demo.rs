//! `splatstream demo`: everything once, without any input.

mod pictures;
mod report;

use crate::compare::errors::{AttributeErrors, ErrorSums};
use crate::compare::{Match, compare_frames};
use crate::console::{Console, to_json};
use crate::failure::Failure;
use crate::output_file::{OutputFile, check_directory, make_directory};
use crate::progress::Progress;
use clap::Args;
use pictures::Album;
use report::{Demonstration, Encoding, Point, Scene};
use splatstream_chart::numbers::bits_per_gaussian;
use splatstream_decoder::operating_point::{OperatingPoint, OperatingPointInfo, operating_points};
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::decode_stream;
use splatstream_encoder::{Preset, Quality, Report, Settings, Structure, encode};
use splatstream_files::builtin::{BuiltinScene, Tracking};
use splatstream_files::ply;
use splatstream_format::Limits;
use splatstream_format::payload::{SceneDescription, UpAxis};
use splatstream_gaussians::GaussianFrame;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Try everything without any input: make a moving scene, encode it, decode it at every operating point, verify, draw.
///
/// The stream has two spatial layers, two temporal layers with predicted frames, and three refinements. Writes the frames of
/// the source, the stream, the decoded frames, a picture of each operating point, and a report.
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
}

/// The stream's name in the directory of the demo.
const STREAM: &str = "demo.gss";

/// Frames of a GOP.
const GOP: u32 = 8;

impl Demo {
    /// Makes, encodes, decodes, verifies, reports.
    pub(crate) fn run(&self, console: &Console) -> Result<(), Failure> {
        check_directory(&self.out, "files of the demo")?;
        make_directory(&self.out)?;
        let tracking = if self.untracked { Tracking::Untracked } else { Tracking::Tracked };
        let scene = BuiltinScene {
            gaussians: self.gaussians,
            frames: self.frames,
            tracking,
            ..BuiltinScene::default()
        };
        let mut source = self.write_source(scene)?;
        let (stream, encoding, digests) = self.encode(&mut source.frames)?;
        let points = self.points(&stream, &source.frames)?;
        let errors = self.verify(&stream, &source.frames, &digests)?;
        let demonstration = Demonstration {
            directory: self.out.clone(),
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

    /// Makes the frames and writes them as PLY.
    fn write_source(&self, scene: BuiltinScene) -> Result<Source, Failure> {
        let directory = self.out.join("source");
        make_directory(&directory)?;
        let frames: Vec<GaussianFrame> = (0..scene.frames).map(|number| scene.frame(number)).collect();
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

    /// All that a stream can have, with little search.
    fn settings(&self) -> Settings {
        let structure = match self.frames {
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

    fn encode(&self, frames: &mut Vec<GaussianFrame>) -> Result<(Vec<u8>, Encoding, Vec<u64>), Failure> {
        let progress = Progress::frames("encoding", self.frames);
        let start = Instant::now();
        let mut stream = Vec::new();
        let Report { bytes, gaussians, digests, .. } =
            encode(frames, &self.settings(), &mut stream, &mut |done, _| progress.at(done))
                .map_err(|error| Failure::other(error.to_string()))?;
        let seconds = start.elapsed().as_secs_f64();
        OutputFile::write(&self.out.join(STREAM), &stream)?;
        let rate = gaussians as f64 / seconds.max(f64::MIN_POSITIVE);
        let bpg = bits_per_gaussian(bytes, gaussians);
        Ok((stream, Encoding { bytes, gaussians, bpg, seconds, gaussians_per_second: rate }, digests))
    }

    /// Decodes and draws every operating point, and writes the frames of the last, which is everything.
    fn points(&self, stream: &[u8], source: &[GaussianFrame]) -> Result<Vec<Point>, Failure> {
        let infos = operating_points(stream, &Limits::default()).map_err(|error| self.fault(error))?;
        let mut album = Album::start(&self.out)?;
        let progress = Progress::frames("decoding", infos.len() as u32 * self.frames);
        let (mut points, mut moment) = (Vec::new(), None);
        for (done, info) in infos.iter().enumerate() {
            progress.at(done as u32 * self.frames);
            let is_last = done + 1 == infos.len();
            let directory = is_last.then(|| self.out.join("decoded"));
            let (shown, seconds) = self.decode(stream, info, directory, moment)?;
            // The smallest point has fewest frames: all others have its last one.
            moment = moment.or(shown.as_ref().map(|(number, _)| *number));
            let drawn = shown.map(|(number, frame)| album.draw(info.point, number, &frame, source));
            points.push(Point::new(info, seconds, drawn.transpose()?.flatten()));
        }
        Ok(points)
    }

    /// Decodes one operating point, every digest compared; gives the frame that is drawn, the last one if none is named, and
    /// writes all to a directory if there is one.
    fn decode(
        &self,
        stream: &[u8],
        info: &OperatingPointInfo,
        directory: Option<PathBuf>,
        moment: Option<u32>,
    ) -> Result<(Option<(u32, GaussianFrame)>, f64), Failure> {
        directory.as_deref().map_or(Ok(()), make_directory)?;
        let (mut shown, mut failed, mut writing) = (None, None, Duration::ZERO);
        let options = Options { operating_point: info.point, ..Options::default() };
        let start = Instant::now();
        let summary = decode_stream(stream, &options, |sequence, frame| {
            let number = frame.index;
            let take = || {
                let gaussians = to_gaussians(frame.into_shown(), sequence)?;
                let start = Instant::now();
                if let Some(directory) = &directory {
                    OutputFile::write(&frame_path(directory, number as usize), &ply::write(&gaussians))?;
                }
                writing += start.elapsed();
                if moment.is_none_or(|moment| moment == number) {
                    shown = Some((number, gaussians));
                }
                Ok(())
            };
            failed = take().err();
            if failed.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        let seconds = start.elapsed().saturating_sub(writing).as_secs_f64();
        match (failed, summary.verdict()) {
            (Some(failure), _) => Err(failure),
            (None, Some(error)) => Err(self.fault(error)),
            (None, None) => Ok((shown, seconds)),
        }
    }

    /// Compares all of the decoded stream with what the encoder says it is, and with the source.
    fn verify(
        &self,
        stream: &[u8],
        source: &[GaussianFrame],
        digests: &[u64],
    ) -> Result<AttributeErrors, Failure> {
        let mut sums = ErrorSums::default();
        let (mut decoded, mut broken) = (Vec::new(), None);
        let options = Options { operating_point: OperatingPoint::ALL, ..Options::default() };
        let summary = decode_stream(stream, &options, |sequence, frame| {
            decoded.extend(frame.digest);
            // One frame says enough about the errors of a scene like this one.
            if frame.index == 0
                && let Some(original) = source.first()
            {
                match to_gaussians(frame.into_shown(), sequence) {
                    Ok(shown) => {
                        compare_frames(original, &shown, Match::Auto, &mut sums);
                    }
                    Err(error) => broken = Some(error),
                }
            }
            ControlFlow::Continue(())
        });
        if let Some(error) = broken {
            return Err(error.into());
        }
        match summary.verdict() {
            Some(error) => Err(self.fault(error)),
            None if decoded != digests => {
                Err(Failure::other("the decoder's digests are not the encoder's: please report this"))
            }
            None => Ok(sums.errors()),
        }
    }

    fn fault(&self, error: splatstream_format::Error) -> Failure {
        Failure::stream(&self.out.join(STREAM), error)
    }
}

/// The scene that is encoded.
struct Source {
    frames: Vec<GaussianFrame>,
    summary: Scene,
}

fn frame_path(directory: &Path, number: usize) -> PathBuf {
    directory.join(format!("frame_{number:04}.ply"))
}
