//! The conformance command as a user runs it.

use crate::common::{directory, fail, fixture, json, run, succeed, text};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

fn vectors() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../conformance/vectors")
}

/// Arguments of a subcommand on the vectors of the repository.
fn on_vectors<'a>(command: &'a str, vectors: &'a Path, more: &[&'a str]) -> Vec<&'a str> {
    [&["conformance", command, "--suite", text(vectors)], more].concat()
}

// covers: SS-ER-006
#[test]
fn the_reference_passes_every_case_of_the_suite() {
    let vectors = vectors();
    let report = json(&on_vectors("run", &vectors, &["--strict"]));
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
fn no_report_replaces_a_file_of_the_suite() {
    let directory = directory();
    let [from, suite] = [vectors().join("valid/geometry"), directory.path().join("valid/geometry")];
    let folder = fs::read_dir(from).unwrap().next().unwrap().unwrap();
    let copy = suite.join(folder.file_name());
    fs::create_dir_all(&copy).unwrap();
    let files = ["in.gss", "vector.json"];
    for file in files {
        fs::copy(folder.path().join(file), copy.join(file)).unwrap();
    }
    for file in files {
        let report = directory.path().join("report.json");
        fs::hard_link(copy.join(file), &report).unwrap();
        let said = fail(2, &on_vectors("run", directory.path(), &["--report", text(&report)]));
        assert!(said.contains("this command reads that file"), "{said}");
        assert_eq!(fs::read(folder.path().join(file)).unwrap(), fs::read(&report).unwrap());
        fs::remove_file(report).unwrap();
    }
}

#[test]
fn a_page_of_decoders_is_made_of_reports() {
    let (vectors, directory) = (vectors(), directory());
    let (report, page) = (directory.path().join("report.json"), directory.path().join("DECODERS.md"));
    succeed(&on_vectors("run", &vectors, &["--area", "geometry", "--report", text(&report)]));
    succeed(&["conformance", "matrix", text(&report), text(&report), "-o", text(&page)]);
    let page = fs::read_to_string(page).unwrap();
    let name = concat!("reference ", env!("CARGO_PKG_VERSION"));
    assert!(page.contains(&format!("| Feature | {name} | {name} (2) |")), "{page}");
    assert!(page.contains("| part: ") && !page.contains("| Yes"), "{page}");
    let said = fail(1, &["conformance", "matrix", text(&vectors.join("../VERSION")), "-o", "no.md"]);
    assert!(said.contains("VERSION: not a report of a run"), "{said}");
}

#[test]
fn vectors_are_listed_with_what_they_are_for() {
    let vectors = vectors();
    let listed = succeed(&on_vectors("list", &vectors, &["--area", "geometry"]));
    assert!(listed.starts_with("valid/geometry\n") && listed.contains("SS-"), "{listed}");
    let rows = json(&on_vectors("list", &vectors, &["--area", "geometry"]));
    assert!(rows[0]["purpose"].as_str().unwrap().len() > 10, "{rows}");
}

#[test]
fn what_cannot_be_run_is_1_or_2_with_what_to_do() {
    let vectors = vectors();
    assert!(fail(1, &["conformance", "run", "--suite", "no-such"]).contains("--suite DIR"));
    let said = fail(1, &on_vectors("run", &vectors, &["--stdio", "./no-such-decoder"]));
    assert!(said.contains("no-such-decoder: cannot start") && said.contains("check the path"), "{said}");
    let said = fail(1, &on_vectors("run", &vectors, &["--stdio", "./no-such-decoder --stdio | cat"]));
    assert!(said.contains("warning: '|' is for a shell") && said.contains("use sh -c '...'"), "{said}");
    assert!(
        fail(1, &["conformance", "run", "--suite", text(&vectors.join("../VERSION"))]).contains("is a file")
    );
    let said = fail(1, &["conformance", "run", "--suite", text(&vectors.join("../.."))]);
    assert!(said.contains("did you mean --suite") && said.contains("conformance/vectors"), "{said}");
    let refused = |command: &str| fail(2, &on_vectors("run", &vectors, &["--decoder", command]));
    let said = refused("mydec {in}");
    assert!(said.contains("no {out}") && said.contains("splatstream conformance run --help"), "{said}");
    assert!(refused("mydec {input} {out}").contains("'{input}' is not a placeholder"));
    assert!(refused("mydec {in} {mode} {out}").contains("the command has no {op}"));
    let said = fail(2, &on_vectors("run", &vectors, &["--filter", "no-such-vector"]));
    assert!(said.contains("no case is called no-such-vector; similar vectors are "), "{said}");
    assert!(fail(2, &on_vectors("run", &vectors, &["--time", "soon"])).contains("write seconds"));
    assert!(fail(2, &on_vectors("run", &vectors, &["--memory", "much"])).contains("write 512M or 2G"));
}

#[test]
fn a_claim_of_nothing_and_expectations_of_what_is_not_there_are_refused() {
    let (vectors, directory) = (vectors(), directory());
    let file = |name: &str, content: &str| {
        let path = directory.path().join(name);
        fs::write(&path, content).unwrap();
        path
    };
    let claim = |more: &str| {
        file(
            "mine.json",
            &format!("{{\"schema\": \"splatstream-capabilities/1\", \"name\": \"mine\", {more}}}"),
        )
    };
    let run = |arguments: &[&str]| {
        fail(1, &on_vectors("run", &vectors, &[&["--stdio", "cat"], arguments].concat()))
    };
    let narrow = claim("\"profiles\": [0]");
    let said = run(&["--area", "temporal", "--kind", "valid", "--capabilities", text(&narrow)]);
    assert!(said.contains("claim none of the selected cases"), "{said}");
    let wrong = claim("\"features\": [\"bframes\"]");
    assert!(run(&["--capabilities", text(&wrong)]).contains("did you mean b-frames"));
    let list = file("list.txt", "no-such-vector crash # to be done\n");
    assert!(
        run(&["--area", "geometry", "--expectations", text(&list)])
            .contains("there is no case no-such-vector")
    );
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_tells_what_it_found_and_leaves_nothing_behind() {
    let (vectors, directory) = (vectors(), directory());
    let (report, started) = (directory.path().join("report.json"), directory.path().join("started"));
    let temporary = directory.path().join("temporary");
    fs::create_dir(&temporary).unwrap();
    let script = format!("test -e {0} && sleep 60; touch {0}; exit 12", text(&started));
    let decoder = format!("sh -c '{script}' {{in}} {{op}} {{mode}} {{out}}");
    let arguments = ["--decoder", &decoder, "--jobs", "1", "--time", "60", "--report", text(&report)];
    for signal in ["-INT", "-TERM"] {
        let child = Command::new(env!("CARGO_BIN_EXE_splatstream"))
            .args(on_vectors("run", &vectors, &arguments))
            .env("TMPDIR", &temporary)
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        while !started.exists() {
            std::thread::sleep(Duration::from_millis(10));
        }
        std::thread::sleep(Duration::from_millis(200));
        assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
        let output = child.wait_with_output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(130), "{said}");
        assert!(said.contains("interrupted after 1 of ") && said.contains("report.json"), "{said}");
        let written: Value = serde_json::from_str(&fs::read_to_string(&report).unwrap()).unwrap();
        assert!(written["interrupted"].as_u64().unwrap() > 1000);
        assert_eq!(fs::read_dir(&temporary).unwrap().count(), 0);
        fs::remove_file(&started).unwrap();
    }
}

#[test]
fn our_decoder_speaks_the_protocol() {
    let around = directory();
    let directory = around.path().join("made");
    let decode = |input: &Path| {
        run(&["conformance", "decode", "--in", text(input), "--op", "s0,t0,r0", "--out", text(&directory)])
    };
    assert_eq!(decode(&fixture()).status.code(), Some(0));
    let position = fs::metadata(directory.join("f0000.position.i32")).unwrap().len();
    let opacity = fs::metadata(directory.join("f0000.opacity.i32")).unwrap().len();
    assert!(opacity > 0 && position == 3 * opacity);
    let states = fs::read_dir(&directory)
        .unwrap()
        .filter(|entry| entry.as_ref().unwrap().file_name().to_string_lossy().ends_with(".entropy"));
    assert!(states.count() > 0);
    let output = decode(Path::new("no-such.gss"));
    assert!(String::from_utf8(output.stderr).unwrap().starts_with("no-such.gss: cannot read"));
    let broken = around.path().join("broken.gss");
    fs::write(&broken, "no stream at all").unwrap();
    let output = decode(&broken);
    assert_eq!(output.status.code(), Some(10));
    let said: Value = serde_json::from_slice(&output.stderr).unwrap();
    assert_eq!(said["code"], "SIGNATURE");
}
