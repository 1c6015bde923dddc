//! Clauses 7.1.4 to 7.1.6: what errors cost, wherever they are. Single cases are vectors (`loss`, `order`).

use crate::write::{Plan, Script, decoded};
use splatstream_decoder::operating_point::{OperatingPoint, extract};
use splatstream_decoder::process::{DecodedFrame, Options};
use splatstream_decoder::stream::Summary;
use splatstream_format::syntax::{UnitHeader, UnitType};
use splatstream_format::{Class, Limits};

fn codes(summary: &Summary) -> Vec<&'static str> {
    summary.errors.iter().map(|error| error.kind.code()).collect()
}

fn decode(bytes: &[u8]) -> (Summary, Vec<DecodedFrame>) {
    decoded(bytes, &Options::default())
}

/// Display index and exact lists of each frame.
fn levels(frames: &[DecodedFrame]) -> Vec<(u32, u8)> {
    frames.iter().map(|frame| (frame.index, frame.level)).collect()
}

/// The stream with a flipped bit in the payload of a part.
fn damaged(script: &Script, part: usize) -> Vec<u8> {
    let mut bytes = script.bytes();
    bytes[script.offsets()[part] + UnitHeader::SIZE] ^= 1;
    bytes
}

/// A stream of one I frame too: there is no other frame to compare it with.
#[test]
fn what_a_cut_costs_a_frame_is_said_of_it() {
    let percents = vec![10, 20, 50, 100];
    let layered = Plan { percents: percents.clone(), ..Plan::predicted(1) };
    let alone = Plan { percents, gops: vec![1], ..Plan::intra(1) };
    for plan in [layered, alone] {
        let script = plan.script();
        let (bytes, starts) = (script.bytes(), script.offsets());
        let (_, whole) = decode(&bytes);
        assert!(whole.iter().all(|frame| !frame.is_reduced));
        let mut reduced = 0;
        for cut in starts.iter().flat_map(|&start| [start, start + UnitHeader::SIZE + 1]) {
            let (summary, frames) = decode(&bytes[..cut]);
            assert_eq!(codes(&summary), ["TRUNCATED"]);
            for (frame, whole) in frames.iter().zip(&whole) {
                assert_eq!(frame.is_reduced, frame.planes != whole.planes, "frame {} at {cut}", frame.index);
                reduced += u32::from(frame.is_reduced && !frame.is_lost);
            }
        }
        assert!(reduced > 5, "{reduced} frames shown in part");
    }
}

/// A point below the cut is whole all the same.
#[test]
fn a_frame_that_has_what_its_point_asks_for_is_not_reduced() {
    let script = Plan { gops: vec![1], ..Plan::intra(1) }.script();
    let increments = script.indices(UnitType::Increment);
    let bytes = script.bytes();
    let cut = &bytes[..script.offsets()[increments[2]] + UnitHeader::SIZE + 1];
    for (refinement, is_reduced) in [(0, false), (1, false), (2, true)] {
        let operating_point = OperatingPoint { refinement, ..OperatingPoint::ALL };
        let (_, frames) = decoded(cut, &Options { operating_point, ..Options::default() });
        let found: Vec<_> = frames.iter().map(|frame| (frame.level, frame.is_reduced)).collect();
        assert_eq!(found, [(refinement.min(1) + 1, is_reduced)]);
    }
    // What was extracted says nothing of its point before its last frame: who knows it asks for it.
    let point = OperatingPoint { refinement: 1, ..OperatingPoint::ALL };
    let extracted = extract(&bytes, point, &Limits::default()).unwrap();
    let end = script.offsets()[increments[2]];
    assert_eq!(extracted[..end], bytes[..end]);
    for (operating_point, is_reduced) in [(point, false), (OperatingPoint::ALL, true)] {
        let (_, frames) = decoded(&extracted[..end], &Options { operating_point, ..Options::default() });
        assert_eq!((frames[0].level, frames[0].is_reduced), (2, is_reduced));
    }
}

#[test]
fn a_damaged_increment_costs_its_list_and_those_after_it() {
    let script = Plan { percents: vec![10, 20, 50, 100], ..Plan::predicted(1) }.script();
    let (_, whole) = decode(&script.bytes());
    assert_eq!(levels(&whole), [(0, 4), (1, 4), (2, 4), (3, 4), (4, 4), (5, 4), (6, 4)]);
    for part in script.indices(UnitType::Increment) {
        let id = script.parts[part].id;
        let (summary, frames) = decode(&damaged(&script, part));
        assert_eq!((codes(&summary), summary.lost), (vec!["CHECKSUM"], Vec::new()), "{id:?}");
        let is_anchor = id.frame == 0 || id.frame == 4;
        for (frame, whole) in frames.iter().zip(&whole) {
            let same_gop = (frame.index < 4) == (id.frame < 4);
            let depends = same_gop
                && match (is_anchor, id.frame % 4, frame.index % 4) {
                    (true, ..) => true,
                    // Frame 2 is the only one to which another refers.
                    (_, 2, 3) => true,
                    (_, lost, index) => lost == index,
                };
            // Where the lowest spatial layer of the I frame has the list, it is shown in place of the higher one.
            let shows_lower = is_anchor && id.spatial_layer == 1 && frame.index == id.frame;
            let expected = if depends && !shows_lower { id.refinement } else { 4 };
            assert_eq!(frame.level, expected, "{id:?} {}", frame.index);
            // Nothing has to be missing: carried lists stand in for exact ones, as far as the I frame has them.
            let kept = if is_anchor && id.spatial_layer == 0 && same_gop { id.refinement } else { 4 };
            assert_eq!(frame.level + frame.carried_lists, kept, "{id:?} {}", frame.index);
            assert_eq!((frame.is_lost, frame.is_reduced), (kept == 0, depends), "{id:?} {}", frame.index);
            let exact = frame.planes.len() - frame.carried;
            if !shows_lower {
                assert_eq!(frame.planes.part(0..exact), whole.planes.part(0..exact), "{id:?}");
            }
        }
    }
}

#[test]
fn a_frame_without_increments_is_carried() {
    let script = Plan::predicted(4).script();
    let emptied = script.without(|index| {
        let id = script.parts[index].id;
        id.unit_type == UnitType::Increment && id.frame == 2
    });
    let (summary, frames) = decode(&emptied.bytes());
    assert_eq!(codes(&summary), [""; 0]);
    let shown = |frame: &DecodedFrame| (frame.level, frame.carried_lists, frame.is_lost);
    assert_eq!(
        frames[..4].iter().map(shown).collect::<Vec<_>>(),
        [(3, 0, false), (3, 0, false), (0, 3, false), (0, 3, false)]
    );
    assert_eq!(frames[2].planes.len(), frames[0].planes.len(), "nothing replaces what is stale");
}

#[test]
fn a_stream_cut_anywhere_is_truncated_and_gives_what_was_complete() {
    let small = |plan| Plan { gops: vec![3], percents: vec![50, 100], gaussians: 10, ..plan };
    for plan in [small(Plan::intra(8)), small(Plan::predicted(8))] {
        let bytes = plan.script().bytes();
        let (_, whole) = decode(&bytes);
        let stop = Options { stop_at_first_error: true, ..Options::default() };
        for length in 0..bytes.len() {
            let (summary, frames) = decoded(&bytes[..length], &stop);
            assert_eq!(summary.verdict().unwrap().class(), Class::Truncated, "{length}");
            assert!(whole.starts_with(&frames), "{length}");
            let (summary, all) = decode(&bytes[..length]);
            assert_eq!(summary.errors.len(), 1, "{length}");
            assert!(all.len() <= frames.len() + 1 && all.starts_with(&frames), "{length}");
        }
    }
}
