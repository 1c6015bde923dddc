//! Annex B: a stream is a file header and units, back to back, up to the end unit.

use crate::levels::Levels;
use crate::syntax::{FileHeader, Profile, UnitHeader, UnitId, UnitType, after};
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

/// A unit: header accepted, payload within the stream. The payload of a unit of known type has the check sum
/// that the header gives, but for [`Damaged`] ones.
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

/// A unit whose payload is not the one that was written. The next unit can still be found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Damaged<'a> {
    /// Its header is intact.
    pub unit: Unit<'a>,
    /// The check sum that failed.
    pub error: Error,
    /// Whether nobody looks at the payload, so that the damage is no error: the unit is passed over by step 2 of 7.13.3
    /// if no unit before it was lost.
    pub passed_over: bool,
}

/// What stands at the place of a unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Delivery<'a> {
    /// A whole unit.
    Intact(Unit<'a>),
    /// A unit with a wrong payload.
    Damaged(Damaged<'a>),
}

/// The units of a stream, in order.
///
/// As an iterator it is for readers that want every unit: a damaged one is an `Err`, unless it is passed over.
/// [`Units::next_unit`] keeps damage, after which more units come, apart from errors, after which nothing comes.
#[derive(Debug, Clone)]
pub struct Units<'a> {
    rest: &'a [u8],
    at: u64,
    profile: Profile,
    limits: Limits,
    unit_count: u32,
    levels: Levels,
    state: State,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    /// A unit is due.
    Open,
    /// The end unit has been read: nothing may follow.
    Ended,
    /// Nothing more is given out.
    Done,
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

    /// The units from the one at an absolute offset on, as an index gives it.
    pub fn units_from(&self, offset: u64) -> Units<'a> {
        Units::starting_at(self.bytes, offset, self.header.profile(), &self.limits)
    }
}

impl<'a> Units<'a> {
    /// The units of a stream from an offset on. Past the end of the stream there are none.
    pub(crate) fn starting_at(stream: &'a [u8], at: u64, profile: Profile, limits: &Limits) -> Self {
        let rest = usize::try_from(at).ok().and_then(|start| stream.get(start..)).unwrap_or_default();
        Self {
            rest,
            at,
            profile,
            limits: *limits,
            unit_count: 0,
            levels: Levels::default(),
            state: State::Open,
        }
    }

    /// Absolute offset of the next unit.
    pub const fn position(&self) -> u64 {
        self.at
    }

    /// Units given out so far.
    pub const fn unit_count(&self) -> u32 {
        self.unit_count
    }

    /// Whether a unit is due: the end unit has not been met, nor an error.
    pub fn is_open(&self) -> bool {
        self.state == State::Open
    }

    /// The next unit. `None` after the end unit and after an error.
    pub fn next_unit(&mut self) -> Option<Result<Delivery<'a>>> {
        let next = match self.state {
            State::Open => self.read(),
            State::Ended => {
                self.state = State::Done;
                return self.nothing_follows().err().map(Err);
            }
            State::Done => return None,
        };
        if next.is_err() {
            self.state = State::Done;
        }
        Some(next)
    }

    /// Delimits one unit, and only then looks at its payload.
    fn read(&mut self) -> Result<Delivery<'a>> {
        let at = self.at;
        if self.rest.is_empty() {
            return Err(Error::new(at, CLAUSE, ErrorKind::Truncated { element: "unit_header" }));
        }
        let (header, rest) = UnitHeader::parse(self.rest, at, self.profile)?;
        let units = u64::from(self.unit_count).saturating_add(1);
        Limits::check(at, "max_units", units, self.limits.max_units.into())?;
        header.within(at, &self.limits)?;
        let payload_at = after(at, UnitHeader::SIZE);
        let truncated = Error::new(payload_at, CLAUSE, ErrorKind::Truncated { element: "payload" });
        let length = usize::try_from(header.payload_length).map_err(|_| truncated)?;
        let (payload, rest) = rest.split_at_checked(length).ok_or(truncated)?;
        self.rest = rest;
        self.at = after(payload_at, length);
        self.unit_count = self.unit_count.saturating_add(1);
        if header.unit_type() == UnitType::End {
            self.state = State::Ended;
        }
        let unit = Unit { at, header, payload, payload_at };
        let passed_over = !self.levels.takes(&header);
        Ok(match header.check_payload(at, payload, self.profile) {
            Ok(()) => {
                self.levels.follow(&unit, self.profile);
                Delivery::Intact(unit)
            }
            Err(error) => Delivery::Damaged(Damaged { unit, error, passed_over }),
        })
    }

    /// 6.11: the stream ends with the last byte of the end unit.
    fn nothing_follows(&self) -> Result<()> {
        if self.rest.is_empty() {
            return Ok(());
        }
        let kind = ErrorKind::TrailingBytes { element: "stream", bytes: after(0, self.rest.len()) };
        Err(Error::new(self.at, CLAUSE, kind))
    }
}

impl<'a> Iterator for Units<'a> {
    type Item = Result<Unit<'a>>;

    fn next(&mut self) -> Option<Self::Item> {
        Some(match self.next_unit()? {
            Ok(Delivery::Intact(unit)) => Ok(unit),
            Ok(Delivery::Damaged(damaged)) if damaged.passed_over => Ok(damaged.unit),
            Ok(Delivery::Damaged(damaged)) => Err(damaged.error),
            Err(error) => Err(error),
        })
    }
}

impl core::iter::FusedIterator for Units<'_> {}

/// The first bytes of a stream.
pub fn write_file_header(profile: Profile, level: u8) -> Result<Vec<u8>> {
    FileHeader::new(profile, level)?.to_bytes()
}

/// Appends a unit with its check sums. Nothing is appended where a reader would refuse the header; offsets of
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
