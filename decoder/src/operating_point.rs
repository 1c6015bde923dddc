//! Clause 7.2: operating points, and the stream that holds just one.

mod tally;

pub use tally::{OperatingPointInfo, Tally, all_points, operating_points};

use core::fmt;
use core::str::FromStr;
use splatstream_format::follower::Follower;
use splatstream_format::payload::{Index, OperatingPoints};
use splatstream_format::syntax::{
    EndOfStream, IndexEntry, OperatingPointEntry, SequenceParameters, UnitHeader, UnitType,
};
use splatstream_format::unit::Stream;
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

    /// Everything that a sequence has.
    pub const fn highest(sequence: &SequenceParameters) -> Self {
        Self {
            spatial: sequence.spatial_layer_count.saturating_sub(1),
            temporal: sequence.temporal_layer_count.saturating_sub(1),
            refinement: sequence.refinement_count.saturating_sub(1),
        }
    }

    /// Whether there is this point in a sequence whose highest one is given. 255 on an axis is all that there is.
    ///
    /// ```
    /// use splatstream_decoder::operating_point::OperatingPoint;
    ///
    /// let highest = OperatingPoint { spatial: 1, temporal: 0, refinement: 4 };
    /// let lower = OperatingPoint { refinement: 2, ..highest };
    /// assert!(lower.is_within(highest) && OperatingPoint::ALL.is_within(highest));
    /// assert!(!highest.is_within(lower));
    /// ```
    pub const fn is_within(self, highest: Self) -> bool {
        const fn has(value: u8, highest: u8) -> bool {
            value == u8::MAX || value <= highest
        }
        has(self.spatial, highest.spatial)
            && has(self.temporal, highest.temporal)
            && has(self.refinement, highest.refinement)
    }

    /// The lower of two on each axis.
    #[must_use]
    pub fn at_most(self, other: Self) -> Self {
        Self {
            spatial: self.spatial.min(other.spatial),
            temporal: self.temporal.min(other.temporal),
            refinement: self.refinement.min(other.refinement),
        }
    }

    /// Clause 7.2: whether a unit belongs to the operating point. `whole_anchor` is the number of spatial
    /// layers if the unit is an increment of a whole anchor: a receiver of all layers takes all of it.
    pub fn takes(&self, header: &UnitHeader, whole_anchor: Option<u8>) -> bool {
        let takes_all = whole_anchor.is_some_and(|layers| self.spatial.saturating_add(1) >= layers);
        header.spatial_layer <= self.spatial
            && header.temporal_layer <= self.temporal
            && (takes_all || header.refinement <= self.refinement)
    }

    /// Whether an entry of the list is of a point that this one holds.
    const fn holds(&self, entry: &OperatingPointEntry) -> bool {
        entry.spatial_layer <= self.spatial
            && entry.temporal_layer <= self.temporal
            && entry.refinement <= self.refinement
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

/// The stream that holds just the units of an operating point; index, operating points and end are written again.
///
/// # Errors
/// What delimiting the units finds, and damage in units that belong to the point. Increments are copied as they are:
/// decoders discard some of them, whose payload may be anything.
pub fn extract(bytes: &[u8], point: OperatingPoint, limits: &Limits) -> FormatResult<Vec<u8>> {
    let stream = Stream::open(bytes, limits)?;
    let mut out = stream.header().to_bytes()?;
    let (profile, mut reader) = (stream.header().profile(), stream.units());
    let mut follower = Follower::new(profile);
    let mut units = 0_u32;
    let mut frames = 0_u32;
    let mut entries = Vec::new();
    let mut index_offset = 0;
    while let Some(unit) = reader.next_unit() {
        let unit = unit?;
        if !point.takes(&unit.header, follower.whole_anchor_layers(&unit.header)) {
            continue;
        }
        unit.check_header(profile)?;
        if unit.header.unit_type() != UnitType::Increment {
            unit.check_payload()?;
        }
        follower.follow(&unit);
        let here = u64::try_from(out.len()).unwrap_or(u64::MAX);
        match unit.header.unit_type() {
            UnitType::Index => {
                index_offset = here;
                let index = Index { entries: core::mem::take(&mut entries) };
                rewrite(&mut out, &unit.header, &index.to_bytes()?)?;
            }
            UnitType::OperatingPoints => {
                let mut points = OperatingPoints::parse(unit.payload, unit.payload_at)?;
                points.entries.retain(|entry| point.holds(entry));
                rewrite(&mut out, &unit.header, &points.to_bytes()?)?;
            }
            UnitType::End => {
                let end = EndOfStream { frame_count: frames, unit_count: units, index_offset };
                rewrite(&mut out, &unit.header, &end.to_bytes()?)?;
            }
            kind => {
                if kind == UnitType::GopHeader {
                    entries.push(IndexEntry { frame: unit.header.frame, reserved_zero: 0, offset: here });
                }
                frames = frames.saturating_add(u32::from(kind == UnitType::FrameHeader));
                out.extend(unit.header.to_bytes()?);
                out.extend_from_slice(unit.payload);
            }
        }
        units = units.saturating_add(1);
    }
    Ok(out)
}

/// Appends a unit with a new payload. All elements of its header that do not follow from that are as they were.
fn rewrite(out: &mut Vec<u8>, header: &UnitHeader, payload: &[u8]) -> FormatResult<()> {
    out.extend(header.with_payload(payload)?.to_bytes()?);
    out.extend_from_slice(payload);
    Ok(())
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
