//! `splatstream encode`: frames in files to a stream.

mod choice;
mod choices;
mod decided;
mod each;
mod effort;
mod encoded;
mod failed;
mod finetune;
mod network_name;
mod options;
mod output;
mod pictures;
mod prune;
mod refinements;
mod shards;
pub(crate) mod warnings;

use crate::assumed_up::AssumedUp;
use crate::cameras::{BackgroundArg, CameraArgs, Views, to_stream};
use crate::console::Console;
use crate::failure::Failure;
use crate::frame_files::{FrameFiles, unread};
use crate::input_args::{InputArgs, parse_size};
use crate::machine;
use crate::numbers::parse_frame_rate;
use crate::output_file::refuse_inputs;
use crate::progress::Progress;
use crate::setting_names::{
    AnchorName, FidelityName, ImportanceName, PredictorChoiceName, PredictorName, PresetName, QualityName,
    ShName, ToolName,
};
use clap::Args;
use core::ops::RangeInclusive;
use decided::Decided;
use effort::Budget;
use encoded::Encoded;
use failed::failed;
use finetune::{FinetuneArgs, Taken, told_of_fitting};
use network_name::NetworkName;
pub use options::{EncodeOptions, OptionsError, Prepared};
use output::{Output, check_name};
use prune::PruneArgs;
use refinements::Refinements;
use shards::ShardArgs;
use splatstream_encoder::{FrameSource, Quality, Settings, Size, Structure, Work, encode};
use splatstream_format::payload::SceneDescription;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::Camera;
use std::path::{Path, PathBuf};
use std::time::Instant;
use warnings::{Warning, unlike_frames};

/// Encode frames of Gaussians to a stream.
///
/// Frames are .ply, .compressed.ply, .spz, .sog, .splat, .ksplat, .glb or .gltf files, or SOG directories (those with a
/// meta.json). One .zip, .tar or .tar.gz of such files is a sequence, and so is one .splatv or .splat4d.
/// Frames are taken in the natural order of their names: frame_9 before frame_10. The finished stream is decoded, and
/// pictures of a few frames are compared with those of the source; a quality or a size that was missed is a warning.
#[derive(Args)]
#[command(after_help = "Examples:\n  splatstream encode frames/ -o talk.gss --fps 30\n  \
    splatstream encode garden.ply -o garden.gss --quality visually-lossless --preset small\n  \
    splatstream encode garden.ply -o garden.gss --target-mb 8\n  \
    splatstream encode frames.zip -o talk.gss\n  \
    splatstream encode kitchen.splatv -o kitchen.gss --samples 100\n  \
    splatstream encode frames/ -o talk.html\n  \
    splatstream encode garden.ply -o garden.gss --psnr 45 --finetune\n  \
    splatstream encode garden.ply -o garden.gss --time-budget 30\n  \
    splatstream encode garden.ply plant.spz talk/ --each -o streams/\n  \
    splatstream encode frames/ --write-plan -o plan.json\n  \
    splatstream encode frames/ --plan plan.json --shard 2/8 -o shard-2.gss")]
pub(crate) struct Encode {
    /// Files, or one directory of frames, or one file of many; - is one file on standard input, but no .splat or .ksplat.
    #[arg(required = true, value_name = "INPUT")]
    inputs: Vec<PathBuf>,
    /// The stream to write; - is standard output. A name that ends in .html is a web page that plays it, with the stream
    /// inside.
    #[arg(short, long = "out", value_name = "OUT.gss")]
    out: PathBuf,
    /// Every input is a scene of its own: encode each to a stream of its name in the directory OUT.
    #[arg(long)]
    each: bool,
    /// How much to do: smaller files take longer [default: balanced].
    #[arg(long, value_enum)]
    preset: Option<PresetName>,
    /// How close pictures of the decoded scene are to those of the source: PSNR at 540 lines. The quantisers are fitted
    /// to the first frame for it.
    #[arg(long, value_enum, default_value_t = QualityName::High)]
    quality: QualityName,
    /// A PSNR in decibels instead of a named quality, 20 to 90.
    #[arg(long, value_name = "DB", conflicts_with = "quality", value_parser = parse_psnr)]
    psnr: Option<f32>,
    /// The size of the stream instead, bits per Gaussian with everything counted, to 3 %: it is encoded a few times.
    #[arg(long, value_name = "BITS", conflicts_with_all = ["quality", "psnr"], value_parser = parse_positive)]
    target_bpg: Option<f64>,
    /// The size of the stream in megabytes (of 1,000,000 bytes) instead, to 3 %.
    #[arg(long, value_name = "MB", conflicts_with_all = ["quality", "psnr", "target_bpg"], value_parser = parse_positive)]
    target_mb: Option<f64>,
    /// Frames in a GOP; decoding can start at each.
    #[arg(long, value_name = "N", default_value_t = Settings::default().gop)]
    #[arg(value_parser = clap::value_parser!(u32).range(1..))]
    gop: u32,
    /// Spatial layers by the height in lines that each is meant for, 1 to 4 rising numbers; default is 540,720,1080
    /// for a sequence and one layer for a single frame.
    #[arg(long, value_name = "HEIGHTS", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..))]
    layers: Vec<u32>,
    /// Temporal layers, 1 to 4: 1 is I P P P, 2 is I B P B P, more are dyadic.
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u8).range(1..=4))]
    temporal_layers: u8,
    /// Code every frame by itself.
    #[arg(long, conflicts_with = "temporal_layers")]
    all_intra: bool,
    /// What of I frames a receiver of the first refinements gets.
    #[arg(long, value_enum, default_value_t = AnchorName::Nested, conflicts_with = "all_intra")]
    anchor: AnchorName,
    /// What new Gaussians are predicted by, from those of the reference or of lower layers.
    #[arg(long, value_enum, default_value_t = PredictorName::Auto)]
    predictor: PredictorName,
    /// How a predictor is chosen.
    #[arg(long, value_enum, value_name = "RULE", default_value_t = PredictorChoiceName::Bits)]
    choose_by: PredictorChoiceName,
    /// Neighbours of a prediction.
    #[arg(long, value_name = "K", default_value_t = Settings::default().neighbours)]
    #[arg(value_parser = clap::value_parser!(u8).range(1..=16))]
    neighbours: u8,
    /// The network of the transformer: registered, trained (on this sequence, and carried in the stream), or a file
    /// that train has made; default is trained for --predictor transformer, and none otherwise.
    #[arg(long, value_name = "registered|trained|FILE")]
    network: Option<NetworkName>,
    /// Share of the Gaussians up to each refinement, percent: 1 to 10 rising numbers, the last 100; or auto:N, which chooses N
    /// of them so that pictures are best for receivers that take any part of the bytes.
    #[arg(long, value_name = "PERCENTS|auto:N", default_value = "10,20,30,50,100")]
    refinements: Refinements,
    /// Highest degree of spherical harmonics kept; default is what the scene needs.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(0..=3))]
    sh_degree: Option<u8>,
    /// How spherical harmonics are coded.
    #[arg(long, value_enum, default_value_t = ShName::Auto)]
    sh: ShName,
    /// Frames per second: 30, 29.97 or 30000/1001.
    #[arg(long, value_name = "RATE", default_value = "30", value_parser = parse_frame_rate)]
    fps: (u32, u32),
    /// Keep Gaussians whose opacity is below 1/255 everywhere.
    #[arg(long)]
    keep_invisible: bool,
    #[command(flatten)]
    prune: PruneArgs,
    /// Leave out Gaussians with values that are NaN or infinite, or a rotation of length 0, and count them; without
    /// this option they are an error.
    #[arg(long)]
    drop_invalid: bool,
    /// What puts Gaussians into the first refinements; default is removal, and footprint for the fast preset.
    #[arg(long, value_enum)]
    importance: Option<ImportanceName>,
    /// Views to measure importance and pictures in: a cameras.json or transforms.json, ring:N or forward:N; default is all
    /// around. The first 64 cameras of a file go into the stream, for viewers to start from.
    #[arg(long, value_name = "CAMS.json|ring:N|forward:N")]
    cameras: Option<Views>,
    #[command(flatten)]
    shards: ShardArgs,
    /// Memory that GOPs which are coded at the same time may take together, as in 512M or 4G; with little, fewer are, and
    /// the stream is the same.
    #[arg(long, value_name = "SIZE", value_parser = parse_size, default_value = "2G")]
    gop_memory: u64,
    /// Most memory that encoding may take with what it reads, as in 512M or 4G: frames that take more are refused before (exit
    /// code 13), and with little, fewer GOPs are coded at once; the stream is the same [default: three quarters of what this
    /// machine has free].
    #[arg(long, value_name = "SIZE", value_parser = parse_size)]
    max_memory: Option<u64>,
    #[command(flatten)]
    reading: InputArgs,
    #[command(flatten)]
    views: CameraArgs,
    #[command(flatten)]
    background: BackgroundArg,
    /// What the scene is called, for viewers.
    #[arg(long, value_name = "TEXT", value_parser = parse_title)]
    title: Option<String>,
    /// Metres that a unit of the scene stands for.
    #[arg(long, value_name = "METRES", value_parser = parse_metres)]
    metres_per_unit: Option<f32>,
    /// What predicted frames are true to where files are not tracked, that is, no row of one is the same row of the next;
    /// default is pictures, and attributes for the fast preset.
    #[arg(long, value_enum)]
    fidelity: Option<FidelityName>,
    /// How far the pictures of a frame that is true to them may be below what they would be if every difference were
    /// sent, decibels, in the views of --cameras.
    #[arg(long, value_name = "DB", default_value_t = Settings::default().tolerance, value_parser = parse_tolerance)]
    tolerance: f32,
    /// Tools to leave out, to see what each is worth.
    #[arg(long, value_enum, value_name = "TOOL,...", value_delimiter = ',')]
    without: Vec<ToolName>,
    #[command(flatten)]
    finetune: FinetuneArgs,
}

/// Cameras that a stream can hold.
const MAX_CAMERAS: usize = 64;

/// A PSNR that can be asked for, decibels.
const PSNR_ALLOWED: RangeInclusive<f32> = 20.0..=90.0;

fn parse_psnr(text: &str) -> Result<f32, String> {
    let decibels = text.parse().ok().filter(|decibels| PSNR_ALLOWED.contains(decibels));
    decibels.ok_or_else(|| format!("'{text}' is not a PSNR from 20 to 90 decibels"))
}

fn parse_positive(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number| (1e-6..=1e9).contains(number));
    number.ok_or_else(|| format!("'{text}' is not a number from 0.000001 to 1000000000"))
}

fn parse_tolerance(text: &str) -> Result<f32, String> {
    let decibels = text.parse().ok().filter(|decibels| (0.05..=20.0).contains(decibels));
    decibels.ok_or_else(|| format!("'{text}' is not a number of decibels from 0.05 to 20"))
}

fn parse_title(text: &str) -> Result<String, String> {
    match text.len() {
        1..=1024 => Ok(text.to_owned()),
        bytes => Err(format!("a title has 1 to 1024 bytes, this one has {bytes}")),
    }
}

fn parse_metres(text: &str) -> Result<f32, String> {
    let metres = text.parse().ok().filter(|metres| (f32::MIN_POSITIVE..=1e12).contains(metres));
    metres.ok_or_else(|| format!("'{text}' is not a number of metres above 0, at most 10^12"))
}

impl Encode {
    /// Encodes to a file that appears when it is whole.
    pub(crate) fn run(&self, console: &Console) -> Result<(), Failure> {
        if self.each {
            return each::run(self, console);
        }
        if self.shards.writes_plan() {
            return shards::write_plan(self, console);
        }
        console.claim(Some(&self.out))?;
        refuse_inputs(&self.out, &self.inputs)?;
        check_name(&self.out)?;
        self.shards.check_name(&self.out)?;
        let encoded = self.one(console, &self.inputs, &self.out)?;
        console.report_beside(Some(&self.out), &encoded, || encoded.text())
    }

    /// Encodes one scene or sequence; warnings are said.
    fn one(&self, console: &Console, inputs: &[PathBuf], out: &Path) -> Result<Encoded, Failure> {
        let memory = self.memory();
        let mut source = FrameFiles::find(inputs, self.reading.within(memory))?.unchecked();
        let read = self.read_files(&source);
        // At once, and not after minutes of work.
        refuse_inputs(out, &read)?;
        let (mut settings, decided) = self.settings_for(&mut source, (out, memory))?;
        let kept = self.finetune.keep(&mut settings)?;
        let mut file = Output::create(out, &read, self.title.as_deref())?;
        let start = Instant::now();
        let progress = Progress::frames("encoding", source.len());
        if let Some(finetune) = &mut settings.finetune {
            finetune.watch = told_of_fitting(&progress);
        }
        let shard = self.shards.open(&mut source, &settings, memory)?;
        shard.iter().for_each(|shard| progress.of(shard.frames));
        let mut at = |done, _| progress.at(done);
        let report = match &shard {
            None => encode(&mut source, &settings, &mut file, &mut at),
            Some(shard) => shard.encode(&mut source, &mut file, &mut at),
        };
        let report = report.map_err(|error| failed(&source, (out, memory), &error))?;
        drop(progress);
        let page_bytes = file.finish()?;
        kept.remove()?;
        let name_of = |frame| source.name(frame);
        // The size that was asked for is that of the whole stream.
        let settings = if shard.is_some() { Settings { size: None, ..settings } } else { settings };
        let mut encoded = Encoded::new(out, &report, &settings, &name_of, start.elapsed().as_secs_f64());
        encoded.shard = shard.map(|shard| shard.report);
        encoded.page_bytes = page_bytes;
        encoded.chosen.extend(decided.choices());
        encoded.warnings.extend(decided.warnings());
        encoded.warnings.extend(self.unlike(&source, inputs));
        encoded.warnings.extend(source.warnings());
        encoded.warnings.iter().for_each(|warning| console.complain(&warning.text()));
        Ok(encoded)
    }

    /// What is said of frames that were read and are hardly those of one sequence.
    fn unlike(&self, source: &FrameFiles, inputs: &[PathBuf]) -> Option<Warning> {
        let unlike = source.likeness().unlike(inputs.len() > 1)?;
        unlike_frames(&unlike, self.all_intra, self.shards.option())
    }

    /// Memory that everything together may take, bytes.
    fn memory(&self) -> u64 {
        self.max_memory.unwrap_or_else(machine::memory)
    }

    /// Every file that is read: frames, cameras, a network.
    fn read_files(&self, source: &FrameFiles) -> Vec<PathBuf> {
        let cameras = self.cameras.iter().flat_map(|views| views.files_with(self.finetune.images()));
        let network = match &self.network {
            Some(NetworkName::File(path)) => Some(path),
            _ => None,
        };
        let others = network.into_iter().chain(self.shards.plan_file()).cloned();
        source.inputs().into_iter().chain(cameras).chain(others).collect()
    }

    /// Spatial layers.
    fn layer_count(&self, is_predicted: bool) -> Result<u8, Failure> {
        match self.layers.as_slice() {
            [] if is_predicted => Ok(3),
            [] => Ok(1),
            layers if layers.is_sorted_by(|a, b| a < b) && layers.len() <= 4 => Ok(layers.len() as u8),
            _ => Err(Failure::Usage("--layers takes 1 to 4 rising heights, as 540,720,1080".into())),
        }
    }

    fn structure(&self, is_predicted: bool) -> Structure {
        match is_predicted {
            true => Structure::Predicted { layers: self.temporal_layers },
            false => Structure::Intra,
        }
    }

    /// What the stream says about its scene, the cameras of the encoder, and what was taken to point up if nobody says it.
    fn scene(
        &self,
        first: &GaussianFrame,
    ) -> Result<(SceneDescription, Vec<Camera>, Option<AssumedUp>), Failure> {
        let assumed = self.views.up.is_none().then(|| AssumedUp::of(first));
        let mut description = self.description();
        let cameras = match &self.cameras {
            None => Vec::new(),
            Some(views) => self.views.cameras(Some(views), first, &description)?,
        };
        // Cameras that were made are made again by whoever needs some.
        if let Some(Views::File(_)) = &self.cameras {
            description.cameras = to_stream(cameras.get(..MAX_CAMERAS).unwrap_or(&cameras));
        }
        Ok((description, cameras, assumed))
    }

    /// The settings but for the refinements, and what was decided where the options leave it open.
    fn settings(&self, source: &mut dyn FrameSource) -> Result<(Settings, Decided), Failure> {
        let is_predicted = source.len() > 1 && !self.all_intra;
        let layers = self.layer_count(is_predicted)?;
        self.refinements.check()?;
        let first = source.frame(0).map_err(|error| unread(error.as_ref()))?;
        let (description, cameras, assumed_up) = self.scene(&first)?;
        let work = Work {
            gaussians: first.len() as u64,
            sh_degree: first.sh_degree().min(self.sh_degree.unwrap_or(u8::MAX)),
            frames: source.len(),
            is_predicted,
        };
        let budget = self.finetune.budget(self.preset.is_some())?.map(|seconds| Budget::of(seconds, work));
        let preset = self.preset.unwrap_or(PresetName::Balanced).into();
        let usual = budget.map_or_else(|| Settings::of(preset), |budget| budget.effort().settings());
        let psnr = self.goal();
        // With predicted frames values are fitted where that is asked for, not by a preset.
        let fitted = usual.finetune.as_ref().filter(|_| !is_predicted);
        let iterations = fitted.map_or(0, |finetune| finetune.iterations);
        let taken = Taken {
            cameras: self.cameras.as_ref(),
            height: self.views.height,
            background: self.background.colour(&description),
            frames: source.len(),
        };
        let mut settings = Settings {
            structure: self.structure(is_predicted),
            anchor: self.anchor.into(),
            spatial_layers: layers,
            predictors: self.predictor.into(),
            predictor_choice: self.choose_by.into(),
            neighbours: self.neighbours,
            network: self.network.as_ref().map(NetworkName::source).transpose()?,
            steps: Quality::from(self.quality).steps(),
            psnr,
            size: self.size(),
            verify: true,
            drop_invalid: self.drop_invalid,
            gop: self.gop,
            gop_memory: self.gop_memory,
            max_memory: self.memory(),
            sh_degree: self.sh_degree,
            sh: self.sh.into(),
            keep_invisible: self.keep_invisible,
            prune: self.prune.threshold(psnr)?,
            ticks: self.fps,
            importance: self.importance.map(Into::into),
            finetune: self.finetune.settings(iterations, &self.layers, &taken)?,
            cameras,
            fidelity: self.fidelity.map(Into::into),
            tolerance: self.tolerance,
            description,
            ..usual
        };
        self.without.iter().for_each(|tool| tool.leave_out_of(&mut settings));
        Ok((settings, Decided { assumed_up, budget }))
    }

    /// All settings for files, which take some of the memory themselves.
    fn settings_for(
        &self,
        source: &mut FrameFiles,
        (out, memory): (&Path, u64),
    ) -> Result<(Settings, Decided), Failure> {
        let (mut settings, decided) = self.settings(source)?;
        settings.max_memory = source.left_for(&settings, memory);
        let put = self.refinements.put(source, &mut settings);
        put.map_err(|error| failed(source, (out, memory), &error))?;
        Ok((settings, decided))
    }

    /// Whether the preset and the iterations are chosen for a time that all frames take together.
    fn chooses_effort(&self) -> bool {
        matches!(self.finetune.budget(self.preset.is_some()), Ok(Some(_)))
    }

    /// The PSNR that is aimed at, decibels; none where a size is.
    fn goal(&self) -> Option<f32> {
        let asked = || self.psnr.unwrap_or_else(|| Quality::from(self.quality).decibels());
        self.size().is_none().then(asked)
    }

    /// The size that was asked for.
    fn size(&self) -> Option<Size> {
        let bytes = self.target_mb.map(|megabytes| Size::Bytes((megabytes * 1e6) as u64));
        self.target_bpg.map(Size::BitsPerGaussian).or(bytes)
    }

    /// What the stream says about its scene, but for cameras.
    fn description(&self) -> SceneDescription {
        SceneDescription {
            up_axis: self.views.up.map(Into::into).unwrap_or_default(),
            metres_per_unit: self.metres_per_unit,
            background: self.background.background,
            title: self.title.clone(),
            ..SceneDescription::default()
        }
    }
}
