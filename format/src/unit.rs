//! Annex B: a stream is a file header and units, back to back, up to the end unit.

pub(crate) mod delimited;

pub use delimited::{Landmark, Unit};

use crate::syntax::{FileHeader, Profile, UnitHeader, UnitId, after};
use crate::unit_reader::{Event, UnitReader};
use crate::{Limits, Result};

/// A stream whose file header has been accepted.
#[derive(Debug, Clone, Copy)]
pub struct Stream<'a> {
    header: FileHeader,
    bytes: &'a [u8],
    limits: Limits,
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
