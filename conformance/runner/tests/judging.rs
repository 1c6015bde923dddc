//! What each answer is called.
#![cfg(unix)]
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed test")]

mod common;

use common::{Vectors, WRITE, labels, results, settings};
use splatstream_conformance::command::split;
use splatstream_conformance::limits::Limits;
use splatstream_conformance::run::Settings;
use splatstream_conformance::session::Decoder;
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
