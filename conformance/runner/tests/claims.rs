//! Claims of decoders, expected failures, and contradictory records.
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
fn what_is_not_claimed_is_neither_run_nor_passed() {
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
        let has_profile = capabilities.profiles.contains(&1);
        let results = results(&suite, &Settings { capabilities, ..settings("exit 12") });
        for result in &results {
            let is_run = result.vector == "later-version" && has_profile;
            let wanted = if is_run { Outcome::Pass } else { Outcome::NotClaimed };
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

fn read(list: &str, suite: &Suite) -> Result<Expectations, String> {
    let file = tempfile::NamedTempFile::new().unwrap();
    fs::write(file.path(), list).unwrap();
    Expectations::read(file.path(), suite).map_err(|error| error.to_string())
}

/// The results of a decoder that calls everything invalid, and what a list makes of them.
fn expecting(list: &str) -> (Vec<CaseResult>, Vec<String>) {
    let vectors = Vectors::new();
    let suite = vectors.suite();
    let mut results = results(&suite, &settings("exit 11"));
    let stale = read(list, &suite).unwrap().apply(&mut results);
    (results, stale)
}

#[test]
fn an_expected_failure_has_the_expected_outcome() {
    let list = "# known\ngood wrong-outcome  # it rejects everything\nbig@s3,t3,r9/full fail # likewise\n";
    let (results, stale) = expecting(list);
    assert_eq!(stale, Vec::<String>::new());
    let outcomes: Vec<Outcome> = results.iter().map(|result| result.outcome).collect();
    assert_eq!(outcomes, [Outcome::ExpectedFailure, Outcome::Pass, Outcome::ExpectedFailure]);
}

#[test]
fn a_list_goes_stale_with_what_passes_or_fails_otherwise() {
    for (line, why) in [
        ("bad wrong-class # x", "is pass and not wrong-class"),
        ("good crash # x", "is wrong-outcome and not crash"),
    ] {
        let (_, stale) = expecting(line);
        assert!(stale.len() == 1 && stale[0].contains(why), "{line}: {stale:?}");
    }
}

#[test]
fn a_list_without_reasons_with_patterns_or_with_unknown_cases_is_refused() {
    let vectors = Vectors::new();
    for (line, why) in [
        ("good fail", "say after a # why"),
        ("g* fail # x", "patterns are not allowed"),
        ("good pass # x", "pass is not one of"),
        ("good # x", "write `vector[@op[/mode]] outcome"),
        ("goood crash # x", "there is no case goood; similar ones are good"),
        ("good@s0,t0,r0 fail # x", "similar ones are good@s3,t3,r9/full"),
    ] {
        let error = read(line, &vectors.suite()).unwrap_err();
        assert!(error.contains("line 1") && error.contains(why), "{line}: {error}");
    }
}

#[test]
fn a_contradictory_record_is_refused_with_its_file() {
    type Change = fn(&mut Value);
    let changes: [(&str, Change); 8] = [
        ("unknown field `expected`", |record| record["expected"] = json!(1)),
        ("is not the stream of this record", |record| record["sha256"] = json!("00")),
        ("name, area and kind", |record| record["area"] = json!("other")),
        ("a rejection has a class", |record| record["expect"] = json!({"outcome": "reject"})),
        ("a state that does not exist", |record| {
            record["points"] = json!([{"op": "s0,t0,r0", "mode": "full", "states": [1]}])
        }),
        ("kind valid has no acceptable", |record| {
            record["acceptable"] = json!([{"class": "invalid", "code": "RANGE"}])
        }),
        ("have mode full", |record| {
            record["inside"] = json!(36);
            record["points"] = json!([{"op": "s0,t0,r0", "mode": "subset", "states": [0]}])
        }),
        ("neither points nor inside", |record| {
            record["inside"] = json!(36);
            record["sweep"] = json!({"cut": "every byte", "steps": []})
        }),
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
    let filter = |pattern: &str| Selection { filter: vec![pattern.to_owned()], ..Selection::default() };
    assert_eq!(names(&filter("b*")), ["bad", "big"]);
    assert_eq!(names(&Selection { kind: Some(Kind::Either), ..filter("b*") }), ["big"]);
    assert_eq!(names(&filter("good@s3,t3,r9/full")), ["good"]);
    assert_eq!(names(&filter("*@s3*")), ["good", "bad", "big"]);
    let two = Selection { filter: ["good", "big"].map(str::to_owned).to_vec(), ..Selection::default() };
    assert_eq!(names(&two), ["good", "big"]);
}

#[test]
fn a_selection_of_nothing_names_the_wrong_word() {
    let vectors = Vectors::new();
    let suite = vectors.suite();
    let some = |word: &str| Some(word.to_owned());
    let none = Selection::default;
    for (selection, why) in [
        (Selection { filter: vec!["[".to_owned()], ..none() }, "--filter ["),
        (
            Selection { filter: ["b*", "goad*"].map(str::to_owned).to_vec(), ..none() },
            "goad*; similar vectors are good",
        ),
        (Selection { area: some("streams"), ..none() }, "no area 'streams'; there are stream"),
        (Selection { feature: some("bframes"), ..none() }, "no feature 'bframes'; there are b-frames"),
        (Selection { requirement: some("SS-XX-002"), ..none() }, "similar requirements are SS-XX-001"),
        (Selection { kind: Some(Kind::Either), filter: vec!["good".to_owned()], ..none() }, "by all of them"),
    ] {
        let error = selection.of(Case::all(&suite)).unwrap_err().to_string();
        assert!(error.contains(why), "{error}");
    }
}

#[test]
fn an_unknown_claim_is_refused_with_those_that_exist() {
    let file = tempfile::NamedTempFile::new().unwrap();
    for (key, value, why) in [
        (
            "features",
            json!(["bframes"]),
            "no feature 'bframes'; did you mean b-frames? There are predicted, b-frames",
        ),
        ("level", json!(7), "no level 7; there are 1 to 4"),
        ("profiles", json!([0, 3]), "no profile 3; there are 0 and 1"),
        ("name", json!(""), "the name is empty"),
        ("modes", json!(["half"]), "unknown variant `half`, expected one of `full`, `subset`, `inside`"),
        ("colour", json!(true), "unknown field `colour`"),
    ] {
        let mut claim = json!({"schema": "splatstream-capabilities/1", "name": "mine"});
        claim[key] = value;
        fs::write(file.path(), claim.to_string()).unwrap();
        let error = Capabilities::read(file.path()).unwrap_err().to_string();
        assert!(error.contains(why), "{error}");
    }
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
