//! C.10: the files of a package become the stream again, byte for byte; those of a package that has not ended, a stream of what
//! is there.

pub(crate) mod file;

use crate::division::{Division, Piece};
use crate::ending::end_here;
use crate::representation::Representation;
use core::fmt;
use file::Media;
use splatstream_format::syntax::SequenceParameters;
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
