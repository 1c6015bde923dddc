//! What fits frames to pictures, and what that has done.

use crate::cameras::Views;
use crate::failure::Failure;
use crate::numbers::counted;
use crate::output_file::check_directory;
use crate::progress::Progress;
use crate::unfinished::advise;
use clap::{Args, ValueEnum};
use serde::Serialize;
use splatstream_capture::load_photographs;
use splatstream_chart::numbers::bits_per_gaussian;
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_encoder::{
    Attribute, Finetune, FinetuneLoss, FinetuneProgress, FinetuneReport, FinetuneState, FinetuneWatch,
    Photograph, PointReport, PointWeight, Report, Settings, StateError,
};
use splatstream_render::camera::read_views;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;

/// Iterations where none are given.
const ITERATIONS: &str = "200";

/// Options of fitting to pictures.
#[derive(Args, Debug)]
pub(super) struct FinetuneArgs {
    /// Choose the values of frames by pictures of what is decoded, in so many iterations at most, 200 if none are given:
    /// fewer bits for the same PSNR, and minutes for each frame. The small preset takes 20; 0 takes none. Of
    /// sequences with predicted frames I frames are fitted, only if this is given, and the others follow their values; where
    /// predicting saves little all frames are I frames then. Where such a sequence takes fewer bytes at equal PSNR without,
    /// nothing is fitted, and the report says so; it is not tried without where options below name what counts.
    #[arg(long, value_name = "ITERATIONS", num_args = 0..=1, default_missing_value = ITERATIONS)]
    finetune: Option<u32>,
    /// Seconds that encoding may take: the preset and the iterations are chosen for them, by counts and a model of costs
    /// and not by the clock, so that the same command writes the same bytes anywhere. They are seconds of one core of a
    /// busy machine of 2025. With --finetune instead: seconds on the clock for each frame, each time it is encoded; how far it
    /// gets in them depends on the machine, and so do the bytes.
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds)]
    time_budget: Option<f64>,
    /// Fit the frame to photographs and not to pictures of the source: those in this directory, named as the cameras of
    /// the file that --cameras gives. What is transparent in them shows --background. The steps stay those with which
    /// pictures of the source have the quality that is asked for.
    #[arg(long, value_name = "DIR", requires = "finetune", requires = "cameras")]
    images: Option<PathBuf>,
    /// Fit these attributes only, to see what each is worth.
    #[arg(long, value_enum, value_name = "ATTRIBUTE,...", value_delimiter = ',', requires = "finetune")]
    finetune_only: Vec<AttributeName>,
    /// Operating points that matter, and what a decibel at each is worth, as in s0,t0,r1=1,s2,t0,r4=3; a point without a weight
    /// has weight 1. Frames are fitted to what receivers at these points see, and not at others. Default is all Gaussians of
    /// each spatial layer, or of the highest one where frames are predicted.
    #[arg(long, value_name = "POINT=WEIGHT,...", requires = "finetune")]
    optimise_for: Option<PointWeights>,
    /// Lines of the pictures to fit to, in turn, as in 540,720,1080; what is named twice counts twice. Default is those that each
    /// spatial layer is for.
    #[arg(long, value_name = "LINES,...", value_delimiter = ',', requires = "finetune")]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=8640))]
    finetune_lines: Vec<u32>,
    /// What fitting makes small. Whichever it is, --psnr asks for a PSNR.
    #[arg(long, value_enum, value_name = "LOSS", default_value = "squared", requires = "finetune")]
    finetune_loss: LossName,
    /// Keep in this directory how far fitting has come, until the stream is written: whatever ends this command before, --resume
    /// goes on from there and writes the stream that it would have written. Up to 20 iterations are lost. It takes 1.4 KB
    /// of a Gaussian with spherical harmonics of degree 3 while it is fitted, and a sixth of that afterwards.
    #[arg(long, value_name = "DIR", requires = "finetune", conflicts_with_all = ["each", "write_plan"])]
    finetune_state: Option<PathBuf>,
    /// Go on with what an earlier run has left in --finetune-state, of the same inputs with the same options; begin where none
    /// has left anything.
    #[arg(long, requires = "finetune_state")]
    resume: bool,
}

/// What fitting makes small.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum LossName {
    /// Squared error: the highest PSNR.
    Squared,
    /// Four fifths L1 and a fifth SSIM, the loss that 3D Gaussian splatting trains with.
    L1Ssim,
}

impl From<LossName> for FinetuneLoss {
    fn from(name: LossName) -> Self {
        match name {
            LossName::Squared => Self::SquaredError,
            LossName::L1Ssim => Self::l1_ssim(),
        }
    }
}

/// Operating points and their weights, as a user writes them.
#[derive(Debug, Clone, PartialEq)]
struct PointWeights(Vec<PointWeight>);

impl FromStr for PointWeights {
    type Err = String;

    /// Points are separated by commas, as their parts are: each begins with an s.
    fn from_str(text: &str) -> Result<Self, String> {
        let mut points: Vec<String> = Vec::new();
        for part in text.split(',') {
            match points.last_mut() {
                Some(point) if !part.starts_with('s') => *point += &format!(",{part}"),
                _ => points.push(part.to_owned()),
            }
        }
        points.iter().map(|point| point_weight(point)).collect::<Result<_, _>>().map(Self)
    }
}

/// A point and its weight, as in s0,t0,r1=2.
fn point_weight(text: &str) -> Result<PointWeight, String> {
    let (point, weight) = text.split_once('=').unwrap_or((text, "1"));
    let point = point.parse::<OperatingPoint>().map_err(|error| error.to_string())?;
    let weight = weight.parse().ok().filter(|weight| (1e-6..=1e6).contains(weight));
    let weight = weight
        .ok_or_else(|| format!("'{text}' has no weight from 0.000001 to 1000000; write it as s0,t0,r1=2"))?;
    Ok(PointWeight { point, weight })
}

fn parse_seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|seconds| (0.001..=1e7).contains(seconds));
    seconds.ok_or_else(|| format!("'{text}' is not a number of seconds from 0.001 to 10000000"))
}

/// An attribute of Gaussians.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum AttributeName {
    /// Centres.
    Position,
    /// Semi-axes.
    LogScale,
    /// Rotations.
    Rotation,
    /// Opacities.
    Opacity,
    /// The constant part of colours.
    Dc,
    /// What colours change with the direction of view.
    Sh,
}

impl From<AttributeName> for Attribute {
    fn from(name: AttributeName) -> Self {
        match name {
            AttributeName::Position => Self::Position,
            AttributeName::LogScale => Self::LogScale,
            AttributeName::Rotation => Self::Rotation,
            AttributeName::Opacity => Self::Opacity,
            AttributeName::Dc => Self::Dc,
            AttributeName::Sh => Self::Sh,
        }
    }
}

impl FinetuneArgs {
    /// Where photographs are, if some are given.
    pub(super) fn images(&self) -> Option<&Path> {
        self.images.as_deref()
    }

    /// The time that a preset and iterations are to be chosen for, seconds; none: they are given, or the usual ones.
    ///
    /// # Errors
    /// A preset is given too, or there is nothing to limit.
    pub(super) fn budget(&self, has_preset: bool) -> Result<Option<f64>, Failure> {
        match (self.time_budget, self.finetune) {
            (Some(_), None) if has_preset => Err(Failure::Usage(
                "--time-budget chooses the preset: leave out --preset, or give --finetune and the time that it may take".to_owned(),
            )),
            (Some(_), Some(0)) => Err(Failure::Usage(
                "--time-budget has nothing to limit with --finetune 0: leave out one of them".to_owned(),
            )),
            (Some(seconds), None) => Ok(Some(seconds)),
            _ => Ok(None),
        }
    }

    /// The settings of the encoder; none where nothing is to be fitted. `usual`: iterations where none are given, or 0;
    /// `layers`: lines that spatial layers are for, if they were given; `taken`: where and how photographs were.
    ///
    /// # Errors
    /// A photograph that is not there, cannot be read or has another shape than its camera; cameras that took none.
    pub(super) fn settings(
        &self,
        usual: u32,
        layers: &[u32],
        taken: &Taken<'_>,
    ) -> Result<Option<Finetune>, Failure> {
        let iterations = self.finetune.unwrap_or(usual);
        if iterations == 0 {
            return Ok(None);
        }
        let is_held = |name: &&AttributeName| !self.finetune_only.contains(name);
        let held = match self.finetune_only.is_empty() {
            true => Vec::new(),
            false => {
                AttributeName::value_variants().iter().filter(is_held).map(|&name| name.into()).collect()
            }
        };
        let photographs = match &self.images {
            Some(directory) => taken.photographs(directory)?,
            None => Vec::new(),
        };
        let time_budget = self.finetune.and(self.time_budget).map(Duration::from_secs_f64);
        Ok(Some(Finetune {
            iterations,
            time_budget,
            loss: self.finetune_loss.into(),
            photographs,
            lines: layers.to_vec(),
            resolutions: self.finetune_lines.clone(),
            optimise_for: self.optimise_for.clone().map_or_else(Vec::new, |points| points.0),
            held,
            ..Finetune::default()
        }))
    }
}

/// How far fitting has come, while it is kept.
#[derive(Debug, Clone)]
pub(super) struct Kept(Option<FinetuneState>);

impl FinetuneArgs {
    /// Has it kept how far fitting comes, where that is asked for, and says to whoever interrupts it how to go on.
    ///
    /// # Errors
    /// A directory that has a state which nobody asked for, or one of other settings; nothing to keep.
    pub(super) fn keep(&self, settings: &mut Settings) -> Result<Kept, Failure> {
        let Some(directory) = &self.finetune_state else { return Ok(Kept(None)) };
        check_directory(directory, "states of fitting")?;
        let state = match self.resume {
            true => FinetuneState::resume(directory, settings),
            false => FinetuneState::create(directory, settings),
        };
        let state = state.map_err(|error| not_kept(&error))?;
        let Some(finetune) = &mut settings.finetune else {
            return Err(Failure::Usage(
                "--finetune-state has nothing to keep with --finetune 0: leave out one of them".to_owned(),
            ));
        };
        finetune.state = state.clone();
        advise(format!(
            "{} has how far fitting came; the same command with --resume goes on",
            directory.display()
        ));
        Ok(Kept(Some(state)))
    }
}

impl Kept {
    /// Removes it: the stream is written.
    pub(super) fn remove(&self) -> Result<(), Failure> {
        self.0.as_ref().map_or(Ok(()), FinetuneState::remove).map_err(|error| not_kept(&error))
    }
}

/// Why a state is of no use.
pub(super) fn not_kept(error: &StateError) -> Failure {
    match error {
        StateError::Exists { directory } => Failure::Usage(format!(
            "{}: an earlier run has left its state there; give --resume to go on with it, or remove the directory",
            directory.display()
        )),
        _ => Failure::other(error.to_string()),
    }
}

/// How the photographs were taken that frames may be fitted to.
pub(super) struct Taken<'a> {
    /// The cameras that were asked for.
    pub(super) cameras: Option<&'a Views>,
    /// Rows to reduce them to.
    pub(super) height: Option<u32>,
    /// What they show where they are transparent.
    pub(super) background: [f32; 3],
    /// Frames that will be fitted.
    pub(super) frames: u32,
}

impl Taken<'_> {
    /// What the cameras took, from a directory.
    ///
    /// # Errors
    /// As those of [`load_photographs`]; cameras that are made, or several frames: photographs are of one moment.
    fn photographs(&self, directory: &Path) -> Result<Vec<Photograph>, Failure> {
        let Some(Views::File(path)) = self.cameras else {
            return Err(Failure::Usage(
                "--images needs the cameras that took them: give their file as --cameras".into(),
            ));
        };
        if self.frames > 1 {
            return Err(Failure::Usage(format!(
                "--images shows one moment, and there are {} frames: encode the frame that it shows by itself",
                self.frames
            )));
        }
        Failure::refuse_standard_input(path)?;
        let capture =
            read_views(path).map_err(|error| Failure::other(format!("{}: {error}", path.display())))?;
        let photographs = load_photographs(&capture, Some(directory), self.height, self.background)
            .map_err(|error| Failure::other(error.to_string()))?;
        let of_encoder = |photograph: splatstream_capture::Photograph| Photograph {
            camera: photograph.camera().clone(),
            picture: photograph.picture(),
        };
        Ok(photographs.into_iter().map(of_encoder).collect())
    }
}

/// Says beside a bar how far fitting a frame has come.
pub(super) fn told_of_fitting(progress: &Progress) -> FinetuneWatch {
    let tell = progress.teller();
    FinetuneWatch::new(move |FinetuneProgress { spatial_layer, done, iterations, .. }| {
        let of_layer = match spatial_layer {
            0 => String::new(),
            layer => format!(" of spatial layer {layer}"),
        };
        tell(match done < iterations {
            true => format!("encoding, fine-tuning{of_layer}: {done} of {iterations} iterations"),
            false => "encoding".to_owned(),
        });
    })
}

/// What fitting one frame has done.
#[derive(Serialize)]
pub(super) struct Fitted {
    frame: u32,
    spatial_layer: u8,
    iterations: u32,
    /// Those of them that an earlier run had done.
    resumed_iterations: u32,
    seconds: f64,
    /// In views that no slope was taken of.
    psnr_db_before: f64,
    psnr_db_after: f64,
    /// Of all values but positions, as estimated.
    values_bpg_before: f64,
    values_bpg_after: f64,
    points: Vec<FittedPoint>,
}

/// What it has done for receivers of an operating point.
#[derive(Serialize)]
struct FittedPoint {
    point: String,
    weight: f64,
    /// In views by which nothing was chosen.
    psnr_db_before: f64,
    psnr_db_after: f64,
}

impl From<&PointReport> for FittedPoint {
    fn from(report: &PointReport) -> Self {
        let PointReport { point, weight, psnr: [psnr_db_before, psnr_db_after], .. } = *report;
        Self { point: point.to_string(), weight, psnr_db_before, psnr_db_after }
    }
}

impl Fitted {
    /// Every frame that was fitted.
    pub(super) fn of(report: &Report) -> Vec<Self> {
        let fitted = |one: &FinetuneReport| {
            let coded = report.coded.get(one.frame as usize);
            let gaussians = coded.map_or(0, |frame| u64::from(frame.gaussians));
            let [psnr_db_before, psnr_db_after] = one.psnr;
            let [values_bpg_before, values_bpg_after] =
                one.bits.map(|bits| bits_per_gaussian((bits / 8.0) as u64, gaussians));
            Self {
                frame: one.frame,
                spatial_layer: one.spatial_layer,
                iterations: one.iterations,
                resumed_iterations: one.resumed,
                seconds: one.seconds,
                psnr_db_before,
                psnr_db_after,
                values_bpg_before,
                values_bpg_after,
                points: one.points.iter().map(FittedPoint::from).collect(),
            }
        };
        report.finetuned.iter().map(fitted).collect()
    }

    /// Lines for people: each layer of the first frame, and how many there are.
    pub(super) fn text(all: &[Self]) -> String {
        let seconds: f64 = all.iter().map(|fitted| fitted.seconds).sum();
        let line = |fitted: &Self| {
            let earlier = match fitted.resumed_iterations {
                0 => String::new(),
                resumed => format!(", {resumed} of them by an earlier run"),
            };
            let layer = format!(
                "  fine-tuned         frame {}, spatial layer {}, {}{earlier}: {:.2} to {:.2} dB in views that it was not fitted \
                 to, {:.2} to {:.2} bits per Gaussian\n",
                fitted.frame,
                fitted.spatial_layer,
                counted(fitted.iterations.into(), "iteration"),
                fitted.psnr_db_before,
                fitted.psnr_db_after,
                fitted.values_bpg_before,
                fitted.values_bpg_after,
            );
            let point = |point: &FittedPoint| {
                let FittedPoint { point, weight, psnr_db_before, psnr_db_after } = point;
                format!(
                    "  point {point:<12} weight {weight}: {psnr_db_before:.2} to {psnr_db_after:.2} dB in views that nothing was \
                     chosen by\n"
                )
            };
            fitted.points.iter().map(point).fold(layer, |text, line| text + &line)
        };
        let first =
            all.iter().take_while(|fitted| all.first().is_some_and(|first| first.frame == fitted.frame));
        let mut text: String = first.map(line).collect();
        if !all.is_empty() {
            let layers = counted(all.len() as u64, "layer");
            text += &format!("  fine-tuning        {layers} of all frames, in {seconds:.1} seconds\n");
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::{PointWeight, PointWeights};
    use splatstream_decoder::operating_point::OperatingPoint;

    #[test]
    fn points_and_weights_read_as_they_are_written() {
        let point = |spatial, temporal, refinement, weight| PointWeight {
            point: OperatingPoint { spatial, temporal, refinement },
            weight,
        };
        let parsed = |text: &str| text.parse::<PointWeights>();
        let both = PointWeights(vec![point(0, 0, 1, 1.0), point(2, 1, 4, 3.5)]);
        assert_eq!(parsed("s0,t0,r1=1,s2,t1,r4=3.5"), Ok(both.clone()));
        assert_eq!(parsed("s0,t0,r1,s2,t1,r4=3.5"), Ok(both));
        for text in [
            "",
            "s0,t0,r1=",
            "s0,t0,r1=0",
            "s0,t0,r1=-1",
            "s0,t0,r1=NaN",
            "s0,t0=1",
            "r1=1,s0,t0",
            "s0,t0,r1=1,2",
        ] {
            assert!(parsed(text).is_err(), "{text}");
        }
    }
}
