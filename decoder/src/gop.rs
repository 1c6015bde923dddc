//! What a gop_header starts: transforms, codebooks and a network, defined until the next one (clause 7.1).

use crate::colour::Colour;
use crate::layout::ShCoding;
use splatstream_format::payload::{Codebook, Network, Transform, Weights};
use splatstream_format::syntax::{
    CodebookHeader, FrameHeader, GopHeader, IncrementHeader, SequenceParameters, Table, TransformHeader,
    TransformKind, UnitType, WeightsHeader,
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
    codebooks: [Option<Defined>; 16],
    codebook_values: u64,
    network: Option<Network>,
}

/// A codebook and the temporal layer that defined it.
#[derive(Debug, Clone)]
struct Defined {
    codebook: Codebook,
    temporal_layer: u8,
}

const DEFINED_ONCE: &str = "an identifier is defined once in a GOP";

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
            network: None,
        }
    }

    /// The learned predictor, if the GOP has one.
    pub fn network(&self) -> Option<&Network> {
        self.network.as_ref()
    }

    /// Takes a transform, codebook or weights unit.
    ///
    /// # Errors
    /// What clauses 6.7, 6.8 and 6.17 refuse, an identifier or a network defined twice, more codebook values than the
    /// limits.
    pub fn tool(&mut self, unit: &Unit<'_>, sequence: &SequenceParameters, limits: &Limits) -> Result<()> {
        match unit.header.unit_type() {
            UnitType::Transform => self.transform(unit, sequence),
            UnitType::Weights => self.weights(unit),
            _ => self.codebook(unit, limits),
        }
    }

    fn transform(&mut self, unit: &Unit<'_>, sequence: &SequenceParameters) -> Result<()> {
        let (header, rest) = TransformHeader::parse(unit.payload, unit.payload_at, sequence)?;
        let slots = match header.kind() {
            Some(TransformKind::Sh) => &mut self.sh,
            _ => &mut self.dc,
        };
        let slot = undefined(slots, header.transform_id, unit, "6.7")?;
        *slot = Some(Transform::parse_rest(header, rest, unit.payload_at)?);
        Ok(())
    }

    fn weights(&mut self, unit: &Unit<'_>) -> Result<()> {
        let (header, rest) = WeightsHeader::parse(unit.payload, unit.payload_at)?;
        if self.network.is_some() {
            let rule = "a GOP has one network";
            return Err(Error::new(unit.payload_at, "6.17", ErrorKind::Constraint { rule }));
        }
        let weights = Weights::parse_rest(header, rest, unit.payload_at)?;
        self.network = Some(weights.network(unit.payload_at)?);
        Ok(())
    }

    fn codebook(&mut self, unit: &Unit<'_>, limits: &Limits) -> Result<()> {
        let (header, rest) = CodebookHeader::parse(unit.payload, unit.payload_at)?;
        let known = defined(&self.codebooks, header.codebook_id);
        let layer = unit.header.temporal_layer;
        if known.is_some_and(|known| known.temporal_layer != layer) {
            let rule = "a codebook is replaced in the temporal layer that defined it";
            return Err(Error::new(unit.payload_at, "6.8", ErrorKind::Constraint { rule }));
        }
        let replaced = known.map_or(0, |known| u64::from(known.codebook.header.value_count()));
        let values = self.codebook_values.saturating_sub(replaced);
        self.codebook_values = values.saturating_add(u64::from(header.value_count()));
        let most = u64::from(limits.max_codebook_values);
        let at = element_at(&CodebookHeader::TABLE, unit.payload_at, "entry_count_minus1");
        Limits::check(at, "max_codebook_values", self.codebook_values, most)?;
        let codebook = Codebook::parse_rest(header, rest, unit.payload_at)?;
        if let Some(slot) = self.codebooks.get_mut(usize::from(header.codebook_id)) {
            *slot = Some(Defined { codebook, temporal_layer: layer });
        }
        Ok(())
    }

    /// The transforms that a frame header names.
    ///
    /// # Errors
    /// Invalid if one is not defined.
    pub fn transforms(&self, frame: &FrameHeader, at: u64) -> Result<Transforms<'_>> {
        let find = |slots, id: u8, element| {
            let undefined = ErrorKind::Undefined { element, id: u64::from(id) };
            let at = element_at(&FrameHeader::TABLE, at, element);
            defined(slots, id).ok_or(Error::new(at, "6.6", undefined))
        };
        let dc = find(&self.dc, frame.dc_transform_id, "dc_transform_id")?;
        let sh = match frame.sh_transform() {
            None => None,
            Some(id) => Some(find(&self.sh, id, "sh_transform_id")?),
        };
        Ok(Transforms { dc, sh })
    }

    /// What an increment of a temporal layer needs to reconstruct colour; its payload stands at offset `at`.
    ///
    /// # Errors
    /// Invalid if a codebook is not defined or has another number of components than the transform.
    pub fn colour<'a>(
        &'a self,
        transforms: Transforms<'a>,
        header: &IncrementHeader,
        layer: u8,
        at: u64,
    ) -> Result<Colour<'a>> {
        let rank = transforms.sh.map_or(0, |transform| transform.header.rank);
        if transforms.sh.is_none() && header.sh_mode != 0 {
            let value = i64::from(header.sh_mode);
            let kind = ErrorKind::OutOfRange { element: "sh_mode", value, min: 0, max: 0 };
            return Err(Error::new(header.at(at, "sh_mode"), "6.14", kind));
        }
        let mode = ShCoding::of(&header.sh(), rank);
        let mut codebooks = [None; 4];
        for ((slot, id), stage) in codebooks.iter_mut().zip(header.sh().codebooks()).zip(0..) {
            let at = header.at(at, "codebook_ids").saturating_add(stage);
            let undefined = ErrorKind::Undefined { element: "codebook_ids", id: u64::from(id) };
            let known = defined(&self.codebooks, id).ok_or(Error::new(at, "6.14", undefined))?;
            let Defined { codebook, temporal_layer } = known;
            if *temporal_layer > layer {
                let rule = "a codebook belongs to no higher temporal layer than the units that use it";
                return Err(Error::new(at, "6.14", ErrorKind::Constraint { rule }));
            }
            if codebook.header.component_count != rank {
                let kind = ErrorKind::Mismatch {
                    element: "component_count",
                    value: u64::from(codebook.header.component_count),
                    expected: u64::from(rank),
                };
                return Err(Error::new(at, "6.14", kind));
            }
            *slot = Some(codebook);
        }
        Ok(Colour { dc: transforms.dc, sh: transforms.sh, mode, codebooks })
    }
}

fn defined<T>(slots: &[Option<T>; 16], id: u8) -> Option<&T> {
    slots.get(usize::from(id)).and_then(Option::as_ref)
}

/// Absolute offset of an element of the record at `at`.
pub(crate) fn element_at(table: &Table, at: u64, element: &str) -> u64 {
    at.saturating_add(u64::try_from(table.offset(element)).unwrap_or(u64::MAX))
}

/// The slot of an identifier that no unit of the GOP has defined yet.
fn undefined<'s, T>(
    slots: &'s mut [Option<T>; 16],
    id: u8,
    unit: &Unit<'_>,
    clause: &'static str,
) -> Result<&'s mut Option<T>> {
    match slots.get_mut(usize::from(id)) {
        Some(slot) if slot.is_none() => Ok(slot),
        _ => Err(Error::new(unit.payload_at, clause, ErrorKind::Constraint { rule: DEFINED_ONCE })),
    }
}
