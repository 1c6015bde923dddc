//! The operating points of a stream.

use super::Shown;
use crate::console::Console;
use crate::numbers::{bits_per_gaussian, grouped};
use crate::stream_file::StreamFile;
use crate::table::Table;
use serde::Serialize;
use splatstream_decoder::operating_point::{OperatingPointInfo, operating_points};
use splatstream_format::Limits;

/// One entry of what `--json` prints.
#[derive(Serialize)]
struct Point {
    op: String,
    bytes: u64,
    frames: u32,
    gaussians: u64,
    percent: u8,
    bpg: f64,
}

/// Lists the operating points, smallest first.
pub(super) fn show(stream: &StreamFile, limits: &Limits, console: &Console) -> Shown {
    let points = match operating_points(&stream.bytes, limits) {
        Ok(points) => points.iter().map(Point::from).collect(),
        Err(error) => return Ok(Some(error)),
    };
    console.report(&points, || text(&points))?;
    Ok(None)
}

impl From<&OperatingPointInfo> for Point {
    fn from(info: &OperatingPointInfo) -> Self {
        Self {
            op: info.point.to_string(),
            bytes: info.bytes,
            frames: info.frames,
            gaussians: info.gaussians,
            percent: info.percent,
            bpg: bits_per_gaussian(info.bytes, info.gaussians),
        }
    }
}

fn text(points: &Vec<Point>) -> String {
    let mut table = Table::new(["point", "bytes", "frames", "Gaussians", "% of a frame", "bits a Gaussian"]);
    for point in points {
        table.row([
            point.op.clone(),
            grouped(point.bytes),
            grouped(point.frames.into()),
            grouped(point.gaussians),
            point.percent.to_string(),
            format!("{:.2}", point.bpg),
        ]);
    }
    table.text()
}
