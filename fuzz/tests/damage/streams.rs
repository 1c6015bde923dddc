//! Damaged streams: whole and in pieces, at several operating points.

use crate::intact::{Intact, options};
use crate::{damaged, peak_of_process, so_many};
use splatstream::{Decoder, Error, Frame, Limits, OperatingPoint};
use splatstream_fuzz::laws::{Decoded, exact};
use splatstream_fuzz::streams;
use splatstream_gaussians::random::SplitMix64;
use std::sync::Arc;

const POINTS: [&str; 3] = ["s0,t0,r0", "s0,t9,r9", "s9,t0,r1"];

fn points() -> impl Iterator<Item = OperatingPoint> {
    let others = POINTS.into_iter().map(|point| point.parse().unwrap());
    std::iter::once(OperatingPoint::ALL).chain(others)
}

/// What a decoder gave: frames, and what it said at the end.
fn taken(decoder: &mut Decoder, frames: &mut Vec<Frame>) -> Option<Error> {
    loop {
        match decoder.next_frame() {
            Ok(Some(frame)) => frames.push(frame),
            Ok(None) => return None,
            Err(error) => return Some(error),
        }
    }
}

type Given = (Vec<Frame>, Option<Error>);

fn whole(bytes: &[u8], point: OperatingPoint) -> Given {
    let mut decoder = Decoder::from_bytes(Arc::<[u8]>::from(bytes)).with_operating_point(point);
    let mut frames = Vec::new();
    let end = taken(&mut decoder, &mut frames);
    (frames, end)
}

fn pushed(bytes: &[u8], point: OperatingPoint, random: &mut SplitMix64) -> Given {
    let mut decoder = Decoder::new().with_operating_point(point).with_limits(Limits::default());
    let (mut frames, mut rest) = (Vec::new(), bytes);
    while !rest.is_empty() {
        let (piece, after) = rest.split_at((1 + random.below(2000)).min(rest.len()));
        rest = after;
        if let Err(error) = decoder.push(piece) {
            return (frames, Some(error));
        }
        if let Some(error) = taken(&mut decoder, &mut frames) {
            return (frames, Some(error));
        }
    }
    decoder.end();
    let end = taken(&mut decoder, &mut frames);
    (frames, end)
}

/// Frames of both ways, and whether something was said to be wrong.
fn compare(whole: &Given, pushed: &Given, what: &str) {
    let [all, parts] = [whole, pushed].map(|(frames, _)| frames);
    assert_eq!(all.len(), parts.len(), "{what}: pieces give other frames");
    for (one, other) in all.iter().zip(parts) {
        assert!(
            one.index() == other.index() && one.integers() == other.integers(),
            "{what}: {}",
            one.index()
        );
    }
    assert_eq!(whole.1.is_some(), pushed.1.is_some(), "{what}: pieces end otherwise");
}

fn has_told((frames, end): &Given) -> bool {
    end.is_some() || frames.iter().any(|frame| !frame.warnings().is_empty())
}

#[test]
fn what_is_left_of_damaged_streams_is_right_and_losses_are_told() {
    let talk = include_bytes!("../../../examples/talk.gss").as_slice();
    let streams: Vec<&[u8]> = streams::ALL.into_iter().chain([talk]).collect();
    let count = so_many(700);
    let mut random = SplitMix64::new(17);
    let (mut decodes, mut frames, mut whole_frames) = (0, 0, 0);
    for number in 0..count {
        let stream = streams[number % streams.len()];
        let (bytes, intact) = (damaged(stream, &mut random), Intact::new(stream));
        for point in points() {
            let what = format!("number {number} at {point}");
            let given = whole(&bytes, point);
            compare(&given, &pushed(&bytes, point, &mut random), &what);
            let decoded = Decoded::of(&bytes, &options(point));
            let of_point = Decoded::of(stream, &options(point));
            let mut is_same = decoded.frames.len() == of_point.frames.len();
            for frame in decoded.frames.iter().filter(|frame| !frame.is_lost) {
                assert!(intact.has(frame), "{what}: frame {} is wrong", frame.index);
                let at_point = of_point.frames.iter().find(|other| other.index == frame.index);
                let is_whole = at_point.is_some_and(|whole| exact(whole) == exact(frame));
                is_same &= is_whole;
                (frames, whole_frames) = (frames + 1, whole_frames + usize::from(is_whole));
            }
            assert!(is_same || has_told(&given), "{what}: a loss is not told");
            decodes += 2;
        }
    }
    println!(
        "damaged streams: {count}, each at {} operating points whole and in pieces: {decodes} decodings; frames {frames}, \
         of these {whole_frames} whole, the others exact as far as they go; losses all told; no panic; peak memory of the process {:.1} MB",
        POINTS.len() + 1,
        peak_of_process()
    );
}
