//! The runner finds the error of every planted decoder.
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed test")]

use splatstream_conformance::cancel::Cancel;
use splatstream_conformance::capabilities::Capabilities;
use splatstream_conformance::case::Case;
use splatstream_conformance::command::{Template, split};
use splatstream_conformance::limits::Limits;
use splatstream_conformance::result::CaseResult;
use splatstream_conformance::run::{Settings, run};
use splatstream_conformance::session::Decoder;
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

/// The smallest vector with a property.
fn smallest(suite: &Suite, is_wanted: impl Fn(&Located) -> bool) -> &Located {
    suite
        .vectors
        .iter()
        .filter(|located| is_wanted(located))
        .min_by_key(|located| located.vector.bytes)
        .unwrap()
}

/// A valid vector with many features, and streams with errors of which nothing is shown.
fn few(suite: &Suite) -> Vec<Case<'_>> {
    let broken = |class| {
        smallest(suite, move |located| {
            located.vector.kind == Kind::Invalid
                && located.vector.expect.class == Some(class)
                && located.vector.states.is_empty()
                && located.vector.inside.is_none()
                && located.vector.sweep.is_none()
        })
    };
    let few =
        [rich(suite), broken(Class::Malformed), broken(Class::Invalid)].map(|located| &located.vector.name);
    Case::all(suite).into_iter().filter(|case| few.contains(&&case.vector.name)).collect()
}

/// A vector with B frames, spatial layers, prefixes and carried lists.
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
        cancel: Cancel::default(),
    }
}

fn once(fault: &str) -> Decoder {
    let command = format!("'{PLANTED}' {fault} --in {{in}} --op {{op}} --mode {{mode}} --out {{out}}");
    Decoder::Once(Template::parse(&command).unwrap())
}

fn persistent(fault: &str) -> Decoder {
    Decoder::Persistent(split(&format!("'{PLANTED}' {fault} --stdio")).unwrap())
}

/// The results of a planted decoder, which are the same with a process for each case and with one process.
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

/// Asserts the verdicts on valid streams and on those with errors, except passed ones.
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

/// Asserts that failed cases have this symptom, except those where the output is that of another operating point.
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
fn accepting_without_output_is_missing_files_and_a_wrong_outcome() {
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
    // A Gaussian of a carried list comes from no unit of the frame.
    let units = results
        .iter()
        .filter_map(|result| result.difference.as_ref()?.unit.as_ref().zip(result.difference.as_ref()));
    let mut units = units.map(|(unit, difference)| (unit.frame, difference.frame));
    assert!(
        units.clone().count() > 0 && units.all(|(of_unit, of_frame)| of_unit == of_frame),
        "{results:#?}"
    );
    assert!(difference.read.iter().any(|clause| clause.starts_with("7.")), "{difference:#?}");
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
fn another_operating_point_is_recognised() {
    let suite = suite();
    let results = results(&few(&suite), "wrong-operating-point");
    assert_looks_like(&results, Symptom::OtherPoint);
    assert!(results.iter().any(|result| result.label() == "wrong-planes"));
    assert!(results.iter().any(|result| result.label() == "extra-files"), "temporal layers");
}

#[test]
fn an_unexpected_file_is_an_extra_file() {
    assert_caught("extra-files", &["extra-files"], &["extra-files"]);
}

#[test]
fn reports_of_a_decoder_about_its_own_planes_do_not_count() {
    assert_caught("self-reported-hash", &["wrong-planes"], &[]);
}

#[test]
fn a_rejection_of_another_class_is_the_wrong_class() {
    assert_caught("wrong-class", &[], &["wrong-class"]);
}

#[test]
fn carried_lists_in_a_subset_are_recognised() {
    let results = assert_caught("ignores-subset-mode", &["wrong-planes"], &[]);
    assert_looks_like(&results, Symptom::OtherMode);
    assert!(results.iter().all(|result| result.mode == Mode::Subset || !result.outcome.is_failure()));
}

/// The failed cases of a planted decoder among those that are selected; their verdicts are these.
fn failed(
    fault: &str,
    strict: bool,
    labels: &[&str],
    is_selected: impl Fn(&Case<'_>) -> bool,
) -> Vec<CaseResult> {
    let suite = suite();
    let cases: Vec<Case<'_>> = Case::all(&suite).into_iter().filter(is_selected).collect();
    assert!(!cases.is_empty(), "{fault}");
    let settings = |fault| Settings { strict, ..settings(persistent(fault)) };
    let failures = |fault| {
        let mut results = run(&cases, &settings(fault), |_| {}).unwrap();
        results.retain(|result| result.outcome.is_failure());
        results
    };
    let right = failures("none");
    assert!(right.is_empty(), "{right:#?}");
    let failed = failures(fault);
    let found: BTreeSet<&str> = failed.iter().map(CaseResult::label).collect();
    assert_eq!(found, labels.iter().copied().collect(), "{fault}: {failed:#?}");
    failed
}

fn has(case: &Case<'_>, features: &[&str]) -> bool {
    features.iter().all(|feature| case.vector.features.iter().any(|has| has == feature))
}

fn is_valid_with(case: &Case<'_>, features: &[&str]) -> bool {
    case.vector.kind == Kind::Valid && has(case, features)
}

fn tests(case: &Case<'_>, requirement: &str) -> bool {
    case.vector.requirements.iter().any(|tested| tested == requirement)
}

#[test]
fn missing_compensation_is_recognised_with_its_clause() {
    let failed = failed("ignores-compensation", false, &["wrong-planes"], |case| {
        tests(case, "SS-CA-004") && case.vector.kind == Kind::Valid
    });
    assert_looks_like(&failed, Symptom::Uncompensated);
    let reads = |result: &CaseResult| {
        result.difference.as_ref().is_some_and(|difference| difference.read[0] == "7.8.3")
    };
    assert!(failed.iter().all(reads));
}

#[test]
fn frames_without_mixed_lists_are_those_of_the_other_mode() {
    // Whoever shows no carried lists compares no carried_digest either.
    let failed = failed("no-mixed-lists", false, &["wrong-outcome", "wrong-planes"], |case| {
        is_valid_with(case, &["carried", "subset"]) && case.mode() == Mode::Full
    });
    assert!(failed.iter().any(|result| result.symptom == Some(Symptom::OtherMode)));
}

#[test]
fn whole_anchors_in_a_nested_stream_are_found() {
    let suite = suite();
    let results = results(&few(&suite), "whole-anchor");
    assert!(results.iter().any(|result| result.kind == Kind::Valid && result.outcome.is_failure()));
}

#[test]
fn lists_below_the_limit_that_are_dropped_are_wrong_planes() {
    failed("ignores-limit", false, &["wrong-planes"], |case| {
        tests(case, "SS-LO-002") && case.vector.kind == Kind::Invalid
    });
}

#[test]
fn frames_after_a_fatal_error_that_are_dropped_are_missing_files() {
    failed("no-resynchronisation", false, &["missing-files"], |case| {
        tests(case, "SS-ER-004") && case.vector.kind == Kind::Invalid
    });
}

#[test]
fn lost_frames_that_are_not_reported_are_wrong() {
    failed("forgets-lost", false, &["wrong-lost"], |case| tests(case, "SS-ER-005"));
}

#[test]
fn a_start_inside_a_stream_that_is_taken_for_its_beginning_is_a_wrong_outcome() {
    failed("ignores-inside", false, &["wrong-outcome"], |case| {
        case.mode() == Mode::Inside && case.vector.kind == Kind::Valid
    });
}

#[test]
fn prefixes_of_a_stream_that_are_accepted_are_found() {
    let failed = failed("accepts-truncated", false, &["wrong-outcome"], |case| case.vector.sweep.is_some());
    let first =
        |result: &CaseResult| result.detail.as_deref().is_some_and(|detail| detail.starts_with("cut after"));
    assert!(failed.iter().all(first), "{failed:#?}");
}

#[test]
fn a_wrong_code_is_found_in_a_strict_run() {
    failed("wrong-code", true, &["wrong-code"], |case| !case.vector.acceptable.is_empty());
}

#[test]
fn a_wrong_state_of_the_entropy_decoder_is_wrong_entropy() {
    assert_caught("wrong-entropy", &["wrong-entropy"], &[]);
}

#[test]
fn big_endian_values_are_recognised() {
    let results = assert_caught("big-endian", &["wrong-planes"], &[]);
    assert_looks_like(&results, Symptom::BigEndian);
}

#[test]
fn a_decoder_that_removes_its_folder_fails_and_the_run_goes_on() {
    assert_caught("removes-folder", &["missing-files"], &["missing-files"]);
}

#[test]
fn unlimited_memory_is_too_much_memory() {
    let suite = suite();
    let cases: Vec<Case<'_>> = few(&suite).into_iter().take(2).collect();
    let results = results(&cases, "out-of-memory");
    assert!(results.iter().all(|result| result.label() == "too-much-memory"), "{results:#?}");
}

#[test]
fn unlimited_output_is_too_much_output() {
    let suite = suite();
    let cases: Vec<Case<'_>> = few(&suite).into_iter().take(2).collect();
    let results = results(&cases, "endless-output");
    assert!(results.iter().all(|result| result.label() == "too-much-output"), "{results:#?}");
}
