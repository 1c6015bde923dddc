//! What the demo tells.

use super::pictures::Drawn;
use crate::compare::errors::AttributeErrors;
use crate::numbers::{counted, frames as frames_in_words};
use serde::Serialize;
use splatstream_chart::numbers::{bits_per_gaussian, grouped};
use splatstream_chart::table::Table;
use splatstream_decoder::operating_point::OperatingPointInfo;
use std::path::PathBuf;

/// What `--json` prints, and report.json holds.
#[derive(Serialize)]
pub(super) struct Demonstration {
    pub(super) directory: PathBuf,
    /// The file that plays the stream in a browser.
    pub(super) page: &'static str,
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
    frames: u32,
    percent: u8,
    bpg: f64,
    seconds: f64,
    gaussians_per_second: f64,
    /// What it looks like.
    #[serde(flatten)]
    drawn: Option<Drawn>,
}

impl Point {
    /// An operating point that took so long to decode.
    pub(super) fn new(info: &OperatingPointInfo, seconds: f64, drawn: Option<Drawn>) -> Self {
        Self {
            op: info.point.to_string(),
            bytes: info.bytes,
            gaussians: info.gaussians,
            frames: info.frames,
            percent: info.percent,
            bpg: bits_per_gaussian(info.bytes, info.gaussians),
            seconds,
            gaussians_per_second: info.gaussians as f64 / seconds.max(f64::MIN_POSITIVE),
            drawn,
        }
    }
}

impl Demonstration {
    /// The report for people.
    pub(super) fn text(&self) -> String {
        let Scene { frames, gaussians, sh_degree, ply_bytes } = &self.scene;
        let Encoding { bytes, bpg, seconds, gaussians_per_second: rate, .. } = &self.encoding;
        let (place, page) = (self.directory.display(), self.page);
        let moment = self.operating_points.iter().find_map(|point| point.drawn.as_ref());
        let moment = moment.map_or(0, |drawn| drawn.frame);
        format!(
            "scene     {}, {} in all, SH degree {sh_degree}: {} bytes as PLY\n\
             encoded   {} bytes, {bpg:.2} bits per Gaussian, 1/{:.0} of the PLY; {seconds:.2} s, {} Gaussians per second\n\
             decoded   at every operating point; every frame has the digest that the encoder computed\n\
             drawn     frame {moment} of every point, and of the source: {place}/pictures/source.png\n\n\
             {}\nsS: spatial layers up to S, tT: temporal layers up to T, rR: refinements up to R; dB: PSNR of the picture \
             against the source\n\n\
             errors of frame 0 with everything decoded\n{}\n\
             files     {place}: demo.gss, {page}, source/, decoded/, pictures/, report.txt, report.json\n\
             try next  splatstream inspect --stats {place}/demo.gss\n\
             watch it  open {place}/{page} in a browser\n",
            frames_in_words(*frames),
            counted(*gaussians, "Gaussian"),
            grouped(*ply_bytes),
            grouped(*bytes),
            *ply_bytes as f64 / (*bytes).max(1) as f64,
            grouped(*rate as u64),
            self.points().text(),
            self.errors.text(),
        )
    }

    fn points(&self) -> Table {
        let mut table =
            Table::new(["point", "bytes", "frames", "% of a frame", "decoding ms", "dB", "picture"]);
        for point in &self.operating_points {
            let drawn = point.drawn.as_ref();
            let decibels = drawn.and_then(|drawn| drawn.psnr_db);
            table.row([
                point.op.clone(),
                grouped(point.bytes),
                point.frames.to_string(),
                point.percent.to_string(),
                format!("{:.1}", point.seconds * 1000.0),
                decibels.map_or("-".to_owned(), |decibels| format!("{decibels:.1}")),
                drawn.map_or("-".to_owned(), |drawn| drawn.picture.clone()),
            ]);
        }
        table
    }
}
