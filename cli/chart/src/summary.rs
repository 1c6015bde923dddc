//! What `chart` says on the terminal.

use super::gop_text;
use super::peers::MissingPeer;
use super::scene_chart::SceneChart;
use crate::table::Table;
use serde::Serialize;

/// What is said of a chart: the baseline of each scene. As JSON it is what `chart --json` says of scenes.
#[derive(Serialize)]
pub struct Summary {
    scenes: Vec<SceneSummary>,
    /// The tables of sequences, in words.
    #[serde(skip)]
    sequences: String,
}

/// The baseline of a scene.
#[derive(Serialize)]
struct SceneSummary {
    scene: String,
    variant: String,
    quality: String,
    frames: usize,
    gaussians: u64,
    bytes: u64,
    bpg: f64,
    mbit_s: f64,
    /// A still has no bandwidth; the key is of a sequence of such frames.
    #[serde(skip)]
    is_still: bool,
    psnr_db: f64,
    ssim: Option<f64>,
    st_lpips: Option<f64>,
    encode_gaussians_per_second: f64,
    decode_gaussians_per_second: f64,
    variants: Vec<VariantSummary>,
    peers: Vec<String>,
    peers_missing: Vec<String>,
}

/// A variant beside the baseline.
#[derive(Serialize)]
struct VariantSummary {
    variant: String,
    group: &'static str,
    psnr_db_at_baseline_rate: Option<f64>,
    bd_rate_percent: Option<f64>,
    encode_gaussians_per_second: f64,
    decode_gaussians_per_second: f64,
}

impl Summary {
    pub(super) fn new(charts: &[SceneChart]) -> Self {
        let scenes = charts.iter().filter_map(SceneSummary::new).collect();
        let sequences = charts.iter().map(gop_text::text).collect();
        Self { scenes, sequences }
    }

    /// For people.
    pub fn text(&self) -> String {
        let mut table = Table::new([
            "scene",
            "bits per Gaussian",
            "Mbit/s",
            "PSNR dB",
            "SSIM",
            "encoded M/s",
            "decoded M/s",
        ]);
        for scene in &self.scenes {
            let speed = |speed: f64| format!("{:.2}", speed / 1e6);
            table.row([
                scene.scene.clone(),
                format!("{:.2}", scene.bpg),
                if scene.is_still { "-".to_owned() } else { format!("{:.2}", scene.mbit_s) },
                format!("{:.2}", scene.psnr_db),
                scene.ssim.map_or_else(|| "none".to_owned(), |ssim| format!("{ssim:.4}")),
                speed(scene.encode_gaussians_per_second),
                speed(scene.decode_gaussians_per_second),
            ]);
        }
        format!("{}\n{}", table.text(), self.sequences)
    }
}

impl SceneSummary {
    fn new(chart: &SceneChart) -> Option<Self> {
        let run = chart.headline()?;
        let point = run.full()?;
        let standings = chart.standings();
        let own = standings.first()?;
        let variants = standings.iter().skip(1).map(|standing| VariantSummary {
            variant: standing.name.clone(),
            group: standing.group.name(),
            psnr_db_at_baseline_rate: standing.psnr_at_rate,
            bd_rate_percent: standing.bd_rate,
            encode_gaussians_per_second: standing.encode_speed,
            decode_gaussians_per_second: standing.decode_speed,
        });
        Some(Self {
            scene: chart.name.clone(),
            variant: run.variant.clone(),
            quality: run.quality.clone(),
            frames: chart.frames.0,
            gaussians: chart.gaussians,
            bytes: point.info.bytes,
            bpg: chart.rate(point),
            mbit_s: chart.bandwidth(point),
            is_still: chart.is_still(),
            psnr_db: point.figures.psnr_db,
            ssim: point.figures.ssim,
            st_lpips: point.figures.st_lpips,
            encode_gaussians_per_second: own.encode_speed,
            decode_gaussians_per_second: own.decode_speed,
            variants: variants.collect(),
            peers: chart.peers.iter().map(|peer| peer.peer.clone()).collect(),
            peers_missing: chart.missing.iter().map(missing_text).collect(),
        })
    }
}

fn missing_text(missing: &MissingPeer) -> String {
    format!("{}: {}", missing.peer, missing.why)
}
