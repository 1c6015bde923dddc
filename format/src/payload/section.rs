//! 5.15 section: models and blocks of the planes of one kind.

use super::{length, write_leb128};
use crate::entropy::section::Section;
use crate::syntax::SequenceParameters;
use crate::syntax::reader::Reader;
use crate::{Error, ErrorKind, Result};

/// log2 of the lanes of a section, at most.
const MAX_LANES_LOG2: u8 = 5;
/// Clause of the semantics.
const SEMANTICS: &str = "6.15";

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

impl<'a> CodedSection<'a> {
    /// Divides a section of `count` values. What is in its parts is not looked at.
    pub(super) fn read(
        section: Section,
        count: u32,
        sequence: &SequenceParameters,
        reader: &mut Reader<'a, '_>,
    ) -> Result<Self> {
        reader.record("section", "5.15");
        let at = reader.at();
        let lanes_log2 = reader.u8("lanes_log2")?;
        if lanes_log2 > MAX_LANES_LOG2 {
            let (value, max) = (lanes_log2.into(), MAX_LANES_LOG2.into());
            let kind = ErrorKind::OutOfRange { element: "lanes_log2", value, min: 0, max };
            return Err(Error::new(at, SEMANTICS, kind));
        }
        let model_length = reader.number("model_length")?;
        let model_at = reader.at();
        let model = reader.take("models", length(model_length))?;
        let block_count = length(count.div_ceil(1_u32.wrapping_shl(sequence.block_log2.into())));
        // Every length takes a byte. Checked before room is made for them.
        if block_count > reader.rest().len() {
            return Err(reader.short("block_length"));
        }
        let mut lengths = Vec::with_capacity(block_count);
        for block in 0..block_count {
            lengths.push(reader.number_indexed("block_length", Some(block))?);
        }
        let mut blocks = Vec::with_capacity(block_count);
        for (block, block_length) in lengths.into_iter().enumerate() {
            let at = reader.at();
            blocks.push((reader.take_indexed("blocks", Some(block), length(block_length))?, at));
        }
        Ok(Self { section, count, lanes_log2, model, model_at, blocks })
    }
}

/// The bytes of one section for a writer.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct SectionBytes {
    /// log2 of the entropy states of a block.
    pub lanes_log2: u8,
    /// The models of the planes.
    pub model: Vec<u8>,
    /// Each block.
    pub blocks: Vec<Vec<u8>>,
}

impl SectionBytes {
    /// Appends the section. That the parts fit is checked by reading what was written.
    pub(super) fn write(&self, bytes: &mut Vec<u8>) -> Result<()> {
        let put_length = |part: &[u8], bytes: &mut Vec<u8>| {
            let rule = "a part of a section is shorter than 2^32 bytes";
            let number = u32::try_from(part.len())
                .map_err(|_| Error::new(0, SEMANTICS, ErrorKind::Constraint { rule }))?;
            write_leb128(number, bytes);
            Ok(())
        };
        bytes.push(self.lanes_log2);
        put_length(&self.model, bytes)?;
        bytes.extend_from_slice(&self.model);
        for block in &self.blocks {
            put_length(block, bytes)?;
        }
        for block in &self.blocks {
            bytes.extend_from_slice(block);
        }
        Ok(())
    }
}
