//! The example adapters work.
#![cfg(unix)]
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed test")]

mod common;

use common::settings;
use splatstream_conformance::capabilities::Capabilities;
use splatstream_conformance::case::Case;
use splatstream_conformance::command::{Template, split};
use splatstream_conformance::result::{CaseResult, Outcome};
use splatstream_conformance::run::{Settings, run};
use splatstream_conformance::session::Decoder;
use splatstream_conformance::suite::Suite;
use splatstream_conformance::vector::Kind;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

fn conformance() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_path_buf()
}

/// The results of a decoder on a few small vectors of each kind.
fn results(decoder: Decoder, capabilities: Capabilities) -> Vec<CaseResult> {
    let suite = Suite::read(&conformance().join("vectors")).unwrap();
    let mut located: Vec<_> = suite.vectors.iter().collect();
    located.sort_by_key(|located| located.vector.bytes);
    let some = |kind| located.iter().filter(move |located| located.vector.kind == kind).step_by(9).take(5);
    let few: Vec<&str> =
        some(Kind::Valid).chain(some(Kind::Invalid)).map(|located| located.vector.name.as_str()).collect();
    let cases: Vec<Case<'_>> =
        Case::all(&suite).into_iter().filter(|case| few.contains(&case.vector.name.as_str())).collect();
    let mut settings = Settings { decoder, capabilities, ..settings("") };
    settings.limits.time = Duration::from_secs(60);
    run(&cases, &settings, |_| {}).unwrap()
}

/// Whether a program can be started here; without it the other tests can still run.
fn is_there(program: &str) -> bool {
    Command::new(program).arg("--version").output().is_ok()
}

fn assert_all(results: &[CaseResult], outcome: Outcome) {
    let others: Vec<&CaseResult> = results.iter().filter(|result| result.outcome != outcome).collect();
    assert!(!results.is_empty() && others.is_empty(), "{others:#?}");
}

#[test]
fn the_python_adapter_passes_with_states_of_the_entropy_decoder_and_output() {
    if !is_there("python3") {
        return;
    }
    let folder = conformance().join("adapters/python");
    let claim = || Capabilities::read(&folder.join("capabilities.json")).unwrap();
    let adapter = folder.join("adapter.py");
    let adapter = adapter.display();
    let command = format!("python3 '{adapter}' --in {{in}} --op {{op}} --mode {{mode}} --out {{out}}");
    assert_all(&results(Decoder::Once(Template::parse(&command).unwrap()), claim()), Outcome::Pass);
    let words = split(&format!("python3 '{adapter}' --stdio")).unwrap();
    assert_all(&results(Decoder::Persistent(words), claim()), Outcome::Pass);
}

#[test]
fn the_shell_adapter_passes() {
    if !is_there("python3") {
        return;
    }
    let adapter = conformance().join("adapters/shell/adapter.sh");
    let command = format!("'{}' {{in}} {{op}} {{mode}} {{out}}", adapter.display());
    let decoder = Decoder::Once(Template::parse(&command).unwrap());
    assert_all(&results(decoder, Capabilities::everything("shell")), Outcome::Pass);
}

#[test]
fn the_c_adapter_compiles_without_a_warning_and_answers_unsupported() {
    if !is_there("cc") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let (source, program) = (conformance().join("adapters/c/adapter.c"), folder.path().join("adapter"));
    let mut compiler = Command::new("cc");
    compiler.args(["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-o"]).arg(&program).arg(source);
    assert!(compiler.status().unwrap().success());
    let program = program.display();
    let once =
        Decoder::Once(Template::parse(&format!("'{program}' {{in}} {{op}} {{mode}} {{out}}")).unwrap());
    let persistent = Decoder::Persistent(split(&format!("'{program}' --stdio")).unwrap());
    for decoder in [once, persistent] {
        let mut results = results(decoder, Capabilities::everything("c"));
        results.retain(|result| result.kind == Kind::Valid);
        assert_all(&results, Outcome::Unsupported);
    }
}
