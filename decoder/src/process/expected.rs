//! What the state of a decoder expects of a unit, and where the elements stand that do not meet it.

use splatstream_format::syntax::{Table, UnitHeader};
use splatstream_format::unit::Unit;
use splatstream_format::{Error, ErrorKind, Result};

/// The error of a unit that may not stand where it does.
pub(super) fn unexpected(unit: &Unit<'_>) -> Error {
    let name = unit.header.unit_type().name();
    Error::new(unit.at, "7.1", ErrorKind::UnexpectedUnit { unit: name })
}

/// Refuses a value that is not the one the state has.
pub(super) fn same<T: Into<u64>>(
    at: u64,
    clause: &'static str,
    element: &'static str,
    value: T,
    expected: T,
) -> Result<()> {
    let (value, expected) = (value.into(), expected.into());
    if value == expected {
        return Ok(());
    }
    Err(Error::new(at, clause, ErrorKind::Mismatch { element, value, expected }))
}

/// Absolute offset of an element of a record that starts at `at`.
pub(super) fn element_at(table: &Table, at: u64, element: &str) -> u64 {
    after(at, table.offset(element))
}

/// Absolute offset of `frame` in the header of a unit.
pub(super) fn frame_at(unit: &Unit<'_>) -> u64 {
    element_at(&UnitHeader::TABLE, unit.at, "frame")
}

/// An offset so many bytes later.
pub(super) fn after(at: u64, bytes: usize) -> u64 {
    at.saturating_add(u64::try_from(bytes).unwrap_or(u64::MAX))
}
