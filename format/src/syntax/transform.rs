//! 5.7 transform: a linear transform from coded components to colour.

use super::{MAX_ID, SequenceParameters, decode, table};
use crate::Result;

table! {
    /// 5.7 — the fixed part of a transform; the mean and the basis follow.
    "5.7" "6.7" transform TransformHeader {
        /// 0 to 15
        transform_id: u8,
        /// 0 is dc, 1 is sh
        transform_kind: u8,
        /// planes the transform gives
        dimension: u8,
        /// components the transform takes, 1 to dimension
        rank: u8,
    }
}

/// What a transform gives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TransformKind {
    /// 0: the degree 0 colour.
    Dc,
    /// 1: the coefficients of the higher degrees.
    Sh,
}

impl TransformKind {
    /// The kind with a code.
    pub const fn from_code(code: u8) -> Option<Self> {
        match code {
            0 => Some(Self::Dc),
            1 => Some(Self::Sh),
            _ => None,
        }
    }

    /// The code of the kind.
    pub const fn code(self) -> u8 {
        match self {
            Self::Dc => 0,
            Self::Sh => 1,
        }
    }

    /// The name used in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Dc => "dc",
            Self::Sh => "sh",
        }
    }

    /// The planes that a transform of this kind gives in a sequence.
    pub const fn dimension(self, sequence: &SequenceParameters) -> u8 {
        match self {
            Self::Dc => 3,
            Self::Sh => sequence.sh_dimension(),
        }
    }
}

impl TransformHeader {
    /// What the transform gives; `None` for a header that [`Self::validate`] refuses.
    pub const fn kind(&self) -> Option<TransformKind> {
        TransformKind::from_code(self.transform_kind)
    }

    /// Reads and checks the fixed part of a payload that stands at offset `at`; gives the bytes after it.
    ///
    /// # Errors
    /// Malformed: bytes are missing. Those of [`Self::validate`].
    pub fn parse<'a>(payload: &'a [u8], at: u64, sequence: &SequenceParameters) -> Result<(Self, &'a [u8])> {
        let (header, rest): (Self, _) = decode(&Self::TABLE, payload, at)?;
        header.validate(at, sequence)?;
        Ok((header, rest))
    }

    /// 6.7.
    ///
    /// # Errors
    /// Unsupported: a reserved kind. Invalid: an identifier, a dimension or a rank that a stream of this
    /// sequence cannot have.
    pub fn validate(&self, at: u64, sequence: &SequenceParameters) -> Result<()> {
        let check = Self::TABLE.check(at);
        check.range("transform_id", self.transform_id, 0, MAX_ID)?;
        check.known(self.kind().is_some(), "transform_kind", self.transform_kind)?;
        let dimension = self.kind().map_or(0, |kind| kind.dimension(sequence));
        check.equal("dimension", self.dimension.into(), dimension.into())?;
        check.range("rank", self.rank, 1, dimension)
    }
}
