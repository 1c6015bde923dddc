//! All vectors through the reference decoder, in one process and with nothing else in it.
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed test")]

use sha2::{Digest, Sha256};
use splatstream_conformance::answer::{Answer, Ending};
use splatstream_conformance::case::Case;
use splatstream_conformance::judge::{Rules, judge};
use splatstream_conformance::output::Output;
use splatstream_conformance::protocol::{Request, Said};
use splatstream_conformance::reference;
use splatstream_conformance::result::Outcome;
use splatstream_conformance::suite::Suite;
use splatstream_conformance::vector::Kind;
use splatstream_decoder::operating_point::extract;
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::{decode_stream, decode_stream_inside};
use splatstream_format::Limits;
use splatstream_format::syntax::UnitType;
use splatstream_format::unit::Stream;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

/// Codes of errors and states of the entropy decoder count as planes do.
const RULES: Rules = Rules { strict: true, entropy: true, output: true };

fn suite() -> Suite {
    Suite::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../vectors")).unwrap()
}

/// Does `check` with every case, on all processors; the first that fails ends all.
fn check_all(cases: &[Case<'_>], check: impl Fn(&Case<'_>) + Sync) {
    let next = AtomicUsize::new(0);
    let work = || {
        while let Some(case) = cases.get(next.fetch_add(1, Ordering::Relaxed)) {
            if let Err(panic) = catch_unwind(AssertUnwindSafe(|| check(case))) {
                next.store(cases.len(), Ordering::Relaxed);
                resume_unwind(panic);
            }
        }
    };
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(work);
        }
    });
}

fn decode(case: &Case<'_>) {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_path_buf();
    let request =
        Request { input: case.stream.to_path_buf(), op: case.op().to_owned(), mode: case.mode(), out };
    let (code, diagnosis) = reference::answer(&request).unwrap();
    let said = diagnosis.map_or(Said::Nothing, Said::Diagnosis);
    let (ending, complaint) = (Ending::Code(code), String::new());
    let answer = Answer { ending, said, fault: None, complaint, took: Duration::ZERO };
    let result = judge(case, &answer, &Output::read(&request.out).unwrap(), RULES);
    assert_eq!(result.outcome, Outcome::Pass, "{case}: {result:#?}");
}

#[test]
fn the_reference_shows_of_every_case_what_its_record_says() {
    let suite = suite();
    let cases = Case::all(&suite);
    assert!(cases.len() >= 1000, "{} cases", cases.len());
    check_all(&cases, decode);
}

// covers: SS-OP-004, SS-OP-008
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

/// B.3: from each group of a stream on come the frames that also come from its start on.
fn decode_from_groups(case: &Case<'_>) {
    let bytes = std::fs::read(case.stream).unwrap();
    let mut whole = Vec::new();
    decode_stream(&bytes, &Options::default(), |_, frame| {
        whole.push(frame);
        ControlFlow::Continue(())
    });
    let units = Stream::open(&bytes, &Limits::default()).unwrap().units().map(Result::unwrap);
    for group in units.filter(|unit| unit.header.unit_type() == UnitType::GopHeader) {
        let mut frames = Vec::new();
        let summary = decode_stream_inside(&bytes, group.at, &Options::default(), |_, frame| {
            frames.push(frame);
            ControlFlow::Continue(())
        });
        assert_eq!(summary.end, None, "{case} from byte {}", group.at);
        let first = whole.iter().position(|frame| frame.number >= group.header.frame).unwrap_or(whole.len());
        assert_eq!(frames, whole[first..], "{case} from byte {}", group.at);
    }
}

// covers: SS-BS-008
#[test]
fn from_each_group_on_the_reference_shows_what_it_shows_of_the_whole() {
    let suite = suite();
    let mut cases = Case::all(&suite);
    cases.retain(|case| case.vector.kind == Kind::Valid);
    cases.dedup_by_key(|case| &case.vector.name);
    assert!(cases.len() >= 200, "{} streams", cases.len());
    check_all(&cases, decode_from_groups);
}
