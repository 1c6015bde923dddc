//! Streams of profile Dynamic: scenes and settings, their units, what is decoded at each operating point.

use super::{decoded, encoded, strict};
use splatstream_decoder::operating_point::{OperatingPoint, operating_points};
use splatstream_decoder::process::{DecodedFrame, Options};
use splatstream_decoder::stream::Summary;
use splatstream_encoder::{FrameReport, Preset, Report, Settings, Steps, Structure};
use splatstream_files::builtin::{BuiltinScene, Tracking};
use splatstream_format::Limits;
use splatstream_format::syntax::{GopHeader, Profile, SequenceParameters, UnitHeader, UnitType};
use splatstream_format::unit::{Stream, Unit};
use splatstream_gaussians::GaussianFrame;
use std::collections::BTreeMap;

/// Frames of the built-in scene; fewer than 100 Gaussians are the first of 100.
pub(crate) fn scene(gaussians: u32, frames: u32, sh_degree: u8, tracking: Tracking) -> Vec<GaussianFrame> {
    let scene = BuiltinScene { gaussians, frames, seed: 3, tracking, sh_degree };
    let cut = |frame: GaussianFrame| {
        let kept = (frame.len() as u32).min(gaussians.max(1));
        if gaussians < 100 { frame.select(&(0..kept).collect::<Vec<_>>()) } else { frame }
    };
    (0..frames).map(|t| cut(scene.frame(t))).collect()
}

/// Settings that take little time: no pictures are drawn to rank Gaussians.
pub(crate) fn quick() -> Settings {
    Settings {
        preset: Preset::Fast,
        steps: Steps {
            position_bits: 11.1,
            log_scale: 0.31,
            rotation: 0.055,
            opacity: 0.46,
            dc: 0.185,
            sh: 0.22,
        },
        refinements: vec![20, 50, 100],
        keep_invisible: true,
        block_log2: 6,
        ..Settings::default()
    }
}

/// The same with predicted frames.
pub(crate) fn predicted(layers: u8) -> Settings {
    Settings { structure: Structure::Predicted { layers }, ..quick() }
}

/// The stream of some frames, after a look at what every decoder must find in it.
pub(crate) fn coded(frames: &[GaussianFrame], settings: &Settings, what: &str) -> (Vec<u8>, Report) {
    let (bytes, report) = encoded(frames.to_vec(), settings);
    assert_eq!(report.bytes, bytes.len() as u64, "{what}");
    let stream = Stream::open(&bytes, &strict().limits).unwrap();
    assert_eq!(stream.header().profile(), Profile::Dynamic, "{what}");
    let (shown, summary) = decoded(&bytes, &strict());
    assert_eq!(summary.verdict(), None, "{what}");
    // Frames that are true to their pictures leave out what these do not show.
    let count = |(source, coded): (&GaussianFrame, &FrameReport)| {
        if coded.by_pictures { coded.gaussians as usize } else { source.len() }
    };
    let counts: Vec<usize> = frames.iter().zip(&report.coded).map(count).collect();
    assert_eq!(shown.iter().map(|frame| frame.planes.len()).collect::<Vec<_>>(), counts, "{what}");
    let digests: Vec<u64> = shown.iter().filter_map(|frame| frame.digest).collect();
    assert_eq!(digests, report.digests, "{what}");
    (bytes, report)
}

/// The units of a stream that must be whole.
pub(crate) fn units(bytes: &[u8]) -> Vec<Unit<'_>> {
    Stream::open(bytes, &Limits::default()).unwrap().units().map(Result::unwrap).collect()
}

/// The bytes of a unit, header and payload.
pub(crate) fn range(unit: &Unit<'_>) -> core::ops::Range<usize> {
    let at = unit.at as usize;
    at..at + UnitHeader::SIZE + unit.payload.len()
}

/// Bytes of the units that operating points choose from: those of GOPs and frames.
pub(crate) fn units_of_frames(bytes: &[u8]) -> u64 {
    let counted = |code: u8| (2..=6).contains(&code) || code == UnitType::Weights.code();
    let counted = units(bytes).into_iter().filter(|unit| counted(unit.header.unit_type));
    counted.map(|unit| range(&unit).len() as u64).sum()
}

/// A stream that is whole, and what is decoded of it at every operating point.
pub(crate) struct Whole<'a> {
    pub(crate) units: Vec<Unit<'a>>,
    pub(crate) sequence: SequenceParameters,
    /// GOP headers with their first frames.
    pub(crate) gops: Vec<(u32, GopHeader)>,
    pub(crate) points: BTreeMap<OperatingPoint, Vec<DecodedFrame>>,
}

impl<'a> Whole<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        let units = units(bytes);
        let of_type =
            |unit_type| units.iter().filter(move |unit: &&Unit<'_>| unit.header.unit_type() == unit_type);
        let sequence = of_type(UnitType::SequenceParameters).next().unwrap();
        let sequence = SequenceParameters::parse_payload(sequence.payload, 0, Profile::Dynamic).unwrap();
        let gop = |unit: &Unit<'_>| {
            (unit.header.frame, GopHeader::parse_payload(unit.payload, 0, Profile::Dynamic).unwrap())
        };
        let gops = of_type(UnitType::GopHeader).map(gop).collect();
        let infos = operating_points(bytes, &Limits::default()).unwrap();
        let at = |point| {
            let (frames, summary) = decoded_at(bytes, point);
            assert_eq!(summary.verdict(), None, "at {point}");
            frames
        };
        let points = infos.iter().map(|info| (info.point, at(info.point))).collect();
        Self { units, sequence, gops, points }
    }

    /// The frames at a point.
    pub(crate) fn at(&self, spatial: u8, temporal: u8, refinement: u8) -> &[DecodedFrame] {
        &self.points[&OperatingPoint { spatial, temporal, refinement }]
    }

    /// The frames with all that there is.
    pub(crate) fn all(&self) -> &[DecodedFrame] {
        self.points.values().last().unwrap()
    }
}

/// Strictly decoded at an operating point.
pub(crate) fn decoded_at(bytes: &[u8], operating_point: OperatingPoint) -> (Vec<DecodedFrame>, Summary) {
    decoded(bytes, &Options { operating_point, ..strict() })
}
