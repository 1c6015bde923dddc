//! 5.14 increment: header, then the sections that are present.

use super::section::{CodedSection, SectionBytes};
use crate::entropy::section::Section;
use crate::syntax::reader::Reader;
use crate::syntax::{IncrementHeader, Profile, SequenceParameters};
use crate::{Limits, Result};

/// An increment, borrowed from the stream.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Increment<'a> {
    /// The elements before the sections.
    pub header: IncrementHeader,
    /// The sections that are present, in stream order.
    pub sections: Vec<CodedSection<'a>>,
}

impl<'a> Increment<'a> {
    /// Reads and checks a payload that stands at offset `at`. What is in the sections is not looked at.
    ///
    /// # Errors
    /// Malformed: bytes are missing or left over, or a number is not in its shortest form. Unsupported: flags
    /// that are reserved in the profile. Invalid: a value that clause 6.14 forbids. Over limit: more
    /// Gaussians than `limits` allow, or than the payload can hold.
    pub fn parse(
        payload: &'a [u8],
        at: u64,
        sequence: &SequenceParameters,
        profile: Profile,
        limits: &Limits,
    ) -> Result<Self> {
        Self::read(&mut Reader::new(payload, at), sequence, profile, limits)
    }

    /// The same from a reader of the payload.
    pub(crate) fn read(
        reader: &mut Reader<'a, '_>,
        sequence: &SequenceParameters,
        profile: Profile,
        limits: &Limits,
    ) -> Result<Self> {
        let (at, payload_length) = (reader.at(), reader.rest().len());
        let header = IncrementHeader::read(reader, sequence, profile)?;
        header.within(at, payload_length, limits)?;
        let mut sections = Vec::new();
        for section in Section::OF_INCREMENT {
            let count = header.count(section);
            if count > 0 {
                sections.push(CodedSection::read(section, count, sequence, reader)?);
            }
        }
        reader.record(IncrementHeader::TABLE.name, IncrementHeader::TABLE.syntax);
        reader.end()?;
        Ok(Self { header, sections })
    }

    /// A section, if it is present.
    pub fn section(&self, section: Section) -> Option<&CodedSection<'a>> {
        self.sections.iter().find(|coded| coded.section == section)
    }
}

/// The bytes of a payload; refused where [`Increment::parse`] would refuse them in every profile and at every level.
/// `sections` are those with a count above 0, in stream order. Offsets of errors count from the start of the payload.
///
/// # Errors
/// Those of [`Increment::parse`] in the profile Dynamic at level 4; invalid with a part of a section of 2^32
/// bytes or more.
pub fn write_increment(
    header: &IncrementHeader,
    sequence: &SequenceParameters,
    sections: &[SectionBytes],
) -> Result<Vec<u8>> {
    let mut bytes = header.to_bytes(sequence)?;
    for section in sections {
        section.write(&mut bytes)?;
    }
    Increment::parse(&bytes, 0, sequence, Profile::Dynamic, &Limits::of_level(4))?;
    Ok(bytes)
}
