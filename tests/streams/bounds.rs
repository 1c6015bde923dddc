//! Limits, cancellation, and many decoders at a time.

use super::vectors;
use splatstream::{Cancel, Decoder, Error, Limits};
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::{Step, StreamDecoder};
use std::sync::Arc;

fn verdict(limits: Limits) -> Result<usize, Error> {
    let mut frames = 0;
    for frame in Decoder::from_bytes(vectors::talk()).with_limits(limits) {
        frame?;
        frames += 1;
    }
    Ok(frames)
}

#[test]
fn each_limit_ends_decoding_where_it_is_reached() {
    let all = Limits::default();
    assert_eq!(verdict(all).unwrap(), 12);
    let lower = [
        Limits { max_memory: 1 << 20, ..all },
        Limits { max_gaussians: 399, ..all },
        Limits { max_total_gaussians: 4799, ..all },
        Limits { max_unit: 1000, ..all },
        Limits { max_output: 4800 * 14 * 4 - 1, ..all },
        Limits { max_work: 10_000, ..all },
    ];
    for limits in lower {
        let error = verdict(limits).expect_err("the limit is too low");
        assert_eq!(error.class(), Some(splatstream_format::Class::OverLimit), "{limits:?}: {error}");
    }
    let enough = Limits { max_gaussians: 400, max_total_gaussians: 4800, max_output: 4800 * 14 * 4, ..all };
    assert_eq!(verdict(enough).unwrap(), 12);
    let endless = Limits { max_total_gaussians: 1, max_output: 1, max_work: 1, ..all }.without_totals();
    assert_eq!(verdict(endless).unwrap(), 12);
}

#[test]
fn totals_count_from_where_a_seek_went() {
    let limits = Limits { max_total_gaussians: 4800, ..Limits::default() };
    let mut decoder = Decoder::from_bytes(vectors::talk()).with_limits(limits);
    for _ in 0..5 {
        decoder.seek(splatstream::Position::Frame(0)).unwrap();
        assert_eq!(decoder.by_ref().map(Result::unwrap).count(), 12);
    }
}

#[test]
fn thirty_two_decoders_share_the_bytes() {
    let bytes = vectors::talk();
    let decode = |bytes: Arc<[u8]>| -> Vec<_> {
        Decoder::from_bytes(bytes).map(|frame| frame.unwrap().into_integers()).collect()
    };
    let expected = decode(bytes.clone());
    std::thread::scope(|scope| {
        let all: Vec<_> = (0..32).map(|_| scope.spawn(|| decode(bytes.clone()))).collect();
        all.into_iter().for_each(|one| assert_eq!(one.join().unwrap(), expected));
    });
}

#[test]
fn a_decoder_that_is_cancelled_says_so_and_can_seek() {
    let cancel = Cancel::new();
    let mut decoder = Decoder::from_bytes(vectors::talk());
    decoder.set_cancel(cancel.clone());
    decoder.next_frame().unwrap().unwrap();
    cancel.request();
    assert!(matches!(decoder.next_frame(), Err(Error::Cancelled)));
    assert!(decoder.next_frame().unwrap().is_none() && decoder.is_finished());
    decoder.set_cancel(Cancel::new());
    decoder.seek(splatstream::Position::Frame(3)).unwrap();
    assert_eq!(decoder.next_frame().unwrap().unwrap().index(), 3);
}

#[test]
fn what_follows_an_interrupt_is_not_read() {
    let (bytes, interrupt) = (vectors::talk(), Cancel::new());
    let mut decoder = StreamDecoder::new(&Options::default());
    decoder.set_interrupt(interrupt.clone());
    let step = decoder.next_step(&bytes, true).unwrap();
    assert!(matches!(step, Step::Frame(_)));
    interrupt.request();
    let position = decoder.position();
    let rest = &bytes[usize::try_from(position).unwrap()..];
    assert!(matches!(decoder.next_step(rest, true), Ok(Step::End)));
    assert_eq!(decoder.position(), position);
}

#[test]
fn pushed_bytes_are_dropped_as_they_are_decoded() {
    let bytes = vectors::talk();
    let limits = Limits { max_memory: 64 << 20, ..Limits::default() };
    // A hundred times the stream, as junk after its end, which is counted and not kept.
    let mut decoder = Decoder::new().with_limits(limits);
    let mut frames = 0;
    for chunk in bytes.chunks(700).chain(std::iter::repeat_n([7_u8; 1 << 20].as_slice(), 100)) {
        decoder.push(chunk).unwrap();
        while let Some(frame) = decoder.next_frame().unwrap() {
            frames += usize::from(!frame.is_empty());
        }
    }
    decoder.end();
    assert!(matches!(decoder.next_frame(), Err(Error::Incomplete(_))));
    assert_eq!(frames, 12);
}
