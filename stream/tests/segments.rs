//! C.10: what a client of an operating point has fetched is the units of that point, in the order of the stream.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

mod common;

use common::{files, is_conforming, package, vectors};
use splatstream_format::Limits;
use splatstream_stream::division::{Division, Place};
use splatstream_stream::package::{Layout, Options, Package};
use splatstream_stream::segments::Initialization;

/// What a client has that fetches levels up to a refinement, of Representations that it wants, by ranges of the manifest.
fn fetched(package: &Package<'_>, wants: impl Fn(&Place) -> bool, refinement: usize) -> Vec<u8> {
    let files = files(package);
    let (mut head, mut samples) = (Vec::new(), Vec::new());
    for (info, (_, bytes)) in package.manifest.representations.iter().zip(&files) {
        let init = Initialization::parse(&bytes[..info.init.size as usize]).unwrap();
        assert_eq!(init.representation().to_string(), info.id);
        let whose = Place { frame: 0, representation: init.representation(), refinement: 0 };
        head = init.head().to_vec();
        let subsegments = package.manifest.gops.iter().flat_map(|gop| &gop.subsegments);
        for one in subsegments.filter(|one| one.representation == info.id && wants(&whose)) {
            // One range.
            let (start, last) = (one.levels[0].bytes.offset, &one.levels[refinement].bytes);
            let range = &bytes[start as usize..(last.offset + last.size) as usize];
            let found = init.samples(range).unwrap();
            samples.extend(found.into_iter().map(|(place, units)| (place, units.to_vec())));
        }
    }
    samples.sort_by_key(|(place, _)| *place);
    samples.into_iter().fold(head, |stream, (_, units)| [stream, units].concat())
}

// covers: SS-CR-004, SS-CR-018
#[test]
fn ranges_hold_the_units_of_operating_points() {
    for path in vectors().into_iter().filter(|path| is_conforming(path)).step_by(5) {
        let stream = std::fs::read(&path).unwrap();
        let division = Division::of(&stream, &Limits::default()).unwrap();
        let last = usize::from(division.sequence.refinement_count) - 1;
        for (layout, refinement, layers) in
            [(Layout::Gop, 0, 0), (Layout::Frame, last / 2, 1), (Layout::Gop, last, 3)]
        {
            let package = package(&stream, &Options { layout, ..Options::default() });
            let wants = |place: &Place| place.representation.codes().1 <= layers;
            let pieces = division.gops.iter().flat_map(|gop| &gop.pieces);
            let of_point = pieces
                .filter(|piece| wants(&piece.place) && usize::from(piece.place.refinement) <= refinement);
            let mut expected = stream[..division.head_end as usize].to_vec();
            of_point.for_each(|piece| expected.extend(&stream[piece.start as usize..piece.end as usize]));
            assert!(fetched(&package, wants, refinement) == expected, "{}", path.display());
        }
    }
}
