//! What is requested for a fetch.

use crate::control::{Fetch, Ladder};
use crate::manifest::Manifest;
use crate::playback::parts::{Kind, Part, parts, requests};
use std::collections::BTreeSet;

/// How a player sends fetches.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Requests {
    /// As one request, whatever ranges they have.
    #[default]
    Together,
    /// As the client of this crate does for the package that a manifest describes, whose ladder is simulated: initialisation
    /// segments besides, a request for ranges of a file that nearly touch, each after the one before has ended.
    OfClient(Box<Manifest>),
}

/// A request of a fetch.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Request(Vec<Piece>);

/// Bytes that are of use when the last one is there.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Piece {
    /// Bytes before it that nobody wants.
    gap: u64,
    bytes: u64,
    /// The Representation whose initialisation segment it is, of which the session does not know.
    init: Option<usize>,
}

impl Request {
    pub(super) fn bytes(&self) -> u64 {
        self.ends().last().unwrap_or(0)
    }

    /// Where something new has arrived.
    pub(super) fn ends(&self) -> impl Iterator<Item = u64> {
        self.0.iter().scan(0_u64, |end, piece| {
            *end = end.saturating_add(piece.gap).saturating_add(piece.bytes);
            Some(*end)
        })
    }

    /// Those of its first bytes that the session counts.
    pub(super) fn counted(&self, bytes: u64) -> u64 {
        let own = self.0.iter().zip(self.ends()).filter(|(piece, _)| piece.init.is_none());
        own.map(|(piece, end)| bytes.saturating_sub(end.saturating_sub(piece.bytes)).min(piece.bytes)).sum()
    }

    /// Representations whose initialisation segments are in its first bytes.
    pub(super) fn inits(&self, bytes: u64) -> impl Iterator<Item = usize> {
        self.0
            .iter()
            .zip(self.ends())
            .filter(move |(_, end)| *end <= bytes)
            .filter_map(|(piece, _)| piece.init)
    }
}

impl Requests {
    /// Those of a fetch, where some initialisation segments are there; none if it has no bytes.
    pub(super) fn of(&self, fetch: &Fetch, ladder: &Ladder, inits: &BTreeSet<usize>) -> Vec<Request> {
        match self {
            Self::Together => together(fetch, ladder),
            Self::OfClient(manifest) => {
                let mut wanted = parts(manifest, fetch, |representation| !inits.contains(&representation));
                let requests = requests(&mut wanted);
                let mut pieces = wanted.iter().filter(|part| part.range.size > 0).map(piece);
                requests.iter().map(|request| taken(&mut pieces, request.size)).collect()
            }
        }
    }
}

fn together(fetch: &Fetch, ladder: &Ladder) -> Vec<Request> {
    let gop = ladder.gops().get(fetch.gop());
    let pieces = fetch.ranges().iter().flat_map(|range| {
        let all = gop.map_or(&[][..], |gop| gop.pieces(range.representation));
        all.get(usize::from(range.from)..usize::from(range.to)).unwrap_or_default()
    });
    let request = Request(pieces.map(|piece| Piece { gap: 0, bytes: piece.bytes, init: None }).collect());
    if request.bytes() > 0 { vec![request] } else { Vec::new() }
}

fn piece(part: &Part) -> Piece {
    let init = matches!(part.kind, Kind::Init).then_some(part.representation);
    Piece { gap: part.gap, bytes: part.range.size, init }
}

/// As many pieces as a request of so many bytes has.
fn taken(pieces: &mut impl Iterator<Item = Piece>, size: u64) -> Request {
    let mut request = Request::default();
    while request.bytes() < size
        && let Some(piece) = pieces.next()
    {
        request.0.push(piece);
    }
    request
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::{Decision, Layered, Session, Settings};
    use crate::package::{Options, Package};
    use splatstream_format::Limits;

    /// What is requested first of the stream of annex E.
    fn first(inits: &BTreeSet<usize>) -> (Manifest, Vec<Request>, Vec<Request>) {
        let stream = include_bytes!("../../../spec/data/worked-temporal-example.gss");
        let package = Package::of(stream, &Options::default(), &Limits::default()).expect("it conforms");
        let ladder = package.manifest.ladder().expect("it is complete");
        let mut session = Session::new(ladder.clone(), Settings::default(), Layered::default(), 0);
        let Decision::Fetch(fetch) = session.decide(0) else { panic!("there is nothing to wait for") };
        let client = Requests::OfClient(Box::new(package.manifest.clone()));
        let (apart, together) =
            (client.of(&fetch, &ladder, inits), Requests::Together.of(&fetch, &ladder, inits));
        (package.manifest, apart, together)
    }

    #[test]
    fn initialisation_segments_come_with_the_first_levels() {
        let (manifest, apart, together) = first(&BTreeSet::new());
        let inits: Vec<usize> = apart.iter().flat_map(|request| request.inits(request.bytes())).collect();
        // s0, t0 and t1; s1 is for later.
        assert_eq!((inits, apart.len(), together.len()), (vec![0, 2, 3], 3, 1));
        let init = manifest.representations[0].init.size;
        let base = &apart[0];
        assert_eq!((base.inits(init - 1).count(), base.inits(init).count(), base.counted(init)), (0, 1, 0));
        let counted: u64 = apart.iter().map(|request| request.counted(request.bytes())).sum();
        assert_eq!(counted, together[0].bytes());
        assert_eq!(together[0].counted(7), 7);
    }

    #[test]
    fn initialisation_segments_come_once() {
        let (_, apart, together) = first(&(0..4).collect());
        assert!(apart.iter().all(|request| request.inits(u64::MAX).count() == 0));
        assert_eq!(apart.iter().map(Request::bytes).sum::<u64>(), together[0].bytes());
    }
}
