//! 5.14 increment and 5.15 section: header, then models and blocks of each section that is there.

use super::number::number;
use super::{Parsed, block_lengths, element, fault, length, whole, write_leb128};
use crate::entropy::layout::Section;
use crate::syntax::{IncrementHeader, SequenceParameters, after};
use crate::{Error, ErrorKind, Limits, Result};
use nom::bytes::complete::take;
use nom::{Offset, Parser};

/// log2 of the lanes of a section, at most.
const MAX_LANES_LOG2: u8 = 5;

/// One section, borrowed from the stream.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CodedSection<'a> {
    /// What it codes.
    pub section: Section,
    /// How many values each of its planes has, 1 or more.
    pub count: u32,
    /// log2 of the entropy states of a block.
    pub lanes_log2: u8,
    /// The models of the planes, a bit section.
    pub model: &'a [u8],
    /// Absolute offset of `model`.
    pub model_at: u64,
    /// The bytes of each block and their absolute offset.
    pub blocks: Vec<(&'a [u8], u64)>,
}

/// An increment, borrowed from the stream.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Increment<'a> {
    /// The fixed part.
    pub header: IncrementHeader,
    /// The sections that are there, in stream order.
    pub sections: Vec<CodedSection<'a>>,
}

impl<'a> Increment<'a> {
    /// Reads and checks a payload that stands at offset `at`. What is in the sections is not looked at.
    pub fn parse(payload: &'a [u8], at: u64, sequence: &SequenceParameters, limits: &Limits) -> Result<Self> {
        let (header, rest) = IncrementHeader::parse(payload, at, sequence)?;
        header.within(at, limits)?;
        Self::parse_behind(header, rest, at, sequence)
    }

    /// Divides `rest`, the bytes behind a header that has been accepted. `at` is the offset of the payload,
    /// that is of the header.
    pub fn parse_behind(
        header: IncrementHeader,
        rest: &'a [u8],
        at: u64,
        sequence: &SequenceParameters,
    ) -> Result<Self> {
        let at = after(at, IncrementHeader::SIZE);
        let divided = |mut input: &'a [u8]| {
            let mut sections = Vec::new();
            for section in Section::ALL.into_iter().filter(|&section| header.count(section) > 0) {
                let (behind, coded) = one(section, header.count(section), sequence, input)?;
                sections.push(coded);
                input = behind;
            }
            Ok((input, sections))
        };
        let mut sections = whole(&IncrementHeader::TABLE, rest, at, divided)?;
        // Every part lies within `rest`, so that its place there gives its offset.
        for coded in &mut sections {
            coded.model_at = after(at, rest.offset(coded.model));
            for (block, block_at) in &mut coded.blocks {
                *block_at = after(at, rest.offset(block));
            }
        }
        Ok(Self { header, sections })
    }

    /// A section, if it is there.
    pub fn section(&self, section: Section) -> Option<&CodedSection<'a>> {
        self.sections.iter().find(|coded| coded.section == section)
    }
}

/// The parts of a section, offsets still open.
fn one<'a>(
    section: Section,
    values: u32,
    sequence: &SequenceParameters,
    input: &'a [u8],
) -> Parsed<'a, CodedSection<'a>> {
    let start = input;
    let (input, lanes) = element("lanes_log2", take(1_usize)).parse(input)?;
    let lanes_log2 = lanes.first().copied().unwrap_or(0);
    if lanes_log2 > MAX_LANES_LOG2 {
        let (value, max) = (lanes_log2.into(), MAX_LANES_LOG2.into());
        return fault(start, ErrorKind::OutOfRange { element: "lanes_log2", value, min: 0, max });
    }
    let (input, model_length) = number("model_length")(input)?;
    let (input, model) = element("models", take(model_length)).parse(input)?;
    let block_count = length(values.div_ceil(1_u32.wrapping_shl(sequence.block_log2.into())));
    let (mut input, lengths) = block_lengths(block_count, input)?;
    let mut blocks = Vec::with_capacity(lengths.len());
    for block_length in lengths {
        let (rest, block) = element("blocks", take(block_length)).parse(input)?;
        blocks.push((block, 0));
        input = rest;
    }
    Ok((input, CodedSection { section, count: values, lanes_log2, model, model_at: 0, blocks }))
}

/// The bytes of one section for [`write_increment`].
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct SectionBytes {
    /// log2 of the entropy states of a block.
    pub lanes_log2: u8,
    /// The models of the planes.
    pub model: Vec<u8>,
    /// Each block.
    pub blocks: Vec<Vec<u8>>,
}

/// The bytes of a payload; refused where [`Increment::parse`] would refuse them. `sections` are those with a count
/// above 0, in stream order. Offsets of errors count from the start of the payload.
pub fn write_increment(
    header: &IncrementHeader,
    sequence: &SequenceParameters,
    sections: &[SectionBytes],
) -> Result<Vec<u8>> {
    let mut bytes = header.to_bytes(sequence)?;
    let constraint = |rule| Error::new(0, IncrementHeader::TABLE.semantics, ErrorKind::Constraint { rule });
    let put_length = |section: &[u8], bytes: &mut Vec<u8>| {
        let number = u32::try_from(section.len());
        let number = number.map_err(|_| constraint("a section is shorter than 2^32 bytes"))?;
        write_leb128(number, bytes);
        Ok(())
    };
    for section in sections {
        bytes.push(section.lanes_log2);
        put_length(&section.model, &mut bytes)?;
        bytes.extend_from_slice(&section.model);
        for block in &section.blocks {
            put_length(block, &mut bytes)?;
        }
        for block in &section.blocks {
            bytes.extend_from_slice(block);
        }
    }
    Increment::parse(&bytes, 0, sequence, &Limits { max_gaussians: u32::MAX, ..Limits::default() })?;
    Ok(bytes)
}
