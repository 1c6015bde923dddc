//! The verdict on each answer.
#![cfg(unix)]
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed test")]

mod common;

use common::{Vectors, WRITE, labels, results, settings};
use serde_json::{Value, json};
use splatstream_conformance::command::split;
use splatstream_conformance::limits::Limits;
use splatstream_conformance::report::{Report, summary};
use splatstream_conformance::result::CaseResult;
use splatstream_conformance::run::Settings;
use splatstream_conformance::selection::Selection;
use splatstream_conformance::session::Decoder;
use splatstream_conformance::symptom::Symptom;
use splatstream_conformance::vector::Mode;
use std::collections::BTreeSet;
use std::time::{Duration, Instant};

#[test]
fn right_answers_pass_and_each_of_several_right_ones() {
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
fn a_wrong_code_is_a_warning_or_in_a_strict_run_a_failure() {
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
fn a_strict_run_requires_a_code_and_the_class_of_the_exit_code() {
    let vectors = Vectors::new();
    let said = |line: &str, strict| {
        let settings = Settings { strict, ..settings(&format!("echo \"{line}\" >&2; exit 11")) };
        let all = results(&vectors.suite(), &settings);
        let bad = all.into_iter().find(|result| result.vector == "bad").unwrap();
        (bad.label(), bad.detail.unwrap_or_default())
    };
    for (line, why) in [
        ("", "no code: the last line on standard error is not a JSON object"),
        ("done", "is not a JSON object: \"done\""),
        ("7", "is not a JSON object: \"7\""),
        ("{\\\"class\\\":\\\"invalid\\\"}", "the JSON object has no code"),
        (
            "{\\\"code\\\":\\\"RANGE\\\",\\\"class\\\":\\\"malformed\\\"}",
            "says malformed, the exit code invalid",
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
fn a_decoder_that_removes_its_folder_fails_only_that_case() {
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
fn files_with_other_names_are_reported_with_the_right_names() {
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

/// The verdict on a decoder of a vector whose units 1 and 2 have entropy states.
fn entropy(script: &str, is_claimed: bool) -> (&'static str, String) {
    let vectors = Vectors::none();
    vectors.add("valid", "states", json!({"outcome": "accept"}), |record| {
        let unit = |state: Option<&str>| {
            let mut unit = json!({"at": 16, "bytes": 20, "type": "increment"});
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
        ("true".to_owned(), true, "u0001.entropy is claimed and missing"),
        (write(1, "00000000000000AB"), false, "u0001.entropy is 00000000000000AB: use lower-case digits"),
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
fn a_violation_of_the_protocol_is_explained() {
    let vectors = Vectors::new();
    let verdict = |script: &str| {
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
            "no answer within 0.3 s; --time SECONDS allows more; an answer is a line",
        ),
    ] {
        let (found, detail) = verdict(script);
        assert!(found == label && detail.contains(why), "{script}: {found}: {detail}");
    }
}

#[test]
fn a_cancelled_run_ends_at_once_and_leaves_no_process() {
    let vectors = Vectors::new();
    let suite = vectors.suite();
    let (folder, start) = (tempfile::tempdir().unwrap(), Instant::now());
    let alive = folder.path().join("alive");
    let script = format!(
        "case $(cat $1) in bad) while true; do date > {}; sleep 0.1; done;; esac; exit 12",
        alive.display()
    );
    let settings = Settings { jobs: 1, ..settings(&script) };
    let cancel = settings.cancel.clone();
    let results = std::thread::scope(|scope| {
        scope.spawn(|| {
            while !alive.exists() && start.elapsed() < Duration::from_secs(9) {
                std::thread::sleep(Duration::from_millis(5));
            }
            cancel.set();
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
    // Processes that it leaves neither delay the runner nor go on.
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

/// The results of a run over one changed vector.
fn of_one(kind: &str, expect: Value, change: impl FnOnce(&mut Value), settings: &Settings) -> CaseResult {
    let vectors = Vectors::none();
    vectors.add(kind, "one", expect, change);
    results(&vectors.suite(), settings).remove(0)
}

#[test]
fn each_fault_of_a_unit_with_several_is_right() {
    let expect = || json!({"outcome": "reject", "class": "invalid", "code": "RANGE"});
    let change = |record: &mut Value| {
        record["acceptable"] = json!([{"class": "invalid", "code": "RANGE"}, {"class": "invalid", "code": "MISMATCH"},
                {"class": "malformed", "code": "NUMBER"}]);
    };
    for (code, exit, label) in [
        ("RANGE", 11, "pass"),
        ("MISMATCH", 11, "pass"),
        ("NUMBER", 10, "pass"),
        ("NUMBER", 11, "wrong-code"),
        ("DIGEST", 11, "wrong-code"),
        ("OVER_LIMIT", 13, "wrong-class"),
    ] {
        let script = format!("{WRITE}; echo \"{{\\\"code\\\":\\\"{code}\\\"}}\" >&2; exit {exit}");
        let result = of_one("invalid", expect(), change, &Settings { strict: true, ..settings(&script) });
        assert_eq!(result.label(), label, "{code}: {result:#?}");
        assert_eq!(result.expected, "invalid RANGE or invalid MISMATCH or malformed NUMBER");
    }
}

#[test]
fn lost_frames_are_compared_if_the_decoder_reports_them() {
    let expect = || json!({"outcome": "reject", "class": "invalid", "code": "RANGE"});
    let change = |record: &mut Value| {
        record["points"] = json!([{"op": "s0,t0,r0", "mode": "full", "states": [0], "lost": [[3, 5]]}]);
    };
    for (said, label) in
        [("{}", "pass"), ("{\\\"lost\\\":[[3,5]]}", "pass"), ("{\\\"lost\\\":[]}", "wrong-lost")]
    {
        let script = format!("{WRITE}; echo \"{said}\" >&2; exit 11");
        assert_eq!(of_one("invalid", expect(), change, &settings(&script)).label(), label, "{said}");
    }
}

#[test]
fn every_prefix_of_a_swept_stream_is_decoded_and_the_first_wrong_one_is_named() {
    let expect = || json!({"outcome": "reject", "class": "truncated", "code": "TRUNCATED"});
    // The stream is `one`: the frame comes out of the prefix of two bytes.
    let change = |record: &mut Value| {
        record["sweep"] =
            json!({"cut": "every byte", "steps": [{"bytes": 0, "states": []}, {"bytes": 2, "states": [0]}]});
    };
    let right = format!("case $(cat $1) in on) {WRITE};; esac; exit 14");
    assert_eq!(of_one("invalid", expect(), change, &settings(&right)).label(), "pass");
    for (script, label, detail) in [
        ("exit 14", "missing-files", "cut after 2 bytes: missing: "),
        ("case $(cat $1) in o) exit 11;; esac; exit 14", "wrong-class", "cut after 1 bytes"),
        ("exit 0", "wrong-outcome", "cut after 0 bytes"),
    ] {
        let result = of_one("invalid", expect(), change, &settings(script));
        let found = result.detail.clone().unwrap_or_default();
        assert!(result.label() == label && found.starts_with(detail), "{script}: {result:#?}");
    }
}

#[test]
fn a_decoder_that_starts_inside_gets_mode_inside_and_the_bytes_from_the_gop_header_on() {
    let change = |record: &mut Value| record["inside"] = json!(2);
    let script = format!("test $3 = inside && test $(cat $1) = e && {WRITE}");
    let result = of_one("valid", json!({"outcome": "accept"}), change, &settings(&script));
    assert_eq!((result.label(), result.case_name().as_str()), ("pass", "one@s3,t3,r9/inside"), "{result:#?}");
    let mut narrow = settings(&script);
    narrow.capabilities.modes = vec![Mode::Full];
    let result = of_one("valid", json!({"outcome": "accept"}), change, &narrow);
    assert_eq!(result.label(), "not-claimed");
}

#[test]
fn failures_of_one_cause_are_listed_once() {
    let vectors = Vectors::new();
    vectors.add("valid", "great", json!({"outcome": "accept"}), |_| {});
    let suite = vectors.suite();
    let settings = settings("case $(cat $1) in bad) exit 11;; big) exit 7;; esac; exit 12");
    let report =
        Report::new(&suite, &settings, &Selection::default(), results(&suite, &settings), Vec::new());
    let text = summary::text(&report);
    assert_eq!(text.matches("FAIL").count(), 2, "{text}");
    assert!(text.contains("likewise 1 case: great@s3,t3,r9/full"), "{text}");
}

#[test]
fn failures_are_grouped_by_their_kind_and_not_by_what_differs_in_their_texts() {
    let vectors = Vectors::new();
    for (name, code) in [("first", "CHECKSUM"), ("second", "NUMBER"), ("third", "NUMBER")] {
        let expect = json!({"outcome": "reject", "class": "malformed", "code": code});
        vectors.add("invalid", name, expect, |_| {});
    }
    let suite = vectors.suite();
    let said = |settings: &Settings| {
        let results = results(&suite, settings);
        let texts: BTreeSet<_> = results.iter().map(|result| result.detail.clone()).collect();
        (summary::text(&Report::new(&suite, settings, &Selection::default(), results, Vec::new())), texts)
    };
    // Every answer is another text that is none: the request itself.
    let (text, texts) = said(&Settings { decoder: Decoder::Persistent(vec!["cat".into()]), ..settings("") });
    assert_eq!(text.matches("FAIL").count(), 1, "{text}");
    assert!(text.contains("does not start with an exit code") && texts.len() > 3, "{text}");
    // Every crash has another last message.
    let (text, texts) = said(&settings("echo cannot read $1 >&2; exit 1"));
    assert_eq!(text.matches("FAIL").count(), 1, "{text}");
    assert!(text.contains("last message: cannot read") && texts.len() > 3, "{text}");
    // What is wrong is the class, not the code that is missed.
    let (text, _) = said(&settings("exit 11"));
    assert!(text.contains("expected of all: malformed NUMBER (2), malformed CHECKSUM (1)"), "{text}");
}
