//! What quality costs: every scene with every variant at every quality, decoded, rendered, compared with its source.

use crate::Progress;
use crate::front;
use crate::gop;
use crate::page::{Page, SceneFigures};
use crate::peers::Peers;
use crate::picture_comparison::Judge;
use crate::report::{File, Report};
use crate::scene_chart::SceneChart;
use crate::scenes::Scene;
use crate::summary::Summary;
use crate::svg::Figure;
use crate::sweep::{Sweep, Variant};
use crate::variant_comparison::bytes_for_the_same;
use crate::{Error, csv_files, figures, front_figures, measure, pictures};
use splatstream_render::Camera;
use splatstream_render::metrics::StLpips;

/// A scene, and where it is looked at from.
pub struct Subject {
    /// The scene.
    pub scene: Scene,
    /// The cameras, at least one.
    pub cameras: Vec<Camera>,
}

/// What the charts of all scenes have in common.
pub struct Charting<'a> {
    /// The variants and qualities.
    pub sweep: Sweep,
    /// Frames per second, for bandwidths.
    pub fps: f64,
    /// Frames in the GOP whose operating points are measured, 2 or more.
    pub gop: u32,
    /// Whether each predictor and each part of the network is measured too.
    pub ablation: bool,
    /// The learned metric; without it, it is not measured.
    pub learned: Option<StLpips>,
    /// Results of other codecs.
    pub peers: Option<Peers<'a>>,
    /// The command that makes the page, for people to repeat.
    pub command: String,
}

impl Charting<'_> {
    /// Steps of progress that [`Charting::run`] takes.
    pub fn steps(&self, subjects: &[Subject]) -> u32 {
        let of_scene = |Subject { scene, .. }: &Subject| {
            let of_gop = if gop::is_sequence(scene, self.gop) { gop::steps(self.ablation) } else { 0 };
            let of_peers = self.peers.as_ref().map_or(0, |peers| peers.count(scene));
            let of_fronts: usize =
                self.fronts(scene).into_iter().map(|frames| self.contenders(scene, frames).len()).sum();
            let of_runs = measure::steps(&self.sweep) + of_fronts as u32;
            scene.frames.len() as u32 + of_runs + of_gop + of_peers
        };
        subjects.iter().map(of_scene).sum()
    }

    /// Measures every scene.
    ///
    /// # Errors
    /// The encoder refuses a scene, or a scene has no frame or no camera.
    pub fn run(&self, subjects: Vec<Subject>, progress: &dyn Progress) -> Result<Report<Summary>, Error> {
        let mut kept = Vec::new();
        let charts = subjects.into_iter().map(|subject| self.chart(subject, progress, &mut kept));
        let charts: Vec<SceneChart> = charts.collect::<Result<_, _>>()?;
        let figures: Vec<SceneFigures> = charts
            .iter()
            .map(|scene| SceneFigures {
                rates: figures::rate_figures(scene),
                speeds: front_figures::figures(scene),
                costs: figures::cost_figures(scene),
            })
            .collect();
        let mut files = csv_files::files(&charts)?;
        files.extend(figures.iter().flat_map(SceneFigures::all).map(Figure::file));
        let page = Page { charts: &charts, figures: &figures, sweep: &self.sweep, command: &self.command };
        Ok(Report { files, pictures: kept, page: page.html(), summary: Summary::new(&charts) })
    }

    /// Frames of each front: the first by itself, and the first GOP unless charts are to be quick.
    pub(crate) fn fronts(&self, scene: &Scene) -> Vec<u32> {
        let is_sequence = self.sweep.choices && gop::is_sequence(scene, self.gop);
        let of_gop = is_sequence.then(|| self.gop.min(scene.frames.len() as u32));
        core::iter::once(1).chain(of_gop).collect()
    }

    pub(crate) fn contenders(&self, scene: &Scene, frames: u32) -> Vec<Variant> {
        front::contenders(&self.sweep, (frames, scene.sh_degree()))
    }

    fn chart(
        &self,
        subject: Subject,
        progress: &dyn Progress,
        kept: &mut Vec<File>,
    ) -> Result<SceneChart, Error> {
        let Subject { mut scene, cameras } = subject;
        progress.step(format!("{}: pictures of the source", scene.name));
        let mut judge = Judge::new(&scene.frames, cameras, self.learned.as_ref(), || progress.advance());
        let runs = measure::measure(&mut scene, &self.sweep, &mut judge, progress)?;
        let quality = self.sweep.quality().name().to_owned();
        let mut chart = SceneChart::new(&scene, judge.cameras(), runs, quality, self.fps);
        for frames in self.fronts(&scene) {
            let variants = self.contenders(&scene, frames);
            let mut some = scene.frames.iter().take(frames as usize).cloned().collect();
            chart.fronts.push(front::measure(&mut some, &variants, &self.sweep, &mut judge, progress)?);
        }
        if gop::is_sequence(&scene, self.gop) {
            let settings = gop::settings(self.sweep.headline(), self.gop);
            let asked = (self.fps, self.ablation);
            chart.gop = Some(gop::measure(&scene, &settings, asked, &mut judge, progress)?);
        }
        if let Some(peers) = &self.peers {
            progress.step(format!("{}: pictures of other codecs", scene.name));
            (chart.peers, chart.missing) = peers.judged(&scene, &judge, || progress.advance());
            let anchor = chart.anchor();
            for peer in &mut chart.peers {
                peer.ours_percent = bytes_for_the_same(&anchor, peer.rate_point());
            }
        }
        if let Some(run) = chart.headline() {
            chart.pictures = pictures::pictures(&scene.name, run, &judge, kept)?;
        }
        Ok(chart)
    }
}
