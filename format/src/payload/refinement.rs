//! 5.9 refinement: header, models, blocks.

use super::number::number;
use super::{Parsed, block_lengths, element, fault, length, whole, write_leb128};
use crate::syntax::{RefinementHeader, SequenceParameters, after, encode};
use crate::{Error, ErrorKind, Limits, Result};
use nom::bytes::complete::take;
use nom::{Offset, Parser};

/// The sections of a refinement, borrowed from the stream.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refinement<'a> {
    /// The fixed part.
    pub header: RefinementHeader,
    /// The models of the planes, a bit section.
    pub model: &'a [u8],
    /// Absolute offset of `model`.
    pub model_at: u64,
    /// The bytes of each block and their absolute offset.
    pub blocks: Vec<(&'a [u8], u64)>,
}

impl<'a> Refinement<'a> {
    /// Reads and checks a payload that stands at offset `at`. What is in the sections is not looked at.
    pub fn parse(payload: &'a [u8], at: u64, sequence: &SequenceParameters, limits: &Limits) -> Result<Self> {
        let (header, rest) = RefinementHeader::parse(payload, at, sequence)?;
        header.within(at, limits)?;
        Self::parse_behind(header, rest, at, sequence)
    }

    /// Divides `rest`, the bytes behind a header that has been accepted. `at` is the offset of the payload,
    /// that is of the header.
    pub fn parse_behind(
        header: RefinementHeader,
        rest: &'a [u8],
        at: u64,
        sequence: &SequenceParameters,
    ) -> Result<Self> {
        let at = after(at, RefinementHeader::SIZE);
        let divided = |input| sections(&header, length(header.block_count(sequence)), input);
        let (model, blocks) = whole(&RefinementHeader::TABLE, rest, at, divided)?;
        // Every section lies within `rest`, so that its place there gives its offset.
        let offset = |section: &[u8]| after(at, rest.offset(section));
        let blocks = blocks.into_iter().map(|block| (block, offset(block))).collect();
        Ok(Self { header, model, model_at: offset(model), blocks })
    }

    /// The bytes of the payload; see [`write_refinement`].
    pub fn to_bytes(&self, sequence: &SequenceParameters) -> Result<Vec<u8>> {
        let blocks: Vec<&[u8]> = self.blocks.iter().map(|(block, _)| *block).collect();
        write_refinement(&self.header, sequence, self.model, &blocks)
    }
}

/// The bytes of a payload; refused where [`Refinement::parse`] would refuse them. Offsets of errors count from
/// the start of the payload.
pub fn write_refinement<B: AsRef<[u8]>>(
    header: &RefinementHeader,
    sequence: &SequenceParameters,
    model: &[u8],
    blocks: &[B],
) -> Result<Vec<u8>> {
    header.validate(0, sequence)?;
    let refuse = |kind| Error::new(0, RefinementHeader::TABLE.semantics, kind);
    let constraint = |rule| refuse(ErrorKind::Constraint { rule });
    if blocks.len() != length(header.block_count(sequence)) {
        return Err(constraint("there are ceil(gaussian_count / 2^block_log2) blocks"));
    }
    let mut bytes = encode(&RefinementHeader::TABLE, header)?;
    let put_length = |section: &[u8], bytes: &mut Vec<u8>| {
        let number = u32::try_from(section.len());
        let number = number.map_err(|_| constraint("a section is shorter than 2^32 bytes"))?;
        write_leb128(number, bytes);
        Ok(number)
    };
    let model_length = put_length(model, &mut bytes)?;
    validate_model_length(header, model_length).map_err(refuse)?;
    bytes.extend_from_slice(model);
    for block in blocks {
        put_length(block.as_ref(), &mut bytes)?;
    }
    for block in blocks {
        bytes.extend_from_slice(block.as_ref());
    }
    Ok(bytes)
}

/// The models and the blocks.
fn sections<'a>(
    header: &RefinementHeader,
    block_count: usize,
    section: &'a [u8],
) -> Parsed<'a, (&'a [u8], Vec<&'a [u8]>)> {
    let (input, model_length) = number("model_length")(section)?;
    if let Err(kind) = validate_model_length(header, model_length) {
        return fault(section, kind);
    }
    let (input, model) = element("models", take(model_length)).parse(input)?;
    let (mut input, lengths) = block_lengths(block_count, input)?;
    let mut blocks = Vec::with_capacity(lengths.len());
    for block_length in lengths {
        let (rest, block) = element("blocks", take(block_length)).parse(input)?;
        blocks.push(block);
        input = rest;
    }
    Ok((input, (model, blocks)))
}

/// 6.9: without Gaussians there is nothing to model.
fn validate_model_length(
    header: &RefinementHeader,
    model_length: u32,
) -> core::result::Result<(), ErrorKind> {
    if header.gaussian_count > 0 || model_length == 0 {
        return Ok(());
    }
    Err(ErrorKind::Mismatch { element: "model_length", value: model_length.into(), expected: 0 })
}
