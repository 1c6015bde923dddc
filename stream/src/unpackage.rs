//! C.10: the files of a package become the stream again, byte for byte; those of a package that has not ended, a stream of what
//! is there.

pub(crate) mod file;

use crate::division::{Division, Piece};
use crate::representation::Representation;
use core::fmt;
use file::Media;
use splatstream_format::syntax::{EndOfStream, SequenceParameters, UnitHeader, UnitId, UnitType};
use splatstream_format::unit::Stream;
use splatstream_format::{Error, ErrorKind, Limits};

/// What is wrong with a file of a package.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileError {
    /// The name of the file that was given, or of the stream that came out.
    pub file: String,
    /// Where, which clause, what.
    pub error: Error,
}

impl fmt::Display for FileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.file, self.error)
    }
}

impl std::error::Error for FileError {}

/// The stream that a package was made of. `files` are the names and the bytes of all its files of media, in any order.
///
/// # Errors
/// Files that are damaged, incomplete or not those of one package; and one whose samples are not divided as clause C.3
/// says: nothing else than that stream would have given this package.
pub fn unpackage(files: &[(String, &[u8])], limits: &Limits) -> Result<Vec<u8>, FileError> {
    put_together(files, limits, true)
}

/// The stream of the GOPs of a live package that has not ended, with an end unit that is made for it as clause 7.11 makes those
/// of extracted streams, and without a number of frames in its sequence parameters. `files` have complete GOPs only.
///
/// # Errors
/// As [`unpackage`], and a package that has ended.
pub fn unpackage_growing(files: &[(String, &[u8])], limits: &Limits) -> Result<Vec<u8>, FileError> {
    put_together(files, limits, false)
}

/// The stream in some files, which have its end or do not.
fn put_together(files: &[(String, &[u8])], limits: &Limits, has_ended: bool) -> Result<Vec<u8>, FileError> {
    let mut media = Vec::new();
    for (name, bytes) in files {
        let parsed = Media::parse(bytes).map_err(|error| FileError { file: name.clone(), error })?;
        media.push((name.as_str(), parsed));
    }
    media.sort_by_key(|(_, one)| one.representation);
    let base = check_set(&media, has_ended)?;
    let mut samples = Vec::new();
    for (name, one) in &media {
        let in_file = |error| FileError { file: (*name).to_owned(), error };
        for (place, part) in one.places(&base.sequence).map_err(in_file)? {
            samples.push((place, part, *name));
        }
    }
    samples.sort_by_key(|(place, ..)| *place);
    let mut stream = base.head.to_vec();
    for (_, part, _) in &samples {
        stream.extend_from_slice(part.bytes);
    }
    stream.extend_from_slice(base.tail);
    let in_stream = |error| FileError { file: "the stream in the package".to_owned(), error };
    if !has_ended {
        end_here(&mut stream, limits).map_err(in_stream)?;
    }
    let whole = Division::of(&stream, limits).map_err(in_stream)?;
    let pieces = whole.gops.iter().flat_map(|gop| &gop.pieces);
    check_division(pieces, &samples)?;
    Ok(stream)
}

/// Ends a stream that has no end unit: with one that counts frames and units, and knows no index, since those that a stream may
/// have come after its last GOP. Sequence parameters announce no frames any more, as not all that they announced are there.
fn end_here(stream: &mut Vec<u8>, limits: &Limits) -> splatstream_format::Result<()> {
    let mut end = EndOfStream { frame_count: 0, unit_count: 0, index_offset: 0 };
    let mut changed = Vec::new();
    let opened = Stream::open(stream, limits)?;
    let profile = opened.header().profile();
    let mut units = opened.units();
    let whole = u64::try_from(stream.len()).unwrap_or(u64::MAX);
    while let Some(unit) = units.next_unit() {
        let unit = match unit {
            // What is missed there is the unit that is made here.
            Err(error) if error.at == whole => break,
            unit => unit?,
        };
        let kind = unit.header.unit_type();
        end.frame_count = end.frame_count.saturating_add(u32::from(kind == UnitType::FrameHeader));
        end.unit_count = end.unit_count.saturating_add(1);
        if kind == UnitType::SequenceParameters {
            let sequence = SequenceParameters::parse_payload(unit.payload, unit.payload_at, profile)?;
            let payload = SequenceParameters { frame_count: 0, ..sequence }.to_bytes()?;
            changed.push((unit.at, whole_unit(kind, &payload)?));
        }
    }
    for (at, bytes) in changed {
        let place = usize::try_from(at).ok().and_then(|at| stream.get_mut(at..)?.get_mut(..bytes.len()));
        place.into_iter().for_each(|place| place.copy_from_slice(&bytes));
    }
    stream.extend(whole_unit(UnitType::End, &end.to_bytes()?)?);
    Ok(())
}

/// Header and payload of a unit that is of the whole stream.
fn whole_unit(kind: UnitType, payload: &[u8]) -> splatstream_format::Result<Vec<u8>> {
    let header = UnitHeader::new(UnitId::stream(kind), payload)?;
    Ok([&header.to_bytes()?[..], payload].concat())
}

/// What the base Representation carries for all.
struct Base<'a> {
    head: &'a [u8],
    tail: &'a [u8],
    sequence: SequenceParameters,
}

/// The files are those of one package, as far as their heads can tell.
fn check_set<'a>(media: &[(&str, Media<'a>)], has_ended: bool) -> Result<Base<'a>, FileError> {
    let none = FileError {
        file: "the package".to_owned(),
        error: Error::new(
            0,
            "C.3",
            ErrorKind::Constraint { rule: "a package has a file of Representation s0" },
        ),
    };
    let Some((name, base)) =
        media.first().filter(|(_, one)| one.representation == Representation::Spatial(0))
    else {
        return Err(none);
    };
    let refused = |file: &str, at, clause, rule| {
        let error = Error::new(at, clause, ErrorKind::Constraint { rule });
        Err(FileError { file: file.to_owned(), error })
    };
    let mut before = None;
    for (name, one) in media {
        if before == Some(one.representation) {
            return refused(name, one.head_at, "C.3", "two files are of the same Representation");
        }
        if one.head != base.head {
            return refused(name, one.head_at, "C.4.2", "the units in gssC are those of Representation s0");
        }
        if one.tail.is_some() != (before.is_none() && has_ended) {
            let rule = match has_ended {
                true => "Representation s0 has gssT, and no other has",
                false => "a package that has not ended has no gssT",
            };
            return refused(name, 0, "C.6", rule);
        }
        before = Some(one.representation);
    }
    let sequence = file::sequence(base.head, base.head_at)
        .map_err(|error| FileError { file: (*name).to_owned(), error })?;
    if media.iter().any(|(_, one)| one.refinements != sequence.refinement_count) {
        return refused(name, base.head_at, "C.4.2", "the refinement_count of gssC is that of the sequence");
    }
    Ok(Base { head: base.head, tail: base.tail.unwrap_or_default(), sequence })
}

/// Every sample is a piece of the stream, and every piece is a sample.
fn check_division<'a>(
    mut pieces: impl Iterator<Item = &'a Piece>,
    samples: &[(crate::division::Place, file::Part<'_>, &str)],
) -> Result<(), FileError> {
    for (place, part, name) in samples {
        let length = u64::try_from(part.bytes.len()).unwrap_or(u64::MAX);
        let piece = pieces.next();
        let same = piece
            .is_some_and(|piece| piece.place == *place && piece.end.saturating_sub(piece.start) == length);
        if !same {
            let rule = "a sample has the units of its frame, Representation and refinement";
            let error = Error::new(part.at, "C.3", ErrorKind::Constraint { rule });
            return Err(FileError { file: (*name).to_owned(), error });
        }
    }
    Ok(())
}
