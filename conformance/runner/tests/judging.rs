//! What each answer is called.
#![cfg(unix)]
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed test")]

mod common;

use common::{Vectors, WRITE, labels, results, settings};
use serde_json::json;
use splatstream_conformance::command::split;
use splatstream_conformance::limits::Limits;
use splatstream_conformance::report::Report;
use splatstream_conformance::result::CaseResult;
use splatstream_conformance::run::Settings;
use splatstream_conformance::selection::Selection;
use splatstream_conformance::session::Decoder;
use splatstream_conformance::symptom::Symptom;
use std::time::{Duration, Instant};

#[test]
fn the_right_answers_pass_and_of_two_right_ones_either_does() {
    let right = "case $(cat $1) in bad) exit 11;; esac;";
    assert_eq!(labels(&format!("{right} {WRITE}")), ["pass", "pass", "pass"]);
    assert_eq!(
        labels(&format!("{right} case $(cat $1) in big) exit 13;; esac; {WRITE}")),
        ["pass", "pass", "pass"]
    );
}

#[test]
fn every_exit_code_has_its_name() {
    for (code, names) in [
        (0, ["missing-files", "wrong-outcome", "missing-files"]),
        (10, ["wrong-outcome", "wrong-class", "wrong-outcome"]),
        (11, ["wrong-outcome", "pass", "wrong-outcome"]),
        (12, ["unsupported", "wrong-class", "unsupported"]),
        (13, ["over-limit", "wrong-class", "pass"]),
        (14, ["truncated", "wrong-class", "truncated"]),
        (1, ["crash"; 3]),
        (255, ["crash"; 3]),
    ] {
        assert_eq!(labels(&format!("exit {code}")), names, "exit code {code}");
    }
}

#[test]
fn a_signal_is_a_crash() {
    assert_eq!(labels("kill -SEGV $$"), ["crash"; 3]);
}

#[test]
fn files_are_judged_by_their_bytes_and_their_names() {
    assert_eq!(
        labels(&format!("{WRITE}; printf abce > $4/f0000.dc.i32")),
        ["wrong-planes", "wrong-outcome", "wrong-planes"]
    );
    assert_eq!(labels(&format!("{WRITE}; : > $4/f0001.dc.i32"))[0], "extra-files");
    assert_eq!(labels(&format!("{WRITE}; mkdir $4/more"))[0], "extra-files");
    assert_eq!(labels(&format!("{WRITE}; ln -s /etc/passwd $4/meta.json"))[0], "extra-files");
    assert_eq!(
        labels(&format!("{WRITE}; rm $4/f0000.dc.i32; ln -s f0000.opacity.i32 $4/f0000.dc.i32"))[0],
        "missing-files"
    );
    assert_eq!(labels(&format!("{WRITE}; : > $4/meta.json"))[0], "pass");
}

#[test]
fn a_wrong_code_is_a_warning_and_if_asked_for_a_failure() {
    let vectors = Vectors::new();
    let script =
        "echo \"{\\\"code\\\":\\\"DIGEST\\\",\\\"clause\\\":\\\"6.2\\\",\\\"byte\\\":3}\" >&2; exit 11";
    let bad = |settings: &Settings| {
        results(&vectors.suite(), settings).into_iter().find(|result| result.vector == "bad").unwrap()
    };
    let lenient = bad(&settings(script));
    assert_eq!(
        (lenient.label(), lenient.warnings.len(), lenient.notes.len()),
        ("pass", 1, 1),
        "{lenient:#?}"
    );
    let strict = bad(&Settings { strict: true, ..settings(script) });
    assert_eq!(strict.label(), "wrong-code");
}

#[test]
fn who_is_strict_demands_a_code_and_the_class_of_the_exit_code() {
    let vectors = Vectors::new();
    let said = |line: &str, strict| {
        let settings = Settings { strict, ..settings(&format!("echo \"{line}\" >&2; exit 11")) };
        let all = results(&vectors.suite(), &settings);
        let bad = all.into_iter().find(|result| result.vector == "bad").unwrap();
        (bad.label(), bad.detail.unwrap_or_default())
    };
    for (line, why) in [
        ("", "no code: the last line on standard error is no JSON object"),
        ("done", "is no JSON object: \"done\""),
        ("7", "is no JSON object: \"7\""),
        ("{\\\"class\\\":\\\"invalid\\\"}", "the JSON object has no code"),
        (
            "{\\\"code\\\":\\\"RANGE\\\",\\\"class\\\":\\\"malformed\\\"}",
            "says malformed and the exit code invalid",
        ),
        ("{\\\"code\\\":3}", "invalid type"),
    ] {
        assert_eq!(said(line, false).0, "pass", "{line}");
        let (label, detail) = said(line, true);
        assert!(label == "wrong-code" && detail.contains(why), "{line}: {label}: {detail}");
    }
    assert_eq!(said("{\\\"code\\\":\\\"RANGE\\\"}", true).0, "pass");
}

#[test]
fn a_decoder_that_does_away_with_its_folder_fails_that_case_alone() {
    let vectors = Vectors::new();
    for change in ["rm -r $4", "rm -r $4; echo > $4", "rm -r $(dirname $4)"] {
        let script =
            format!("case $(cat $1) in big) {WRITE};; good) {change};; bad) {change}; exit 11;; esac");
        let all = results(&vectors.suite(), &Settings { jobs: 1, ..settings(&script) });
        let labels: Vec<&str> = all.iter().map(CaseResult::label).collect();
        assert_eq!(labels, ["missing-files", "missing-files", "pass"], "{all:#?}");
        assert_eq!(all[0].detail.as_deref(), Some("the decoder removed its output folder"));
        assert_eq!(all[0].symptom, None);
    }
}

#[test]
fn files_with_other_names_are_told_with_those_that_are_right() {
    let vectors = Vectors::new();
    let first = |script: &str| results(&vectors.suite(), &settings(script)).remove(0);
    let shorter =
        first("for a in position log_scale opacity rotation dc; do printf abcd > $4/f000.$a.i32; done");
    let detail = shorter.detail.unwrap();
    assert!(
        detail.contains("found instead: f000.dc.i32, ") && detail.ends_with("names are f%04d.ATTRIBUTE.i32")
    );
    assert_eq!(shorter.symptom, None);
    let later =
        first("for a in position log_scale opacity rotation dc; do printf abcd > $4/f0001.$a.i32; done");
    assert_eq!(later.symptom, Some(Symptom::OtherNumbers));
    assert_eq!(first("exit 0").symptom, Some(Symptom::NothingWritten));
}

/// What a decoder of one vector with states of the entropy decoder is told: units 1 and 2 have some.
fn entropy(script: &str, is_claimed: bool) -> (&'static str, String) {
    let vectors = Vectors::none();
    vectors.add("valid", "states", json!({"outcome": "accept"}), |record| {
        let unit = |state: Option<&str>| {
            let mut unit = json!({"at": 16, "bytes": 20, "type": "refinement"});
            if let Some(state) = state {
                unit["entropy"] = json!(state);
            }
            unit
        };
        record["units"] = json!([unit(None), unit(Some("00000000000000ab")), unit(Some("00000000000000cd"))]);
    });
    let mut settings = settings(&format!("{WRITE}; {script}"));
    settings.capabilities.entropy = is_claimed;
    let result = results(&vectors.suite(), &settings).remove(0);
    (result.label(), result.detail.unwrap_or_default())
}

#[test]
fn states_of_the_entropy_decoder_are_compared_where_they_are_written_or_claimed() {
    let write = |unit: u32, state: &str| format!("echo {state} > $4/u{unit:04}.entropy");
    let right = [write(1, "00000000000000ab"), write(2, "00000000000000cd")].join("; ");
    assert_eq!((entropy(&right, true).0, entropy("true", false).0), ("pass", "pass"));
    assert_eq!(entropy(&write(2, "00000000000000cd"), false).0, "pass");
    for (script, is_claimed, why) in [
        ("true".to_owned(), true, "u0001.entropy is claimed and not there"),
        (write(1, "00000000000000AB"), false, "u0001.entropy is 00000000000000AB: write lower-case letters"),
        (write(2, "1"), false, "u0002.entropy is 1 and should be 00000000000000cd, 1 in all"),
        (write(0, "1"), false, "u0000.entropy: unit 0 has no entropy state"),
        (write(7, "1"), false, "u0007.entropy: unit 7 has no entropy state"),
        (write(3, "00000000000000cd"), false, "units count from 0"),
        (
            [write(2, "00000000000000ab"), write(3, "00000000000000cd")].join("; "),
            false,
            "units count from 0",
        ),
    ] {
        let (label, detail) = entropy(&script, is_claimed);
        assert!(label == "wrong-entropy" && detail.contains(why), "{script}: {label}: {detail}");
    }
}

#[test]
fn a_process_that_breaks_the_protocol_is_told_how() {
    let vectors = Vectors::new();
    let told = |script: &str| {
        let decoder = Decoder::Persistent(split(&format!("sh -c '{script}'")).unwrap());
        let limits = Limits { time: Duration::from_millis(300), ..Limits::default() };
        let all = results(&vectors.suite(), &Settings { decoder, limits, jobs: 1, ..settings("") });
        (all[0].label(), all[0].detail.clone().unwrap_or_default())
    };
    for (script, label, why) in [
        ("read line; echo decoding", "crash", "the answer \"decoding\" does not start with an exit code"),
        ("read line; exit 3", "crash", "the process ended with exit code 3 before it answered"),
        ("read line; kill -9 $$", "crash", "ended by a signal before it answered"),
        (
            "read line; printf 0; sleep 9",
            "timeout",
            "not done within 0.3 s; --time SECONDS allows more; an answer is a line",
        ),
    ] {
        let (found, detail) = told(script);
        assert!(found == label && detail.contains(why), "{script}: {found}: {detail}");
    }
}

#[test]
fn a_run_that_is_stopped_ends_at_once_and_leaves_no_process() {
    let vectors = Vectors::new();
    let suite = vectors.suite();
    let (folder, start) = (tempfile::tempdir().unwrap(), Instant::now());
    let alive = folder.path().join("alive");
    let script = format!(
        "case $(cat $1) in bad) while true; do date > {}; sleep 0.1; done;; esac; exit 12",
        alive.display()
    );
    let settings = Settings { jobs: 1, ..settings(&script) };
    let stop = settings.stop.clone();
    let results = std::thread::scope(|scope| {
        scope.spawn(|| {
            while !alive.exists() && start.elapsed() < Duration::from_secs(9) {
                std::thread::sleep(Duration::from_millis(5));
            }
            stop.set();
        });
        results(&suite, &settings)
    });
    assert!(start.elapsed() < Duration::from_secs(5), "{:?}", start.elapsed());
    assert_eq!(results.len(), 1, "{results:#?}");
    let report = Report::new(&suite, &settings, &Selection::default(), results, Vec::new());
    assert_eq!(report.interrupted, Some(3));
    std::fs::remove_file(&alive).unwrap();
    std::thread::sleep(Duration::from_millis(300));
    assert!(!alive.exists());
}

#[test]
fn a_decoder_is_killed_with_all_that_it_started() {
    let vectors = Vectors::new();
    let start = Instant::now();
    let limits = Limits { time: Duration::from_millis(200), ..Limits::default() };
    let sleeping = Settings { limits, ..settings("sleep 60; exit 0") };
    assert!(results(&vectors.suite(), &sleeping).iter().all(|result| result.label() == "timeout"));
    // What it leaves behind does not keep the runner, nor does it live on.
    let leaving = settings("echo $$ > $4/meta.json; sleep 60 & exit 12");
    assert!(results(&vectors.suite(), &leaving).iter().all(|result| result.label() != "timeout"));
    assert!(start.elapsed() < Duration::from_secs(20), "{:?}", start.elapsed());
}

#[test]
fn a_persistent_decoder_is_started_again_after_it_broke_off() {
    let vectors = Vectors::new();
    let script = "read line; case $line in *bad*) kill -9 $$;; esac; echo 12; read line; echo nonsense";
    let decoder = Decoder::Persistent(split(&format!("sh -c '{script}'")).unwrap());
    let results = results(&vectors.suite(), &Settings { decoder, jobs: 1, ..settings("") });
    let answers: Vec<&str> = results.iter().filter_map(|result| result.answer.as_deref()).collect();
    // In the order of the suite: good, bad, big.
    assert_eq!(answers, ["unsupported", "no answer", "unsupported"]);
}
