//! Operating points that change while a stream is decoded.

use super::vectors;
use splatstream::{Decoder, Frame, OperatingPoint, extract};

fn point(text: &str) -> OperatingPoint {
    text.parse().unwrap()
}

fn at(text: &str) -> Vec<Frame> {
    let decoder = Decoder::from_bytes(vectors::talk()).with_operating_point(point(text));
    decoder.map(Result::unwrap).collect()
}

#[test]
fn a_point_decodes_as_the_stream_that_holds_just_it() {
    for text in ["s0,t0,r0", "s0,t1,r1", "s0,t0,r2"] {
        let small = extract(&vectors::talk(), point(text), &Default::default()).unwrap();
        let small: Vec<Frame> = Decoder::from_bytes(small).map(Result::unwrap).collect();
        let frames = at(text);
        assert_eq!(frames.len(), small.len());
        for (frame, small) in frames.iter().zip(&small) {
            assert_eq!((frame.index(), frame.integers()), (small.index(), small.integers()));
            assert_eq!(frame.operating_point(), point(text));
        }
    }
}

#[test]
fn a_higher_point_holds_from_the_next_gop_on() {
    let (low, high) = (at("s0,t0,r0"), at("s0,t1,r2"));
    let mut decoder = Decoder::from_bytes(vectors::talk()).with_operating_point(point("s0,t0,r0"));
    let first = decoder.next_frame().unwrap().unwrap();
    decoder.set_operating_point(OperatingPoint::ALL);
    let rest: Vec<Frame> = decoder.map(Result::unwrap).collect();
    assert_eq!(first.integers(), low[0].integers());
    for frame in rest {
        let expected = if frame.index() < 4 { &low } else { &high };
        let expected = expected.iter().find(|other| other.index() == frame.index()).unwrap();
        assert_eq!(frame.integers(), expected.integers(), "frame {}", frame.index());
    }
}

#[test]
fn a_lower_point_holds_from_a_frame_on_and_drifts_nowhere() {
    let all = at("s0,t1,r2");
    for after in 1..all.len() {
        let mut decoder = Decoder::from_bytes(vectors::talk());
        let mut frames: Vec<Frame> = decoder.by_ref().take(after).map(Result::unwrap).collect();
        decoder.set_operating_point(point("s0,t1,r0"));
        frames.extend(decoder.map(Result::unwrap));
        assert_eq!(frames.len(), all.len(), "no frame is lost");
        for (frame, all) in frames.iter().zip(&all) {
            assert!(frame.warnings().is_empty());
            // The first Gaussians of a frame are those of its first refinement, whatever else is shown.
            let exact = frame.len() - frame.carried();
            // Sizes and opacities make up for what is missing.
            let (mine, theirs) = (frame.integers(), all.integers());
            for axis in 0..3 {
                assert_eq!(
                    mine.position[axis][..exact],
                    theirs.position[axis][..exact],
                    "frame {}",
                    frame.index()
                );
                assert_eq!(
                    mine.rotation[axis][..exact],
                    theirs.rotation[axis][..exact],
                    "frame {}",
                    frame.index()
                );
                assert_eq!(mine.dc[axis][..exact], theirs.dc[axis][..exact], "frame {}", frame.index());
            }
            let expected = if frame.operating_point() == point("s0,t1,r0") { 1 } else { 3 };
            assert_eq!(frame.refinements(), expected, "frame {}", frame.index());
        }
        // A frame is given before the next one begins.
        let whole = frames.iter().filter(|frame| frame.refinements() == 3).count();
        assert_eq!(whole, after);
    }
}
