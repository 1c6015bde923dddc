//! Annex B: a stream is a file header and units, back to back, up to the end unit.

use crate::syntax::{
    FileHeader, GopHeader, Profile, SequenceParameters, UnitHeader, UnitId, UnitType, after,
};
use crate::unit_reader::{Event, UnitReader};
use crate::{Error, ErrorKind, Limits, Result};

/// What a stream is made of.
pub(crate) const CLAUSE: &str = "B.1";

/// A stream whose file header has been accepted.
#[derive(Debug, Clone, Copy)]
pub struct Stream<'a> {
    header: FileHeader,
    bytes: &'a [u8],
    limits: Limits,
}

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

/// The units of a stream, in order.
///
/// [`Units::next_unit`] delimits units and leaves their checks to the caller. It stops where the end of a unit is not
/// known, from where [`Units::scan_for`] may go on. As an iterator it is for readers that want every unit checked: a unit
/// with a wrong header or payload is an `Err`, after which more units come.
#[derive(Debug, Clone)]
pub struct Units<'a> {
    bytes: &'a [u8],
    profile: Profile,
    reader: UnitReader,
    /// Absolute offset of the unit that was given out or refused last.
    last: u64,
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

impl<'a> Stream<'a> {
    /// Reads and checks the file header of the stream that `bytes` is.
    ///
    /// # Errors
    /// Those of [`FileHeader::parse`].
    pub fn open(bytes: &'a [u8], limits: &Limits) -> Result<Self> {
        let (header, _) = FileHeader::parse(bytes)?;
        Ok(Self { header, bytes, limits: *limits })
    }

    /// The file header.
    pub const fn header(&self) -> &FileHeader {
        &self.header
    }

    /// The units from the first on.
    pub fn units(&self) -> Units<'a> {
        self.units_from(after(0, FileHeader::SIZE))
    }

    /// The units from the one at an absolute offset on, as an index gives it. Past the end of the stream there are none.
    pub fn units_from(&self, offset: u64) -> Units<'a> {
        Units::starting_at(self.bytes, offset, self.header.profile(), &self.limits)
    }
}

impl<'a> Units<'a> {
    pub(crate) fn starting_at(bytes: &'a [u8], at: u64, profile: Profile, limits: &Limits) -> Self {
        let reader = UnitReader::starting_at(at.min(after(0, bytes.len())), limits);
        Self { bytes, profile, last: reader.position(), reader }
    }

    /// Absolute offset of the next unit.
    pub fn position(&self) -> u64 {
        self.reader.position()
    }

    /// Whether a unit is due: the end unit has not been met, and the end of every unit was known.
    pub fn is_open(&self) -> bool {
        self.reader.is_open()
    }

    /// The next unit. `None` after the end unit, and after a unit whose end is not known.
    pub fn next_unit(&mut self) -> Option<Result<Unit<'a>>> {
        self.last = self.reader.position();
        match self.reader.read(self.rest(), true) {
            Ok(Event::Unit(unit)) => Some(Ok(unit)),
            Ok(_) => None,
            Err(error) => Some(Err(error)),
        }
    }

    /// Goes to the first intact unit of a kind that starts after the first byte of the unit that was given out or refused
    /// last. If there is none, nothing more is given out.
    pub fn scan_for(&mut self, landmark: Landmark) -> bool {
        self.reader.scan_from(self.last.saturating_add(1), landmark);
        self.reader.scan(self.rest(), true);
        self.reader.is_open()
    }

    fn rest(&self) -> &'a [u8] {
        usize::try_from(self.position()).ok().and_then(|at| self.bytes.get(at..)).unwrap_or_default()
    }
}

impl<'a> Iterator for Units<'a> {
    type Item = Result<Unit<'a>>;

    fn next(&mut self) -> Option<Self::Item> {
        let unit = self.next_unit()?;
        Some(unit.and_then(|unit| {
            unit.check_header(self.profile)?;
            unit.check_payload()?;
            Ok(unit)
        }))
    }
}

/// The first bytes of a stream.
///
/// # Errors
/// Unsupported: a level that is not defined.
pub fn write_file_header(profile: Profile, level: u8) -> Result<Vec<u8>> {
    FileHeader::new(profile, level)?.to_bytes()
}

/// Appends a unit with its checksums. Nothing is appended where a reader would refuse the header; offsets of
/// errors count from the start of the unit.
///
/// # Errors
/// Those of [`UnitHeader::new`].
pub fn write_unit(out: &mut Vec<u8>, id: UnitId, payload: &[u8]) -> Result<()> {
    let header = UnitHeader::new(id, payload)?.to_bytes()?;
    out.extend(header);
    out.extend_from_slice(payload);
    Ok(())
}

/// A record that does not end within the stream: the stream is cut, not malformed.
pub(crate) fn cut_is_truncated(error: Error) -> Error {
    match error.kind {
        ErrorKind::ShortSection { element } => Error { kind: ErrorKind::Truncated { element }, ..error },
        _ => error,
    }
}
