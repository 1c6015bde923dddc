//! C.10 for clients: what initialisation segments say, and the units in the ranges of bytes that were fetched.

use crate::division::Place;
use crate::representation::Representation;
use crate::unpackage::file::{self, Media};
use splatstream_format::Result;
use splatstream_format::syntax::SequenceParameters;

/// What a client knows of a Representation before its first subsegment.
///
/// ```
/// use splatstream_stream::segments::Initialization;
///
/// /// The start of a stream, and the units of some subsegments of several Representations, for a decoder.
/// fn units(inits: &[&[u8]], fetched: &[(usize, &[u8])]) -> splatstream_format::Result<Vec<u8>> {
///     let mut known = Vec::new();
///     for init in inits {
///         known.push(Initialization::parse(init)?);
///     }
///     let mut stream = known.first().map_or(Vec::new(), |base| base.head().to_vec());
///     let mut samples = Vec::new();
///     for (representation, bytes) in fetched {
///         samples.extend(known[*representation].samples(bytes)?);
///     }
///     samples.sort_by_key(|(place, _)| *place);
///     samples.iter().for_each(|(_, units)| stream.extend_from_slice(units));
///     Ok(stream)
/// }
/// assert!(units(&[b"no file"], &[]).is_err());
/// ```
#[derive(Debug, Clone)]
pub struct Initialization {
    representation: Representation,
    refinements: u8,
    head: Vec<u8>,
    sequence: SequenceParameters,
}

impl Initialization {
    /// Reads `ftyp` and `moov`.
    ///
    /// # Errors
    /// Malformed boxes, or a movie that C.4 does not allow.
    pub fn parse(bytes: &[u8]) -> Result<Self> {
        let media = Media::parse(bytes)?;
        let sequence = file::sequence(media.head, media.head_at)?;
        let Media { representation, refinements, head, .. } = media;
        Ok(Self { representation, refinements, head: head.to_vec(), sequence })
    }

    /// Whose it is.
    pub const fn representation(&self) -> Representation {
        self.representation
    }

    /// The file header and the units before the first GOP: what a decoder is given first.
    pub fn head(&self) -> &[u8] {
        &self.head
    }

    /// The sequence parameters.
    pub const fn sequence(&self) -> &SequenceParameters {
        &self.sequence
    }

    /// The samples in whole levels of one subsegment or of several, from the first level of each on, with their places.
    /// Offsets of errors count from the first of the bytes.
    ///
    /// # Errors
    /// Malformed boxes, samples that are not in the bytes, and times that no frame has.
    pub fn samples<'a>(&self, bytes: &'a [u8]) -> Result<Vec<(Place, &'a [u8])>> {
        let mut media = Media::empty(self.representation, self.refinements);
        media.read(bytes)?;
        let places = media.places_of_levels(&self.sequence)?;
        Ok(places.into_iter().map(|(place, part)| (place, part.bytes)).collect())
    }
}
