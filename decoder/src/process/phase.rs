//! Clause 7.1.2: which units may come when.

use splatstream_format::syntax::UnitType;
use splatstream_format::unit::Unit;
use splatstream_format::{Error, ErrorKind, Result};

/// Where in the stream a decoder is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Phase {
    /// No sequence_parameters yet.
    Start,
    /// No GOP yet.
    Sequence,
    /// In a GOP, before its first frame.
    Gop,
    /// In a frame.
    Frame,
    /// In a GOP, after a frame that a codebook ended.
    Between,
    /// After operating_points.
    Listed,
    /// After the index.
    Indexed,
    /// After the end unit.
    Ended,
    /// After an error that cost the rest of its GOP: units are discarded until decoding can go on (clause 9).
    Lost,
}

use Phase::{Between, Frame, Gop, Indexed, Listed, Lost, Sequence, Start};

/// The phases in which each unit of known type may come.
const ALLOWED: [(UnitType, &[Phase]); 11] = [
    (UnitType::SequenceParameters, &[Start, Sequence, Gop, Frame, Between, Listed, Indexed, Lost]),
    (UnitType::SceneDescription, &[Sequence]),
    (UnitType::GopHeader, &[Sequence, Gop, Frame, Between, Lost]),
    (UnitType::Transform, &[Gop]),
    (UnitType::Weights, &[Gop]),
    (UnitType::Codebook, &[Gop, Frame, Between]),
    (UnitType::FrameHeader, &[Gop, Frame, Between]),
    (UnitType::Increment, &[Frame]),
    (UnitType::OperatingPoints, &[Sequence, Gop, Frame, Between, Lost]),
    (UnitType::Index, &[Sequence, Gop, Frame, Between, Listed, Lost]),
    (UnitType::End, &[Sequence, Gop, Frame, Between, Listed, Indexed, Lost]),
];

impl Phase {
    /// Whether units of a type may come in this phase.
    pub(super) fn allows(self, unit_type: UnitType) -> bool {
        ALLOWED.iter().any(|(known, phases)| *known == unit_type && phases.contains(&self))
    }

    /// Whether units of a GOP may come.
    pub(super) const fn is_in_gop(self) -> bool {
        matches!(self, Gop | Frame | Between)
    }

    /// The phase after a unit that may come in this one.
    pub(super) const fn after(self, unit_type: UnitType) -> Self {
        match (unit_type, self) {
            (UnitType::SequenceParameters, Start) => Sequence,
            (UnitType::GopHeader, _) => Gop,
            (UnitType::FrameHeader, _) => Frame,
            (UnitType::Codebook, Frame) => Between,
            (UnitType::OperatingPoints, _) => Listed,
            (UnitType::Index, _) => Indexed,
            (UnitType::End, _) => Self::Ended,
            _ => self,
        }
    }
}

/// Whether a unit of a type ends the frame in progress.
pub(super) const fn ends_frame(unit_type: UnitType) -> bool {
    ends_gop(unit_type) || matches!(unit_type, UnitType::FrameHeader | UnitType::Codebook)
}

/// Whether a unit of a type ends the GOP in progress.
pub(super) const fn ends_gop(unit_type: UnitType) -> bool {
    matches!(unit_type, UnitType::GopHeader | UnitType::OperatingPoints | UnitType::Index | UnitType::End)
}

/// Whether units of a type that do not belong to the operating point are discarded.
pub(super) const fn is_layered(unit_type: UnitType) -> bool {
    matches!(unit_type, UnitType::FrameHeader | UnitType::Codebook | UnitType::Increment)
}

/// The error of a unit that may not stand where it does.
pub(super) fn unexpected(unit: &Unit<'_>) -> Error {
    Error::new(unit.at, "7.1.2", ErrorKind::UnexpectedUnit { unit: unit.header.unit_type().name() })
}

/// Refuses a value that differs from the one that follows from the state.
pub(super) fn same<T: Into<u64>>(
    at: u64,
    clause: &'static str,
    element: &'static str,
    value: T,
    expected: T,
) -> Result<()> {
    let (value, expected) = (value.into(), expected.into());
    if value == expected { Ok(()) } else { Err(mismatch(at, clause, element, value, expected)) }
}

/// The error of such a value.
pub(super) const fn mismatch(
    at: u64,
    clause: &'static str,
    element: &'static str,
    value: u64,
    expected: u64,
) -> Error {
    Error::new(at, clause, ErrorKind::Mismatch { element, value, expected })
}
