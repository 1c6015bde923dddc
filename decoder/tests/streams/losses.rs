//! Clauses 7.1.4 to 7.1.6: what errors cost.

use crate::write::{Part, Plan, Script, decoded};
use splatstream_decoder::process::{DecodedFrame, Options};
use splatstream_decoder::stream::Summary;
use splatstream_format::Class;
use splatstream_format::syntax::{UnitHeader, UnitId, UnitType};
use std::ops::RangeInclusive;

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
            assert_eq!(frame.is_lost, kept == 0);
            let exact = frame.planes.len() - frame.carried;
            if !shows_lower {
                assert_eq!(frame.planes.part(0..exact), whole.planes.part(0..exact), "{id:?}");
            }
        }
    }
}

#[test]
fn increments_in_the_wrong_place_cost_what_the_state_says() {
    let script = Plan::predicted(2).script();
    let at = |frame, s, r, t| script.find(UnitId::of_increment(frame, r).on_layers(s, t));
    let swapped = |a: usize, b: usize| {
        let mut script = script.clone();
        script.parts.swap(a, b);
        decode(&script.bytes())
    };
    // (0, 1) before (0, 0): the first is out of order, which costs all lists of the frame.
    let (summary, frames) = swapped(at(0, 0, 0, 0), at(0, 0, 1, 0));
    assert_eq!(
        (codes(&summary), levels(&frames[..2]).to_vec()),
        (vec!["UNEXPECTED_UNIT"], vec![(0, 0), (1, 0)])
    );
    // List 2 of a P frame before list 1: list 0 stays.
    let (summary, frames) = swapped(at(2, 1, 1, 0), at(2, 1, 2, 0));
    assert_eq!((codes(&summary), frames[2].level, frames[3].level), (vec!["UNEXPECTED_UNIT"], 1, 1));
    // An increment of another frame changes nothing, and it is missed in its own.
    let (summary, frames) = swapped(at(1, 1, 2, 1), at(2, 1, 2, 0));
    assert_eq!(codes(&summary), ["MISMATCH", "MISMATCH"]);
    assert_eq!((frames[1].level, frames[2].level), (2, 2));
    // After the last frame there is no frame in progress.
    let mut late = script.clone();
    let increment = late.parts[at(2, 1, 2, 0)].clone();
    let codebook = late.parts[late.indices(UnitType::Codebook)[0]].clone();
    let next_gop = late.indices(UnitType::GopHeader)[1] - 1;
    late.parts.splice(next_gop..next_gop, [codebook, increment]);
    let (summary, frames) = decode(&late.bytes());
    assert_eq!((codes(&summary), frames.len()), (vec!["UNEXPECTED_UNIT"], 7));
}

#[test]
fn an_intra_frame_without_increments_is_lost_and_so_are_frames_without_reference() {
    let script = Plan::predicted(3).script();
    let is_of = |frame: u32, types: &'static [UnitType]| {
        let script = &script;
        move |index: usize| {
            let id = script.parts[index].id;
            id.frame == frame && types.contains(&id.unit_type)
        }
    };
    let (summary, frames) = decode(&script.without(is_of(0, &[UnitType::Increment])).bytes());
    assert_eq!(codes(&summary), ["CONSTRAINT"]);
    assert!(frames[..4].iter().all(|frame| frame.is_lost && frame.planes.is_empty()));
    assert!(frames[4..].iter().all(|frame| frame.level == 3));
    // Frames 1, 2 and 3 refer to frame 0, 0 and 2; only what refers to an absent frame is an error.
    let header = [UnitType::FrameHeader, UnitType::Increment];
    let (summary, frames) =
        decode(&script.without(is_of(0, &[UnitType::FrameHeader, UnitType::Increment])).bytes());
    assert_eq!(codes(&summary), ["UNDEFINED", "UNDEFINED"], "{header:?}");
    assert_eq!(levels(&frames[..3]), [(1, 0), (2, 0), (3, 0)]);
    assert!(frames[..3].iter().all(|frame| frame.is_lost) && frames[3].level == 3);
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

/// What a fatal error costs: display indices of the frames that come, and of those that are lost.
fn outcome(bytes: &[u8]) -> (Vec<&'static str>, Vec<u32>, Vec<RangeInclusive<u32>>) {
    let (summary, frames) = decode(bytes);
    (codes(&summary), frames.iter().map(|frame| frame.index).collect(), summary.lost)
}

#[test]
fn a_fatal_error_costs_the_rest_of_its_gop() {
    let script = Plan { gops: vec![3, 3, 3], ..Plan::intra(5) }.script();
    let gops = script.indices(UnitType::GopHeader);
    let frames = script.indices(UnitType::FrameHeader);
    let case = |part| outcome(&damaged(&script, part));
    assert_eq!(case(frames[4]), (vec!["CHECKSUM"], vec![0, 1, 2, 3, 6, 7, 8], vec![4..=5]));
    assert_eq!(case(gops[1] + 1), (vec!["CHECKSUM"], vec![0, 1, 2, 6, 7, 8], vec![3..=5]));
    assert_eq!(case(gops[1]), (vec!["CHECKSUM"], vec![0, 1, 2, 6, 7, 8], vec![3..=5]));
    assert_eq!(case(frames[8]), (vec!["CHECKSUM"], (0..8).collect(), vec![8..=8]));
    // The copies of the sequence parameters make up for the first, but not for its GOP.
    assert_eq!(case(0), (vec!["CHECKSUM"], (3..9).collect(), vec![0..=2]));
    // A unit that no decoder of this version knows.
    let mut unknown = script.clone();
    let private = Part::new(UnitId::of_frame(UnitType::User(200), 77), vec![1, 2, 3]);
    unknown.parts.insert(frames[4] + 1, private);
    assert_eq!(outcome(&unknown.bytes()), (Vec::new(), (0..9).collect(), Vec::new()));
    // Two errors, one after the other.
    let mut both = damaged(&script, frames[1]);
    both[script.offsets()[frames[5]] + UnitHeader::SIZE] ^= 1;
    assert_eq!(outcome(&both), (vec!["CHECKSUM"; 2], vec![0, 3, 4, 6, 7, 8], vec![1..=2, 5..=5]));
}

#[test]
fn after_a_wrong_unit_header_decoding_goes_on_with_the_next_gop_header() {
    let script = Plan { gops: vec![3, 3, 3], ..Plan::intra(6) }.script();
    let offsets = script.offsets();
    let frames = script.indices(UnitType::FrameHeader);
    let with = |edit: &dyn Fn(&mut Vec<u8>)| {
        let mut bytes = script.bytes();
        edit(&mut bytes);
        outcome(&bytes)
    };
    let lost = (vec!["CHECKSUM"], vec![0, 3, 4, 5, 6, 7, 8], vec![1..=2]);
    // Any bit of a header.
    for byte in 0..UnitHeader::SIZE {
        assert_eq!(with(&|bytes| bytes[offsets[frames[1]] + byte] ^= 4), lost, "{byte}");
    }
    // Bytes that are no unit, and bytes that are missing. The frame in progress is output.
    let inserted = with(&|bytes| _ = bytes.splice(offsets[frames[2]]..offsets[frames[2]], [9; 50]));
    assert_eq!(inserted, (vec!["CHECKSUM"], vec![0, 1, 3, 4, 5, 6, 7, 8], vec![2..=2]));
    let (codes, indices, lost) = with(&|bytes| _ = bytes.drain(offsets[frames[2]] - 9..offsets[frames[2]]));
    assert_eq!((codes.len(), indices, lost), (2, vec![0, 1, 3, 4, 5, 6, 7, 8], vec![2..=2]));
    // Whole GOPs are missing: an error, but nothing else is lost.
    let gops = script.indices(UnitType::GopHeader);
    let gone = script.without(|index| (gops[1]..gops[2] - 1).contains(&index));
    assert_eq!(outcome(&gone.bytes()), (vec!["MISMATCH"], vec![0, 1, 2, 6, 7, 8], vec![3..=5]));
    // A GOP again: it starts nothing new.
    let mut twice = script.clone();
    let again: Vec<Part> = script.parts[gops[0]..gops[1] - 1].to_vec();
    twice.parts.splice(gops[1] - 1..gops[1] - 1, again);
    assert_eq!(outcome(&twice.bytes()), (vec!["MISMATCH"], (0..9).collect(), Vec::new()));
}

#[test]
fn frames_that_are_missing_in_an_all_intra_gop_are_lost_alone() {
    let script = Plan { gops: vec![4, 2], ..Plan::intra(7) }.script();
    let without = |frames: RangeInclusive<u32>| {
        let is_lost = |index: usize| {
            let id = script.parts[index].id;
            let is_of_frame = matches!(id.unit_type, UnitType::FrameHeader | UnitType::Increment);
            is_of_frame && frames.contains(&id.frame)
        };
        outcome(&script.without(is_lost).bytes())
    };
    assert_eq!(without(1..=2), (vec!["MISMATCH"], vec![0, 3, 4, 5], vec![1..=2]));
    assert_eq!(without(3..=3), (vec!["MISMATCH"], vec![0, 1, 2, 4, 5], vec![3..=3]));
    assert_eq!(without(0..=3), (vec!["MISMATCH"], vec![4, 5], vec![0..=3]));
    assert_eq!(without(3..=4), (vec!["MISMATCH"; 2], vec![0, 1, 2, 5], vec![3..=4]));
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
