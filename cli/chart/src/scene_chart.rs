//! Everything that was found out about a scene.

use super::front::FrontRow;
use super::gop::Gop;
use super::levels::{Level, intra_levels};
use super::measure::{Point, Run};
use super::modes::{Mode, intra_modes, mbit_per_second};
use super::peers::{MissingPeer, PeerPoint};
use super::pictures::Pictures;
use super::scenes::Scene;
use super::sweep::Group;
use super::variant_comparison::{Standing, curve, standings};
use crate::numbers::bits_per_gaussian;
use splatstream_render::Camera;
use splatstream_render::metrics::{Comparison, RatePoint};

/// A scene, measured.
pub(crate) struct SceneChart {
    /// What the page calls it.
    pub(crate) name: String,
    /// Where it comes from, in words.
    pub(crate) source: String,
    /// Frames measured, and frames of the source.
    pub(crate) frames: (usize, u32),
    /// Gaussians of the source over the frames measured.
    pub(crate) gaussians: u64,
    /// Degree of its spherical harmonics.
    pub(crate) sh_degree: u8,
    /// Number of cameras, and pixels of the first.
    pub(crate) cameras: (usize, u32, u32),
    /// Frames per second.
    pub(crate) fps: f64,
    /// The quality at which variants are compared.
    pub(crate) quality: String,
    /// All runs, the baseline first.
    pub(crate) runs: Vec<Run>,
    /// Speed against size: of the first frame by itself, then of the first GOP with predicted frames, if there is one.
    pub(crate) fronts: Vec<Vec<FrontRow>>,
    /// The first GOP with predicted frames; none if the scene has one frame.
    pub(crate) gop: Option<Gop>,
    /// Other codecs.
    pub(crate) peers: Vec<PeerPoint>,
    /// Other codecs that were not measured.
    pub(crate) missing: Vec<MissingPeer>,
    /// What it looks like.
    pub(crate) pictures: Option<Pictures>,
}

impl SceneChart {
    /// A scene with its runs, so far without peers and pictures.
    pub(crate) fn new(scene: &Scene, cameras: &[Camera], runs: Vec<Run>, quality: String, fps: f64) -> Self {
        let builtin = || "made by the program itself".to_owned();
        Self {
            name: scene.name.clone(),
            source: scene.path.as_ref().map_or_else(builtin, |path| path.display().to_string()),
            frames: (scene.frames.len(), scene.frames_of_source),
            gaussians: scene.gaussians(),
            sh_degree: scene.sh_degree(),
            cameras: (
                cameras.len(),
                cameras.first().map_or(0, |camera| camera.width),
                cameras.first().map_or(0, |camera| camera.height),
            ),
            fps,
            quality,
            runs,
            fronts: Vec::new(),
            gop: None,
            peers: Vec::new(),
            missing: Vec::new(),
            pictures: None,
        }
    }

    /// The runs of the baseline, coarsest first.
    pub(crate) fn baseline(&self) -> impl Iterator<Item = &Run> {
        self.runs.iter().filter(|run| run.group == Group::Baseline)
    }

    /// The run that stands for the scene: the baseline at the quality of comparison.
    pub(crate) fn headline(&self) -> Option<&Run> {
        self.baseline().find(|run| run.quality == self.quality)
    }

    /// Bits per Gaussian of the source.
    pub(crate) fn rate(&self, point: &Point) -> f64 {
        bits_per_gaussian(point.info.bytes, self.gaussians)
    }

    /// Frames per second; none if the scene stands still.
    pub(crate) fn frame_rate(&self) -> Option<f64> {
        (self.frames.1 > 1).then_some(self.fps)
    }

    /// Mbit/s at the frame rate.
    pub(crate) fn bandwidth(&self, point: &Point) -> Option<f64> {
        self.frame_rate().map(|fps| mbit_per_second(point.info.bytes, self.frames.0, fps))
    }

    /// Mbit/s of one bit per Gaussian of the source.
    pub(crate) fn mbit_per_bpg(&self) -> Option<f64> {
        self.frame_rate().map(|fps| self.gaussians as f64 * fps / self.frames.0.max(1) as f64 / 1e6)
    }

    /// Whether the learned metric was measured.
    pub(crate) fn has_learned(&self) -> bool {
        self.runs.iter().filter_map(Run::full).any(|point| point.figures.st_lpips.is_some())
    }

    /// All runs beside the baseline.
    pub(crate) fn runs_compared(&self) -> Vec<Standing> {
        standings(&self.runs, &self.quality, self.gaussians)
    }

    /// Variants beside the baseline at the quality of comparison, the baseline first.
    pub(crate) fn standings(&self) -> Vec<Standing> {
        self.runs_compared().into_iter().filter(|run| run.quality == self.quality).collect()
    }

    /// The baseline over its qualities.
    pub(crate) fn anchor(&self) -> Vec<RatePoint> {
        self.baseline().next().map_or_else(Vec::new, |run| curve(&self.runs, &run.variant, self.gaussians))
    }

    /// The refinement levels of intra frames.
    pub(crate) fn intra_levels(&self) -> Vec<Level> {
        self.headline().map_or_else(Vec::new, intra_levels)
    }

    /// Ways to play intra frames.
    pub(crate) fn intra_modes(&self) -> Vec<Mode> {
        self.headline().map_or_else(Vec::new, |run| intra_modes(run, self.frame_rate()))
    }
}

/// A metric that figures are drawn of.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Metric {
    /// Short name, also in file names.
    pub(crate) id: &'static str,
    /// Name on the page.
    pub(crate) name: &'static str,
    /// Name and unit on an axis.
    pub(crate) axis: &'static str,
    /// Which way is better.
    pub(crate) better: &'static str,
    /// The figure.
    pub(crate) of: fn(&Comparison) -> Option<f64>,
    /// Decimals.
    pub(crate) decimals: usize,
}

/// PSNR, SSIM and the learned metric.
pub(crate) const METRICS: [Metric; 3] = [
    Metric {
        id: "psnr",
        name: "PSNR",
        axis: "PSNR, dB",
        better: "higher",
        of: |figures| Some(figures.psnr_db),
        decimals: 2,
    },
    Metric {
        id: "ssim",
        name: "SSIM",
        axis: "SSIM",
        better: "higher",
        of: |figures| figures.ssim,
        decimals: 4,
    },
    Metric {
        id: "st-lpips",
        name: "ST-LPIPS",
        axis: "ST-LPIPS, learned distance",
        better: "lower",
        of: |figures| figures.st_lpips,
        decimals: 4,
    },
];
