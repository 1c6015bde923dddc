//! Two frames that are decoded at a time are those that come one after the other, with any number of threads.

use super::arrival::{Said, damaged_talk};
use super::vectors;
use proptest::prelude::*;
use splatstream::{Cancel, Decoder, Error, OperatingPoint};
use std::io::Cursor;
use std::sync::Arc;

fn with_threads<R: Send>(threads: usize, run: impl FnOnce() -> R + Send) -> R {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(run)
}

/// What is said where two frames are decoded at a time: of bytes that are there, that are read, and that come in chunks.
fn ahead(bytes: &Arc<[u8]>, threads: usize, chunk: usize) -> [Said; 3] {
    with_threads(threads, || {
        [
            Said::of(Decoder::from_bytes(bytes.clone()).ahead()),
            Said::of(Decoder::from_reader(Cursor::new(bytes.to_vec())).ahead()),
            Said::of_pushed(Decoder::new().ahead(), bytes, &[chunk]),
        ]
    })
}

#[test]
fn every_vector_gives_the_same_frames_one_by_one_and_two_at_a_time() {
    for (path, bytes) in vectors::all() {
        let expected = Said::of(Decoder::from_bytes(bytes.clone()));
        for threads in [1, 2] {
            for said in ahead(&bytes, threads, 5000) {
                assert_eq!(said, expected, "{} with {threads} threads", path.display());
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn damage_is_told_with_the_same_frames(
        bytes in damaged_talk(),
        chunk in 1_usize..9000,
    ) {
        let bytes: Arc<[u8]> = bytes.into();
        let expected = Said::of(Decoder::from_bytes(bytes.clone()));
        for said in ahead(&bytes, 2, chunk) {
            prop_assert_eq!(&said, &expected);
        }
    }
}

#[test]
fn no_frame_waits_for_bytes_that_have_not_come() {
    let bytes = vectors::talk();
    let limits = splatstream_format::Limits::of_level(4);
    let mut decoder = Decoder::new().ahead();
    let (mut pushed, mut given) = (0, 0);
    for unit in splatstream_format::unit::Stream::open(&bytes, &limits).unwrap().units() {
        let unit = unit.unwrap();
        let end = unit.payload_at as usize + unit.payload.len();
        decoder.push(&bytes[pushed..end]).unwrap();
        pushed = end;
        let is_last = unit.header.unit_type() == splatstream_format::syntax::UnitType::Increment
            && unit.header.refinement == 2;
        given += u32::from(is_last);
        let frame = decoder.next_frame().unwrap();
        assert_eq!(frame.map(|frame| frame.index()), is_last.then_some(unit.header.frame));
    }
    assert_eq!(given, 12);
}

#[test]
fn a_lower_operating_point_holds_one_frame_later_at_most() {
    let low: OperatingPoint = "s0,t1,r0".parse().unwrap();
    for taken in 1..12 {
        let mut decoder = Decoder::from_bytes(vectors::talk()).ahead();
        let shown = decoder.by_ref().take(taken).map(|frame| frame.unwrap().index()).last().unwrap();
        decoder.set_operating_point(low);
        for frame in decoder {
            let frame = frame.unwrap();
            let is_low = frame.refinements() == 1 && frame.operating_point() == low;
            assert!(is_low || frame.index() == shown + 1, "{taken}: {}", frame.index());
        }
    }
}

#[test]
fn a_decoder_that_is_ahead_can_be_cancelled() {
    let cancel = Cancel::new();
    let mut decoder = Decoder::from_bytes(vectors::talk()).ahead();
    decoder.set_cancel(cancel.clone());
    // The frame after the second one has been decoded beside it.
    decoder.by_ref().take(2).for_each(|frame| drop(frame.unwrap()));
    cancel.request();
    assert!(matches!(decoder.next_frame(), Err(Error::Cancelled)));
    assert!(decoder.next_frame().unwrap().is_none() && decoder.is_finished());
}
