//! A Yes stands for all cases of a complete suite.
#![cfg(unix)]
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed test")]

mod common;

use common::{Vectors, WRITE, settings};
use serde_json::json;
use splatstream_conformance::case::Case;
use splatstream_conformance::matrix;
use splatstream_conformance::report::{Report, Tally};
use splatstream_conformance::run::{Settings, run};
use splatstream_conformance::selection::Selection;
use splatstream_conformance::suite::Suite;
use std::fs;
use std::path::Path;

const RIGHT: &str = "case $(cat $1) in bad) exit 11;; esac;";

/// Vectors of which `good`, `better` and `best` are valid; `best` is of level 3.
fn vectors() -> Vectors {
    let vectors = Vectors::new();
    vectors.add("valid", "better", json!({"outcome": "accept"}), |_| {});
    vectors.add("valid", "best", json!({"outcome": "accept"}), |record| record["level"] = json!(3));
    vectors.seal();
    vectors
}

fn report(suite: &Suite, settings: &Settings, filter: &[&str]) -> Report {
    let filter = filter.iter().map(|&pattern| pattern.to_owned()).collect();
    let selection = Selection { filter, ..Selection::default() };
    let results = run(&selection.of(Case::all(suite)).unwrap(), settings, |_| {}).unwrap();
    Report::new(suite, settings, &selection, results, Vec::new())
}

/// The cells of a row of a page about one decoder.
fn cell(report: &Report, row: &str) -> String {
    let page = matrix::page(std::slice::from_ref(report));
    let line = page.lines().find(|line| line.starts_with(&format!("| {row} |"))).unwrap();
    line.split('|').nth(2).unwrap().trim().to_owned()
}

#[test]
fn a_yes_is_of_all_cases_of_the_suite() {
    let vectors = vectors();
    let suite = vectors.suite();
    let right = settings(&format!("{RIGHT} {WRITE}"));
    let whole = report(&suite, &right, &[]);
    assert_eq!(whole.features["predicted"], Tally { cases: 3, claimed: 3, run: 3, pass: 3 });
    for row in ["predicted", "profile 1", "streams with errors", "no crash, no timeout"] {
        assert_eq!(cell(&whole, row), "Yes", "{row}");
    }
    assert_eq!(cell(&whole, "suite"), "9");

    let part = report(&suite, &right, &["better"]);
    assert_eq!(part.features["predicted"], Tally { cases: 3, claimed: 3, run: 1, pass: 1 });
    assert_eq!(cell(&part, "predicted"), "part: 1 of 3 run");
    assert_eq!(cell(&part, "streams with errors"), "not run");
    assert_eq!(cell(&part, "no crash, no timeout"), "part: 1 of 5 run");
    assert_eq!(cell(&part, "suite"), "9, a part");
}

#[test]
fn what_failed_or_is_not_claimed_is_counted() {
    let vectors = vectors();
    let suite = vectors.suite();
    let wrong =
        report(&suite, &settings(&format!("case $(cat $1) in better) exit 1;; esac; {RIGHT} {WRITE}")), &[]);
    assert_eq!(cell(&wrong, "predicted"), "No: 1 of 3 failed");
    assert_eq!(cell(&wrong, "no crash, no timeout"), "No: 1 of 5 failed");
    let mut narrow = settings(&format!("{RIGHT} {WRITE}"));
    narrow.capabilities.level = 2;
    let narrow = report(&suite, &narrow, &[]);
    assert_eq!(cell(&narrow, "predicted"), "2 of 3 claimed, all passed");
    let mut none = settings("exit 1");
    none.capabilities.profiles = vec![0];
    assert_eq!(cell(&report(&suite, &none, &[]), "predicted"), "not claimed");
}

#[test]
fn two_decoders_of_one_name_have_two_columns() {
    let vectors = vectors();
    let report = report(&vectors.suite(), &settings("exit 11"), &["bad"]);
    assert!(matrix::page(&[report.clone(), report]).contains("| Feature | script | script (2) |"));
}

#[test]
fn a_changed_suite_is_reported_and_gives_no_yes() {
    let vectors = vectors();
    assert_eq!(vectors.suite().complaint(), None);
    vectors.add("valid", "more", json!({"outcome": "accept"}), |_| {});
    assert_eq!(vectors.suite().complaint().unwrap(), "this is not suite 9: 1 vector is not part of it");
    for name in ["more", "better", "best"] {
        fs::remove_dir_all(vectors.path().join("valid/stream").join(name)).unwrap();
    }
    let suite = vectors.suite();
    assert_eq!(suite.complaint().unwrap(), "this is not suite 9: 2 vectors are missing");
    let cut = report(&suite, &settings(&format!("{RIGHT} {WRITE}")), &[]);
    assert_eq!(cell(&cut, "suite"), "9, changed");
    assert_eq!(cell(&cut, "predicted"), "1 of a changed suite, all passed");

    let vectors = self::vectors();
    let path = vectors.path().join("valid/stream/good/vector.json");
    fs::write(&path, fs::read_to_string(&path).unwrap().replace("made up", "made over")).unwrap();
    assert_eq!(vectors.suite().complaint().unwrap(), "this is not suite 9: vectors were changed");
}

#[test]
fn the_vectors_of_the_repository_are_those_of_its_manifest() {
    let suite = Suite::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../vectors")).unwrap();
    assert_eq!(suite.complaint(), None, "python3 conformance/generator/manifest.py conformance/vectors");
}

#[test]
fn the_folder_above_or_below_is_suggested() {
    let vectors = vectors();
    let refused = |path: &Path| Suite::read(path).unwrap_err().to_string();
    let advice = format!("did you mean --suite {}", vectors.path().display());
    assert!(refused(&vectors.path().join("valid")).contains(&advice));
    assert!(refused(&vectors.path().join("valid/stream")).contains(&advice));
}

#[test]
fn a_file_that_is_not_a_report_is_refused_with_advice() {
    let file = tempfile::NamedTempFile::new().unwrap();
    for (text, why) in [
        ("# a page", "not a report of a run"),
        ("{}", "it has no schema"),
        ("{\"schema\": \"splatstream-capabilities/1\"}", "instead of splatstream-report/3"),
        ("{\"schema\": \"splatstream-report/3\"}", "missing field"),
    ] {
        fs::write(file.path(), text).unwrap();
        let error = Report::read(file.path()).unwrap_err().to_string();
        assert!(error.contains(why) && error.contains("--report FILE.json"), "{error}");
    }
}
