//! A stream that is read from its start to its end, unit by unit.

use crate::shard::Shard;
use splatstream_format::payload::SceneDescription;
use splatstream_format::syntax::{EndOfStream, FileHeader, GopHeader, Profile, SequenceParameters, UnitType};
use splatstream_format::unit::Unit;
use splatstream_format::unit_reader::{Event, UnitReader};
use splatstream_format::{Error, ErrorKind, Limits};
use std::io::{self, Read};

/// Bytes that are read at once, at least.
const PIECE: u64 = 1 << 16;

/// What is wrong with a part.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PartError {
    /// It cannot be read.
    #[error("it cannot be read: {0}")]
    Read(#[from] io::Error),
    /// It is no stream, or a damaged one.
    #[error(transparent)]
    Stream(#[from] Error),
}

/// What holds for a whole stream that is to be joined with others.
#[derive(Debug, Clone, PartialEq)]
pub struct StreamPart {
    /// Its profile.
    pub profile: Profile,
    /// Its level.
    pub level: u8,
    /// Its sequence parameters.
    pub sequence: SequenceParameters,
    /// What it says of its scene.
    pub description: Option<SceneDescription>,
    /// What it is a part of, if it is a shard.
    pub shard: Option<Shard>,
    /// Display indices.
    pub frames: u32,
    /// GOPs.
    pub gops: u32,
    /// Units, the end unit included.
    pub units: u32,
    /// Bytes.
    pub bytes: u64,
}

impl StreamPart {
    /// Reads a stream to its end. Every unit is delimited and its checksums are compared; nothing is decoded.
    ///
    /// # Errors
    /// A stream that is damaged, not complete, or not one of the specification.
    pub fn scan(stream: &mut dyn Read, limits: &Limits) -> Result<Self, PartError> {
        let mut scan = Scan::default();
        let (header, bytes) = walk(stream, limits, &mut |header, unit| scan.unit(header.profile(), unit))?;
        let missing = Error::new(bytes, "7.1.2", ErrorKind::UnexpectedUnit { unit: "end" });
        Ok(Self {
            profile: header.profile(),
            level: header.level,
            sequence: scan.sequence.ok_or(missing)?,
            description: scan.description,
            shard: scan.shard,
            frames: scan.frames,
            gops: scan.gops,
            units: scan.units,
            bytes,
        })
    }
}

/// What is known of a stream up to a unit.
#[derive(Default)]
struct Scan {
    sequence: Option<SequenceParameters>,
    description: Option<SceneDescription>,
    shard: Option<Shard>,
    frames: u32,
    gops: u32,
    units: u32,
    /// frame_header units.
    coded: u32,
    /// Offset of the index unit.
    index_offset: u64,
}

impl Scan {
    fn unit(&mut self, profile: Profile, unit: &Unit<'_>) -> Result<(), PartError> {
        let (payload, at) = (unit.payload, unit.payload_at);
        match unit.header.unit_type() {
            UnitType::SequenceParameters => {
                let sequence = SequenceParameters::parse_payload(payload, at, profile)?;
                if self.sequence.is_some_and(|first| first != sequence) {
                    let rule = "sequence_parameters are repeated without a change";
                    return Err(Error::new(at, "6.4", ErrorKind::Constraint { rule }).into());
                }
                self.sequence = Some(sequence);
            }
            UnitType::SceneDescription => self.description = Some(SceneDescription::parse(payload, at)?),
            UnitType::GopHeader => {
                let header = GopHeader::parse_payload(payload, at, profile)?;
                // A stream that lacks its beginning, or GOPs, is no part of another.
                let mismatch = |element, value: u32, expected: u32| {
                    let (value, expected) = (value.into(), expected.into());
                    Error::new(unit.at, "6.5", ErrorKind::Mismatch { element, value, expected })
                };
                if header.gop_index != self.gops {
                    return Err(mismatch("gop_index", header.gop_index, self.gops).into());
                }
                if unit.header.frame != self.frames {
                    return Err(mismatch("frame", unit.header.frame, self.frames).into());
                }
                header.validate_from(at, self.frames)?;
                self.gops = self.gops.saturating_add(1);
                self.frames = self.frames.saturating_add(header.gop_frame_count);
            }
            UnitType::FrameHeader => self.coded = self.coded.saturating_add(1),
            UnitType::Index => self.index_offset = unit.at,
            UnitType::End => self.end(unit)?,
            UnitType::User(_) => self.shard = self.shard.take().or_else(|| Shard::of(unit)),
            _ => {}
        }
        self.units = self.units.saturating_add(1);
        Ok(())
    }

    /// The end unit proves that nothing is missing.
    fn end(&self, unit: &Unit<'_>) -> Result<(), Error> {
        let end = EndOfStream::parse_payload(unit.payload, unit.payload_at)?;
        let (frame_count, unit_count, index_offset) = (self.coded, self.units, self.index_offset);
        end.validate_against(unit.payload_at, &EndOfStream { frame_count, unit_count, index_offset })
    }
}

/// Gives `visit` the units of a stream in order, each as it was written. Only the unit at hand is in memory.
/// Gives the file header and the bytes of the stream.
pub(super) fn walk<E: From<PartError>>(
    stream: &mut dyn Read,
    limits: &Limits,
    visit: &mut dyn FnMut(&FileHeader, &Unit<'_>) -> Result<(), E>,
) -> Result<(FileHeader, u64), E> {
    let fault = |error: Error| E::from(PartError::Stream(error));
    let mut reader = UnitReader::new(limits);
    let (mut kept, mut is_end, mut header) = (Vec::new(), false, None);
    loop {
        let at = reader.position();
        let mut missing = 0;
        match reader.read(&kept, is_end).map_err(fault)? {
            Event::FileHeader(found) => header = Some(found),
            Event::Unit(unit) => {
                let Some(header) = &header else { continue };
                unit.check_header(header.profile()).map_err(fault)?;
                unit.check_payload().map_err(fault)?;
                visit(header, &unit)?;
            }
            Event::NeedMoreData(bytes) => missing = bytes,
            Event::End => break,
        }
        let taken = usize::try_from(reader.position().saturating_sub(at)).unwrap_or(usize::MAX);
        kept.drain(..taken.min(kept.len()));
        if missing > 0 {
            let read = stream.take(missing.max(PIECE)).read_to_end(&mut kept);
            is_end = read.map_err(|error| E::from(PartError::Read(error)))? == 0;
        }
    }
    let missing = Error::new(0, "6.2", ErrorKind::Truncated { element: "file_header" });
    Ok((header.ok_or_else(|| fault(missing))?, reader.position()))
}
