//! 5.2 file_header: the first bytes of a stream.

use super::{cut_is_truncated, decode, encode, table};
use crate::{ErrorKind, Result};

/// The first eight bytes: line ends and the eighth bit show a transfer that took the file for text.
pub const SIGNATURE: [u8; 8] = [0x89, 0x47, 0x53, 0x53, 0x0D, 0x0A, 0x1A, 0x0A];

/// The version that this crate reads and writes, 2.0 release candidate 3: 128 + 2, and the number of the candidate.
const VERSION: (u8, u8) = (130, 3);
/// The same as people write it; conformance suites name theirs so.
pub const SPECIFICATION: &str = "2.0-rc.3";
/// Levels of annex A.
const LEVELS: core::ops::RangeInclusive<u8> = 1..=4;
/// `header_crc` itself, which it does not cover.
const CRC_SIZE: usize = 4;

table! {
    /// 5.2 — signature, version, profile and level.
    "5.2" "6.2" file_header FileHeader {
        /// the eight bytes 89 47 53 53 0D 0A 1A 0A
        signature: u8[8],
        /// 130: a release candidate of version 2.0
        version_major: u8,
        /// number of the release candidate, 3
        version_minor: u8,
        /// 0 is Intra, 1 is Dynamic
        profile: u8,
        /// 1 to 4, annex A
        level: u8,
        /// CRC-32 of the 12 bytes before
        header_crc: u32,
    }
}

/// The tools that a stream uses, annex A.1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Profile {
    /// 0: I frames with refinements.
    Intra,
    /// 1: spatial layers, predicted frames, temporal layers.
    Dynamic,
}

impl Profile {
    /// The code in the stream.
    pub const fn code(self) -> u8 {
        match self {
            Self::Intra => 0,
            Self::Dynamic => 1,
        }
    }

    /// The profile of a code; others are reserved.
    pub const fn from_code(code: u8) -> Option<Self> {
        match code {
            0 => Some(Self::Intra),
            1 => Some(Self::Dynamic),
            _ => None,
        }
    }

    /// The name used in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Intra => "Intra",
            Self::Dynamic => "Dynamic",
        }
    }
}

impl FileHeader {
    /// The profile; that of a header that was refused is Intra.
    pub fn profile(&self) -> Profile {
        Profile::from_code(self.profile).unwrap_or(Profile::Intra)
    }

    /// The header of a stream of this version.
    ///
    /// # Errors
    /// Unsupported: a level that is not defined.
    pub fn new(profile: Profile, level: u8) -> Result<Self> {
        let (version_major, version_minor) = VERSION;
        let header = Self {
            signature: SIGNATURE,
            version_major,
            version_minor,
            profile: profile.code(),
            level,
            header_crc: 0,
        };
        let header = Self { header_crc: header.covered_crc(), ..header };
        header.validate(0)?;
        Ok(header)
    }

    /// Reads and checks the header of a stream that starts with `bytes`; gives the bytes after it.
    ///
    /// # Errors
    /// Truncated: the header is not complete. Those of [`Self::validate`].
    pub fn parse(bytes: &[u8]) -> Result<(Self, &[u8])> {
        // First of all, and on as many bytes as there are: another file format is not a truncated stream.
        Self::TABLE.check(0).well_formed(
            bytes.iter().zip(SIGNATURE).all(|(found, expected)| *found == expected),
            "signature",
            ErrorKind::Signature,
        )?;
        let (header, rest): (Self, _) = decode(&Self::TABLE, bytes, 0).map_err(cut_is_truncated)?;
        header.validate(0)?;
        Ok((header, rest))
    }

    /// The bytes of the header; refused where [`Self::parse`] would refuse them.
    ///
    /// # Errors
    /// Those of [`Self::validate`].
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        self.validate(0)?;
        Ok(encode(self))
    }

    /// 6.2: signature, checksum, version, profile, level, in this order.
    ///
    /// # Errors
    /// Malformed: the signature or the checksum is wrong. Unsupported: another version, profile or level.
    pub fn validate(&self, at: u64) -> Result<()> {
        let check = Self::TABLE.check(at);
        check.well_formed(self.signature == SIGNATURE, "signature", ErrorKind::Signature)?;
        check.checksum("header_crc", self.header_crc, self.covered_crc())?;
        check.known(self.version_major == VERSION.0, "version_major", self.version_major)?;
        check.known(self.version_minor == VERSION.1, "version_minor", self.version_minor)?;
        check.known(Profile::from_code(self.profile).is_some(), "profile", self.profile)?;
        check.known(LEVELS.contains(&self.level), "level", self.level)
    }

    /// What `header_crc` shall be.
    fn covered_crc(&self) -> u32 {
        let bytes = encode(self);
        bytes.split_last_chunk::<CRC_SIZE>().map_or(0, |(covered, _)| crc32fast::hash(covered))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_specification_is_named_by_its_version() {
        let (major, candidate) = VERSION;
        assert_eq!(SPECIFICATION, format!("{}.0-rc.{candidate}", major - 128));
    }
}
