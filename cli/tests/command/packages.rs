//! `package` and `unpackage`: a stream goes to files and comes back.

use crate::common::{directory, fail, fixture, json, run_with, succeed, text, write_damaged, write_stream};
use std::fs;
use std::path::Path;
use std::process::Command;

#[test]
fn a_stream_comes_back_from_its_package() {
    let directory = directory();
    let stream = write_stream(directory.path());
    let bytes = fs::read(&stream).unwrap();
    for layout in ["gop", "frame"] {
        let (out, back) = (directory.path().join(layout), directory.path().join(format!("{layout}.gss")));
        let report = json(&["package", text(&stream), "-o", text(&out), "--layout", layout]);
        let files = report["representations"].as_array().unwrap();
        for file in files {
            let written = fs::metadata(out.join(file["file"].as_str().unwrap())).unwrap().len();
            assert_eq!(file["bytes"], written);
        }
        let report = json(&["unpackage", text(&out), "-o", text(&back)]);
        assert_eq!((&report["files"], &report["verified"]), (&files.len().into(), &true.into()));
        assert!(fs::read(&back).unwrap() == bytes);
    }
    let piped = run_with(&["package", "-", "-o", text(&directory.path().join("piped"))], &bytes);
    assert!(piped.status.success(), "{}", String::from_utf8_lossy(&piped.stderr));
}

#[test]
fn a_package_is_replaced_only_where_that_is_asked_for() {
    let directory = directory();
    let out = directory.path().join("out");
    succeed(&["package", text(&fixture()), "-o", text(&out)]);
    fs::write(out.join("t3.mp4"), "of another package").unwrap();
    fs::write(out.join("notes.txt"), "of somebody").unwrap();
    let said = fail(2, &["package", text(&fixture()), "-o", text(&out)]);
    assert!(said.contains("--force"), "{said}");
    succeed(&["package", text(&fixture()), "-o", text(&out), "--force"]);
    assert!(!out.join("t3.mp4").exists() && out.join("notes.txt").exists());
    fail(2, &["package", text(&fixture()), "-o", text(&directory.path().join("out.mp4"))]);
}

/// There is no room for the largest file, which is not the first.
#[cfg(unix)]
#[test]
fn a_package_is_whole_or_the_one_before_stays() {
    let directory = directory();
    let out = directory.path().join("new/out");
    let package = |limit: &str, force: &[&str]| {
        let line = format!("trap '' XFSZ; ulimit -f {limit}; exec \"$@\"");
        let mut command = Command::new("sh");
        command.args(["-c", &line, "sh", env!("CARGO_BIN_EXE_splatstream"), "package", text(&fixture())]);
        command.arg("-o").arg(&out).args(force).output().unwrap()
    };
    let whole = |out: &Path| -> Vec<_> {
        let paths = fs::read_dir(out).unwrap().map(|entry| entry.unwrap().path());
        let mut files: Vec<_> = paths.map(|path| (path.clone(), fs::read(path).unwrap())).collect();
        files.sort();
        files
    };
    assert!(package("unlimited", &[]).status.success());
    let before = whole(&out);
    let sizes = before.iter().map(|(_, bytes)| bytes.len() / 512);
    let (least, most) = (sizes.clone().min().unwrap(), sizes.max().unwrap());
    assert!(least < most);
    let few = (most - 1).to_string();
    assert_eq!(package(&few, &["--force"]).status.code(), Some(1));
    assert!(whole(&out) == before, "the one before is lost");
    fs::remove_dir_all(directory.path().join("new")).unwrap();
    assert_eq!(package(&few, &[]).status.code(), Some(1));
    assert!(!directory.path().join("new").exists(), "empty directories are left");
    assert!(package("unlimited", &[]).status.success());
}

#[test]
fn a_stream_that_grows_is_packaged_as_it_comes() {
    let directory = directory();
    let stream = write_stream(directory.path());
    let bytes = fs::read(&stream).unwrap();
    for (layout, input) in [("gop", text(&stream)), ("frame", "-")] {
        let (out, back) = (directory.path().join(layout), directory.path().join("back.gss"));
        let package = ["package", input, "-o", text(&out), "--layout", layout, "--live"];
        let output = run_with(&package, &bytes);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        assert!(out.join("s0-2.m4s").exists() && out.join("manifest.json").exists());
        let mpd = fs::read_to_string(out.join("manifest.mpd")).unwrap();
        assert!(mpd.contains("static"), "{mpd}");
        assert_eq!(json(&["unpackage", text(&out), "-o", text(&back)])["verified"], true);
        assert!(fs::read(&back).unwrap() == bytes);
        fail(2, &package);
    }
    let cut =
        run_with(&["package", "-", "-o", text(&directory.path().join("cut")), "--live"], &bytes[..5000]);
    assert_eq!(cut.status.code(), Some(14));
}

#[test]
fn another_unpackager_is_tested_on_the_packages() {
    let packages = Path::new(env!("CARGO_MANIFEST_DIR")).join("../conformance/packages");
    let run = ["conformance", "packages", "--packages", text(&packages)];
    assert_eq!(json(&run)["failed"], 0);
    // It writes something and is content with everything.
    let said = fail(3, &[&run[..], &["--unpackager", "cp {in}/package.json {out}"]].concat());
    assert!(said.contains("packages failed"), "{said}");
    let words = run_with(&[&run[..], &["--unpackager", "cp {in}/package.json {out}"]].concat(), b"");
    let words = String::from_utf8(words.stdout).unwrap();
    assert!(
        words.contains("invalid/tail-missing: it accepted a package that is invalid (SS-CR-019)"),
        "{words}"
    );
    assert!(words.contains("0 of "), "{words}");
}

#[test]
fn another_packager_is_tested_on_the_streams() {
    let packages = Path::new(env!("CARGO_MANIFEST_DIR")).join("../conformance/packages");
    let run = ["conformance", "packages", "--packages", text(&packages), "--packager"];
    let this = env!("CARGO_BIN_EXE_splatstream");
    for how in ["--layout frame", "--live", "--live --layout frame"] {
        let report = json(&[&run[..], &[&format!("'{this}' package {{in}} -o {{out}} {how}")]].concat());
        assert!(report["failed"] == 0 && report["passed"].as_u64() > Some(5), "{report}");
    }
    // Ones that package something else, nothing, and refuse.
    let other = packages.join("valid/temporal-gops-mixed");
    for (command, message) in [
        (
            format!("sh -c 'cp -r \"$2\" \"$1\"' sh {{out}} '{}' {{in}}", text(&other)),
            "of its package, its stream has",
        ),
        ("sh -c 'mkdir \"$1\"' sh {out} {in}".to_owned(), "of its package, it refused a valid package"),
        ("false {in} {out}".to_owned(), "it refused a valid stream with exit code 1"),
    ] {
        let said = run_with(&[&run[..], &[command.as_str()]].concat(), b"");
        let said = String::from_utf8(said.stdout).unwrap();
        assert!(said.contains(message), "{command}: {said}");
    }
}

#[test]
fn damage_is_said() {
    let directory = directory();
    let (out, back) = (directory.path().join("out"), directory.path().join("back.gss"));
    let stream = write_damaged(directory.path());
    fail(10, &["package", text(&stream), "-o", text(&out)]);
    assert!(!out.exists(), "nothing is left of it");
    succeed(&["package", text(&fixture()), "-o", text(&out)]);
    let whole = fs::read(out.join("s0.mp4")).unwrap();
    fs::write(out.join("s0.mp4"), &whole[..whole.len() - 1]).unwrap();
    let said = fail(10, &["unpackage", text(&out), "-o", text(&back)]);
    assert!(said.contains("s0.mp4") && said.contains("C.2"), "{said}");
    fs::write(out.join("s0.mp4"), &whole).unwrap();
    let manifest = fs::read_to_string(out.join("manifest.json")).unwrap();
    fs::write(out.join("manifest.json"), manifest.replacen("\"digest\":\"", "\"digest\":\"0", 1)).unwrap();
    let said = fail(1, &["unpackage", text(&out), "-o", text(&back)]);
    assert!(said.contains("stream.digest"), "{said}");
    fs::remove_file(out.join("manifest.json")).unwrap();
    assert_eq!(json(&["unpackage", text(&out), "-o", text(&back)])["verified"], false);
    fs::remove_file(out.join("s0.mp4")).unwrap();
    let said = fail(1, &["unpackage", text(&out), "-o", text(&back)]);
    assert!(said.contains("no .mp4 or .m4s files here"), "{said}");
}
