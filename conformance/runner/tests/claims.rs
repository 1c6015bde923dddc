//! What a decoder claims, what it is expected to fail, and records that cannot be.
#![cfg(unix)]
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed test")]

mod common;

use common::{Vectors, results, settings};
use serde_json::{Value, json};
use splatstream_conformance::capabilities::Capabilities;
use splatstream_conformance::case::Case;
use splatstream_conformance::expectations::Expectations;
use splatstream_conformance::report::Report;
use splatstream_conformance::result::{CaseResult, Outcome};
use splatstream_conformance::run::Settings;
use splatstream_conformance::selection::Selection;
use splatstream_conformance::suite::Suite;
use splatstream_conformance::vector::Kind;
use std::fs;

fn claim(change: impl FnOnce(&mut Value)) -> Capabilities {
    let mut claim = json!({"schema": "splatstream-capabilities/1", "name": "mine"});
    change(&mut claim);
    serde_json::from_value(claim).unwrap()
}

#[test]
fn what_is_not_claimed_is_not_asked_and_not_passed() {
    let vectors = Vectors::new();
    let unsupported = json!({"outcome": "reject", "class": "unsupported", "code": "RESERVED"});
    vectors.add("invalid", "later-version", unsupported, |record| record["states"] = json!([]));
    let suite = vectors.suite();
    let claims = [
        claim(|claim| claim["profiles"] = json!([0])),
        claim(|claim| claim["level"] = json!(1)),
        claim(|claim| claim["features"] = json!(["b-frames"])),
        claim(|claim| claim["modes"] = json!(["subset"])),
    ];
    for capabilities in claims {
        let results = results(&suite, &Settings { capabilities, ..settings("exit 12") });
        for result in &results {
            let wanted = if result.vector == "later-version" { Outcome::Pass } else { Outcome::NotClaimed };
            assert_eq!(result.outcome, wanted, "{result:#?}");
        }
    }
}

#[test]
fn a_claim_can_be_of_the_highest_or_the_lowest_point_alone() {
    let vectors = Vectors::none();
    vectors.add("valid", "layers", json!({"outcome": "accept"}), |record| {
        let point = |op: &str| json!({"op": op, "mode": "full", "states": [0]});
        record["points"] = json!([point("s1,t0,r2"), point("s1,t0,r0"), point("s0,t0,r0")]);
    });
    let suite = vectors.suite();
    for (points, asked) in [("full", "s1,t0,r2"), ("base", "s0,t0,r0")] {
        let capabilities = claim(|claim| claim["points"] = json!(points));
        let results = results(&suite, &Settings { capabilities, ..settings("exit 12") });
        let ops: Vec<&str> = results
            .iter()
            .filter(|result| result.answer.is_some())
            .map(|result| result.op.as_str())
            .collect();
        assert_eq!(ops, [asked]);
    }
}

fn read(list: &str) -> Result<Expectations, String> {
    let file = tempfile::NamedTempFile::new().unwrap();
    fs::write(file.path(), list).unwrap();
    Expectations::read(file.path()).map_err(|error| error.to_string())
}

/// The results of a decoder that calls everything invalid, and what a list makes of them.
fn expecting(list: &str) -> (Vec<CaseResult>, Vec<String>) {
    let vectors = Vectors::new();
    let mut results = results(&vectors.suite(), &settings("exit 11"));
    let stale = read(list).unwrap().apply(&mut results, true);
    (results, stale)
}

#[test]
fn an_expected_failure_is_one_of_just_that_sort() {
    let list = "# known\ngood wrong-outcome  # it rejects everything\nbig@s3,t3,r9/full fail # likewise\n";
    let (results, stale) = expecting(list);
    assert_eq!(stale, Vec::<String>::new());
    let outcomes: Vec<Outcome> = results.iter().map(|result| result.outcome).collect();
    assert_eq!(outcomes, [Outcome::ExpectedFailure, Outcome::Pass, Outcome::ExpectedFailure]);
}

#[test]
fn a_list_goes_stale_with_what_passes_fails_otherwise_or_is_gone() {
    for (line, why) in [
        ("bad wrong-class # x", "is pass and not wrong-class"),
        ("good crash # x", "is wrong-outcome and not crash"),
        ("gone crash # x", "there is no case gone"),
        ("good@s0,t0,r0 fail # x", "there is no case good@s0,t0,r0"),
    ] {
        let (_, stale) = expecting(line);
        assert!(stale.len() == 1 && stale[0].contains(why), "{line}: {stale:?}");
    }
}

#[test]
fn a_list_without_reasons_or_with_patterns_is_refused() {
    for (line, why) in [
        ("good fail", "say after a # why"),
        ("g* fail # x", "patterns are not allowed"),
        ("good pass # x", "pass is none of"),
        ("good # x", "write `vector[@op[/mode]] outcome"),
    ] {
        let error = read(line).unwrap_err();
        assert!(error.contains("line 1") && error.contains(why), "{line}: {error}");
    }
}

#[test]
fn a_record_that_cannot_be_is_refused_with_its_file() {
    type Change = fn(&mut Value);
    let changes: [(&str, Change); 6] = [
        ("unknown field `expected`", |record| record["expected"] = json!(1)),
        ("is not the stream of this record", |record| record["sha256"] = json!("00")),
        ("name, area and kind", |record| record["area"] = json!("other")),
        ("a rejection has a class", |record| record["expect"] = json!({"outcome": "reject"})),
        ("a state that is not there", |record| {
            record["points"] = json!([{"op": "s0,t0,r0", "mode": "full", "states": [1]}])
        }),
        ("only vectors of kind either", |record| record["acceptable"] = json!([{"outcome": "accept"}])),
    ];
    for (why, change) in changes {
        let vectors = Vectors::none();
        vectors.add("valid", "wrong", json!({"outcome": "accept"}), change);
        let error = Suite::read(vectors.path()).unwrap_err().to_string();
        assert!(error.contains(why) && error.contains("vector.json"), "{why}: {error}");
    }
    assert!(Suite::read(Vectors::none().path()).unwrap_err().to_string().contains("--suite"));
}

#[test]
fn a_selection_takes_what_has_all_that_it_asks_for() {
    let vectors = Vectors::new();
    let suite = vectors.suite();
    let names = |selection: &Selection| -> Vec<String> {
        let cases = selection.of(Case::all(&suite)).unwrap();
        cases.iter().map(|case| case.vector.name.clone()).collect()
    };
    let filter = |pattern: &str| Selection { filter: Some(pattern.to_owned()), ..Selection::default() };
    assert_eq!(names(&filter("b*")), ["bad", "big"]);
    assert_eq!(names(&Selection { kind: Some(Kind::Either), ..filter("b*") }), ["big"]);
    assert!(
        Selection { feature: Some("vq".to_owned()), ..Selection::default() }.of(Case::all(&suite)).is_err()
    );
    assert!(filter("[").of(Case::all(&suite)).is_err());
}

#[test]
fn two_runs_give_the_same_report() {
    let vectors = Vectors::new();
    let suite = vectors.suite();
    let report = || {
        let settings = settings("exit 11");
        let report =
            Report::new(&suite, &settings, &Selection::default(), results(&suite, &settings), Vec::new());
        serde_json::to_string(&Report { date: String::new(), ..report }).unwrap()
    };
    assert_eq!(report(), report());
}
