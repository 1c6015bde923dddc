//! What `chart` says on the terminal.

use super::front::FrontRow;
use super::peers::MissingPeer;
use super::scene_chart::SceneChart;
use crate::columns::{Column, PROGRAMS, Row, Value, metrics, object, objects, text};
use crate::numbers::counted;
use crate::variant_comparison::Standing;
use serde::Serialize;
use splatstream_render::metrics::Comparison;

/// What is said of a chart: the baseline of each scene. As JSON it is what `chart --json` says of scenes.
#[derive(Serialize)]
pub struct Summary {
    scenes: Vec<SceneSummary>,
    /// The tables of fronts and sequences, in words.
    #[serde(skip)]
    tables: String,
}

/// A scene.
#[derive(Serialize)]
struct SceneSummary {
    #[serde(flatten, serialize_with = "object")]
    baseline: Baseline,
    #[serde(serialize_with = "objects")]
    variants: Vec<Standing>,
    #[serde(serialize_with = "objects")]
    front: Vec<FrontRow>,
    peers: Vec<String>,
    peers_missing: Vec<String>,
}

/// The baseline of a scene at the quality of comparison, everything decoded.
#[derive(Debug, Clone)]
pub(crate) struct Baseline {
    scene: String,
    variant: String,
    quality: String,
    /// Frames measured.
    frames: usize,
    /// Gaussians of the source over these frames.
    gaussians: u64,
    bytes: u64,
    /// Bits per Gaussian of the source.
    bpg: f64,
    /// At the frame rate; none if the scene stands still.
    mbit_s: Option<f64>,
    /// Gaussians per second.
    encode_speed: f64,
    decode_speed: f64,
    figures: Comparison,
}

impl Baseline {
    /// Of a scene; none if it was not measured.
    pub(crate) fn new(chart: &SceneChart) -> Option<Self> {
        let run = chart.headline()?;
        let point = run.full()?;
        let standings = chart.standings();
        let own = standings.first()?;
        Some(Self {
            scene: chart.name.clone(),
            variant: run.variant.clone(),
            quality: run.quality.clone(),
            frames: chart.frames.0,
            gaussians: chart.gaussians,
            bytes: point.info.bytes,
            bpg: chart.rate(point),
            mbit_s: chart.bandwidth(point),
            encode_speed: own.encode_speed(),
            decode_speed: own.decode_speed(),
            figures: point.figures,
        })
    }
}

impl Row for Baseline {
    fn columns(_: &[Self]) -> Vec<Column<Self>> {
        let per_frame = |row: &Self| Value::Count(row.gaussians / row.frames.max(1) as u64);
        let encoding = |row: &Self| Value::Speed(row.encode_speed);
        let decoding = |row: &Self| Value::Speed(row.decode_speed);
        let mut columns = vec![
            Column::new("scene", "Scene", |row: &Self| Value::words(&row.scene)),
            Column::new("variant", "", |row: &Self| Value::words(&row.variant)).on(PROGRAMS),
            Column::new("quality", "", |row: &Self| Value::words(&row.quality)).on(PROGRAMS),
            Column::new("frames", "Frames", |row: &Self| Value::Count(row.frames as u64)),
            Column::new("gaussians", "", |row: &Self| Value::Count(row.gaussians)).on(PROGRAMS),
            Column::of_people("Gaussians per frame", per_frame),
            Column::new("bytes", "Size", |row: &Self| Value::Bytes(row.bytes)),
            Column::new("bpg", "Bits per Gaussian", |row: &Self| Value::number(row.bpg, 2)),
            Column::new("mbit_s", "Mbit/s", |row: &Self| Value::number(row.mbit_s, 2)).if_measured(),
        ];
        columns.extend(metrics(|row: &Self| &row.figures));
        columns.extend([
            Column::new("encode_gaussians_per_second", "Encoding", encoding),
            Column::new("decode_gaussians_per_second", "Decoding", decoding),
        ]);
        columns
    }

    fn part_of_page(&self) -> Option<&str> {
        Some(&self.scene)
    }
}

impl Summary {
    pub(super) fn new(charts: &[SceneChart]) -> Self {
        let scenes = charts.iter().filter_map(SceneSummary::new).collect();
        let tables = charts.iter().map(|chart| fronts(chart) + &sequence(chart)).collect();
        Self { scenes, tables }
    }

    /// For people.
    pub fn text(&self) -> String {
        let rows: Vec<Baseline> = self.scenes.iter().map(|scene| scene.baseline.clone()).collect();
        format!("{}\n{}", text(&rows), self.tables)
    }
}

impl SceneSummary {
    fn new(chart: &SceneChart) -> Option<Self> {
        Some(Self {
            baseline: Baseline::new(chart)?,
            variants: chart.standings().into_iter().skip(1).collect(),
            front: chart.fronts.concat(),
            peers: chart.peers.iter().map(|peer| peer.peer.clone()).collect(),
            peers_missing: chart.missing.iter().map(missing_text).collect(),
        })
    }
}

fn missing_text(missing: &MissingPeer) -> String {
    format!("{}: {}", missing.peer, missing.why)
}

/// Speed against size.
fn fronts(chart: &SceneChart) -> String {
    let table = |rows: &Vec<FrontRow>| {
        let of_what = match rows.iter().any(|row| row.is_predicted) {
            true => "the first GOP with predicted frames",
            false => "the first frame by itself",
        };
        format!(
            "{}: speed against size of {of_what}; seconds are of one processor\n{}\n",
            chart.name,
            text(rows)
        )
    };
    chart.fronts.iter().map(table).collect()
}

/// The tables of the first GOP; nothing if the scene has one frame.
fn sequence(chart: &SceneChart) -> String {
    let Some(gop) = &chart.gop else { return String::new() };
    let name = &chart.name;
    let ablation = match gop.ablation.as_slice() {
        [] => String::new(),
        rows => {
            format!("{name}: predictors of new Gaussians; bits are per new Gaussian\n{}\n", text(rows))
        }
    };
    format!(
        "{name}: operating points of the first GOP, {frames} at {fps} per second\n{modes}\n\
         {name}: refinement levels of its predicted frames; carried: what is missing comes from the intra frame; \
         subset: it stays away\n{levels}\n\
         {name}: predicted frames with and without tools\n{tools}\n{ablation}",
        frames = counted(gop.frames as u64, "frame"),
        fps = chart.fps,
        modes = text(&gop.modes),
        levels = text(&gop.levels),
        tools = text(&gop.tools),
    )
}
