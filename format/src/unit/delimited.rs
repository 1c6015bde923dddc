//! Annex B: a unit as it is delimited, and the units from which reading can go on.

use crate::Result;
use crate::syntax::{GopHeader, Profile, SequenceParameters, UnitHeader, UnitType};

/// What a stream is made of.
pub(crate) const CLAUSE: &str = "B.1";

/// A unit whose header is intact and whose payload lies within the stream. Nothing else has been checked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unit<'a> {
    /// Absolute offset of the header.
    pub at: u64,
    /// The header.
    pub header: UnitHeader,
    /// The bytes after the header.
    pub payload: &'a [u8],
    /// Absolute offset of the payload.
    pub payload_at: u64,
}

impl Unit<'_> {
    /// 6.3: the elements of the header, in a stream of a profile.
    ///
    /// # Errors
    /// Those of [`UnitHeader::validate_elements`] and of [`UnitHeader::validate_profile`].
    pub fn check_header(&self, profile: Profile) -> Result<()> {
        self.header.validate_elements(self.at)?;
        self.header.validate_profile(self.at, profile)
    }

    /// 6.3: the payload is the one that was written. The payload of a unit of unknown type may be anything.
    ///
    /// # Errors
    /// Malformed: its checksum is wrong.
    pub fn check_payload(&self) -> Result<()> {
        self.header.check_payload(self.at, self.payload)
    }
}

/// A unit from which reading can go on after damage, clause 9.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Landmark {
    /// A gop_header unit.
    GopHeader,
    /// A sequence_parameters unit.
    SequenceParameters,
}

impl Landmark {
    const fn unit_type(self) -> UnitType {
        match self {
            Self::GopHeader => UnitType::GopHeader,
            Self::SequenceParameters => UnitType::SequenceParameters,
        }
    }

    const fn payload_size(self) -> usize {
        match self {
            Self::GopHeader => GopHeader::SIZE,
            Self::SequenceParameters => SequenceParameters::SIZE,
        }
    }

    /// Bytes of a unit of this kind, its header included.
    pub(crate) const fn size(self) -> usize {
        UnitHeader::SIZE.saturating_add(self.payload_size())
    }

    /// Whether `bytes` starts with an intact unit of this kind.
    fn starts(self, bytes: &[u8]) -> bool {
        if bytes.first() != Some(&self.unit_type().code()) {
            return false;
        }
        let Ok((header, rest)) = UnitHeader::delimit(bytes, 0) else { return false };
        let Some(payload) = rest.get(..self.payload_size()) else { return false };
        let fits = usize::try_from(header.payload_length) == Ok(payload.len());
        let reserved = header.reserved_zero != 0 || header.unit_flags > 1;
        fits && !reserved && header.check_payload(0, payload).is_ok()
    }

    /// The first offset from `from` on at which an intact unit of this kind stands. Takes time linear in the bytes.
    pub fn find(self, bytes: &[u8], from: usize) -> Option<usize> {
        (from..bytes.len()).find(|&at| bytes.get(at..).is_some_and(|rest| self.starts(rest)))
    }
}
