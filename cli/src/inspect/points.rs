//! The operating points of a stream.

use super::Shown;
use crate::console::Console;
use crate::numbers::{bits_per_gaussian, grouped, hex_digest};
use crate::stream_file::StreamFile;
use crate::table::Table;
use serde::Serialize;
use splatstream_decoder::operating_point::{OperatingPoint, OperatingPointInfo, operating_points};
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::decode_stream;
use splatstream_format::payload::OperatingPoints;
use splatstream_format::syntax::{OperatingPointEntry, UnitType};
use splatstream_format::unit::Stream;
use splatstream_format::{Error, Limits};
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
    refinements: u8,
    digest: Option<String>,
    carried_digest: Option<String>,
}

/// The list that the stream has, and where.
struct List {
    at: u64,
    entries: Vec<OperatingPointEntry>,
}

/// Lists the operating points, smallest first.
pub(super) fn show(stream: &StreamFile, limits: &Limits, console: &Console) -> Shown {
    let (infos, list) = match operating_points(&stream.bytes, limits)
        .and_then(|points| Ok((points, List::of(&stream.bytes, limits)?)))
    {
        Ok(found) => found,
        Err(error) => return Ok(Some(error)),
    };
    let mut points: Vec<Point> = infos.iter().map(|info| Point::new(info, list.as_ref())).collect();
    let mut error = None;
    if console.is_json() {
        for (point, info) in points.iter_mut().zip(&infos) {
            let fault = point.decode(&stream.bytes, info.point, limits);
            error = error.or(fault);
        }
    }
    console.report(&points, || text(&points) + &agreement(&points, list.as_ref()))?;
    Ok(error)
}

impl List {
    fn of(bytes: &[u8], limits: &Limits) -> Result<Option<Self>, Error> {
        for unit in Stream::open(bytes, limits)?.units() {
            let unit = unit?;
            if unit.header.unit_type() == UnitType::OperatingPoints {
                let entries = OperatingPoints::parse(unit.payload, unit.payload_at)?.entries;
                return Ok(Some(Self { at: unit.at, entries }));
            }
        }
        Ok(None)
    }

    /// Whether the list says of a point what the units imply; none if it does not name it.
    fn agrees(&self, info: &OperatingPointInfo) -> Option<bool> {
        let OperatingPoint { spatial, temporal, refinement } = info.point;
        let entry = self.entries.iter().find(|entry| entry.key() == (spatial, temporal, refinement))?;
        let listed = (entry.frame_count, entry.gaussian_count, entry.byte_count);
        Some(listed == (info.frames, info.gaussians, info.bytes))
    }
}

impl Point {
    fn new(info: &OperatingPointInfo, list: Option<&List>) -> Self {
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
            listed: list.and_then(|list| list.agrees(info)),
            digests: Vec::new(),
        }
    }

    /// Decodes at the point, for the digests; gives the first error.
    fn decode(&mut self, bytes: &[u8], operating_point: OperatingPoint, limits: &Limits) -> Option<Error> {
        let options = Options { limits: *limits, operating_point, tolerant: true, ..Options::default() };
        let mut lost = None;
        let summary = decode_stream(bytes, &options, |_, frame| {
            self.digests.push(FrameDigest {
                frame: frame.number,
                kind: frame.frame_type.name(),
                refinements: frame.refinements,
                digest: frame.digest.map(hex_digest),
                carried_digest: frame.carried_digest.map(hex_digest),
            });
            lost = lost.or(frame.lost);
            ControlFlow::Continue(())
        });
        lost.or(summary.end)
    }
}

fn text(points: &[Point]) -> String {
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

/// What the list in the stream says beside what the units say.
fn agreement(points: &[Point], list: Option<&List>) -> String {
    let Some(List { at, entries }) = list else { return String::new() };
    let of = |listed: Option<bool>| points.iter().filter(move |point| point.listed == listed);
    let wrong: Vec<&str> = of(Some(false)).map(|point| point.op.as_str()).collect();
    let agreeing = of(Some(true)).count();
    let unknown = entries.len().saturating_sub(agreeing + wrong.len());
    let mut text = format!("\nthe operating_points unit at {at:#x} lists {} points", entries.len());
    if wrong.is_empty() && unknown == 0 {
        return text + ": all agree with the units (clause 6.16)\n";
    }
    if !wrong.is_empty() {
        text += &format!("; other figures than the units (clause 6.16): {}", wrong.join(" "));
    }
    if unknown > 0 {
        text += &format!("; {unknown} are no operating points of this stream");
    }
    text + "\n"
}
