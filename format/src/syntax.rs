//! Clause 5: the fixed records, each written once.
//!
//! A record is declared with `table!`, which yields the struct, both directions and the rows that the
//! inspector prints and that a test compares with the tables of `spec/05-syntax.md`. A record that is refused
//! when read is refused when written: both sides call the record's `validate`, clause 6.

use crate::{Error, ErrorKind, Result};

mod codebook;
mod end;
mod file_header;
mod frame_header;
mod gop_header;
mod increment;
mod index;
mod operating_points;
pub(crate) mod reader;
mod record;
mod scene_description;
mod sequence_parameters;
mod sh_header;
mod transform;
mod unit_header;
mod weights;

pub use codebook::CodebookHeader;
pub use end::EndOfStream;
pub use file_header::{FileHeader, Profile, SIGNATURE, SPECIFICATION};
pub use frame_header::{FrameHeader, FrameRole, FrameType, NO_TRANSFORM};
pub use gop_header::GopHeader;
pub use increment::{IncrementHeader, ListSizes, MAX_ATTRIBUTE_STEP, MAX_NEIGHBOURS, NO_PREDICTOR};
pub use index::{IndexEntry, IndexHeader};
pub use operating_points::{OperatingPointEntry, OperatingPointsHeader};
pub use record::FixedRecord;
pub(crate) use scene_description::in_range;
pub use scene_description::{Camera, SceneDescriptionHeader};
pub use sequence_parameters::{
    MAX_LAYERS, MAX_LINEAR_LOG2, MAX_REFINEMENTS, SequenceParameters, prefix_length,
};
pub use sh_header::{NO_CODEBOOK, ShHeader, ShMode};
pub use transform::{TransformHeader, TransformKind};
pub use unit_header::{ErrorScope, UnitHeader, UnitId, UnitType};
pub use weights::{NetworkHeader, WeightsHeader};

/// Largest identifier of a transform or a codebook.
pub const MAX_ID: u8 = 15;

/// One row of a syntax table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Row {
    /// The syntax element, as the specification spells it.
    pub name: &'static str,
    /// Its type as the specification spells it: `u8`, `u32`, `f32[3]`.
    pub type_name: &'static str,
    /// Bytes of the element, an array as a whole.
    pub bytes: usize,
    /// Numbers of an array; 1 for a single number.
    pub count: usize,
    /// What it is, in a line.
    pub meaning: &'static str,
    /// The clause of its syntax table.
    pub clause: &'static str,
}

/// A syntax table: the fixed rows of one record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Table {
    /// The record, as the specification spells it.
    pub name: &'static str,
    /// Clause of the syntax; cited when the bytes do not parse.
    pub syntax: &'static str,
    /// Clause of the semantics; cited when a constraint is broken.
    pub semantics: &'static str,
    /// The elements in order.
    pub rows: &'static [Row],
}

/// Every fixed record, in the order of clause 5.
pub const TABLES: [Table; 17] = [
    FileHeader::TABLE,
    UnitHeader::TABLE,
    SequenceParameters::TABLE,
    GopHeader::TABLE,
    FrameHeader::TABLE,
    TransformHeader::TABLE,
    CodebookHeader::TABLE,
    SceneDescriptionHeader::TABLE,
    Camera::TABLE,
    IndexHeader::TABLE,
    IndexEntry::TABLE,
    EndOfStream::TABLE,
    IncrementHeader::TABLE,
    OperatingPointsHeader::TABLE,
    OperatingPointEntry::TABLE,
    WeightsHeader::TABLE,
    NetworkHeader::TABLE,
];

/// Declares a record as its specification table: clauses, names, types, meaning.
///
/// `f32` elements are held as their bit pattern (`u32`): this crate does no floating-point arithmetic, and
/// the pattern is what is written back.
macro_rules! table {
    (
        $(#[doc = $doc:literal])+
        $syntax:literal $semantics:literal $name:ident $Record:ident {
            $( #[doc = $meaning:literal] $field:ident : $ty:ident $([$count:literal])?, )+
        }
    ) => {
        $(#[doc = $doc])+
        #[allow(unreachable_pub, reason = "records that are part of another type are private to its module")]
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub struct $Record {
            $( #[doc = $meaning] pub $field: $crate::syntax::table!(@type $ty $($count)?), )+
        }

        impl $crate::syntax::FixedRecord for $Record {
            fn take(bytes: &mut &[u8]) -> Option<Self> {
                Some(Self { $( $field: $crate::syntax::record::Element::take(bytes)?, )+ })
            }

            fn put(&self, out: &mut Vec<u8>) {
                $( $crate::syntax::record::Element::put(&self.$field, out); )+
            }
        }

        #[allow(unreachable_pub, reason = "records that are part of another type are private to its module")]
        impl $Record {
            /// The rows of the syntax table.
            pub const ROWS: &'static [$crate::syntax::Row] = &[ $( $crate::syntax::Row {
                name: stringify!($field),
                type_name: concat!(stringify!($ty) $(, "[", $count, "]")?),
                bytes: size_of::<$crate::syntax::table!(@type $ty $($count)?)>(),
                count: $crate::syntax::table!(@count $($count)?),
                meaning: $meaning.trim_ascii(),
                clause: $syntax,
            }, )+ ];

            /// Bytes of the record.
            pub const SIZE: usize = 0 $( + size_of::<$crate::syntax::table!(@type $ty $($count)?)>() )+;

            /// The syntax table.
            pub const TABLE: $crate::syntax::Table = $crate::syntax::Table {
                name: stringify!($name),
                syntax: $syntax,
                semantics: $semantics,
                rows: Self::ROWS,
            };
        }
    };
    (@type f32) => { u32 };
    (@type f32 $count:literal) => { [u32; $count] };
    (@type $ty:ident) => { $ty };
    (@type $ty:ident $count:literal) => { [$ty; $count] };
    (@count) => { 1 };
    (@count $count:literal) => { $count };
}
pub(crate) use table;

/// Declares `parse` and `to_bytes` of a record whose `validate` needs nothing but the record.
macro_rules! record_io {
    ($Record:ident) => {
        impl $Record {
            /// Reads and checks the record at the start of `bytes`, which stand at offset `at` of the
            /// stream; gives the bytes after it.
            ///
            /// # Errors
            /// Malformed: bytes are missing. Those of [`Self::validate`].
            pub fn parse(bytes: &[u8], at: u64) -> $crate::Result<(Self, &[u8])> {
                let (record, rest): (Self, _) = $crate::syntax::decode(&Self::TABLE, bytes, at)?;
                record.validate(at)?;
                Ok((record, rest))
            }

            /// Reads and checks a payload that is this record and nothing more.
            ///
            /// # Errors
            /// Those of [`Self::parse`]; malformed if bytes are left over.
            pub fn parse_payload(payload: &[u8], at: u64) -> $crate::Result<Self> {
                let (record, rest) = Self::parse(payload, at)?;
                Self::TABLE.ends(rest, at)?;
                Ok(record)
            }

            /// The bytes of the record; refused where [`Self::parse`] would refuse them. Offsets of errors
            /// count from the start of the record.
            ///
            /// # Errors
            /// Those of [`Self::validate`].
            pub fn to_bytes(&self) -> $crate::Result<Vec<u8>> {
                self.validate(0)?;
                Ok($crate::syntax::encode(self))
            }
        }
    };
}
pub(crate) use record_io;

/// The same for a record whose ranges depend on the profile.
macro_rules! record_io_in_profile {
    ($Record:ident) => {
        impl $Record {
            /// Reads and checks the record at the start of `bytes`, which stand at offset `at` of a stream of a
            /// profile; gives the bytes after it.
            ///
            /// # Errors
            /// Malformed: bytes are missing. Those of [`Self::validate`].
            pub fn parse(
                bytes: &[u8],
                at: u64,
                profile: $crate::syntax::Profile,
            ) -> $crate::Result<(Self, &[u8])> {
                let (record, rest): (Self, _) = $crate::syntax::decode(&Self::TABLE, bytes, at)?;
                record.validate(at, profile)?;
                Ok((record, rest))
            }

            /// Reads and checks a payload that is this record and nothing more.
            ///
            /// # Errors
            /// Those of [`Self::parse`]; malformed if bytes are left over.
            pub fn parse_payload(
                payload: &[u8],
                at: u64,
                profile: $crate::syntax::Profile,
            ) -> $crate::Result<Self> {
                let (record, rest) = Self::parse(payload, at, profile)?;
                Self::TABLE.ends(rest, at)?;
                Ok(record)
            }

            /// The bytes of the record; refused where [`Self::parse_payload`] would refuse them in every profile.
            /// Offsets of errors count from the start of the record.
            ///
            /// # Errors
            /// Those of [`Self::validate`] in the profile Dynamic.
            pub fn to_bytes(&self) -> $crate::Result<Vec<u8>> {
                self.validate(0, $crate::syntax::Profile::Dynamic)?;
                Ok($crate::syntax::encode(self))
            }
        }
    };
}
pub(crate) use record_io_in_profile;

/// A record whose values are not checked, and the bytes after it.
pub(crate) fn decode<'a, T: FixedRecord>(table: &Table, bytes: &'a [u8], at: u64) -> Result<(T, &'a [u8])> {
    let mut rest = bytes;
    let record = T::take(&mut rest).ok_or_else(|| table.cut(bytes.len(), at))?;
    Ok((record, rest))
}

/// A record that does not end within the stream: the stream is cut, not malformed.
fn cut_is_truncated(error: Error) -> Error {
    match error.kind {
        ErrorKind::ShortSection { element } => Error { kind: ErrorKind::Truncated { element }, ..error },
        _ => error,
    }
}

/// The bytes of a record whose values are not checked.
pub(crate) fn encode<T: FixedRecord>(record: &T) -> Vec<u8> {
    let mut out = Vec::new();
    record.put(&mut out);
    out
}

/// The offset `bytes` after `at`. Saturates: no stream is near 2^64 bytes.
pub(crate) fn after(at: u64, bytes: usize) -> u64 {
    at.saturating_add(u64::try_from(bytes).unwrap_or(u64::MAX))
}

impl Table {
    /// Bytes of the record.
    pub fn size(&self) -> usize {
        self.rows.iter().map(|row| row.bytes).sum()
    }

    /// Bytes before an element of the record.
    pub fn offset(&self, element: &str) -> usize {
        self.rows.iter().take_while(|row| row.name != element).map(|row| row.bytes).sum()
    }

    /// 6.1: nothing is left of a payload at offset `at` that is this record alone; `rest` is what comes after it.
    ///
    /// # Errors
    /// Malformed: `rest` is not empty.
    pub fn ends(&self, rest: &[u8], at: u64) -> Result<()> {
        if rest.is_empty() {
            return Ok(());
        }
        let kind = ErrorKind::TrailingBytes { element: self.name, bytes: after(0, rest.len()) };
        Err(Error::new(after(at, self.size()), self.syntax, kind))
    }

    /// The checks of one record at an offset in the stream.
    pub(crate) const fn check(&'static self, at: u64) -> Check {
        Check { table: self, at }
    }

    /// The error of a record of which only `present` bytes are there.
    fn cut(&self, present: usize, at: u64) -> Error {
        let mut start: usize = 0;
        for row in self.rows {
            let end = start.saturating_add(row.bytes);
            if end > present {
                return Error::new(
                    after(at, start),
                    self.syntax,
                    ErrorKind::ShortSection { element: row.name },
                );
            }
            start = end;
        }
        Error::new(at, self.syntax, ErrorKind::ShortSection { element: self.name })
    }
}

/// An element in the stream, to be checked by clause 6.
#[derive(Clone, Copy)]
pub(crate) struct Spot {
    /// Absolute offset.
    pub(crate) at: u64,
    /// The clause of its semantics.
    pub(crate) clause: &'static str,
    /// The element, as the specification spells it.
    pub(crate) element: &'static str,
}

impl Spot {
    /// `value` shall be within `min..=max`.
    pub(crate) fn range(self, value: impl Into<i64>, min: impl Into<i64>, max: impl Into<i64>) -> Result<()> {
        let (value, min, max) = (value.into(), min.into(), max.into());
        let kind = ErrorKind::OutOfRange { element: self.element, value, min, max };
        self.holds((min..=max).contains(&value), kind)
    }

    /// `value` shall be zero in this version.
    pub(crate) fn reserved_bits(self, value: impl Into<u64>) -> Result<()> {
        let value = value.into();
        self.holds(value == 0, ErrorKind::ReservedBits { element: self.element, value })
    }

    /// `value` shall be what the elements before it imply.
    pub(crate) fn equal(self, value: u64, expected: u64) -> Result<()> {
        self.holds(value == expected, ErrorKind::Mismatch { element: self.element, value, expected })
    }

    /// A rule without a single number.
    pub(crate) fn rule(self, holds: bool, rule: &'static str) -> Result<()> {
        self.holds(holds, ErrorKind::Constraint { rule })
    }

    /// An error of the kind, unless `holds`.
    pub(crate) fn holds(self, holds: bool, kind: ErrorKind) -> Result<()> {
        if holds { Ok(()) } else { Err(Error::new(self.at, self.clause, kind)) }
    }
}

/// The checks of clause 6 on one record: each names an element and finds its offset in the rows.
#[derive(Clone, Copy)]
pub(crate) struct Check {
    table: &'static Table,
    at: u64,
}

impl Check {
    /// Number `index` of an element.
    pub(crate) fn spot(self, element: &'static str, index: usize) -> Spot {
        Spot { at: self.offset(element, index), clause: self.table.semantics, element }
    }

    /// `value` shall be within `min..=max`.
    pub(crate) fn range(
        self,
        element: &'static str,
        value: impl Into<i64>,
        min: impl Into<i64>,
        max: impl Into<i64>,
    ) -> Result<()> {
        self.spot(element, 0).range(value, min, max)
    }

    /// Number `index` of an array shall be within `min..=max`.
    pub(crate) fn range_in(
        self,
        element: &'static str,
        index: usize,
        value: impl Into<i64>,
        min: impl Into<i64>,
        max: impl Into<i64>,
    ) -> Result<()> {
        self.spot(element, index).range(value, min, max)
    }

    /// `value` shall be zero in this version.
    pub(crate) fn reserved_bits(
        self,
        element: &'static str,
        index: usize,
        value: impl Into<u64>,
    ) -> Result<()> {
        self.spot(element, index).reserved_bits(value)
    }

    /// `value` is kept for a later version unless `known`.
    pub(crate) fn known(self, known: bool, element: &'static str, value: u8) -> Result<()> {
        self.spot(element, 0).holds(known, ErrorKind::Reserved { element, value: value.into() })
    }

    /// `value` shall be what the elements before it imply.
    pub(crate) fn equal(self, element: &'static str, value: u64, expected: u64) -> Result<()> {
        self.spot(element, 0).equal(value, expected)
    }

    /// A rule without a single number.
    pub(crate) fn rule(
        self,
        holds: bool,
        element: &'static str,
        index: usize,
        rule: &'static str,
    ) -> Result<()> {
        self.spot(element, index).rule(holds, rule)
    }

    /// The checksum `stored` in the record shall be that of the bytes it covers.
    pub(crate) fn checksum(self, element: &'static str, stored: u32, computed: u32) -> Result<()> {
        // Fuzzing must reach what is checked after the checksums.
        let holds = stored == computed || cfg!(fuzzing);
        self.well_formed(holds, element, ErrorKind::Checksum { element, stored, computed })
    }

    /// Malformed, unless `holds`: cites the clause of the syntax.
    pub(crate) fn well_formed(self, holds: bool, element: &'static str, kind: ErrorKind) -> Result<()> {
        Spot { clause: self.table.syntax, ..self.spot(element, 0) }.holds(holds, kind)
    }

    /// Absolute offset of number `index` of an element.
    pub(crate) fn offset(self, element: &str, index: usize) -> u64 {
        let row = self.table.rows.iter().find(|row| row.name == element);
        let one = row.and_then(|row| row.bytes.checked_div(row.count)).unwrap_or(0);
        after(self.at, self.table.offset(element).saturating_add(one.saturating_mul(index)))
    }
}
