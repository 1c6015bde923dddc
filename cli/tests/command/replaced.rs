//! A file that is there under the name of an output: it stays as it was where the command fails, and is replaced where the
//! command succeeds.

use crate::common::{directory, fail, run, succeed, text, write_frames, write_still};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// What is in a file before a command writes it.
const OLD: &str = "of an earlier run";

/// Commands that replace files: their lines, and one of the files of each.
const REPLACING: [(&str, &str); 20] = [
    ("encode still.ply -o out.gss --preset fast --psnr 30", "out.gss"),
    ("encode still.ply -o out.html --preset fast --psnr 30", "out.html"),
    ("encode frames --write-plan -o out.json --preset fast --psnr 30 --gop 2", "out.json"),
    ("encode frames --shard 1/2 -o out.gss --preset fast --psnr 30 --gop 2", "out.gss"),
    ("encode still.ply --each -o out --preset fast --psnr 30", "out/still.gss"),
    ("decode talk.gss -o out.ply --frames 0..1", "out.ply"),
    ("decode talk.gss -o out.sog --frames 0..1", "out.sog"),
    ("extract talk.gss --op s0,t0,r0 -o out.gss", "out.gss"),
    ("concat talk.gss talk.gss -o out.gss", "out.gss"),
    ("unpackage package -o out.gss", "out.gss"),
    ("package talk.gss -o out --force", "out/manifest.json"),
    ("view talk.gss -o out.html", "out.html"),
    ("play package --no-wait -o out.json", "out.json"),
    ("train --builtin 1 --frames 2 --quality low -o out.bin", "out.bin"),
    ("fit capture -o out.ply --iterations 1 --gaussians 100 --hold-out 0", "out.ply"),
    ("chart still.ply -o out --quick --qualities low --cameras ring:1 --height 20", "out/index.html"),
    ("demo -o out --gaussians 100 --frames 2", "out/demo.gss"),
    ("manual -o out", "out/splatstream.1"),
    ("conformance run --suite SUITE --report out.json --filter codebook-two-*", "out.json"),
    ("conformance matrix report.json -o out.md", "out.md"),
];

/// Commands whose names say nothing to whom they belong: they refuse a directory with files of such names, unless they are to remove
/// them.
const REFUSING: [(&str, &str); 4] = [
    ("decode talk.gss -o out", "out/frame_0000.ply"),
    ("render still.ply -o out --camera ring:1 --height 9", "out/ring_00.png"),
    ("track frames -o out --cameras ring:2 --views 1 --height 32 --iterations 1 --all", "out/frame_0000.ply"),
    ("simulate -o out --views 2 --height 18 --samples 1 --points 50", "out/transforms.json"),
];

/// The streams, frames and so on that the cases read.
fn write_inputs(directory: &Path) {
    write_frames(directory);
    write_still(directory);
    let at = |name: &str| text(&directory.join(name)).to_owned();
    let (frames, talk) = (at("frames"), at("talk.gss"));
    succeed(&["encode", &frames, "-o", &talk, "--preset", "fast", "--psnr", "30", "--gop", "2"]);
    succeed(&["package", &talk, "-o", &at("package")]);
    let small = ["--views", "3", "--height", "27", "--samples", "1", "--points", "100"];
    succeed(&[&["simulate", "-o", &at("capture")][..], &small].concat());
    let suite = format!("conformance run --suite {} --filter codebook-two-*", suite());
    let report = at("report.json");
    succeed(&suite.split(' ').chain(["--report", &report]).collect::<Vec<_>>());
}

fn suite() -> String {
    text(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../conformance/vectors")).to_owned()
}

/// What is in a directory and below it, but for files of one name.
fn others(directory: &Path, file: &Path) -> Vec<String> {
    let mut found = Vec::new();
    for path in fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().path()) {
        match path.is_dir() {
            true => found.extend(others(&path, file)),
            false if path == file => {}
            false => found.push(path.display().to_string()),
        }
    }
    found.sort();
    found
}

/// Writes the inputs and then, case by case, a file of an earlier run that the case would write; gives the directory, and the file.
fn with_earlier(cases: &[(&str, &str)], check: impl Fn(&Path, &str, &Path)) {
    let directory = directory();
    write_inputs(directory.path());
    for (line, name) in cases {
        let file = directory.path().join(name);
        fs::create_dir_all(file.parent().unwrap()).unwrap();
        fs::write(&file, OLD).unwrap();
        check(directory.path(), &line.replace("SUITE", &suite()), &file);
        // The next case finds nothing of this one.
        fs::remove_file(&file).unwrap();
        let _none = fs::remove_dir_all(directory.path().join("out"));
    }
}

/// Runs a line in a directory where files may have no bytes, which does what a full disk does, or any.
#[cfg(unix)]
fn run_in(directory: &Path, line: &str, is_full: bool) -> Output {
    let program = env!("CARGO_BIN_EXE_splatstream");
    let limit = if is_full { "trap '' XFSZ; ulimit -f 0;" } else { "" };
    // Patterns are for the command, not for the shell.
    let script = format!("set -f; {limit} exec {program} {line}");
    Command::new("sh").args(["-c", &script]).current_dir(directory).output().unwrap()
}

#[cfg(unix)]
#[test]
fn an_earlier_file_stays_where_writing_fails_and_is_replaced_where_it_does_not() {
    with_earlier(&REPLACING, |directory, line, file| {
        let before = others(directory, file);
        let failed = run_in(directory, line, true);
        assert_eq!(failed.status.code(), Some(1), "{line}: {failed:?}");
        assert_eq!(fs::read_to_string(file).unwrap_or_default(), OLD, "{line}: {failed:?}");
        assert_eq!(others(directory, file), before, "{line}");
        let done = run_in(directory, line, false);
        assert!(done.status.success(), "{line}: {done:?}");
        assert!(fs::read(file).unwrap() != OLD.as_bytes(), "{line}");
    });
}

#[cfg(unix)]
#[test]
fn files_with_names_of_an_earlier_run_are_refused_and_replaced_where_that_is_asked_for() {
    with_earlier(&REFUSING, |directory, line, file| {
        let refused = run_in(directory, line, false);
        assert_eq!(refused.status.code(), Some(2), "{line}: {refused:?}");
        assert!(String::from_utf8_lossy(&refused.stderr).contains("--force"), "{line}: {refused:?}");
        assert_eq!(fs::read_to_string(file).unwrap_or_default(), OLD, "{line}");
        let done = run_in(directory, &format!("{line} --force"), false);
        assert!(done.status.success(), "{line}: {done:?}");
        assert!(fs::read(file).unwrap() != OLD.as_bytes(), "{line}");
    });
}

/// A command that writes files is among the cases, or is known not to write any that it is given a name for.
#[test]
fn every_command_that_writes_is_among_them() {
    let help = succeed(&["--help"]);
    let list = help.split("Commands:\n").nth(1).unwrap().split("\n\n").next().unwrap();
    let commands = list.lines().filter_map(|line| line.strip_prefix("  ")?.split(' ').next());
    for command in commands.filter(|name| !["", "help"].contains(name)) {
        let writes = String::from_utf8(run(&[command, "--help"]).stdout).unwrap().contains("--out <");
        let has_case =
            REPLACING.iter().chain(&REFUSING).any(|(line, _)| line.split(' ').next() == Some(command));
        assert!(has_case || !writes, "{command}");
    }
    assert!(fail(2, &["validate", "-o", "out.json"]).contains("unexpected argument"));
}
