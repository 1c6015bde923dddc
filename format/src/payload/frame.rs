//! 5.6 frame_header: the fixed part, the digest of carried lists, and the motion of cells.

use super::section::{CodedSection, SectionBytes};
use super::write_leb128;
use crate::entropy::section::Section;
use crate::syntax::reader::Reader;
use crate::syntax::{FrameHeader, SequenceParameters, Spot};
use crate::{Limits, Result};

/// A frame header, borrowed from the stream.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FramePayload<'a> {
    /// The fixed part.
    pub header: FrameHeader,
    /// Digest of the carried lists, if it is present.
    pub carried_digest: Option<u64>,
    /// Absolute offset of the digest, or of what follows if it is absent.
    pub carried_digest_at: u64,
    /// The motion of cells, if it is present.
    pub cells: Option<Cells<'a>>,
}

/// How cells move.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cells<'a> {
    /// log2 of the side of a cell in grid steps.
    pub cell_log2: u8,
    /// The section; its count is `cell_count`.
    pub coded: CodedSection<'a>,
}

impl<'a> FramePayload<'a> {
    /// Reads and checks a payload that stands at offset `at`. What is in the section is not looked at.
    ///
    /// # Errors
    /// Malformed: bytes are missing or left over, or a number is not in its shortest form. Unsupported: a
    /// frame type or flags that are reserved. Invalid: a value that clause 6.6 forbids. Over limit: more
    /// Gaussians, in a frame or a second, or more cells than `limits` allow.
    pub fn parse(payload: &'a [u8], at: u64, sequence: &SequenceParameters, limits: &Limits) -> Result<Self> {
        Self::read(&mut Reader::new(payload, at), sequence, limits)
    }

    /// The same from a reader of the payload.
    pub(crate) fn read(
        reader: &mut Reader<'a, '_>,
        sequence: &SequenceParameters,
        limits: &Limits,
    ) -> Result<Self> {
        let at = reader.at();
        reader.record(FrameHeader::TABLE.name, FrameHeader::TABLE.syntax);
        let fixed_part = reader.rest();
        for row in FrameHeader::ROWS {
            reader.take(row.name, row.bytes)?;
        }
        let (header, _) = FrameHeader::parse(fixed_part, at)?;
        header.within(at, sequence, limits)?;
        let carried_digest_at = reader.at();
        let carried_digest = match header.has_carried_digest() {
            true => Some(reader.array("carried_digest").map(u64::from_le_bytes)?),
            false => None,
        };
        let cells = match header.has_cells() {
            true => Some(Cells::read(reader, sequence, limits)?),
            false => None,
        };
        reader.record(FrameHeader::TABLE.name, FrameHeader::TABLE.syntax);
        reader.end()?;
        Ok(Self { header, carried_digest, carried_digest_at, cells })
    }
}

impl<'a> Cells<'a> {
    fn read(reader: &mut Reader<'a, '_>, sequence: &SequenceParameters, limits: &Limits) -> Result<Self> {
        let spot = |at, element| Spot { at, clause: FrameHeader::TABLE.semantics, element };
        let at = reader.at();
        let cell_count = reader.number("cell_count")?;
        spot(at, "cell_count").range(cell_count, 1, u32::MAX)?;
        Limits::check(at, "max_cells", cell_count.into(), limits.max_cells.into())?;
        let at = reader.at();
        let cell_log2 = reader.u8("cell_log2")?;
        spot(at, "cell_log2").range(cell_log2, 0, sequence.position_bits)?;
        let coded = CodedSection::read(Section::Cells, cell_count, sequence, reader)?;
        Ok(Self { cell_log2, coded })
    }
}

/// The motion of cells for [`write_frame`].
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct CellsBytes {
    /// Cells that move or are stale.
    pub cell_count: u32,
    /// log2 of the side of a cell in grid steps.
    pub cell_log2: u8,
    /// The section.
    pub section: SectionBytes,
}

/// The bytes of a payload; refused where [`FramePayload::parse`] would refuse them at every level. `frame_flags` of
/// the header is replaced by what follows from the other arguments. Offsets of errors count from the start of the
/// payload.
///
/// # Errors
/// Those of [`FramePayload::parse`] at level 4, without its limit of the rate; invalid with a part of a
/// section of 2^32 bytes or more.
pub fn write_frame(
    header: &FrameHeader,
    carried_digest: Option<u64>,
    cells: Option<&CellsBytes>,
    sequence: &SequenceParameters,
) -> Result<Vec<u8>> {
    let digest_flag = if carried_digest.is_some() { FrameHeader::HAS_CARRIED_DIGEST } else { 0 };
    let cells_flag = if cells.is_some() { FrameHeader::HAS_CELLS } else { 0 };
    let mut bytes = FrameHeader { frame_flags: digest_flag | cells_flag, ..*header }.to_bytes()?;
    bytes.extend(carried_digest.into_iter().flat_map(u64::to_le_bytes));
    if let Some(cells) = cells {
        write_leb128(cells.cell_count, &mut bytes);
        bytes.push(cells.cell_log2);
        cells.section.write(&mut bytes)?;
    }
    let limits = Limits { max_gaussian_rate: u64::MAX, ..Limits::of_level(4) };
    FramePayload::parse(&bytes, 0, sequence, &limits)?;
    Ok(bytes)
}
