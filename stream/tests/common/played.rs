//! What was played is what a decoder of the whole stream shows.

use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_decoder::process::{DecodedFrame, Options as Decoding};
use splatstream_decoder::stream::{decode_stream, decode_stream_inside};
use splatstream_stream::playback::PlayedGop;
use std::cell::RefCell;
use std::ops::ControlFlow;
use std::rc::Rc;

/// The frames of a stream at a point.
fn frames(
    decode: impl FnOnce(&Decoding, &mut Vec<DecodedFrame>),
    point: OperatingPoint,
) -> Vec<DecodedFrame> {
    let mut frames = Vec::new();
    decode(&Decoding { operating_point: point, ..Decoding::default() }, &mut frames);
    frames
}

/// A stream, a point, and the frames of the one at the other.
type Known = (Vec<u8>, OperatingPoint, Rc<Vec<DecodedFrame>>);

/// The frames of a whole stream at a point, which are decoded once.
fn native(stream: &[u8], point: OperatingPoint) -> Rc<Vec<DecodedFrame>> {
    thread_local! {
        static KNOWN: RefCell<Vec<Known>> = const { RefCell::new(Vec::new()) };
    }
    KNOWN.with_borrow_mut(|known| {
        if let Some((_, _, frames)) = known.iter().find(|(of, at, _)| of == stream && *at == point) {
            return Rc::clone(frames);
        }
        let decode = |options: &Decoding, frames: &mut Vec<DecodedFrame>| {
            let _summary = decode_stream(stream, options, |_, frame| {
                frames.push(frame);
                ControlFlow::Continue(())
            });
        };
        let frames = Rc::new(frames(decode, point));
        known.push((stream.to_vec(), point, Rc::clone(&frames)));
        frames
    })
}

/// Every frame of a GOP is that of the same stream at the same point, and none is missing.
pub(crate) fn check(stream: &[u8], gop: &PlayedGop<'_>) {
    let Some(point) = gop.point else { return };
    let temporal = point.temporal.unwrap_or(0);
    let named = OperatingPoint { spatial: point.spatial, temporal, refinement: point.refinement };
    let played = [gop.head, gop.units].concat();
    let inside = gop.head.len() as u64;
    let ours = frames(
        |options, frames| {
            let _summary = decode_stream_inside(&played, inside, options, |_, frame| {
                frames.push(frame);
                ControlFlow::Continue(())
            });
        },
        named,
    );
    let native = native(stream, named);
    let own = gop.log.first_frame..gop.log.first_frame + gop.log.frame_count;
    let count = if point.temporal.is_none() { 1 } else { usize::MAX };
    let expected: Vec<_> =
        native.iter().filter(|frame| own.contains(&frame.index) && !frame.is_lost).take(count).collect();
    let shown: Vec<_> = ours.iter().filter(|frame| !frame.is_lost).take(count).collect();
    assert_eq!(shown.len(), expected.len(), "GOP {} at {point}", gop.number);
    for (ours, native) in shown.iter().zip(expected) {
        assert_eq!((ours.index, ours.level), (native.index, native.level));
        assert!(ours.planes == native.planes, "frame {} at {point}", ours.index);
    }
}
