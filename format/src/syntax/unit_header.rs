//! 5.3 unit_header: what a unit is, how long, and whether it arrived whole.

use super::{Profile, SequenceParameters, cut_is_truncated, decode, encode, table};
use crate::{Error, ErrorKind, Limits, Result};

/// Bit 0 of `unit_flags`: a decoder that does not know the unit cannot go on without it.
const CRITICAL: u8 = 1;

table! {
    /// 5.3 — the header of a unit.
    "5.3" "6.3" unit_header UnitHeader {
        /// what the payload is
        unit_type: u8,
        /// bit 0 critical; the others are zero
        unit_flags: u8,
        /// 0 is the base layer
        spatial_layer: u8,
        /// 0 is the base layer
        temporal_layer: u8,
        /// 0 is the smallest prefix of the frame
        refinement: u8,
        /// zero
        reserved_zero: u8,
        /// low 16 bits of the CRC-32 of the other 18 bytes
        header_check: u16,
        /// display index of the frame, or of the first frame of the GOP
        frame: u32,
        /// bytes after this header
        payload_length: u32,
        /// CRC-32 of the payload
        payload_crc: u32,
    }
}

/// The kind of a unit (Table of 6.3). A code becomes this type where it is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum UnitType {
    /// 1: what holds for the whole sequence.
    SequenceParameters,
    /// 2: starts a GOP; forgets transforms and codebooks.
    GopHeader,
    /// 3: starts a frame.
    FrameHeader,
    /// 4: a linear transform of colour components.
    Transform,
    /// 5: entries of vector-quantised colour.
    Codebook,
    /// 6: what one refinement of one layer changes and adds.
    Increment,
    /// 7: where the GOPs start.
    Index,
    /// 8: the last unit.
    End,
    /// 9: the learned predictor of a GOP, profile Dynamic.
    Weights,
    /// 10: what a viewer may want to know about the scene.
    SceneDescription,
    /// 11: what the operating points cost.
    OperatingPoints,
    /// 0 (forbidden), 12 to 127: later versions.
    Reserved(u8),
    /// 128 to 255: private data.
    User(u8),
}

impl UnitType {
    /// The type with a code.
    pub const fn from_code(code: u8) -> Self {
        match code {
            1 => Self::SequenceParameters,
            2 => Self::GopHeader,
            3 => Self::FrameHeader,
            4 => Self::Transform,
            5 => Self::Codebook,
            6 => Self::Increment,
            7 => Self::Index,
            8 => Self::End,
            9 => Self::Weights,
            10 => Self::SceneDescription,
            11 => Self::OperatingPoints,
            128.. => Self::User(code),
            0 | 12..=127 => Self::Reserved(code),
        }
    }

    /// The code of the type.
    pub const fn code(self) -> u8 {
        match self {
            Self::SequenceParameters => 1,
            Self::GopHeader => 2,
            Self::FrameHeader => 3,
            Self::Transform => 4,
            Self::Codebook => 5,
            Self::Increment => 6,
            Self::Index => 7,
            Self::End => 8,
            Self::Weights => 9,
            Self::SceneDescription => 10,
            Self::OperatingPoints => 11,
            Self::Reserved(code) | Self::User(code) => code,
        }
    }

    /// The name used in reports and in errors.
    pub const fn name(self) -> &'static str {
        match self {
            Self::SequenceParameters => "sequence_parameters",
            Self::GopHeader => "gop_header",
            Self::FrameHeader => "frame_header",
            Self::Transform => "transform",
            Self::Codebook => "codebook",
            Self::Increment => "increment",
            Self::Index => "index",
            Self::End => "end",
            Self::Weights => "weights",
            Self::SceneDescription => "scene_description",
            Self::OperatingPoints => "operating_points",
            Self::Reserved(0) => "forbidden",
            Self::Reserved(_) => "reserved",
            Self::User(_) => "user",
        }
    }

    /// Whether this version of the text defines the payload.
    pub const fn is_known(self) -> bool {
        !matches!(self, Self::Reserved(_) | Self::User(_))
    }

    /// Whether a writer marks the unit critical.
    pub const fn is_critical(self) -> bool {
        self.is_known() && !matches!(self, Self::Index | Self::SceneDescription | Self::OperatingPoints)
    }

    /// Whether the unit belongs to one GOP, so that `frame` has a meaning.
    const fn has_frame(self) -> bool {
        self.is_critical() && !matches!(self, Self::SequenceParameters | Self::End)
    }

    /// Whether the unit carries a refinement.
    pub const fn has_refinement(self) -> bool {
        matches!(self, Self::Increment)
    }

    /// The highest spatial and temporal layer that a unit of this type may name.
    const fn highest_layers(self) -> (u8, u8) {
        let highest = super::MAX_LAYERS - 1;
        match self {
            Self::Increment => (highest, highest),
            Self::FrameHeader | Self::Codebook => (0, highest),
            _ => (0, 0),
        }
    }

    /// 9: what an error of such a unit costs, apart from errors of its header.
    pub const fn error_scope(self) -> ErrorScope {
        match self {
            Self::Increment => ErrorScope::List,
            _ if self.is_critical() || !self.is_known() => ErrorScope::Gop,
            _ => ErrorScope::Unit,
        }
    }
}

/// What an error of a unit costs, clause 9.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ErrorScope {
    /// The list that the increment belongs to, in this frame and in those that refer to it.
    List,
    /// The unit.
    Unit,
    /// The rest of the GOP.
    Gop,
}

/// A unit's kind and its position on the axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct UnitId {
    /// The kind of unit.
    pub unit_type: UnitType,
    /// 0 is the base layer.
    pub spatial_layer: u8,
    /// 0 is the base layer.
    pub temporal_layer: u8,
    /// 0 is the smallest prefix of the frame.
    pub refinement: u8,
    /// Display index of the frame, or of the first frame of the GOP; 0 for units of the whole stream.
    pub frame: u32,
}

impl UnitId {
    /// A unit of the whole stream: all axes 0.
    pub const fn stream(unit_type: UnitType) -> Self {
        Self { unit_type, spatial_layer: 0, temporal_layer: 0, refinement: 0, frame: 0 }
    }

    /// A unit of a frame, or of the GOP that starts with the frame.
    pub const fn of_frame(unit_type: UnitType, frame: u32) -> Self {
        Self { frame, ..Self::stream(unit_type) }
    }

    /// An increment on the base layers.
    pub const fn of_increment(frame: u32, refinement: u8) -> Self {
        Self { refinement, ..Self::of_frame(UnitType::Increment, frame) }
    }

    /// The same on other layers.
    pub const fn on_layers(self, spatial_layer: u8, temporal_layer: u8) -> Self {
        Self { spatial_layer, temporal_layer, ..self }
    }
}

impl UnitHeader {
    /// The header of a unit with this payload.
    ///
    /// # Errors
    /// Unsupported: a reserved type that stands for a known one, or that is critical. Invalid: layers, a
    /// refinement or a frame that the type cannot have. Malformed: type 0. Over limit: a payload of 2^32
    /// bytes or more.
    pub fn new(id: UnitId, payload: &[u8]) -> Result<Self> {
        let header = Self {
            unit_type: id.unit_type.code(),
            unit_flags: if id.unit_type.is_critical() { CRITICAL } else { 0 },
            spatial_layer: id.spatial_layer,
            temporal_layer: id.temporal_layer,
            refinement: id.refinement,
            reserved_zero: 0,
            header_check: 0,
            frame: id.frame,
            payload_length: 0,
            payload_crc: 0,
        };
        let header = header.with_payload(payload)?;
        // A `Reserved(3)` made by hand would come back as a frame header.
        Self::TABLE.check(0).known(
            UnitType::from_code(header.unit_type) == id.unit_type,
            "unit_type",
            header.unit_type,
        )?;
        header.validate(0)?;
        Ok(header)
    }

    /// This header before another payload: length and checksums are new, all else stays.
    ///
    /// # Errors
    /// Over limit: a payload of 2^32 bytes or more.
    pub fn with_payload(&self, payload: &[u8]) -> Result<Self> {
        let payload_crc = crc32fast::hash(payload);
        let header = Self { payload_length: payload_length(payload)?, payload_crc, ..*self };
        Ok(Self { header_check: header.covered_check(), ..header })
    }

    /// Reads and checks the header at the start of `bytes`; gives the bytes after it.
    ///
    /// # Errors
    /// Those of [`Self::delimit`] and of [`Self::validate_elements`].
    pub fn parse(bytes: &[u8], at: u64) -> Result<(Self, &[u8])> {
        let (header, rest) = Self::delimit(bytes, at)?;
        header.validate_elements(at)?;
        Ok((header, rest))
    }

    /// The same without a check of the elements: the header is intact, so that the end of its unit is known.
    ///
    /// # Errors
    /// Truncated: the header is not complete. Malformed: its checksum is wrong.
    pub fn delimit(bytes: &[u8], at: u64) -> Result<(Self, &[u8])> {
        let (header, rest): (Self, _) = decode(&Self::TABLE, bytes, at).map_err(cut_is_truncated)?;
        header.validate_check(at)?;
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

    /// The kind of unit.
    pub const fn unit_type(&self) -> UnitType {
        UnitType::from_code(self.unit_type)
    }

    /// Whether a decoder that does not know the unit must give up.
    pub const fn is_critical(&self) -> bool {
        self.unit_flags & CRITICAL != 0
    }

    /// The kind of unit and its position on the axes.
    pub const fn id(&self) -> UnitId {
        UnitId {
            unit_type: self.unit_type(),
            spatial_layer: self.spatial_layer,
            temporal_layer: self.temporal_layer,
            refinement: self.refinement,
            frame: self.frame,
        }
    }

    /// What an error of the unit costs: of a unit that is not marked as the text requires, the rest of the GOP.
    pub const fn error_scope(&self) -> ErrorScope {
        let reserved = self.unit_flags & !CRITICAL != 0 || self.reserved_zero != 0;
        if reserved { ErrorScope::Gop } else { self.unit_type().error_scope() }
    }

    /// 6.3.
    ///
    /// # Errors
    /// Malformed: the checksum is wrong. Those of [`Self::validate_elements`].
    pub fn validate(&self, at: u64) -> Result<()> {
        self.validate_check(at)?;
        self.validate_elements(at)
    }

    /// 6.3: the header is the one that was written.
    fn validate_check(&self, at: u64) -> Result<()> {
        let (stored, computed) = (self.header_check.into(), self.covered_check().into());
        Self::TABLE.check(at).checksum("header_check", stored, computed)
    }

    /// 6.3: the elements of an intact header.
    ///
    /// # Errors
    /// Malformed: type 0. Unsupported: reserved bits, or an unknown type that is critical. Invalid: layers, a
    /// refinement or a frame that the type cannot have.
    pub fn validate_elements(&self, at: u64) -> Result<()> {
        let check = Self::TABLE.check(at);
        check.well_formed(self.unit_type != 0, "unit_type", ErrorKind::Number { element: "unit_type" })?;
        check.reserved_bits("unit_flags", 0, self.unit_flags & !CRITICAL)?;
        check.reserved_bits("reserved_zero", 0, self.reserved_zero)?;
        let unit_type = self.unit_type();
        if !unit_type.is_known() {
            return check.known(!self.is_critical(), "unit_type", self.unit_type);
        }
        let refinements = if unit_type.has_refinement() { super::MAX_REFINEMENTS } else { 1 };
        let (spatial, temporal) = unit_type.highest_layers();
        check.range("spatial_layer", self.spatial_layer, 0, spatial)?;
        check.range("temporal_layer", self.temporal_layer, 0, temporal)?;
        check.range("refinement", self.refinement, 0, refinements.saturating_sub(1))?;
        check.range("frame", self.frame, 0, if unit_type.has_frame() { u32::MAX } else { 0 })
    }

    /// 6.3: the unit is one of the profile.
    ///
    /// # Errors
    /// Unsupported: it is not.
    pub fn validate_profile(&self, at: u64, profile: Profile) -> Result<()> {
        let known = profile == Profile::Dynamic || self.unit_type() != UnitType::Weights;
        Self::TABLE.check(at).known(known, "unit_type", self.unit_type)
    }

    /// 6.3: the layers are layers of the sequence.
    ///
    /// # Errors
    /// Invalid: they are not.
    pub fn validate_layers(&self, at: u64, sequence: &SequenceParameters) -> Result<()> {
        let check = Self::TABLE.check(at);
        let last = |count: u8| count.saturating_sub(1);
        check.range("spatial_layer", self.spatial_layer, 0, last(sequence.spatial_layer_count))?;
        check.range("temporal_layer", self.temporal_layer, 0, last(sequence.temporal_layer_count))
    }

    /// A.2: the payload is not longer than agreed.
    pub(crate) fn within(&self, at: u64, limits: &Limits) -> Result<()> {
        let at = Self::TABLE.check(at).offset("payload_length", 0);
        Limits::check(at, "max_payload", self.payload_length.into(), limits.max_payload.into())
    }

    /// 6.3: a payload that is read has the checksum of the header; that of an unknown unit is not read.
    pub(crate) fn check_payload(&self, at: u64, payload: &[u8]) -> Result<()> {
        if !self.unit_type().is_known() {
            return Ok(());
        }
        Self::TABLE.check(at).checksum("payload_crc", self.payload_crc, crc32fast::hash(payload))
    }

    /// What `header_check` shall be.
    fn covered_check(&self) -> u16 {
        let bytes = encode(self);
        let start = Self::TABLE.offset("header_check");
        let end = start.saturating_add(size_of::<u16>());
        let mut crc = crc32fast::Hasher::new();
        crc.update(bytes.get(..start).unwrap_or_default());
        crc.update(bytes.get(end..).unwrap_or_default());
        let [low, high, ..] = crc.finalize().to_le_bytes();
        u16::from_le_bytes([low, high])
    }
}

/// `payload_length`, where the element has room for it.
fn payload_length(payload: &[u8]) -> Result<u32> {
    u32::try_from(payload.len()).map_err(|_| {
        let (asked, allowed) = (super::after(0, payload.len()), u32::MAX.into());
        let kind = ErrorKind::OverLimit { limit: "max_payload", asked, allowed };
        Error::new(0, UnitHeader::TABLE.semantics, kind)
    })
}
