//! Reports, claims and vectors are valid by their schemas.
#![cfg(unix)]
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed test")]

mod common;

use common::{Vectors, WRITE, results, settings};
use serde_json::{Value, json};
use splatstream_conformance::feature::{self, FEATURES, Feature};
use splatstream_conformance::matrix;
use splatstream_conformance::reference;
use splatstream_conformance::report::Report;
use splatstream_conformance::result::Outcome;
use splatstream_conformance::selection::Selection;
use splatstream_conformance::suite::Suite;
use splatstream_conformance::symptom::Symptom;
use std::path::Path;

fn validator(schema: &str) -> jsonschema::Validator {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../schema").join(format!("{schema}.schema.json"));
    let schema = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    jsonschema::validator_for(&schema).unwrap()
}

/// What is wrong with a value by a schema of the suite.
fn problems(schema: &str, value: &Value) -> Vec<String> {
    validator(schema).iter_errors(value).map(|error| format!("{}: {error}", error.instance_path())).collect()
}

#[test]
fn a_report_with_all_kinds_of_results_is_valid() {
    let vectors = Vectors::new();
    vectors.add("valid", "slow", json!({"outcome": "accept"}), |_| {});
    vectors.add("valid", "gone", json!({"outcome": "accept"}), |record| record["level"] = json!(4));
    let suite = vectors.suite();
    let script = format!(
        "case $(cat $1) in good) {WRITE}; echo >> $4/f0000.dc.i32;; bad) exit 10;; big) exit 13;; slow) exit 7;; esac"
    );
    let mut settings = settings(&script);
    settings.capabilities.level = 3;
    let mut report = Report::new(
        &suite,
        &settings,
        &Selection::default(),
        results(&suite, &settings),
        vec!["line 1".to_owned()],
    );
    let whole = json!({
        "frame": 0, "type": "I", "attribute": "dc", "gaussians": 1, "bytes_found": 5, "read": ["7.6.5", "A.2"],
        "value": {"gaussian": 0, "component": 2, "expected": -1, "found": 7, "differing": 1},
        "unit": {"unit": 3, "type": "increment", "byte": 99, "bytes": 40, "frame": 0, "spatial_layer": 0, "refinement": 1},
    });
    report.cases[0].difference = Some(serde_json::from_value(whole).unwrap());
    report.cases[0].symptom = Some(Symptom::OffByOne);
    for outcome in [Outcome::Pass, Outcome::Fail, Outcome::Crash, Outcome::NotClaimed] {
        assert!(report.count(outcome) > 0, "{outcome:?}");
    }
    let value = serde_json::to_value(&report).unwrap();
    assert_eq!(problems("report", &value), Vec::<String>::new());
    let read: Report = serde_json::from_value(value.clone()).unwrap();
    assert_eq!(serde_json::to_value(read).unwrap(), value);
}

#[test]
fn features_are_the_same_in_the_schemas_and_the_guide() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let names: Vec<&str> = feature::names().collect();
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    let schema =
        |name: &str| serde_json::from_str::<Value>(&read(&format!("schema/{name}.schema.json"))).unwrap();
    let of_vectors = &schema("vector")["properties"]["features"]["items"]["enum"];
    let of_claims = &schema("capabilities")["properties"]["features"]["items"]["enum"];
    assert_eq!((of_vectors, of_claims), (&json!(names), &json!(names)));
    let guide = read("adapters/README.md");
    for Feature { name, meaning, clause } in FEATURES {
        assert!(guide.contains(&format!("| `{name}` | {meaning} | {clause} |")), "{name}");
    }
}

#[test]
fn the_claim_of_the_reference_is_valid() {
    let value = serde_json::to_value(reference::capabilities()).unwrap();
    assert_eq!(problems("capabilities", &value), Vec::<String>::new());
    let other = json!({"schema": "splatstream-capabilities/1", "name": "mine", "colour": true});
    assert!(!problems("capabilities", &other).is_empty());
}

#[test]
fn every_vector_of_the_repository_is_valid() {
    let vectors = Path::new(env!("CARGO_MANIFEST_DIR")).join("../vectors");
    let suite = Suite::read(&vectors).unwrap();
    let validator = validator("vector");
    for located in &suite.vectors {
        let path = located.stream.with_file_name("vector.json");
        let record = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
        let problems: Vec<String> = validator
            .iter_errors(&record)
            .map(|error| format!("{}: {error}", error.instance_path()))
            .collect();
        assert_eq!(problems, Vec::<String>::new(), "{}", path.display());
    }
}

/// The results that others and we have submitted, in the order of their names.
fn submitted() -> Vec<Value> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../results");
    let mut paths: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "json"));
    paths.sort();
    paths.iter().map(|path| serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()).collect()
}

#[test]
fn submitted_results_are_of_whole_runs_on_whole_suites() {
    for result in submitted() {
        assert_eq!(problems("report", &result), Vec::<String>::new());
        let report: Report = serde_json::from_value(result).unwrap();
        let (name, suite) = (&report.decoder.name, &report.suite);
        assert!(suite.changed.is_none() && report.interrupted.is_none(), "{name}");
        assert!(report.settings.selection.is_everything(), "{name}");
    }
}

#[test]
fn the_page_of_results_is_made_from_them() {
    let reports: Vec<Report> =
        submitted().into_iter().map(|result| serde_json::from_value(result).unwrap()).collect();
    assert!(reports.len() >= 2, "the reference and the independent decoder are there");
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../results/matrix.md");
    assert_eq!(
        std::fs::read_to_string(page).unwrap(),
        matrix::page(&reports),
        ".ci/reports matrix writes it"
    );
}
