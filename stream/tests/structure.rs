//! The structure of streams, told from headers: what units need, and which frames are missing.
#![allow(
    clippy::unwrap_used,
    clippy::arithmetic_side_effects,
    missing_docs,
    reason = "a panic is a failed test"
)]

use splatstream_format::Limits;
use splatstream_stream::structure::{Frame, Structure, add_run};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

const STREAM: &[u8] = include_bytes!("../../spec/data/worked-temporal-example.gss");
const EVERYTHING: (u8, u8, u8) = (u8::MAX, u8::MAX, u8::MAX);

fn structure(bytes: &[u8]) -> Structure {
    Structure::of(bytes, &Limits::default())
}

/// The frames of a stream.
fn frames(structure: &Structure) -> Vec<&Frame> {
    structure.gops.iter().flat_map(|gop| &gop.frames).collect()
}

/// All valid streams of the conformance suite.
fn streams() -> Vec<PathBuf> {
    let areas =
        fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("../conformance/vectors/valid")).unwrap();
    let vectors = areas.flat_map(|area| fs::read_dir(area.unwrap().path()).unwrap());
    vectors.map(|vector| vector.unwrap().path().join("in.gss")).filter(|path| path.is_file()).collect()
}

#[test]
fn what_a_unit_needs_stands_before_it() {
    let mut needs = 0;
    for path in streams() {
        let structure = structure(&fs::read(&path).unwrap());
        assert!(structure.error.is_none(), "{}: {:?}", path.display(), structure.error);
        for gop in &structure.gops {
            for frame in &gop.frames {
                for increment in &frame.increments {
                    let tools = &increment.tools;
                    let tools = tools.codebooks.iter().chain(&tools.weights).chain(&frame.transforms);
                    let needed = structure.needs(gop, frame, increment);
                    needs += needed.len();
                    // What was extracted may lack what it does not need to be there, but never has it later.
                    let units = needed.iter().filter_map(|need| need.unit.as_ref());
                    for unit in units.chain(tools) {
                        assert!(*unit < increment.span.unit, "{}: {}", path.display(), increment.span.unit);
                    }
                }
            }
        }
    }
    assert!(needs > 3000, "{needs}");
}

#[test]
fn units_lie_where_the_structure_says() {
    let structure = structure(STREAM);
    assert_eq!((structure.gops.len(), frames(&structure).len()), (1, 3));
    let gop = &structure.gops[0];
    let mut spans: Vec<_> = gop.tools.iter().map(|tool| tool.span).chain([gop.span]).collect();
    for frame in &gop.frames {
        spans.push(frame.span);
        spans.extend(frame.increments.iter().map(|increment| increment.span));
        assert_eq!(gop.frame(frame.index).unwrap().span.at, frame.span.at);
    }
    spans.sort_by_key(|span| span.at);
    assert!(spans.len() > 8 && spans.iter().all(|span| !span.damaged));
    assert!(
        spans
            .windows(2)
            .all(|pair| pair[0].unit + 1 == pair[1].unit && pair[0].at + pair[0].bytes == pair[1].at)
    );
    assert!(spans.last().is_some_and(|last| last.at + last.bytes <= STREAM.len() as u64));
}

#[test]
fn a_frame_whose_units_are_gone_is_missing() {
    // One that lists its operating points: without them nobody knows of which layer a frame was.
    let stream = include_bytes!("../../examples/talk.gss");
    let whole = structure(stream);
    let count = whole.sequence.unwrap().frame_count;
    assert!(!whole.points.is_empty());
    let there =
        |structure: &Structure| frames(structure).iter().map(|frame| frame.index).collect::<BTreeSet<_>>();
    assert_eq!(whole.missing(&there(&whole), Some(count), EVERYTHING), []);
    for frame in frames(&whole) {
        let spans = frame.increments.iter().map(|increment| increment.span).chain([frame.span]);
        let (from, to) =
            spans.fold((u64::MAX, 0), |(from, to), span| (from.min(span.at), to.max(span.at + span.bytes)));
        let cut = [&stream[..from as usize], &stream[to as usize..]].concat();
        let part = structure(&cut);
        let missing = part.missing(&there(&part), Some(count), EVERYTHING);
        assert_eq!(missing, [(frame.index, frame.index)], "frame {}", frame.index);
        // At the lowest temporal layer the others are not missed.
        let lowest = part.missing(&there(&part), Some(count), (0, 0, u8::MAX));
        assert_eq!(lowest.is_empty(), frame.role.temporal_layer > 0, "frame {}", frame.index);
    }
}

#[test]
fn damage_is_named_and_what_is_left_is_told() {
    let whole = structure(STREAM);
    let first = whole.gops[0].span.at as usize;
    for at in first..STREAM.len() {
        let mut bytes = STREAM.to_vec();
        bytes[at] ^= 0x55;
        let damaged = structure(&bytes);
        assert!(damaged.error.is_some(), "byte {at}");
        assert!(frames(&damaged).len() <= 3, "byte {at}");
    }
    for end in 0..STREAM.len() {
        let cut = structure(&STREAM[..end]);
        assert!(frames(&cut).len() <= 3 && cut.points.len() <= whole.points.len());
    }
}

#[test]
fn points_are_those_of_the_list_and_units_those_of_the_end() {
    let stream = include_bytes!("../../examples/talk.gss");
    let whole = structure(stream);
    assert!(whole.has_all_units());
    let last = whole.points_up_to(EVERYTHING).last().unwrap();
    assert_eq!(last, *whole.points.last().unwrap());
    assert_eq!(last.frames, whole.sequence.unwrap().frame_count);
    assert!(last.bytes > 0 && last.bytes < stream.len() as u64);
    let (spatial, temporal, refinement) = last.point;
    assert!(spatial == 0 && temporal > 0 && refinement > 0, "{last:?}");
    for point in [(spatial, temporal, 0), (spatial, 0, refinement)] {
        let listed: Vec<_> = whole.points_up_to(point).map(|listed| listed.point).collect();
        assert!(listed.contains(&point) && listed.len() < whole.points.len(), "{point:?}");
        assert!(listed.iter().all(|one| one.0 <= point.0 && one.1 <= point.1 && one.2 <= point.2));
    }
    // Without one of its units, or the end, it has not all.
    let span = whole.gops[0].frames[0].increments.last().unwrap().span;
    let (from, to) = (span.at as usize, (span.at + span.bytes) as usize);
    assert!(!structure(&[&stream[..from], &stream[to..]].concat()).has_all_units());
    assert!(!structure(&stream[..stream.len() - 1]).has_all_units());
}

#[test]
fn runs_that_touch_are_joined() {
    let mut runs = Vec::new();
    for (first, last) in [(0, 0), (1, 3), (3, 2), (5, 6), (u32::MAX, u32::MAX)] {
        add_run(&mut runs, first, last);
    }
    assert_eq!(runs, [(0, 3), (5, 6), (u32::MAX, u32::MAX)]);
}
