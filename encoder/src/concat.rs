//! Streams one after the other, as one stream. Nothing is decoded.
//!
//! Every part is read twice: [`StreamPart::scan`] looks for damage and takes note of what holds for all of it, and
//! [`concat`](fn@concat) copies its units. Frames, GOPs, the index and the operating points are counted again, by what
//! writes them for the encoder: shards of one plan give the stream that one encoder writes.

mod agreement;
mod part;

pub use part::{PartError, StreamPart};

use crate::error::Error;
use crate::shard::Shard;
use crate::writer::{GopSink, Head, Record, UnitWriter};
use agreement::{check_all, description};
use core::ops::Range;
use part::walk;
use splatstream_format::syntax::{GopHeader, Profile, SequenceParameters, UnitId, UnitType};
use splatstream_format::unit::Unit;
use splatstream_format::{Error as StreamError, Limits};
use std::io::{self, Read, Write};

/// Why streams are not joined. Parts are counted from 0, in the order in which they were given.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ConcatError {
    /// There is no part.
    #[error("there is no stream to join")]
    NoParts,
    /// A part cannot be read, or it is at fault.
    #[error("part {part}: {error}")]
    Part {
        /// The part.
        part: usize,
        /// Why.
        error: PartError,
    },
    /// Two parts do not belong to one stream.
    #[error("part {part}: {name} is {value}, and {expected} in part {other}")]
    Differs {
        /// The part.
        part: usize,
        /// An earlier one.
        other: usize,
        /// What differs, as the specification spells it.
        name: &'static str,
        /// What it is.
        value: String,
        /// What it is in the other.
        expected: String,
    },
    /// Shards of two plans.
    #[error("part {part} is a shard of another plan than part {other}")]
    OtherPlan {
        /// The part.
        part: usize,
        /// Another one.
        other: usize,
    },
    /// A shard, and a stream that is none.
    #[error("part {part} is a shard, and part {other} is none")]
    NoShard {
        /// The shard.
        part: usize,
        /// The other stream.
        other: usize,
    },
    /// Two shards hold the same frames.
    #[error("parts {part} and {other} both hold frames {} to {}", .frames.start, .frames.end.saturating_sub(1))]
    Overlap {
        /// The part.
        part: usize,
        /// The one before it.
        other: usize,
        /// The frames that both hold.
        frames: Range<u32>,
    },
    /// Frames of a sequence are in no shard.
    #[error("frames {} to {} of {sequence_frames} are in no part", .frames.start, .frames.end.saturating_sub(1))]
    Missing {
        /// The frames.
        frames: Range<u32>,
        /// Frames of the sequence.
        sequence_frames: u32,
    },
    /// All parts together have more frames or units than a stream can have.
    #[error("all parts together have {count} {what}, a stream has at most {max}")]
    TooLong {
        /// Frames or units.
        what: &'static str,
        /// How many there are.
        count: u64,
        /// How many there may be.
        max: u64,
    },
    /// The stream cannot be written.
    #[error(transparent)]
    Write(#[from] Error),
}

/// What was joined.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Concatenated {
    /// Bytes of the stream.
    pub bytes: u64,
    /// Display indices.
    pub frames: u32,
    /// GOPs.
    pub gops: u32,
    /// The parts in the order in which they were joined: shards in that of their frames.
    pub order: Vec<usize>,
}

/// Joins streams. Shards of one plan come in the order of their frames and shall be complete; other streams come in the
/// order in which they are given, and shall have the same profile, parameters and scene but for the number of frames, the
/// bounds, the title and the cameras. `open` opens the stream of a part for reading from its start.
///
/// ```
/// use splatstream_encoder::{StreamPart, Settings, concat, plan};
/// use splatstream_files::builtin::BuiltinScene;
///
/// let scene = BuiltinScene { gaussians: 100, frames: 4, ..BuiltinScene::default() };
/// let mut frames: Vec<_> = (0..scene.frames).map(|number| scene.frame(number)).collect();
/// let plan = plan(&mut frames, &Settings { gop: 2, ..Settings::default() })?;
/// let mut shards = [Vec::new(), Vec::new()];
/// for (number, shard) in (1..).zip(&mut shards) {
///     plan.encode_shard(&mut frames, (number, 2), shard, &mut |_, _| ())?;
/// }
/// let limits = Default::default();
/// let parts = shards.each_ref().map(|shard| StreamPart::scan(&mut shard.as_slice(), &limits).unwrap());
/// let mut joined = Vec::new();
/// concat(&parts, &mut |part| Ok(Box::new(&shards[part][..])), &mut joined, &limits).unwrap();
/// # Ok::<(), splatstream_encoder::Error>(())
/// ```
///
/// # Errors
/// Parts that do not belong to one stream, that cannot be read, or that have changed since they were scanned; a sink that
/// cannot be written.
pub fn concat<'a>(
    parts: &[StreamPart],
    open: &mut dyn FnMut(usize) -> io::Result<Box<dyn Read + 'a>>,
    sink: &mut dyn Write,
    limits: &Limits,
) -> Result<Concatenated, ConcatError> {
    let order = check_all(parts, limits)?;
    let first = order.first().and_then(|&first| parts.get(first)).ok_or(ConcatError::NoParts)?;
    let frame_count = parts.iter().map(|part| part.frames).fold(0, u32::saturating_add);
    let sequence = SequenceParameters { frame_count, ..first.sequence };
    let mut record = Record::new(first.profile, &sequence, 0);
    let mut writer = UnitWriter::new(sink, &mut record);
    let level = parts.iter().map(|part| part.level).max().unwrap_or(first.level);
    let description = description(&order, parts);
    writer.start(&Head { level, description: description.as_ref(), shard: None })?;
    let mut start = 0;
    for &part in &order {
        let in_part = |error: PartError| ConcatError::Part { part, error };
        let mut stream = open(part).map_err(|error| in_part(error.into()))?;
        let copied = walk(&mut *stream, limits, &mut |header, unit| {
            copy(&mut writer, (header.profile(), unit), start)
        });
        let copied = copied.map_err(|error: CopyError| error.of_part(part))?;
        let known = parts.get(part);
        if known.map(|part| part.bytes) != Some(copied.1) {
            return Err(in_part(io::Error::other("it has changed since it was looked at").into()));
        }
        start = u32::saturating_add(start, known.map_or(0, |part| part.frames));
    }
    writer.finish()?;
    Ok(Concatenated { bytes: record.offset, frames: frame_count, gops: record.gops.len() as u32, order })
}

/// Why copying ends.
enum CopyError {
    Part(PartError),
    Write(Error),
}

impl CopyError {
    fn of_part(self, part: usize) -> ConcatError {
        match self {
            Self::Part(error) => ConcatError::Part { part, error },
            Self::Write(error) => ConcatError::Write(error),
        }
    }
}

impl From<PartError> for CopyError {
    fn from(error: PartError) -> Self {
        Self::Part(error)
    }
}

impl From<StreamError> for CopyError {
    fn from(error: StreamError) -> Self {
        Self::Part(error.into())
    }
}

/// Writes a unit of a part whose frame 0 is frame `start` of the stream. What describes a whole stream is written again.
fn copy(
    writer: &mut UnitWriter<'_>,
    (profile, unit): (Profile, &Unit<'_>),
    start: u32,
) -> Result<(), CopyError> {
    let id = unit.header.id();
    let id = UnitId { frame: id.frame.saturating_add(start), ..id };
    let written = match id.unit_type {
        UnitType::SequenceParameters
        | UnitType::SceneDescription
        | UnitType::OperatingPoints
        | UnitType::Index
        | UnitType::End => Ok(()),
        UnitType::GopHeader => {
            let header = GopHeader::parse_payload(unit.payload, unit.payload_at, profile)?;
            writer.gop(&header, id.frame)
        }
        UnitType::User(_) | UnitType::Reserved(_) if Shard::of(unit).is_some() => Ok(()),
        UnitType::User(_) | UnitType::Reserved(_) => writer.unit_as_it_is(&unit.header, unit.payload),
        _ => GopSink::unit(writer, id, unit.payload.to_vec()),
    };
    written.map_err(CopyError::Write)
}
