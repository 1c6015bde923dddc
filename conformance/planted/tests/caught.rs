//! The runner's own test: every planted decoder is caught, and caught for its fault.
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed test")]

use splatstream_conformance::capabilities::Capabilities;
use splatstream_conformance::case::Case;
use splatstream_conformance::command::{Template, split};
use splatstream_conformance::limits::Limits;
use splatstream_conformance::result::CaseResult;
use splatstream_conformance::run::{Settings, run};
use splatstream_conformance::session::Decoder;
use splatstream_conformance::stop::Stop;
use splatstream_conformance::suite::{Located, Suite};
use splatstream_conformance::symptom::Symptom;
use splatstream_conformance::vector::{Kind, Mode};
use splatstream_format::Class;
use std::collections::BTreeSet;
use std::path::Path;
use std::time::Duration;

const PLANTED: &str = env!("CARGO_BIN_EXE_planted");

fn suite() -> Suite {
    Suite::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../vectors")).unwrap()
}

/// The smallest vector of some sort.
fn smallest(suite: &Suite, is_wanted: impl Fn(&Located) -> bool) -> &Located {
    suite
        .vectors
        .iter()
        .filter(|located| is_wanted(located))
        .min_by_key(|located| located.vector.bytes)
        .unwrap()
}

/// A valid vector with everything that a fault could hide in, and broken streams that are refused as a whole.
fn few(suite: &Suite) -> Vec<Case<'_>> {
    let broken = |class| {
        smallest(suite, move |located| {
            located.vector.kind == Kind::Invalid
                && located.vector.expect.class == Some(class)
                && located.vector.points.is_empty()
        })
    };
    let few =
        [rich(suite), broken(Class::Malformed), broken(Class::Invalid)].map(|located| &located.vector.name);
    Case::all(suite).into_iter().filter(|case| few.contains(&&case.vector.name)).collect()
}

/// A vector with B frames, layers and prefixes, some of whose Gaussians are carried over.
fn rich(suite: &Suite) -> &Located {
    smallest(suite, |located| {
        let vector = &located.vector;
        let has = |feature: &str| vector.features.iter().any(|has| has == feature);
        let differ = |mode| vector.points.iter().filter(move |point| point.mode == mode);
        vector.kind == Kind::Valid
            && ["b-frames", "spatial-layers", "prefixes", "carried"].into_iter().all(has)
            && differ(Mode::Subset).any(|subset| {
                differ(Mode::Full).any(|full| full.op == subset.op && full.states != subset.states)
            })
    })
}

fn settings(decoder: Decoder) -> Settings {
    let limits = Limits { time: Duration::from_secs(20), memory: 256 << 20, output: 32 << 20 };
    Settings {
        decoder,
        capabilities: Capabilities::everything("planted"),
        limits,
        strict: false,
        jobs: 2,
        stop: Stop::default(),
    }
}

fn once(fault: &str) -> Decoder {
    let command = format!("'{PLANTED}' {fault} --in {{in}} --op {{op}} --mode {{mode}} --out {{out}}");
    Decoder::Once(Template::parse(&command).unwrap())
}

fn persistent(fault: &str) -> Decoder {
    Decoder::Persistent(split(&format!("'{PLANTED}' {fault} --stdio")).unwrap())
}

/// The results of a planted decoder, which are the same a process a case and in one process.
fn results(cases: &[Case<'_>], fault: &str) -> Vec<CaseResult> {
    let results = run(cases, &settings(once(fault)), |_| {}).unwrap();
    let again = run(cases, &settings(persistent(fault)), |_| {}).unwrap();
    let labels = |results: &[CaseResult]| results.iter().map(CaseResult::label).collect::<Vec<_>>();
    assert_eq!(labels(&results), labels(&again), "{fault}");
    results
}

fn is_valid(result: &CaseResult) -> bool {
    result.kind == Kind::Valid
}

/// Asserts what valid and what broken streams are called, where they do not pass; some shall not.
fn assert_caught(fault: &str, valid: &[&str], broken: &[&str]) -> Vec<CaseResult> {
    let suite = suite();
    let results = results(&few(&suite), fault);
    let labels = |valid: bool| -> BTreeSet<&str> {
        let results = results.iter().filter(|result| is_valid(result) == valid);
        results.map(CaseResult::label).filter(|&label| label != "pass").collect()
    };
    assert_eq!(labels(true), valid.iter().copied().collect(), "{fault}: {results:#?}");
    assert_eq!(labels(false), broken.iter().copied().collect(), "{fault}: {results:#?}");
    results
}

/// Asserts that the cases that failed look like this, but for those in which the fault leaves just what another operating
/// point has.
fn assert_looks_like(results: &[CaseResult], symptom: Symptom) {
    let failed = results.iter().filter(|result| result.outcome.is_failure());
    assert!(failed.clone().any(|result| result.symptom == Some(symptom)));
    for result in failed {
        assert!(
            [Some(symptom), Some(Symptom::OtherPoint)].contains(&result.symptom),
            "{symptom:?}: {result:#?}"
        );
    }
}

#[test]
fn the_reference_passes() {
    assert_caught("none", &[], &[]);
}

#[test]
fn accepting_without_output_is_missing_files_and_the_wrong_outcome() {
    let results = assert_caught("always-0", &["missing-files"], &["wrong-outcome"]);
    let valid: Vec<CaseResult> = results.into_iter().filter(is_valid).collect();
    assert_looks_like(&valid, Symptom::NothingWritten);
}

#[test]
fn rejecting_everything_is_the_wrong_outcome_and_the_wrong_class() {
    assert_caught("always-reject", &["wrong-outcome"], &["wrong-class"]);
}

#[test]
fn accepting_everything_is_the_wrong_outcome() {
    assert_caught("accepts-everything", &[], &["wrong-outcome"]);
}

#[test]
fn garbage_is_wrong_planes() {
    let results = assert_caught("garbage-out", &["wrong-planes"], &[]);
    assert_looks_like(&results, Symptom::Unrelated);
}

#[test]
fn a_crash_on_a_broken_stream_is_no_rejection() {
    let results = assert_caught("crash", &[], &["crash"]);
    assert!(
        results
            .iter()
            .filter(|result| !is_valid(result))
            .all(|result| result.answer.as_deref() == Some("signal 6"))
    );
}

#[test]
fn a_crash_on_every_stream_is_a_crash() {
    assert_caught("crash-always", &["crash"], &["crash"]);
}

#[test]
fn a_decoder_that_never_ends_is_killed() {
    let suite = suite();
    let cases: Vec<Case<'_>> = few(&suite).into_iter().take(2).collect();
    for decoder in [once("hang"), persistent("hang")] {
        let limits = Limits { time: Duration::from_millis(300), ..Limits::default() };
        let results = run(&cases, &Settings { limits, ..settings(decoder) }, |_| {}).unwrap();
        assert!(results.iter().all(|result| result.label() == "timeout"), "{results:#?}");
    }
}

#[test]
fn one_bit_of_the_last_frame_is_found_by_frame_attribute_and_gaussian() {
    let results = assert_caught("one-lsb-in-last-frame", &["wrong-planes"], &[]);
    assert_looks_like(&results, Symptom::OffByOne);
    let suite = suite();
    let cases = few(&suite);
    let full = cases.iter().filter(|case| case.vector.kind == Kind::Valid && case.mode() == Mode::Full);
    let whole = full.max_by_key(|case| case.op()).unwrap();
    let there = whole.states().unwrap().into_iter().filter(|state| state.gaussians > 0);
    let last = there.map(|state| state.frame).max();
    let whole = results.iter().find(|result| result.case_name() == whole.to_string()).unwrap();
    let difference = whole.difference.as_ref().unwrap();
    let value = difference.value.unwrap();
    assert_eq!((Some(difference.frame), difference.attribute.name()), (last, "opacity"));
    assert_eq!(
        (value.gaussian + 1, value.expected + 1, value.differing),
        (difference.gaussians, value.found, 1)
    );
    assert_eq!(difference.carrier.as_ref().map(|carrier| Some(carrier.frame)), Some(last), "{difference:#?}");
    assert!(difference.read.iter().any(|clause| clause.starts_with("7.1")), "{difference:#?}");
}

#[test]
fn another_order_of_gaussians_is_wrong_planes() {
    let results = assert_caught("sorted-differently", &["wrong-planes"], &[]);
    assert_looks_like(&results, Symptom::OtherOrder);
}

#[test]
fn a_missing_gaussian_is_wrong_planes() {
    let results = assert_caught("wrong-count", &["wrong-planes"], &[]);
    assert_looks_like(&results, Symptom::OtherCount);
}

#[test]
fn missing_b_frames_are_missing_files() {
    let results = assert_caught("ignores-b", &["missing-files"], &[]);
    assert_looks_like(&results, Symptom::TypeMissing);
}

#[test]
fn another_operating_point_is_told() {
    let suite = suite();
    let results = results(&few(&suite), "wrong-operating-point");
    assert_looks_like(&results, Symptom::OtherPoint);
    assert!(results.iter().any(|result| result.label() == "wrong-planes"));
    assert!(results.iter().any(|result| result.label() == "extra-files"), "temporal layers");
}

#[test]
fn a_file_that_nobody_asked_for_is_an_extra_file() {
    assert_caught("extra-files", &["extra-files"], &["extra-files"]);
}

#[test]
fn what_a_decoder_says_of_its_own_planes_does_not_count() {
    assert_caught("self-reported-hash", &["wrong-planes"], &[]);
}

#[test]
fn a_rejection_of_another_class_is_the_wrong_class() {
    assert_caught("wrong-class", &[], &["wrong-class"]);
}

#[test]
fn carried_gaussians_in_a_subset_are_told() {
    let results = assert_caught("ignores-subset-mode", &["wrong-planes"], &[]);
    assert_looks_like(&results, Symptom::OtherMode);
    assert!(results.iter().all(|result| result.mode == Mode::Subset || !result.outcome.is_failure()));
}

#[test]
fn missing_compensation_is_told_with_its_clause() {
    let suite = suite();
    let cases: Vec<Case<'_>> = Case::all(&suite)
        .into_iter()
        .filter(|case| case.vector.area == "temporal" || case.vector.area == "spatial")
        .collect();
    let mut failed = run(&cases, &settings(persistent("ignores-compensation")), |_| {}).unwrap();
    failed.retain(|result| result.outcome.is_failure());
    assert_looks_like(&failed, Symptom::Uncompensated);
    let reads = |result: &CaseResult| {
        result.difference.as_ref().is_some_and(|difference| difference.read[0] == "7.18.3")
    };
    assert!(failed.iter().all(reads));
}

#[test]
fn a_wrong_state_of_the_entropy_decoder_is_wrong_entropy() {
    assert_caught("wrong-entropy", &["wrong-entropy"], &[]);
}

#[test]
fn values_the_other_way_round_are_told() {
    let results = assert_caught("big-endian", &["wrong-planes"], &[]);
    assert_looks_like(&results, Symptom::BigEndian);
}

#[test]
fn a_decoder_that_removes_its_folder_fails_and_the_run_goes_on() {
    assert_caught("removes-folder", &["missing-files"], &["missing-files"]);
}

#[test]
fn memory_without_end_is_too_much_memory() {
    let suite = suite();
    let cases: Vec<Case<'_>> = few(&suite).into_iter().take(2).collect();
    let results = results(&cases, "out-of-memory");
    assert!(results.iter().all(|result| result.label() == "too-much-memory"), "{results:#?}");
}

#[test]
fn output_without_end_is_too_much_output() {
    let suite = suite();
    let cases: Vec<Case<'_>> = few(&suite).into_iter().take(2).collect();
    let results = results(&cases, "endless-output");
    assert!(results.iter().all(|result| result.label() == "too-much-output"), "{results:#?}");
}
