//! Inputs that no output replaces although nobody names them as files: a shell has opened them, they come later, or lie in a
//! directory that is given.
#![cfg(unix)]

use crate::common::{directory, fail, run_with, succeed, text, write_frames, write_still};
use std::fs::{self, File};
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Command, Output};

/// Runs a line of a shell in a directory, in which `splatstream` is the command.
fn shell(directory: &Path, line: &str) -> Output {
    let line = line.replace("splatstream", env!("CARGO_BIN_EXE_splatstream"));
    Command::new("sh").args(["-c", &line]).current_dir(directory).output().unwrap()
}

fn write_talk(directory: &Path) {
    let frames = write_frames(directory);
    let talk = directory.join("talk.gss");
    succeed(&["encode", text(&frames), "-o", text(&talk), "--preset", "fast", "--psnr", "30", "--gop", "2"]);
}

#[test]
fn what_a_shell_reads_or_writes_is_no_other_file() {
    let directory = directory();
    write_talk(directory.path());
    write_still(directory.path());
    let copies = [
        (
            "talk.gss",
            ["a.gss", "page.html", "out/frame_0001.ply", "out/s0.mp4", "out/ring_00.png"].as_slice(),
        ),
        ("still.ply", &["b.gss", "c.html", "plan.json"]),
    ];
    fs::create_dir(directory.path().join("out")).unwrap();
    for (from, names) in copies {
        names.iter().for_each(|to| {
            fs::copy(directory.path().join(from), directory.path().join(to)).unwrap();
        });
    }
    symlink("a.gss", directory.path().join("linked.ply")).unwrap();
    let reading = [
        ("a.gss", "splatstream extract - --op s0,t0,r0 -o a.gss < a.gss"),
        ("a.gss", "splatstream extract - --op s0,t0,r0 -o ./a.gss < linked.ply"),
        ("a.gss", "splatstream decode - -o linked.ply --frames 0..1 < a.gss"),
        ("page.html", "splatstream view - -o page.html < page.html"),
        ("b.gss", "splatstream encode - -o b.gss --preset fast --psnr 30 < b.gss"),
        ("c.html", "splatstream encode - -o c.html --preset fast --psnr 30 < c.html"),
        ("plan.json", "splatstream encode - --write-plan -o plan.json < plan.json"),
        ("out/frame_0001.ply", "splatstream decode - -o out --force < out/frame_0001.ply"),
        ("out/s0.mp4", "splatstream package - -o out --force < out/s0.mp4"),
        (
            "out/ring_00.png",
            "splatstream render - -o out --camera ring:1 --height 9 --force < out/ring_00.png",
        ),
    ];
    let writing = [
        ("a.gss", "splatstream extract a.gss --op s0,t0,r0 -o - >> linked.ply"),
        ("a.gss", "splatstream decode a.gss -o - --frames 0..1 >> a.gss"),
        ("a.gss", "splatstream concat a.gss -o - 1<> a.gss"),
        ("b.gss", "splatstream encode b.gss -o - --preset fast --psnr 30 >> b.gss"),
        ("b.gss", "splatstream encode - -o - --preset fast --psnr 30 < b.gss >> b.gss"),
    ];
    for (lines, reason) in [(&reading[..], "reads that file"), (&writing, "standard output goes to")] {
        for (name, line) in lines {
            let before = fs::read(directory.path().join(name)).unwrap();
            let refused = shell(directory.path(), line);
            assert_eq!(refused.status.code(), Some(2), "{line}: {refused:?}");
            assert!(String::from_utf8_lossy(&refused.stderr).contains(reason), "{line}: {refused:?}");
            assert!(fs::read(directory.path().join(name)).unwrap() == before, "{line}");
        }
    }
    // Other files are written as ever, also beside what is read, and what is no file cannot be lost.
    for line in [
        "splatstream extract - --op s0,t0,r0 -o d.gss < a.gss",
        "splatstream extract a.gss --op s0,t0,r0 -o - > e.gss",
        "splatstream extract - --op s0,t0,r0 -o - < a.gss >> f.gss",
        "splatstream encode - -o - --preset fast --psnr 30 < still.ply > /dev/null",
    ] {
        let done = shell(directory.path(), line);
        assert!(done.status.success(), "{line}: {done:?}");
    }
    assert!(
        fs::read(directory.path().join("d.gss")).unwrap()
            == fs::read(directory.path().join("f.gss")).unwrap()
    );
    let piped = run_with(&["validate", "-"], &fs::read(directory.path().join("e.gss")).unwrap());
    assert!(piped.status.success(), "{piped:?}");
}

/// Names that a command chooses are those of many programs: files of others are not replaced.
#[test]
fn pages_and_reports_of_others_stay() {
    let directory = directory();
    write_still(directory.path());
    let chart = "splatstream chart still.ply -o . --quick --qualities low --cameras ring:1 --height 20";
    let demo = "splatstream demo -o . --gaussians 100 --frames 1";
    for (name, line) in [("index.html", chart), ("report.json", demo), ("source/frame_0000.ply", demo)] {
        let file = directory.path().join(name);
        fs::create_dir_all(file.parent().unwrap()).unwrap();
        fs::write(&file, "of somebody else").unwrap();
        let refused = shell(directory.path(), line);
        assert_eq!(refused.status.code(), Some(2), "{line}: {refused:?}");
        assert!(String::from_utf8_lossy(&refused.stderr).contains("no earlier run of it has"), "{refused:?}");
        assert_eq!(fs::read_to_string(&file).unwrap(), "of somebody else");
        fs::remove_file(file).unwrap();
        let _none = fs::remove_dir(directory.path().join("source"));
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 1, "{line}");
    }
    // Their own they replace.
    for line in [chart, demo, chart, demo] {
        let done = shell(directory.path(), line);
        assert!(done.status.success(), "{line}: {done:?}");
    }
}

#[test]
fn a_stream_of_each_replaces_no_scene_that_comes_later() {
    let directory = directory();
    let still = write_still(directory.path());
    let (frames, out) = (write_frames(directory.path()), directory.path().join("streams"));
    let other = frames.join("f9.ply");
    fs::create_dir(&out).unwrap();
    symlink("../frames/f9.ply", out.join("still.gss")).unwrap();
    let before = fs::read(&other).unwrap();
    let each = ["encode", text(&still), text(&frames), "--each", "-o", text(&out), "--preset", "fast"];
    let said = fail(2, &[&each[..], &["--psnr", "30"]].concat());
    assert!(said.contains("this command reads that file"), "{said}");
    assert!(fs::read(other).unwrap() == before);
    // The others are encoded.
    assert!(File::open(out.join("frames.gss")).is_ok());
}

#[test]
fn photographs_in_a_directory_of_their_own_stay() {
    let directory = directory();
    let still = write_still(directory.path());
    let (capture, pictures) = (directory.path().join("capture"), directory.path().join("pictures"));
    let small = ["--views", "9", "--height", "27", "--samples", "1", "--points", "100"];
    succeed(&[&["simulate", "-o", text(&capture)][..], &small].concat());
    fs::rename(capture.join("images"), &pictures).unwrap();
    let (photograph, out) = (pictures.join("view_003.png"), directory.path().join("out.gss"));
    symlink(&photograph, &out).unwrap();
    let before = fs::read(&photograph).unwrap();
    let encode = ["encode", text(&still), "--cameras", text(&capture), "--images", text(&pictures)];
    let said = fail(2, &[&encode[..], &["--finetune", "1", "-o", text(&out)]].concat());
    assert!(said.contains("this command reads that file"), "{said}");
    assert!(fs::read(photograph).unwrap() == before);
}
