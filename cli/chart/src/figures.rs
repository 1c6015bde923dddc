//! The figures of a scene, from its numbers.

use super::scene_chart::{METRICS, Metric, SceneChart};
use super::svg::Figure;
use super::svg::bars::{Bar, Bars};
use super::svg::plot::{Dot, Line, Plot, Series};
use super::sweep::Group;
use crate::costs::Costs;

/// Styles of curves: the first are qualities, then come peers, the last is what all have in common.
const PEER_STYLES: [usize; 3] = [4, 5, 6];
const COMMON_STYLE: usize = 7;

/// Quality against rate, for each metric that was measured.
pub(super) fn rate_figures(scene: &SceneChart) -> Vec<Figure> {
    METRICS.iter().filter_map(|metric| rate_plot(scene, metric).figure()).collect()
}

fn rate_plot(scene: &SceneChart, metric: &Metric) -> Plot {
    let mut series = vec![all_gaussians(scene, metric)];
    series.extend(scene.baseline().enumerate().map(|(style, run)| {
        let detailed = run.quality == scene.quality;
        let dot = |point: &super::measure::Point| {
            let (rate, percent) = (scene.rate(point), point.info.percent);
            let value = (metric.of)(&point.figures)?;
            let last = percent == 100;
            let label = match (last, detailed) {
                (true, _) => Some(run.quality.clone()),
                (false, true) => Some(format!("{percent} %")),
                (false, false) => None,
            };
            let hint = hint(&format!("{}, {percent} %", run.quality), rate, value, metric);
            Some(Dot { at: (rate, value), label, hint })
        };
        Series { style, line: Line::Solid, dots: run.points.iter().filter_map(dot).collect() }
    }));
    series.extend(reordered(scene, metric));
    series.extend(peers(scene, metric));
    Plot {
        id: format!("{}-rate-{}", scene.name, metric.id),
        title: format!("{}: {} against rate", scene.name, metric.name),
        description: format!(
            "{} of the decoded scene for each quality and refinement level against bits per Gaussian of the \
             source; {} is better.",
            metric.name, metric.better
        ),
        x: "bits per Gaussian of the source".to_owned(),
        y: metric.axis.to_owned(),
        top: scene
            .mbit_per_bpg()
            .map(|factor| (factor, format!("Mbit/s at {} frames per second", scene.fps))),
        series,
    }
}

/// Variants that order Gaussians otherwise, in the colour of their quality.
fn reordered(scene: &SceneChart, metric: &Metric) -> Vec<Series> {
    let style = scene.baseline().position(|run| run.quality == scene.quality).unwrap_or(0);
    let other = scene.runs.iter().filter(|run| run.group == Group::Without && run.points.len() > 1);
    let series = |run: &super::measure::Run| {
        let dot = |(place, point): (usize, &super::measure::Point)| {
            let (rate, value) = (scene.rate(point), (metric.of)(&point.figures)?);
            let name = format!("{} ({}), {} %", run.variant, run.quality, point.info.percent);
            let label = (place == 0).then(|| run.variant.clone());
            Some(Dot { at: (rate, value), label, hint: hint(&name, rate, value, metric) })
        };
        Series { style, line: Line::Dashed, dots: run.points.iter().enumerate().filter_map(dot).collect() }
    };
    other.map(series).collect()
}

fn hint(name: &str, rate: f64, value: f64, metric: &Metric) -> String {
    format!("{name}: {rate:.2} bits per Gaussian, {} {value:.*}", metric.name, metric.decimals)
}

/// The qualities at 100 %: what a sender chooses from who sends everything.
fn all_gaussians(scene: &SceneChart, metric: &Metric) -> Series {
    let dot = |run: &super::measure::Run| {
        let point = run.full()?;
        let (rate, value) = (scene.rate(point), (metric.of)(&point.figures)?);
        Some(Dot { at: (rate, value), label: None, hint: hint(&run.quality, rate, value, metric) })
    };
    Series { style: COMMON_STYLE, line: Line::Dashed, dots: scene.baseline().filter_map(dot).collect() }
}

/// One series a peer, its name at the last point.
fn peers(scene: &SceneChart, metric: &Metric) -> Vec<Series> {
    let mut names: Vec<&str> = Vec::new();
    let lossy = || scene.peers.iter().filter(|point| !point.is_lossless());
    lossy().for_each(|point| {
        if !names.contains(&point.peer.as_str()) {
            names.push(&point.peer);
        }
    });
    let one = |(place, name): (usize, &&str)| {
        let mut points: Vec<_> = lossy().filter(|point| point.peer == **name).collect();
        points.sort_by(|a, b| a.bpg.total_cmp(&b.bpg));
        let dots: Vec<Dot> = points
            .iter()
            .enumerate()
            .filter_map(|(at, point)| {
                let value = (metric.of)(&point.figures)?;
                let label = (at + 1 == points.len()).then(|| (*name).to_owned());
                let hint = hint(&format!("{name} {}", point.details), point.bpg, value, metric);
                Some(Dot { at: (point.bpg, value), label, hint })
            })
            .collect();
        // Their options are not steps of one scale: a line would promise what lies between.
        Series { style: PEER_STYLES[place % PEER_STYLES.len()], line: Line::None, dots }
    };
    names.iter().enumerate().map(one).collect()
}

/// What attributes cost, and what units cost.
pub(super) fn cost_figures(scene: &SceneChart) -> Vec<Figure> {
    [attribute_bars(scene), unit_bars(scene)].iter().filter_map(Bars::figure).collect()
}

fn attribute_bars(scene: &SceneChart) -> Bars {
    let names =
        |costs: &Costs| costs.attributes.iter().map(|cost| cost.attribute.replace('_', " ")).collect();
    let mut parts: Vec<String> = scene.headline().map_or_else(Vec::new, |run| names(&run.costs));
    parts.push("all else".to_owned());
    let bar = |run: &super::measure::Run| {
        let mut parts: Vec<f64> = run.costs.attributes.iter().map(|cost| cost.bpg).collect();
        parts.push((run.costs.bpg - parts.iter().sum::<f64>()).max(0.0));
        Bar { name: run.quality.clone(), parts }
    };
    Bars {
        id: format!("{}-cost-attributes", scene.name),
        title: format!("{}: bits by attribute", scene.name),
        description: "Bits per Gaussian of each attribute, a bar for each quality.".to_owned(),
        x: "bits per coded Gaussian".to_owned(),
        parts,
        bars: scene.baseline().map(bar).collect(),
    }
}

fn unit_bars(scene: &SceneChart) -> Bars {
    let mut parts: Vec<&str> = Vec::new();
    for cost in scene.baseline().flat_map(|run| &run.costs.units) {
        // What can be seen; the rest goes together.
        if cost.percent >= 0.5 && !parts.contains(&cost.kind) {
            parts.push(cost.kind);
        }
    }
    let bar = |run: &super::measure::Run| {
        let bits = |kind: &&str| {
            let of_kind = run.costs.units.iter().filter(|cost| cost.kind == *kind);
            of_kind.map(|cost| cost.bpg).sum::<f64>()
        };
        let mut values: Vec<f64> = parts.iter().map(bits).collect();
        values.push((run.costs.bpg - values.iter().sum::<f64>()).max(0.0));
        Bar { name: run.quality.clone(), parts: values }
    };
    let bars = scene.baseline().map(bar).collect();
    let names = parts.iter().map(|kind| kind.replace('_', " ")).chain(["all else".to_owned()]);
    Bars {
        id: format!("{}-cost-units", scene.name),
        title: format!("{}: bits by kind of unit", scene.name),
        description: "Bits per Gaussian of each kind of unit, a bar for each quality.".to_owned(),
        x: "bits per coded Gaussian".to_owned(),
        parts: names.collect(),
        bars,
    }
}
