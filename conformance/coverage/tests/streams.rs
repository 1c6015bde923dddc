//! Properties of the streams of the vectors: extraction, and decoding from each GOP on.
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed test")]

mod common;

use common::{check_all, suite};
use sha2::{Digest, Sha256};
use splatstream_conformance::case::Case;
use splatstream_conformance::vector::Kind;
use splatstream_decoder::operating_point::extract;
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::{decode_stream, decode_stream_inside};
use splatstream_format::Limits;
use splatstream_format::syntax::UnitType;
use splatstream_format::unit::Stream;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};

// covers: SS-OP-005, SS-OP-007
#[test]
fn the_reference_extracts_the_bytes_of_every_record() {
    let suite = suite();
    let cases = Case::all(&suite);
    let extractions = AtomicUsize::new(0);
    check_all(&cases, |case| {
        let Some(wanted) = case.point.and_then(|point| point.extraction.as_ref()) else { return };
        let stream = std::fs::read(case.stream).unwrap();
        let extracted = extract(&stream, case.op().parse().unwrap(), &Limits::default()).unwrap();
        let digest: String = Sha256::digest(&extracted).iter().map(|byte| format!("{byte:02x}")).collect();
        assert_eq!(digest, *wanted, "{case}");
        extractions.fetch_add(1, Ordering::Relaxed);
    });
    assert!(extractions.into_inner() >= 500);
}

/// B.3: from each GOP on a decoder outputs the same frames as from the start.
fn decode_from_gops(case: &Case<'_>) {
    let bytes = std::fs::read(case.stream).unwrap();
    let mut whole = Vec::new();
    let _ = decode_stream(&bytes, &Options::default(), |_, frame| {
        whole.push(frame);
        ControlFlow::Continue(())
    });
    let mut units = Stream::open(&bytes, &Limits::default()).unwrap().units();
    // A unit that decoders discard may be damaged.
    let units = std::iter::from_fn(|| units.next_unit()).map_while(Result::ok);
    for gop in units.filter(|unit| unit.header.unit_type() == UnitType::GopHeader) {
        let mut frames = Vec::new();
        let summary = decode_stream_inside(&bytes, gop.at, &Options::default(), |_, frame| {
            frames.push(frame);
            ControlFlow::Continue(())
        });
        assert_eq!(summary.verdict(), None, "{case} from byte {}", gop.at);
        let first = whole.iter().position(|frame| frame.index >= gop.header.frame).unwrap_or(whole.len());
        assert_eq!(frames, whole[first..], "{case} from byte {}", gop.at);
    }
}

// covers: SS-BS-012
#[test]
fn from_each_gop_on_the_reference_outputs_the_frames_of_the_whole() {
    let suite = suite();
    let mut cases = Case::all(&suite);
    cases.retain(|case| case.vector.kind == Kind::Valid && case.vector.inside.is_none());
    cases.dedup_by_key(|case| &case.vector.name);
    assert!(cases.len() >= 200, "{} streams", cases.len());
    check_all(&cases, decode_from_gops);
}
