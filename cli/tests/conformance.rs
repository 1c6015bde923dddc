//! The conformance command as a user runs it.
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed test")]

mod common;

use common::{directory, fail, fixture, json, run, succeed, text};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

fn vectors() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../conformance/vectors")
}

/// Arguments of a subcommand on the vectors of the repository.
fn on_vectors<'a>(command: &'a str, vectors: &'a Path, more: &[&'a str]) -> Vec<&'a str> {
    [&["conformance", command, "--suite", text(vectors)], more].concat()
}

// covers: SS-ER-004
#[test]
fn the_reference_passes_every_case_of_the_suite() {
    let vectors = vectors();
    let report = json(&on_vectors("run", &vectors, &[]));
    let summary = &report["summary"];
    assert_eq!(
        summary["pass"].as_u64().unwrap(),
        report["cases"].as_array().unwrap().len() as u64,
        "{summary}"
    );
    assert!(summary["pass"].as_u64().unwrap() >= 1000, "{summary}");
}

#[test]
fn a_decoder_that_fails_is_3_and_reports_are_written() {
    let (vectors, directory) = (vectors(), directory());
    let file = |name: &str| directory.path().join(name);
    let (report, junit, page) = (file("report.json"), file("report.xml"), file("report.md"));
    let arguments = on_vectors("run", &vectors, &["--kind", "invalid", "--area", "bytes", "--stdio", "cat"]);
    let reports = ["--report", text(&report), "--junit", text(&junit), "--markdown", text(&page)];
    let output = run(&[arguments, reports.to_vec()].concat());
    assert_eq!(output.status.code(), Some(3), "{}", String::from_utf8_lossy(&output.stderr));
    let told = String::from_utf8(output.stdout).unwrap();
    assert!(told.starts_with("FAIL ") && told.contains("cat: NOT GOOD: no case passed"), "{told}");
    let report: Value = serde_json::from_str(&fs::read_to_string(report).unwrap()).unwrap();
    assert!(report["cases"][0]["outcome"] == "crash" && report["decoder"]["name"] == "cat", "{report}");
    let xml = fs::read_to_string(junit).unwrap();
    assert!(
        roxmltree::Document::parse(&xml).unwrap().descendants().any(|node| node.has_tag_name("error")),
        "{xml}"
    );
    assert!(fs::read_to_string(page).unwrap().contains("| crash |"));
}

#[test]
fn a_page_of_decoders_is_made_of_reports() {
    let (vectors, directory) = (vectors(), directory());
    let (report, page) = (directory.path().join("report.json"), directory.path().join("DECODERS.md"));
    succeed(&on_vectors("run", &vectors, &["--area", "geometry", "--report", text(&report)]));
    succeed(&["conformance", "matrix", text(&report), text(&report), "-o", text(&page)]);
    let page = fs::read_to_string(page).unwrap();
    assert!(page.contains("| Feature | reference | reference |") && page.contains("| Yes | Yes |"), "{page}");
}

#[test]
fn vectors_are_listed_with_what_they_are_for() {
    let vectors = vectors();
    let listed = succeed(&on_vectors("list", &vectors, &["--area", "geometry"]));
    assert!(listed.starts_with("valid/geometry\n"), "{listed}");
    let rows = json(&on_vectors("list", &vectors, &["--area", "geometry"]));
    assert!(rows[0]["purpose"].as_str().unwrap().len() > 10, "{rows}");
}

#[test]
fn what_cannot_be_run_is_1_or_2_with_what_to_do() {
    let vectors = vectors();
    assert!(fail(1, &["conformance", "run", "--suite", "no-such"]).contains("--suite DIR"));
    let said = fail(1, &on_vectors("run", &vectors, &["--stdio", "./no-such-decoder"]));
    assert!(said.contains("no-such-decoder: cannot start") && said.contains("check the path"), "{said}");
    assert!(fail(2, &on_vectors("run", &vectors, &["--decoder", "mydec {in}"])).contains("no {out}"));
    assert!(
        fail(2, &on_vectors("run", &vectors, &["--filter", "no-such-vector"])).contains("conformance list")
    );
    assert!(fail(2, &on_vectors("run", &vectors, &["--memory", "much"])).contains("write 512M or 2G"));
}

#[test]
fn our_decoder_speaks_the_protocol() {
    let directory = directory();
    let decode = |input: &Path| {
        run(&[
            "conformance",
            "decode",
            "--in",
            text(input),
            "--op",
            "s0,t0,r0",
            "--out",
            text(directory.path()),
        ])
    };
    assert_eq!(decode(&fixture()).status.code(), Some(0));
    let position = fs::metadata(directory.path().join("f0000.position.i32")).unwrap().len();
    let opacity = fs::metadata(directory.path().join("f0000.opacity.i32")).unwrap().len();
    assert!(opacity > 0 && position == 3 * opacity);
    let broken = directory.path().join("broken.gss");
    fs::write(&broken, "no stream at all").unwrap();
    let output = decode(&broken);
    assert_eq!(output.status.code(), Some(10));
    let said: Value = serde_json::from_slice(&output.stderr).unwrap();
    assert_eq!(said["code"], "SIGNATURE");
}
