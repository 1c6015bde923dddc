//! What the demo tells.

use crate::compare::errors::AttributeErrors;
use serde::Serialize;
use splatstream_chart::numbers::{bits_per_gaussian, grouped};
use splatstream_chart::table::Table;
use splatstream_decoder::operating_point::OperatingPointInfo;
use std::path::PathBuf;

/// What `--json` prints, and report.json holds.
#[derive(Serialize)]
pub(super) struct Demonstration {
    pub(super) directory: PathBuf,
    pub(super) scene: Scene,
    pub(super) encoding: Encoding,
    pub(super) operating_points: Vec<Point>,
    /// Errors of frame 0 with everything decoded.
    pub(super) errors: AttributeErrors,
}

/// The scene that is encoded.
#[derive(Serialize)]
pub(super) struct Scene {
    pub(super) frames: u32,
    pub(super) gaussians: u64,
    pub(super) sh_degree: u8,
    pub(super) ply_bytes: u64,
}

/// The stream.
#[derive(Serialize)]
pub(super) struct Encoding {
    pub(super) bytes: u64,
    pub(super) gaussians: u64,
    pub(super) bpg: f64,
    pub(super) seconds: f64,
    pub(super) gaussians_per_second: f64,
}

/// One operating point, decoded.
#[derive(Serialize)]
pub(super) struct Point {
    op: String,
    bytes: u64,
    gaussians: u64,
    percent: u8,
    bpg: f64,
    seconds: f64,
    gaussians_per_second: f64,
}

impl Point {
    /// An operating point that took so long to decode.
    pub(super) fn new(info: &OperatingPointInfo, seconds: f64) -> Self {
        Self {
            op: info.point.to_string(),
            bytes: info.bytes,
            gaussians: info.gaussians,
            percent: info.percent,
            bpg: bits_per_gaussian(info.bytes, info.gaussians),
            seconds,
            gaussians_per_second: info.gaussians as f64 / seconds.max(f64::MIN_POSITIVE),
        }
    }
}

impl Demonstration {
    /// The report for people.
    pub(super) fn text(&self) -> String {
        let Scene { frames, gaussians, sh_degree, ply_bytes } = &self.scene;
        let Encoding { bytes, bpg, seconds, gaussians_per_second: rate, .. } = &self.encoding;
        let place = self.directory.display();
        format!(
            "scene     {frames} frames, {} Gaussians in all, SH degree {sh_degree}: {} bytes as PLY\n\
             encoded   {} bytes, {bpg:.2} bits per Gaussian, 1/{:.0} of the PLY; {seconds:.2} s, {} Gaussians per second\n\
             decoded   at every operating point; every frame has the digest that the encoder computed\n\n\
             {}\nerrors of frame 0 with everything decoded\n{}\n\
             files     {place}: demo.gss, source/, decoded-*/, report.txt, report.json\n\
             try next  splatstream inspect --stats {place}/demo.gss\n",
            grouped(*gaussians),
            grouped(*ply_bytes),
            grouped(*bytes),
            *ply_bytes as f64 / (*bytes).max(1) as f64,
            grouped(*rate as u64),
            self.points().text(),
            self.errors.text(),
        )
    }

    fn points(&self) -> Table {
        let mut table = Table::new([
            "point",
            "bytes",
            "Gaussians",
            "%",
            "bits per Gaussian",
            "decoding ms",
            "Gaussians per second",
        ]);
        for point in &self.operating_points {
            table.row([
                point.op.clone(),
                grouped(point.bytes),
                grouped(point.gaussians),
                point.percent.to_string(),
                format!("{:.2}", point.bpg),
                format!("{:.1}", point.seconds * 1000.0),
                grouped(point.gaussians_per_second as u64),
            ]);
        }
        table
    }
}
