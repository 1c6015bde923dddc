//! Clause 7.11: operating points, and the stream that holds just one.

use core::fmt;
use core::str::FromStr;
use splatstream_format::payload::Index;
use splatstream_format::syntax::{
    EndOfStream, FileHeader, FrameHeader, IndexEntry, SequenceParameters, UnitHeader, UnitType,
};
use splatstream_format::unit::{Stream, Unit, write_unit};
use splatstream_format::{Limits, Result as FormatResult};

/// The layers a client takes: every unit up to these indices on each axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct OperatingPoint {
    /// Highest spatial layer.
    pub spatial: u8,
    /// Highest temporal layer.
    pub temporal: u8,
    /// Highest refinement.
    pub refinement: u8,
}

impl OperatingPoint {
    /// Everything in the stream.
    pub const ALL: Self = Self { spatial: u8::MAX, temporal: u8::MAX, refinement: u8::MAX };

    /// Whether a unit belongs to the operating point.
    pub fn takes(&self, header: &UnitHeader) -> bool {
        header.spatial_layer <= self.spatial
            && header.temporal_layer <= self.temporal
            && header.refinement <= self.refinement
    }
}

impl fmt::Display for OperatingPoint {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "s{},t{},r{}", self.spatial, self.temporal, self.refinement)
    }
}

/// An operating point that is not written `sS,tT,rR`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ParseOperatingPointError(String);

impl fmt::Display for ParseOperatingPointError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "'{}' is not an operating point; write it as s0,t0,r2", self.0)
    }
}

impl std::error::Error for ParseOperatingPointError {}

impl FromStr for OperatingPoint {
    type Err = ParseOperatingPointError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let axis = |part: Option<&str>, letter: char| part?.strip_prefix(letter)?.parse().ok();
        let mut parts = text.split(',');
        let (spatial, temporal, refinement) =
            (axis(parts.next(), 's'), axis(parts.next(), 't'), axis(parts.next(), 'r'));
        match (spatial, temporal, refinement, parts.next()) {
            (Some(spatial), Some(temporal), Some(refinement), None) => {
                Ok(Self { spatial, temporal, refinement })
            }
            _ => Err(ParseOperatingPointError(text.to_owned())),
        }
    }
}

/// What an operating point costs and shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OperatingPointInfo {
    /// The operating point.
    pub point: OperatingPoint,
    /// Bytes of the stream that holds just this operating point.
    pub bytes: u64,
    /// Gaussians over all frames.
    pub gaussians: u64,
    /// Frames.
    pub frames: u32,
    /// The share of every frame, percent.
    pub percent: u8,
}

/// The operating points of a stream, smallest first, from its headers alone.
///
/// # Errors
/// What delimiting the units or reading sequence parameters and frame headers finds.
pub fn operating_points(bytes: &[u8], limits: &Limits) -> FormatResult<Vec<OperatingPointInfo>> {
    let stream = Stream::open(bytes, limits)?;
    let mut sequence = None;
    // Gaussians and last refinement of each frame.
    let mut frames: Vec<(u32, Option<u8>)> = Vec::new();
    for unit in stream.units() {
        let unit = unit?;
        match unit.header.unit_type() {
            UnitType::SequenceParameters => {
                sequence = Some(SequenceParameters::parse_payload(unit.payload, unit.payload_at)?);
            }
            UnitType::FrameHeader => {
                let header = FrameHeader::parse_payload(unit.payload, unit.payload_at)?;
                frames.push((header.gaussian_count, None));
            }
            UnitType::Refinement => {
                if let Some((_, last)) = frames.last_mut() {
                    *last = Some(unit.header.refinement);
                }
            }
            _ => {}
        }
    }
    let Some(sequence) = sequence else { return Ok(Vec::new()) };
    let info = |refinement| {
        let point = OperatingPoint { spatial: 0, temporal: 0, refinement };
        let shown = |&(count, last): &(u32, Option<u8>)| {
            last.map_or(0, |last| u64::from(sequence.prefix_length(refinement.min(last), count)))
        };
        let place = usize::from(refinement);
        Ok(OperatingPointInfo {
            point,
            bytes: u64::try_from(extract(bytes, point, limits)?.len()).unwrap_or(u64::MAX),
            gaussians: frames.iter().map(shown).fold(0, u64::saturating_add),
            frames: u32::try_from(frames.len()).unwrap_or(u32::MAX),
            percent: sequence.refinement_percent.get(place).copied().unwrap_or(100),
        })
    };
    (0..sequence.refinement_count).map(info).collect()
}

/// The stream that holds just the units of an operating point; index and end are made anew.
///
/// # Errors
/// What delimiting the units finds; a damaged unit is an error.
pub fn extract(bytes: &[u8], point: OperatingPoint, limits: &Limits) -> FormatResult<Vec<u8>> {
    let stream = Stream::open(bytes, limits)?;
    let mut out = bytes.get(..FileHeader::SIZE).unwrap_or_default().to_vec();
    let mut units = 0_u32;
    let mut frames = 0_u32;
    let mut entries = Vec::new();
    let mut index_offset = 0;
    for unit in stream.units() {
        let unit = unit?;
        let here = u64::try_from(out.len()).unwrap_or(u64::MAX);
        match unit.header.unit_type() {
            _ if !point.takes(&unit.header) => continue,
            UnitType::Index => {
                index_offset = here;
                let index = Index { entries: core::mem::take(&mut entries) };
                write_unit(&mut out, unit.header.id(), &index.to_bytes()?)?;
            }
            UnitType::End => {
                let end = EndOfStream { frame_count: frames, unit_count: units, index_offset };
                write_unit(&mut out, unit.header.id(), &end.to_bytes()?)?;
            }
            kind => {
                if kind == UnitType::GopHeader {
                    entries.push(IndexEntry { frame: unit.header.frame, reserved_zero: 0, offset: here });
                }
                frames = frames.wrapping_add(u32::from(kind == UnitType::FrameHeader));
                copy(&mut out, &unit, bytes);
            }
        }
        units = units.wrapping_add(1);
    }
    Ok(out)
}

/// Appends the bytes of a unit as they are.
fn copy(out: &mut Vec<u8>, unit: &Unit<'_>, stream: &[u8]) {
    let start = usize::try_from(unit.at).unwrap_or(usize::MAX);
    let length = UnitHeader::SIZE.saturating_add(unit.payload.len());
    out.extend_from_slice(stream.get(start..start.saturating_add(length)).unwrap_or_default());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_operating_point_reads_as_it_is_written() {
        let point = OperatingPoint { spatial: 0, temporal: 1, refinement: 4 };
        assert_eq!(point.to_string().parse(), Ok(point));
        assert!(
            ["", "s0", "s0,t0", "s0,t0,r", "t0,s0,r0", "s0,t0,r0,x"]
                .iter()
                .all(|text| text.parse::<OperatingPoint>().is_err())
        );
    }
}
