//! The operating points of a stream.

use super::Shown;
use super::hull::{Quality, qualities};
use crate::console::Console;
use crate::numbers::{counted, hex_digest};
use crate::stream_file::StreamFile;
use serde::Serialize;
use splatstream_chart::numbers::{bits_per_gaussian, grouped};
use splatstream_chart::table::Table;
use splatstream_decoder::operating_point::{OperatingPoint, OperatingPointInfo, operating_points};
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::decode_stream;
use splatstream_format::payload::OperatingPoints;
use splatstream_format::syntax::{OperatingPointEntry, UnitType};
use splatstream_format::unit::Stream;
use splatstream_format::{Error, Limits, Result};
use std::ops::ControlFlow;

/// One entry of what `--json` prints.
#[derive(Serialize)]
struct Point {
    op: String,
    spatial_layer: u8,
    temporal_layer: u8,
    refinement: u8,
    bytes: u64,
    frames: u32,
    gaussians: u64,
    percent: u8,
    bpg: f64,
    /// PSNR of two frames in three views of 270 lines, against the highest point; null of that.
    psnr_db: Option<f64>,
    /// Whether no point with as many frames has better pictures for as many bytes.
    on_hull: bool,
    /// Whether the list in the stream says the same; none if it does not have the point.
    listed: Option<bool>,
    /// Of each frame; only where JSON is asked for, since every frame is decoded.
    digests: Vec<FrameDigest>,
}

/// The digests of a frame at an operating point.
#[derive(Serialize)]
struct FrameDigest {
    frame: u32,
    #[serde(rename = "type")]
    kind: &'static str,
    /// Exact lists that are shown.
    level: u8,
    digest: Option<String>,
    carried_digest: Option<String>,
}

/// The list that the stream has, and where.
struct List {
    at: u64,
    entries: Vec<OperatingPointEntry>,
}

/// Lists the operating points, smallest first.
pub(super) fn show(stream: &StreamFile, options: &Options, console: &Console) -> Shown {
    let limits = &options.limits;
    let found =
        operating_points(&stream.bytes, limits).and_then(|infos| Ok((infos, list(&stream.bytes, limits)?)));
    let (infos, list) = match found {
        Ok(found) => found,
        Err(error) => return Ok(Some(error)),
    };
    let own = distinct(&infos);
    let qualities = qualities(stream, &own, options)?;
    let point = |(info, quality)| Point::new(info, list.as_ref(), quality);
    let mut points: Vec<Point> = own.iter().zip(qualities).map(point).collect();
    let mut error = first_error(&stream.bytes, options);
    if console.is_json() {
        for (point, info) in points.iter_mut().zip(&own) {
            error = error.or(point.decode(&stream.bytes, info.point, options));
        }
    }
    console
        .report(&points, || text(&points) + &list.map(|list| list.agreement(&infos)).unwrap_or_default())?;
    Ok(error)
}

/// The points without those that have no unit more than a lower one, as in what `extract` has written.
fn distinct(infos: &[OperatingPointInfo]) -> Vec<OperatingPointInfo> {
    let has = |info: &OperatingPointInfo| (info.bytes, info.frames, info.gaussians);
    let mut own: Vec<OperatingPointInfo> = Vec::new();
    for info in infos {
        if own.iter().all(|lower| has(lower) != has(info)) {
            own.push(*info);
        }
    }
    own
}

/// The first error of the stream, found by decoding all of it.
fn first_error(bytes: &[u8], options: &Options) -> Option<Error> {
    let options = Options { operating_point: OperatingPoint::ALL, ..*options };
    decode_stream(bytes, &options, |_, _| ControlFlow::Continue(())).verdict()
}

/// What the stream says of its points, if it does.
fn list(bytes: &[u8], limits: &Limits) -> Result<Option<List>> {
    let mut units = Stream::open(bytes, limits)?.units();
    while let Some(unit) = units.next_unit() {
        let unit = unit?;
        if unit.header.unit_type() == UnitType::OperatingPoints {
            unit.check_payload()?;
            let entries = OperatingPoints::parse(unit.payload, unit.payload_at)?.entries;
            return Ok(Some(List { at: unit.at, entries }));
        }
    }
    Ok(None)
}

impl List {
    /// Whether the list says of a point what the units imply; none if it does not name it.
    fn agrees(&self, info: &OperatingPointInfo) -> Option<bool> {
        let entry = self.entries.iter().find(|entry| point_of(entry) == info.point)?;
        Some(says(entry) == (info.frames, info.gaussians, info.bytes))
    }

    /// What the list says beside what the units imply.
    fn agreement(&self, infos: &[OperatingPointInfo]) -> String {
        let wrong = infos.iter().filter(|info| self.agrees(info) == Some(false));
        let wrong: Vec<String> = wrong.map(|info| info.point.to_string()).collect();
        let points = counted(self.entries.len() as u64, "point");
        let text = format!("\nthe operating_points unit at {:#x} lists {points}", self.at);
        match wrong.as_slice() {
            [] => text + ": all agree with the units (clause 6.16)\n",
            wrong => format!("{text}; other figures than the units (clause 6.16): {}\n", wrong.join(" ")),
        }
    }
}

/// Frames, Gaussians and bytes of an entry.
fn says(entry: &OperatingPointEntry) -> (u32, u64, u64) {
    (entry.frame_count, entry.gaussian_count, entry.byte_count)
}

fn point_of(entry: &OperatingPointEntry) -> OperatingPoint {
    let (spatial, temporal, refinement) = entry.key();
    OperatingPoint { spatial, temporal, refinement }
}

impl Point {
    fn new(info: &OperatingPointInfo, list: Option<&List>, quality: Quality) -> Self {
        Self {
            op: info.point.to_string(),
            spatial_layer: info.point.spatial,
            temporal_layer: info.point.temporal,
            refinement: info.point.refinement,
            bytes: info.bytes,
            frames: info.frames,
            gaussians: info.gaussians,
            percent: info.percent,
            bpg: bits_per_gaussian(info.bytes, info.gaussians),
            psnr_db: quality.psnr_db,
            on_hull: quality.on_hull,
            listed: list.and_then(|list| list.agrees(info)),
            digests: Vec::new(),
        }
    }

    /// Decodes at the point, for the digests; gives the first error.
    fn decode(&mut self, bytes: &[u8], operating_point: OperatingPoint, options: &Options) -> Option<Error> {
        let options = Options { operating_point, ..*options };
        let summary = decode_stream(bytes, &options, |_, frame| {
            self.digests.push(FrameDigest {
                frame: frame.index,
                kind: frame.frame_type.name(),
                level: frame.level,
                digest: frame.digest.map(hex_digest),
                carried_digest: frame.carried_digest.map(hex_digest),
            });
            ControlFlow::Continue(())
        });
        summary.verdict()
    }
}

fn text(points: &[Point]) -> String {
    let mut table = Table::new([
        "point",
        "bytes",
        "frames",
        "Gaussians",
        "% of a frame",
        "bits per Gaussian",
        "dB",
        "hull",
    ]);
    for point in points {
        table.row([
            point.op.clone(),
            grouped(point.bytes),
            grouped(point.frames.into()),
            grouped(point.gaussians),
            point.percent.to_string(),
            format!("{:.2}", point.bpg),
            point.psnr_db.map_or_else(|| "-".to_owned(), |decibels| format!("{decibels:.1}")),
            if point.on_hull { "*" } else { "" }.to_owned(),
        ]);
    }
    table.text()
        + "\ndB: PSNR against the highest point, mean of the first frame and the last of its GOP that all points have, three views of 270 \
           lines\n\
           *: no point with as many frames looks better for as many bytes\n"
}
