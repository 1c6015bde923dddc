//! What a GOP header starts: transforms and codebooks until the next one (clause 7.1).

use crate::colour::Colour;
use crate::layout::ShCoding;
use splatstream_format::payload::{Codebook, Transform};
use splatstream_format::syntax::{
    CodebookHeader, FrameHeader, GopHeader, RefinementHeader, SequenceParameters, Table, TransformHeader,
    TransformKind, UnitType,
};
use splatstream_format::unit::Unit;
use splatstream_format::{Error, ErrorKind, Limits, Result};

/// The state of a GOP.
#[derive(Debug, Clone)]
pub struct Gop {
    /// Its header.
    pub header: GopHeader,
    /// Display index of its first frame.
    pub first_frame: u32,
    dc: [Option<Transform>; 16],
    sh: [Option<Transform>; 16],
    codebooks: [Option<Codebook>; 16],
    codebook_values: u64,
}

/// The transforms of a frame.
#[derive(Debug, Clone, Copy)]
pub struct Transforms<'a> {
    /// Of the dc components.
    pub dc: &'a Transform,
    /// Of the SH components; none at SH degree 0.
    pub sh: Option<&'a Transform>,
}

impl Gop {
    /// A GOP without transforms or codebooks.
    pub fn new(header: GopHeader, first_frame: u32) -> Self {
        Self {
            header,
            first_frame,
            dc: [const { None }; 16],
            sh: [const { None }; 16],
            codebooks: [const { None }; 16],
            codebook_values: 0,
        }
    }

    /// Takes a transform or codebook unit.
    ///
    /// # Errors
    /// What clauses 6.7 and 6.8 refuse, an identifier defined twice, more codebook values than the limits.
    pub fn tool(&mut self, unit: &Unit<'_>, sequence: &SequenceParameters, limits: &Limits) -> Result<()> {
        if unit.header.unit_type() == UnitType::Transform {
            let (header, rest) = TransformHeader::parse(unit.payload, unit.payload_at, sequence)?;
            let slots = match header.kind() {
                Some(TransformKind::Sh) => &mut self.sh,
                _ => &mut self.dc,
            };
            let slot = undefined(slots, header.transform_id, unit, "6.7")?;
            *slot = Some(Transform::parse_behind(header, rest, unit.payload_at)?);
            return Ok(());
        }
        let (header, rest) = CodebookHeader::parse(unit.payload, unit.payload_at)?;
        let slot = undefined(&mut self.codebooks, header.codebook_id, unit, "6.8")?;
        self.codebook_values = self.codebook_values.saturating_add(u64::from(header.value_count()));
        let most = u64::from(limits.max_codebook_values);
        let at = place(&CodebookHeader::TABLE, unit.payload_at, "entry_count_minus1", 0);
        Limits::check(at, "max_codebook_values", self.codebook_values, most)?;
        *slot = Some(Codebook::parse_behind(header, rest, unit.payload_at)?);
        Ok(())
    }

    /// The transforms that a frame header names.
    ///
    /// # Errors
    /// Invalid if one is not defined.
    pub fn transforms(&self, frame: &FrameHeader, at: u64) -> Result<Transforms<'_>> {
        let find = |slots, id: u8, element| {
            let undefined = ErrorKind::Undefined { element, id: u64::from(id) };
            let at = place(&FrameHeader::TABLE, at, element, 0);
            defined(slots, id).ok_or(Error::new(at, "6.6", undefined))
        };
        let dc = find(&self.dc, frame.dc_transform_id, "dc_transform_id")?;
        let sh = match frame.sh_transform() {
            None => None,
            Some(id) => Some(find(&self.sh, id, "sh_transform_id")?),
        };
        Ok(Transforms { dc, sh })
    }

    /// What a unit needs to reconstruct colour.
    ///
    /// # Errors
    /// Invalid if a codebook is not defined or has another number of components than the transform.
    pub fn colour<'a>(
        &'a self,
        transforms: Transforms<'a>,
        header: &RefinementHeader,
        at: u64,
    ) -> Result<Colour<'a>> {
        let rank = transforms.sh.map_or(0, |transform| transform.header.rank);
        if transforms.sh.is_none() && header.sh_mode != 0 {
            let value = i64::from(header.sh_mode);
            let kind = ErrorKind::OutOfRange { element: "sh_mode", value, min: 0, max: 0 };
            return Err(Error::new(place(&RefinementHeader::TABLE, at, "sh_mode", 0), "6.9", kind));
        }
        let mode = ShCoding::of(header, rank);
        let mut codebooks = [None; 4];
        for ((slot, id), stage) in codebooks.iter_mut().zip(header.codebooks()).zip(0..) {
            let at = place(&RefinementHeader::TABLE, at, "codebook_ids", stage);
            let undefined = ErrorKind::Undefined { element: "codebook_ids", id: u64::from(id) };
            let codebook = defined(&self.codebooks, id).ok_or(Error::new(at, "6.9", undefined))?;
            if codebook.header.component_count != rank {
                let kind = ErrorKind::Mismatch {
                    element: "component_count",
                    value: u64::from(codebook.header.component_count),
                    expected: u64::from(rank),
                };
                return Err(Error::new(at, "6.9", kind));
            }
            *slot = Some(codebook);
        }
        Ok(Colour { dc: transforms.dc, sh: transforms.sh, mode, codebooks })
    }
}

fn defined<T>(slots: &[Option<T>; 16], id: u8) -> Option<&T> {
    slots.get(usize::from(id)).and_then(Option::as_ref)
}

/// Absolute offset of a byte of an element of the record at `at`.
fn place(table: &Table, at: u64, element: &str, byte: usize) -> u64 {
    let offset = table.offset(element).saturating_add(byte);
    at.saturating_add(u64::try_from(offset).unwrap_or(u64::MAX))
}

/// The place of an identifier that no unit of the GOP has defined yet.
fn undefined<'s, T>(
    slots: &'s mut [Option<T>; 16],
    id: u8,
    unit: &Unit<'_>,
    clause: &'static str,
) -> Result<&'s mut Option<T>> {
    match slots.get_mut(usize::from(id)) {
        Some(slot) if slot.is_none() => Ok(slot),
        _ => {
            let rule = "an identifier is defined once in a GOP";
            Err(Error::new(unit.payload_at, clause, ErrorKind::Constraint { rule }))
        }
    }
}
