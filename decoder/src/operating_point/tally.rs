//! What operating points cost and show, from the headers of units alone.

use super::OperatingPoint;
use splatstream_format::levels::Levels;
use splatstream_format::payload::OperatingPoints;
use splatstream_format::syntax::{
    GopHeader, IncrementHeader, OperatingPointEntry, OperatingPointsHeader, Profile, RefinementHeader,
    SequenceParameters, UnitHeader, UnitType,
};
use splatstream_format::unit::{Stream, Unit};
use splatstream_format::{Error, ErrorKind, Limits, Result};

/// What an operating point costs and shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OperatingPointInfo {
    /// The operating point.
    pub point: OperatingPoint,
    /// Bytes of the units of its frames and groups, headers included.
    pub bytes: u64,
    /// Decoded Gaussians over all frames; what is carried over is not counted.
    pub gaussians: u64,
    /// Frames that are output.
    pub frames: u32,
    /// Share of the Gaussians of a frame up to its refinement, percent.
    pub percent: u8,
}

/// Whether units belong to operating points, as far as that depends on the units before.
#[derive(Debug, Clone)]
pub(crate) struct Belonging {
    profile: Profile,
    /// The first sequence parameters.
    sequence: Option<SequenceParameters>,
    /// The first frame of the GOP, if it is a predicted one.
    anchor: Option<u32>,
}

impl Belonging {
    pub(crate) const fn new(profile: Profile) -> Self {
        Self { profile, sequence: None, anchor: None }
    }

    /// Takes note of sequence parameters and GOP headers.
    pub(crate) fn follow(&mut self, unit: &Unit<'_>) {
        match unit.header.unit_type() {
            UnitType::SequenceParameters => {
                let parsed = SequenceParameters::parse_payload(unit.payload, unit.payload_at, self.profile);
                self.sequence = self.sequence.or(parsed.ok());
            }
            UnitType::GopHeader => {
                let parsed = GopHeader::parse_payload(unit.payload, unit.payload_at, self.profile);
                let predicted = parsed.is_ok_and(|gop| gop.is_predicted());
                self.anchor = predicted.then_some(unit.header.frame);
            }
            _ => {}
        }
    }

    /// The number of spatial layers, for an increment of the intra frame of a predicted GOP.
    fn anchor_layers(&self, header: &UnitHeader) -> Option<u8> {
        let is_anchor = header.unit_type() == UnitType::Increment && self.anchor == Some(header.frame);
        is_anchor.then(|| self.sequence.map_or(1, |sequence| sequence.spatial_layer_count))
    }

    /// Whether a unit belongs to an operating point.
    pub(crate) fn takes(&self, point: OperatingPoint, header: &UnitHeader) -> bool {
        point.takes_of(header, self.anchor_layers(header))
    }
}

/// What a unit adds.
#[derive(Debug, Clone, Copy)]
struct Piece {
    header: UnitHeader,
    /// As [`OperatingPoint::takes_of`] asks for it.
    anchor: Option<u8>,
    bytes: u64,
    /// Gaussians of its home after the unit; of a refinement, those it adds.
    gaussians: u32,
}

/// The pieces of a stream, unit by unit.
#[derive(Debug, Clone)]
pub struct Tally {
    belonging: Belonging,
    levels: Levels,
    pieces: Vec<Piece>,
}

impl Tally {
    /// For a stream of a profile.
    pub fn new(profile: Profile) -> Self {
        Self { belonging: Belonging::new(profile), levels: Levels::default(), pieces: Vec::new() }
    }

    /// Whether a unit, which need not be counted, belongs to an operating point.
    pub(crate) fn takes(&self, point: OperatingPoint, header: &UnitHeader) -> bool {
        self.belonging.takes(point, header)
    }

    /// Takes note of a unit.
    pub fn unit(&mut self, unit: &Unit<'_>) {
        self.belonging.follow(unit);
        let Belonging { profile, sequence, .. } = self.belonging;
        let (payload, at) = (unit.payload, unit.payload_at);
        if !unit.header.unit_type().is_known_in(profile) {
            return;
        }
        self.levels.follow(unit, profile);
        // The payload of a unit that is passed over shows nothing, whatever it says.
        let is_decoded = self.levels.takes(&unit.header);
        let gaussians = match (unit.header.unit_type(), &sequence) {
            (UnitType::Refinement, Some(sequence)) => {
                RefinementHeader::parse(payload, at, sequence).map_or(0, |(header, _)| header.gaussian_count)
            }
            (UnitType::Increment, _) if !is_decoded => 0,
            (UnitType::Increment, Some(sequence)) => {
                IncrementHeader::parse(payload, at, sequence).map_or(0, |(header, _)| header.home_count())
            }
            (kind, _) if !matches!(kind.code(), 2..=5 | 9) => return,
            _ => 0,
        };
        let length = UnitHeader::SIZE.saturating_add(payload.len());
        let bytes = u64::try_from(length).unwrap_or(u64::MAX);
        self.pieces.push(Piece {
            header: unit.header,
            anchor: self.belonging.anchor_layers(&unit.header),
            bytes,
            gaussians,
        });
    }

    /// Every operating point of the sequence, lowest first.
    pub fn points(&self) -> Vec<OperatingPoint> {
        self.belonging.sequence.as_ref().map(all_points).unwrap_or_default()
    }

    /// What a point costs and shows.
    pub fn info(&self, point: OperatingPoint) -> OperatingPointInfo {
        let takes = |piece: &&Piece| point.takes_of(&piece.header, piece.anchor);
        let mut info = OperatingPointInfo {
            point,
            bytes: 0,
            gaussians: 0,
            frames: 0,
            percent: self.percent(point.refinement),
        };
        // Gaussians and units of each layer of the frame.
        let mut frame: [(u64, u32); 4] = [(0, 0); 4];
        for piece in self.pieces.iter().filter(takes) {
            info.bytes = info.bytes.saturating_add(piece.bytes);
            match piece.header.unit_type() {
                UnitType::FrameHeader => {
                    info.frames = info.frames.saturating_add(1);
                    info.gaussians = info.gaussians.saturating_add(shown(&core::mem::take(&mut frame)));
                }
                UnitType::Refinement | UnitType::Increment => {
                    if let Some((sum, units)) = frame.get_mut(usize::from(piece.header.spatial_layer)) {
                        *sum = sum.saturating_add(piece.gaussians.into());
                        *units = units.saturating_add(1);
                    }
                }
                _ => {}
            }
        }
        info.gaussians = info.gaussians.saturating_add(shown(&frame));
        info
    }

    fn percent(&self, refinement: u8) -> u8 {
        let percents = self.belonging.sequence.map_or([0; 10], |sequence| sequence.refinement_percent);
        percents.get(usize::from(refinement)).copied().unwrap_or(100)
    }

    /// The list of every operating point.
    pub fn list(&self) -> OperatingPoints {
        let entry = |point: OperatingPoint| {
            let info = self.info(point);
            OperatingPointEntry {
                spatial_layer: point.spatial,
                temporal_layer: point.temporal,
                refinement: point.refinement,
                reserved_zero: 0,
                frame_count: info.frames,
                gaussian_count: info.gaussians,
                byte_count: info.bytes,
            }
        };
        OperatingPoints { entries: self.points().into_iter().map(entry).collect() }
    }

    /// 6.16: a list says what the units so far imply; `at` is the offset of its payload.
    ///
    /// # Errors
    /// Invalid otherwise.
    pub(crate) fn check(&self, points: &OperatingPoints, at: u64) -> Result<()> {
        let mut at = at.saturating_add(size(OperatingPointsHeader::SIZE));
        for entry in &points.entries {
            let (spatial, temporal, refinement) = entry.key();
            let info = self.info(OperatingPoint { spatial, temporal, refinement });
            let values = [
                ("frame_count", u64::from(entry.frame_count), u64::from(info.frames)),
                ("gaussian_count", entry.gaussian_count, info.gaussians),
                ("byte_count", entry.byte_count, info.bytes),
            ];
            for (element, value, expected) in values {
                if value != expected {
                    let at = at.saturating_add(size(OperatingPointEntry::TABLE.offset(element)));
                    return Err(Error::new(at, "6.16", ErrorKind::Mismatch { element, value, expected }));
                }
            }
            at = at.saturating_add(size(OperatingPointEntry::SIZE));
        }
        Ok(())
    }
}

/// Every operating point of a sequence, lowest first.
pub fn all_points(sequence: &SequenceParameters) -> Vec<OperatingPoint> {
    let mut points = Vec::new();
    for spatial in 0..sequence.spatial_layer_count {
        // Below the highest spatial layer there are no predicted frames.
        let has_all = spatial.saturating_add(1) == sequence.spatial_layer_count;
        for temporal in 0..if has_all { sequence.temporal_layer_count } else { 1 } {
            for refinement in 0..sequence.refinement_count {
                points.push(OperatingPoint { spatial, temporal, refinement });
            }
        }
    }
    points
}

fn size(bytes: usize) -> u64 {
    u64::try_from(bytes).unwrap_or(u64::MAX)
}

/// The Gaussians of the highest layer with as many units as the lowest that has any: of what is shown.
fn shown(layers: &[(u64, u32); 4]) -> u64 {
    let complete = layers.iter().find(|(_, units)| *units > 0).map_or(0, |(_, units)| *units);
    layers.iter().rev().find(|(_, units)| *units == complete).map_or(0, |(sum, _)| *sum)
}

/// The operating points of a stream, lowest first, from its headers alone.
///
/// # Errors
/// What delimiting the units or reading sequence parameters finds.
pub fn operating_points(bytes: &[u8], limits: &Limits) -> Result<Vec<OperatingPointInfo>> {
    let stream = Stream::open(bytes, limits)?;
    let profile = stream.header().profile();
    let mut tally = Tally::new(profile);
    for unit in stream.units() {
        let unit = unit?;
        if unit.header.unit_type() == UnitType::SequenceParameters {
            SequenceParameters::parse_payload(unit.payload, unit.payload_at, profile)?;
        }
        tally.unit(&unit);
    }
    Ok(tally.points().into_iter().map(|point| tally.info(point)).collect())
}
