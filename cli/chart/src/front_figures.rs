//! The figures of speed against size, and of pictures against the time to decode them.

use super::front::{FrontRow, Place};
use super::measure::{Point, Run};
use super::scene_chart::SceneChart;
use super::svg::Figure;
use super::svg::plot::{Dot, Line, Plot, Series};
use super::sweep::Group;

/// Points that a front has at least: over two, axes make a great difference of any.
const FEWEST: usize = 3;

/// What is drawn against bits: what is done, the unit, how long it takes, and where it stands.
struct Axis {
    verb: &'static str,
    unit: &'static str,
    time: fn(&FrontRow) -> f64,
    place: fn(&FrontRow) -> &Place,
}

const AXES: [Axis; 2] = [
    Axis {
        verb: "encode",
        unit: "seconds of one processor to encode",
        time: |row| row.encode.work(),
        place: |row| &row.encoding,
    },
    Axis {
        verb: "decode",
        unit: "nanoseconds of one processor to decode a Gaussian",
        time: FrontRow::decode_nanoseconds,
        place: |row| &row.decoding,
    },
];

/// All figures of a scene.
pub(super) fn figures(scene: &SceneChart) -> Vec<Figure> {
    let of_front = |rows: &Vec<FrontRow>| {
        AXES.iter().filter_map(|axis| front_plot(&scene.name, rows, axis)).collect::<Vec<_>>()
    };
    let fronts = scene.fronts.iter().flat_map(of_front);
    fronts.chain(decoding_plot(scene)).filter_map(|plot| plot.figure()).collect()
}

/// Bits against time; none of fewer settings than make a figure.
fn front_plot(scene: &str, rows: &[FrontRow], axis: &Axis) -> Option<Plot> {
    let at = |row: &FrontRow| Some(((axis.time)(row), row.bpg?));
    let drawn: Vec<(&FrontRow, (f64, f64))> = rows
        .iter()
        .filter(|row| *(axis.place)(row) != Place::Apart)
        .filter_map(|row| Some((row, at(row)?)))
        .collect();
    if drawn.len() < FEWEST {
        return None;
    }
    let mut front: Vec<(f64, f64)> =
        drawn.iter().filter(|(row, _)| *(axis.place)(row) == Place::OnFront).map(|(_, at)| *at).collect();
    front.sort_by(|a, b| a.0.total_cmp(&b.0));
    let dots = front.into_iter().map(|at| Dot { at, label: None, hint: String::new() });
    let mut series = vec![Series { style: 7, line: Line::Front, dots: dots.collect() }];
    let of_group = |(style, group): (usize, Group)| Series {
        style,
        line: Line::None,
        dots: drawn
            .iter()
            .filter(|(row, _)| row.group == group)
            .map(|&(row, at)| dot(row, at, axis))
            .collect(),
    };
    let groups = [Group::Baseline, Group::Preset, Group::Fitted, Group::Without, Group::Chosen].into_iter();
    series.extend([7, 0, 2, 1, 3].into_iter().zip(groups).map(of_group));
    let first = rows.first()?;
    let (of_what, kind) = match first.is_predicted {
        true => ("a GOP with predicted frames", "gop"),
        false => ("one frame", "frame"),
    };
    Some(Plot {
        id: format!("{scene}-{kind}-{}-front", axis.verb),
        title: format!("{scene}: time to {} {of_what} against size", axis.verb),
        description: format!(
            "Bits per Gaussian at {:.1} dB against {}; less of both is better, and the band joins the settings that no other \
             beats in both.",
            first.psnr_db, axis.unit
        ),
        x: axis.unit.to_owned(),
        y: format!("bits per Gaussian at {:.1} dB", first.psnr_db),
        top: None,
        series,
    })
}

fn dot(row: &FrontRow, at: (f64, f64), axis: &Axis) -> Dot {
    let place = match (axis.place)(row) {
        Place::BeatenBy(other) => format!(", beaten by {other}"),
        Place::OnFront | Place::Apart => String::new(),
    };
    Dot {
        at,
        label: Some(row.name.clone()),
        hint: format!("{}: {:.3} {}, {:.2} bits per Gaussian{place}", row.name, at.0, axis.unit, at.1),
    }
}

/// What pictures are worth that take so long to decode: each quality over its refinement levels.
fn decoding_plot(scene: &SceneChart) -> Option<Plot> {
    let series = |(style, run): (usize, &Run)| {
        let dot = |point: &Point| {
            let nanoseconds = 1e9 * point.decode.work() / scene.gaussians.max(1) as f64;
            let (percent, psnr) = (point.info.percent, point.figures.psnr_db);
            Dot {
                at: (nanoseconds, psnr),
                label: if percent == 100 { Some(run.quality.clone()) } else { Some(format!("{percent} %")) },
                hint: format!("{}, {percent} %: {nanoseconds:.1} ns, {psnr:.2} dB", run.quality),
            }
        };
        Series { style, line: Line::Solid, dots: run.points.iter().map(dot).collect() }
    };
    let series: Vec<Series> = scene.baseline().enumerate().map(series).collect();
    (!series.is_empty()).then(|| Plot {
        id: format!("{}-decode-quality", scene.name),
        title: format!("{}: PSNR against time to decode", scene.name),
        description: "PSNR of each quality over its refinement levels against the time of one processor that decoding them takes, \
                      over all Gaussians of the source."
            .to_owned(),
        x: "nanoseconds of one processor per Gaussian of the source".to_owned(),
        y: "PSNR, dB".to_owned(),
        top: None,
        series,
    })
}
