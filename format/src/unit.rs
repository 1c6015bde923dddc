//! Annex B: a stream is a file header and units, back to back, up to the end unit.

use crate::syntax::{
    FileHeader, GopHeader, Profile, SequenceParameters, UnitHeader, UnitId, UnitType, after,
};
use crate::{Error, ErrorKind, Limits, Result};

/// What a stream is made of.
const CLAUSE: &str = "B.1";

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
    pub fn check_header(&self, profile: Profile) -> Result<()> {
        self.header.validate_elements(self.at)?;
        self.header.validate_profile(self.at, profile)
    }

    /// 6.3: the payload is the one that was written. The payload of a unit of unknown type may be anything.
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
    /// The next unit.
    at: usize,
    /// The unit that was given out or refused last.
    last: usize,
    profile: Profile,
    limits: Limits,
    unit_count: u32,
    state: State,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    /// A unit is due.
    Open,
    /// The end unit has been read: nothing may follow.
    Ended,
    /// The end of a unit is not known: only a scan goes on.
    Lost,
    /// Nothing more is given out.
    Done,
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
        let at = usize::try_from(at).unwrap_or(usize::MAX).min(bytes.len());
        let (limits, state) = (*limits, State::Open);
        Self { bytes, at, last: at, profile, limits, unit_count: 0, state }
    }

    /// Absolute offset of the next unit.
    pub fn position(&self) -> u64 {
        after(0, self.at)
    }

    /// Units given out so far.
    pub const fn unit_count(&self) -> u32 {
        self.unit_count
    }

    /// Whether a unit is due: the end unit has not been met, and the end of every unit was known.
    pub fn is_open(&self) -> bool {
        self.state == State::Open
    }

    /// The next unit. `None` after the end unit, and after a unit whose end is not known.
    pub fn next_unit(&mut self) -> Option<Result<Unit<'a>>> {
        match self.state {
            State::Open => {
                self.last = self.at;
                let unit = self.read();
                if unit.is_err() && self.state == State::Open {
                    self.state = State::Lost;
                }
                Some(unit)
            }
            State::Ended => {
                self.state = State::Done;
                self.nothing_follows().err().map(Err)
            }
            State::Lost | State::Done => None,
        }
    }

    /// Goes to the first intact unit of a kind that starts after the first byte of the unit that was given out or refused
    /// last. If there is none, nothing more is given out.
    pub fn scan_for(&mut self, landmark: Landmark) -> bool {
        let from = self.last.saturating_add(1);
        let found = if self.state == State::Done { None } else { landmark.find(self.bytes, from) };
        self.state = if found.is_some() { State::Open } else { State::Done };
        self.at = found.unwrap_or(self.bytes.len());
        found.is_some()
    }

    /// Delimits one unit.
    fn read(&mut self) -> Result<Unit<'a>> {
        let at = after(0, self.at);
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        if rest.is_empty() {
            return Err(Error::new(at, CLAUSE, ErrorKind::Truncated { element: "unit_header" }));
        }
        let (header, rest) = UnitHeader::delimit(rest, at)?;
        let units = u64::from(self.unit_count).saturating_add(1);
        if let Err(error) = Limits::check(at, "max_units", units, self.limits.max_units.into()) {
            // No later unit is allowed either.
            self.state = State::Done;
            return Err(error);
        }
        header.within(at, &self.limits)?;
        let payload_at = after(at, UnitHeader::SIZE);
        let truncated = Error::new(payload_at, CLAUSE, ErrorKind::Truncated { element: "payload" });
        let length = usize::try_from(header.payload_length).map_err(|_| truncated)?;
        let payload = rest.get(..length).ok_or(truncated)?;
        self.at = self.at.saturating_add(UnitHeader::SIZE).saturating_add(length);
        self.unit_count = self.unit_count.saturating_add(1);
        if header.unit_type() == UnitType::End {
            self.state = State::Ended;
        }
        Ok(Unit { at, header, payload, payload_at })
    }

    /// 6.11: the stream ends with the last byte of the end unit.
    fn nothing_follows(&self) -> Result<()> {
        let left = self.bytes.len().saturating_sub(self.at);
        if left == 0 {
            return Ok(());
        }
        let kind = ErrorKind::TrailingBytes { element: "stream", bytes: after(0, left) };
        Err(Error::new(after(0, self.at), CLAUSE, kind))
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
pub fn write_file_header(profile: Profile, level: u8) -> Result<Vec<u8>> {
    FileHeader::new(profile, level)?.to_bytes()
}

/// Appends a unit with its checksums. Nothing is appended where a reader would refuse the header; offsets of
/// errors count from the start of the unit.
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
