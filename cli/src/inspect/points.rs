//! The operating points of a stream.

use super::Shown;
use crate::console::Console;
use crate::numbers::{bits_per_gaussian, grouped, hex_digest};
use crate::stream_file::StreamFile;
use crate::table::Table;
use serde::Serialize;
use splatstream_decoder::operating_point::{OperatingPoint, OperatingPointInfo, Tally};
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::decode_stream;
use splatstream_format::payload::OperatingPoints;
use splatstream_format::syntax::{OperatingPointEntry, SequenceParameters, UnitType};
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
    let (tally, list) = match tally(&stream.bytes, limits) {
        Ok(found) => found,
        Err(error) => return Ok(Some(error)),
    };
    let infos: Vec<OperatingPointInfo> = tally.points().into_iter().map(|point| tally.info(point)).collect();
    let mut points: Vec<Point> = infos.iter().map(|info| Point::new(info, list.as_ref())).collect();
    let mut error = None;
    if console.is_json() {
        for (point, info) in points.iter_mut().zip(&infos) {
            let fault = point.decode(&stream.bytes, info.point, limits);
            error = error.or(fault);
        }
    }
    console
        .report(&points, || text(&points) + &list.map(|list| list.agreement(&tally)).unwrap_or_default())?;
    Ok(error)
}

/// What the units imply, and what the stream says of them.
fn tally(bytes: &[u8], limits: &Limits) -> Result<(Tally, Option<List>), Error> {
    let stream = Stream::open(bytes, limits)?;
    let profile = stream.header().profile();
    let (mut tally, mut list) = (Tally::new(profile), None);
    for unit in stream.units() {
        let unit = unit?;
        let (payload, at) = (unit.payload, unit.payload_at);
        match unit.header.unit_type() {
            // Without them there are no points.
            UnitType::SequenceParameters => {
                SequenceParameters::parse_payload(payload, at, profile)?;
            }
            UnitType::OperatingPoints => {
                list = Some(List { at: unit.at, entries: OperatingPoints::parse(payload, at)?.entries });
            }
            _ => {}
        }
        tally.unit(&unit);
    }
    Ok((tally, list))
}

impl List {
    /// Whether the list says of a point what the units imply; none if it does not name it.
    fn agrees(&self, info: &OperatingPointInfo) -> Option<bool> {
        let OperatingPoint { spatial, temporal, refinement } = info.point;
        let entry = self.entries.iter().find(|entry| entry.key() == (spatial, temporal, refinement))?;
        Some(says(entry) == (info.frames, info.gaussians, info.bytes))
    }

    /// What the list says beside what the units imply.
    fn agreement(&self, tally: &Tally) -> String {
        let is_wrong = |entry: &&OperatingPointEntry| {
            let info = tally.info(point_of(entry));
            says(entry) != (info.frames, info.gaussians, info.bytes)
        };
        let wrong = self.entries.iter().filter(is_wrong).map(|entry| point_of(entry).to_string());
        let wrong: Vec<String> = wrong.collect();
        let text =
            format!("\nthe operating_points unit at {:#x} lists {} points", self.at, self.entries.len());
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
