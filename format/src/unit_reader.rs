//! Annex B for streams that arrive in pieces: file header and units, or how many more bytes are needed.
//!
//! The reader holds no bytes. It is given those of the stream from [`UnitReader::position`] on, as many as there are, and
//! whether more may come. What lies before the position is never needed again.

use crate::syntax::{FileHeader, UnitHeader, UnitType, after};
use crate::unit::delimited::{CLAUSE, Landmark, Unit};
use crate::{Class, Error, ErrorKind, Limits, Result};

/// What stands at the position of a reader.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event<'a> {
    /// The header of the file, which has been accepted. It comes once, before any unit.
    FileHeader(FileHeader),
    /// A unit whose header is intact and whose payload is there. Nothing else has been checked.
    Unit(Unit<'a>),
    /// At least so many more bytes are needed, 1 or more. Never given where no more may come.
    NeedMoreData(u64),
    /// Nothing more is given out, unless [`UnitReader::scan_for`] or [`UnitReader::reopen`] goes on.
    End,
}

/// Delimits the units of a stream.
///
/// ```
/// use splatstream_format::syntax::Profile;
/// use splatstream_format::unit::write_file_header;
/// use splatstream_format::unit_reader::{Event, UnitReader};
///
/// let bytes = write_file_header(Profile::Dynamic, 1)?;
/// let mut reader = UnitReader::new(&Default::default());
/// assert_eq!(reader.read(&bytes[..10], false)?, Event::NeedMoreData(6));
/// assert!(matches!(reader.read(&bytes, false)?, Event::FileHeader(_)));
/// assert_eq!((reader.position(), reader.read(&[], false)?), (16, Event::NeedMoreData(20)));
/// # Ok::<(), splatstream_format::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct UnitReader {
    /// Absolute offset of what comes next.
    at: u64,
    limits: Limits,
    unit_count: u32,
    state: State,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    /// The file header is due.
    Start,
    /// A unit is due.
    Open,
    /// The end unit has been read, which ends at this offset: nothing may follow.
    Ended(u64),
    /// The end of a unit is not known: only a scan goes on.
    Lost,
    /// A landmark is looked for.
    Scanning(Landmark),
    /// Nothing more is given out.
    Done,
}

impl UnitReader {
    /// A reader of a stream from its first byte on.
    pub const fn new(limits: &Limits) -> Self {
        Self { at: 0, limits: *limits, unit_count: 0, state: State::Start }
    }

    /// A reader of the units from an absolute offset on, as an index gives it.
    pub const fn starting_at(at: u64, limits: &Limits) -> Self {
        Self { at, limits: *limits, unit_count: 0, state: State::Open }
    }

    /// Absolute offset of the first byte that the reader needs next.
    pub const fn position(&self) -> u64 {
        self.at
    }

    /// Whether a unit is due: the end unit has not been met, and the end of every unit was known.
    pub fn is_open(&self) -> bool {
        self.state == State::Open
    }

    /// Reads what stands at the position. `bytes` are those of the stream from there on; `is_end` says that no more
    /// will come.
    ///
    /// # Errors
    /// What clauses 6.2, 6.3 and B.1 say of the file header and of the ends of units. After an error nothing is given out
    /// until [`UnitReader::scan_for`] is called.
    pub fn read<'a>(&mut self, bytes: &'a [u8], is_end: bool) -> Result<Event<'a>> {
        let bytes = bytes.get(self.scan(bytes, is_end)..).unwrap_or_default();
        match self.state {
            State::Start => self.file_header(bytes, is_end),
            State::Open => self.unit(bytes, is_end),
            State::Ended(end) => self.trailer(bytes, end, is_end),
            State::Scanning(landmark) => Ok(Event::NeedMoreData(missing(landmark.size(), bytes))),
            State::Lost | State::Done => Ok(Event::End),
        }
    }

    /// After an error: goes to the first intact unit of a kind that starts after the first byte of the unit that was
    /// refused. Nothing happens where no unit will be given out any more.
    pub fn scan_for(&mut self, landmark: Landmark) {
        if self.state == State::Lost {
            self.scan_from(self.at.saturating_add(1), landmark);
        }
    }

    /// Goes to the first intact unit of a kind from an absolute offset on.
    pub(crate) fn scan_from(&mut self, at: u64, landmark: Landmark) {
        if self.state != State::Done {
            (self.at, self.state) = (at, State::Scanning(landmark));
        }
    }

    /// The end unit that was given out last is none: units may follow.
    pub fn reopen(&mut self) {
        if let State::Ended(end) = self.state {
            (self.at, self.state) = (end, State::Open);
        }
    }

    fn file_header(&mut self, bytes: &[u8], is_end: bool) -> Result<Event<'static>> {
        match FileHeader::parse(bytes) {
            Ok((header, _)) => {
                (self.at, self.state) = (after(0, FileHeader::SIZE), State::Open);
                Ok(Event::FileHeader(header))
            }
            Err(error) if !is_end && error.class() == Class::Truncated => {
                Ok(Event::NeedMoreData(missing(FileHeader::SIZE, bytes)))
            }
            Err(error) => {
                self.state = State::Done;
                Err(error)
            }
        }
    }

    fn unit<'a>(&mut self, bytes: &'a [u8], is_end: bool) -> Result<Event<'a>> {
        if !is_end && bytes.len() < UnitHeader::SIZE {
            return Ok(Event::NeedMoreData(missing(UnitHeader::SIZE, bytes)));
        }
        let event = self.delimit(bytes, is_end);
        if event.is_err() && self.state == State::Open {
            self.state = State::Lost;
        }
        event
    }

    fn delimit<'a>(&mut self, bytes: &'a [u8], is_end: bool) -> Result<Event<'a>> {
        let at = self.at;
        if bytes.is_empty() {
            return Err(Error::new(at, CLAUSE, ErrorKind::Truncated { element: "unit_header" }));
        }
        let (header, rest) = UnitHeader::delimit(bytes, at)?;
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
        let Some(payload) = rest.get(..length) else {
            return if is_end { Err(truncated) } else { Ok(Event::NeedMoreData(missing(length, rest))) };
        };
        self.at = after(payload_at, length);
        self.unit_count = self.unit_count.saturating_add(1);
        if header.unit_type() == UnitType::End {
            self.state = State::Ended(self.at);
        }
        Ok(Event::Unit(Unit { at, header, payload, payload_at }))
    }

    /// 6.11: the stream ends with the last byte of the end unit. The bytes after it are counted, not kept.
    fn trailer(&mut self, bytes: &[u8], end: u64, is_end: bool) -> Result<Event<'static>> {
        self.at = after(self.at, bytes.len());
        if !is_end {
            return Ok(Event::NeedMoreData(1));
        }
        self.state = State::Done;
        match self.at.saturating_sub(end) {
            0 => Ok(Event::End),
            bytes => Err(Error::new(end, CLAUSE, ErrorKind::TrailingBytes { element: "stream", bytes })),
        }
    }

    /// Goes on looking for a landmark, if one is looked for; how many bytes were skipped.
    pub(crate) fn scan(&mut self, bytes: &[u8], is_end: bool) -> usize {
        let State::Scanning(landmark) = self.state else { return 0 };
        let found = landmark.find(bytes, 0);
        let skipped = match (found, is_end) {
            (Some(at), _) => at,
            (None, true) => bytes.len(),
            // One may have begun.
            (None, false) => bytes.len().saturating_sub(landmark.size().saturating_sub(1)),
        };
        self.at = after(self.at, skipped);
        self.state = match (found, is_end) {
            (Some(_), _) => State::Open,
            (None, true) => State::Done,
            (None, false) => self.state,
        };
        skipped
    }
}

/// How many bytes are missing until there are `size`; at least one.
fn missing(size: usize, bytes: &[u8]) -> u64 {
    after(0, size.saturating_sub(bytes.len()).max(1))
}
