//! What is asked of a new decoder holds in whatever order it is asked for.

use super::vectors;
use splatstream::{Cancel, Decoder, Limits, OperatingPoint};
use splatstream_format::unit::Stream;

/// One thing to ask for: a letter, and how.
type Asked<'a> = (char, &'a dyn Fn(Decoder) -> Decoder);

/// Asks for what is left in every order, and tells `check` about each.
fn orders(
    make: &dyn Fn() -> Decoder,
    left: &[Asked<'_>],
    done: &[Asked<'_>],
    check: &mut dyn FnMut(&str, Decoder),
) {
    if left.is_empty() {
        let name: String = done.iter().map(|(letter, _)| letter).collect();
        check(&name, done.iter().fold(make(), |decoder, (_, ask)| ask(decoder)));
    }
    for (place, &next) in left.iter().enumerate() {
        let others = [&left[..place], &left[place + 1..]].concat();
        orders(make, &others, &[done, &[next]].concat(), check);
    }
}

/// The offset of the second gop_header.
fn second_gop(bytes: &[u8]) -> u64 {
    let units = Stream::open(bytes, &splatstream_format::Limits::default()).unwrap();
    let gops = units
        .units()
        .map(Result::unwrap)
        .filter(|unit| unit.header.unit_type() == splatstream_format::syntax::UnitType::GopHeader);
    gops.map(|unit| unit.at).nth(1).unwrap()
}

#[test]
fn whatever_the_order_all_that_is_asked_for_holds() {
    let bytes = vectors::talk();
    let gop = second_gop(&bytes);
    let point: OperatingPoint = "s0,t1,r1".parse().unwrap();
    // The Gaussians of the eight frames from the second GOP on: those of the first would be too many.
    let limits = Limits { max_total_gaussians: 8 * 400, ..Limits::default() };
    let cancel = Cancel::new();
    let start = |decoder: Decoder| decoder.starting_at(gop);
    let limit = |decoder: Decoder| decoder.with_limits(limits);
    let lower = |decoder: Decoder| decoder.with_operating_point(point);
    let ahead = |decoder: Decoder| decoder.ahead();
    let cancelled = |mut decoder: Decoder| {
        decoder.set_cancel(cancel.clone());
        decoder
    };
    let all: [Asked<'_>; 5] = [('s', &start), ('l', &limit), ('o', &lower), ('a', &ahead), ('c', &cancelled)];
    let mut digests = Vec::new();
    let mut count = 0;
    orders(&|| Decoder::from_bytes(bytes.clone()), &all, &[], &mut |name, mut decoder| {
        let frames: Vec<_> = decoder.by_ref().take(7).map(|frame| frame.expect(name)).collect();
        assert_eq!(frames[0].index(), 4, "{name}");
        assert!(frames.iter().all(|frame| frame.refinements() == 2), "{name}");
        let found: Vec<_> = frames.iter().map(splatstream::Frame::digest).collect();
        assert!(digests.is_empty() || digests == found, "{name}");
        digests = found;
        count += 1;
    });
    assert_eq!(count, 120);

    // Cancelled before the first frame, and over the limit at the first of them.
    let few = |decoder: Decoder| decoder.with_limits(Limits { max_total_gaussians: 399, ..limits });
    orders(
        &|| Decoder::from_bytes(bytes.clone()),
        &[all[0], ('l', &few), all[2], all[3]],
        &[],
        &mut |name, mut decoder| {
            assert!(matches!(decoder.next_frame(), Err(splatstream::Error::Stream(_))), "{name}");
        },
    );
    cancel.request();
    orders(&|| Decoder::from_bytes(bytes.clone()), &all, &[], &mut |name, mut decoder| {
        assert!(matches!(decoder.next_frame(), Err(splatstream::Error::Cancelled)), "{name}");
    });
}
