//! `splatstream train`: a network for the learned predictor.

use crate::console::Console;
use crate::failure::Failure;
use crate::frame_files::{FrameFiles, inputs_of, unread};
use crate::input_args::InputArgs;
use crate::memory_bound::{MemoryArgs, MemoryBound, bytes_of};
use crate::numbers::counted;
use crate::output_file::{OutputFile, check_ending, refuse_inputs, refuse_standard};
use crate::progress::Progress;
use crate::setting_names::QualityName;
use clap::Args;
use serde::Serialize;
use sha2::{Digest, Sha256};
use splatstream_chart::Progress as _;
use splatstream_chart::numbers::grouped;
use splatstream_encoder::transformer::{Architecture, Sample};
use splatstream_encoder::{
    FrameSource, Quality, Settings, ShChoice, Structure, bytes_of_samples, nearer, samples, train_network,
};
use splatstream_files::builtin::{BuiltinScene, Tracking};
use splatstream_gaussians::GaussianFrame;
use std::path::PathBuf;

/// Train a network that predicts new Gaussians, for encode --network.
///
/// Every sequence is encoded once, for what its new Gaussians can be predicted from. The same sequences give the same
/// network.
#[derive(Args)]
#[command(after_help = "Example:\n  splatstream train talk/ dance/ -o people.bin\n  \
    splatstream encode walk/ -o walk.gss --predictor transformer --network people.bin")]
pub(crate) struct Train {
    /// Directories of frames.
    #[arg(value_name = "SEQUENCE", required_unless_present = "builtin")]
    sequences: Vec<PathBuf>,
    /// Built-in scenes with untracked frames to train on too, by their seeds.
    #[arg(long, value_name = "SEED,...", value_delimiter = ',')]
    builtin: Vec<u64>,
    /// The network to write.
    #[arg(short, long, value_name = "NETWORK.bin")]
    out: PathBuf,
    /// Frames of each sequence, from the first.
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u32).range(2..))]
    frames: u32,
    /// How close decoded scenes are to the source.
    #[arg(long, value_enum, default_value_t = QualityName::High)]
    quality: QualityName,
    #[command(flatten)]
    memory: MemoryArgs,
    #[command(flatten)]
    reading: InputArgs,
}

/// Gives a frame of a sequence by its number.
type Frame<'a> = dyn FnMut(u32) -> Result<GaussianFrame, Failure> + 'a;

/// What `--json` prints.
#[derive(Serialize)]
struct Trained {
    output: PathBuf,
    bytes: usize,
    sha256: String,
    /// What the network adds to.
    base: &'static str,
    samples: usize,
    epochs: usize,
    /// Mean absolute errors of held-out Gaussians by output, in steps / 64: of the base, and of the network.
    base_errors: Vec<f64>,
    errors: Vec<f64>,
}

impl Train {
    /// Collects, trains, writes.
    pub(crate) fn run(&self, console: &Console) -> Result<(), Failure> {
        refuse_standard(&self.out)?;
        check_ending(&self.out, "bin", "a network")?;
        let inputs = inputs_of(&self.sequences)?;
        // At once, and not after minutes of work.
        refuse_inputs(&self.out, &inputs)?;
        let (mut found, mut bound) = (Vec::new(), self.memory.bound());
        for architecture in Architecture::BASES {
            found.push((architecture, self.samples(&architecture, &mut bound)?));
        }
        let (architecture, all) = nearer(found);
        let count = all.len();
        let progress = Progress::steps(0);
        let trained = train_network(&architecture, all, &mut |epoch| {
            progress.step(format!("epoch {}, error {:.2}", epoch.epoch, epoch.validation));
        });
        drop(progress);
        let Some((network, report)) = trained.map_err(|error| Failure::other(error.to_string()))? else {
            return Err(Failure::other(
                "too few Gaussians are new in these sequences to train with: give more frames".to_owned(),
            ));
        };
        let bytes = network.to_bytes().map_err(|error| Failure::other(error.to_string()))?;
        OutputFile::write_apart(&self.out, &inputs, &bytes)?;
        let sha256 = Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect();
        let trained = Trained {
            output: self.out.clone(),
            bytes: bytes.len(),
            sha256,
            base: if architecture.knn_base { "knn" } else { "bilateral" },
            samples: count,
            epochs: report.epochs.len(),
            base_errors: report.base.means().collect(),
            errors: report.best.means().collect(),
        };
        console.report(&trained, || trained.text())
    }

    /// What all sequences give. What is kept of each, the bound takes note of.
    fn samples(&self, architecture: &Architecture, bound: &mut MemoryBound) -> Result<Vec<Sample>, Failure> {
        let settings = Settings {
            structure: Structure::Predicted { layers: 2 },
            spatial_layers: 3,
            steps: Quality::from(self.quality).steps(),
            // Entries of codebooks are not predicted.
            sh: ShChoice::Coefficients,
            ..Settings::default()
        };
        let (mut all, left) = (Vec::new(), bound.left());
        let progress = Progress::steps((self.sequences.len() + self.builtin.len()) as u32);
        let mut add = |name: String, count: u32, frame: &mut Frame<'_>| {
            progress.step(name.clone());
            let first = frame(0)?;
            // Of a sequence whose frames are like the first.
            let of_frames = bytes_of(&first).saturating_mul(count.into());
            let (gaussians, degree) = (first.len() as u64, first.sh_degree());
            let encoding = settings.memory(gaussians, degree, count).saturating_add(of_frames);
            let failed = |error: splatstream_encoder::Error| Failure::other(format!("{name}: {error}"));
            let of_samples = bytes_of_samples(&settings, architecture, gaussians, count).map_err(failed)?;
            bound.check(encoding.saturating_add(of_samples), &name, "fewer --frames take less")?;
            let (mut held, mut frames) = (bytes_of(&first), vec![first]);
            for number in 1..count {
                let next = frame(number)?;
                held = held.saturating_add(bytes_of(&next));
                bound.check(held.saturating_add(of_samples), &name, "fewer --frames take less")?;
                frames.push(next);
            }
            let max_memory = bound.left().saturating_sub(held.saturating_add(of_samples));
            let settings = Settings { max_memory, ..settings.clone() };
            let found = match samples(&mut frames, &settings, architecture) {
                Err(splatstream_encoder::Error::OverMemory { asked, .. }) => {
                    let asked = asked.saturating_add(held).saturating_add(of_samples);
                    return bound.check(asked, &name, "fewer --frames take less");
                }
                found => found.map_err(failed)?,
            };
            bound.keep(of_samples);
            all.extend(found);
            progress.advance();
            Ok::<(), Failure>(())
        };
        for path in &self.sequences {
            let mut files = FrameFiles::find(std::slice::from_ref(path), self.reading.within(left))?;
            let count = self.frames.min(files.len());
            let mut frame = |number| files.frame(number).map_err(|error| unread(error.as_ref()));
            add(path.display().to_string(), count, &mut frame)?;
        }
        for &seed in &self.builtin {
            let scene = BuiltinScene {
                seed,
                tracking: Tracking::Untracked,
                frames: self.frames,
                ..Default::default()
            };
            add(format!("built-in scene {seed}"), self.frames, &mut |number| Ok(scene.frame(number)))?;
        }
        Ok(all)
    }
}

impl Trained {
    fn text(&self) -> String {
        let steps = |errors: &[f64]| errors.iter().map(|error| error / 64.0).sum::<f64>();
        let (base, error) = (steps(&self.base_errors), steps(&self.errors));
        format!(
            "{}\n  size        {} bytes\n  SHA-256     {}\n  trained     on {} of 16 Gaussians, {}\n  \
             error       {error:.3} steps, {:.1} % less than {} has ({base:.3})\n",
            self.output.display(),
            grouped(self.bytes as u64),
            self.sha256,
            counted(self.samples as u64, "batch"),
            counted(self.epochs as u64, "epoch"),
            100.0 * (1.0 - error / base.max(f64::MIN_POSITIVE)),
            self.base,
        )
    }
}
