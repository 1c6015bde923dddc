//! Every exit code, and what the user is told with it.

use crate::common::{
    UNIT_HEADER, directory, fail, fixture, json, payload_length, run, seal, succeed, text, write_frames,
    write_still,
};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
#[cfg(target_os = "linux")]
use std::process::Command;
use tempfile::TempDir;

/// Bytes of file_header.
const FILE_HEADER: usize = 16;

/// The committed stream with a change.
fn changed(change: impl FnOnce(&mut Vec<u8>)) -> (TempDir, PathBuf) {
    let directory = directory();
    let path = directory.path().join("changed.gss");
    let mut bytes = fs::read(fixture()).expect("the fixture");
    change(&mut bytes);
    fs::write(&path, bytes).expect("a file");
    (directory, path)
}

/// The offset of the first unit of a type.
fn unit(bytes: &[u8], unit_type: u8) -> usize {
    let mut at = FILE_HEADER;
    while bytes[at] != unit_type {
        at += UNIT_HEADER + payload_length(bytes, at);
    }
    at
}

/// What `validate --json` says of the committed stream with a change, which shall exit with `code`.
fn verdict(code: i32, change: impl FnOnce(&mut Vec<u8>)) -> Value {
    let (_directory, path) = changed(change);
    let output = run(&["validate", text(&path), "--json"]);
    assert_eq!(output.status.code(), Some(code), "{}", String::from_utf8_lossy(&output.stderr));
    let complaint = String::from_utf8(output.stderr).expect("text");
    assert!(complaint.starts_with(&format!("{}: byte 0x", text(&path))), "{complaint}");
    assert_eq!(complaint.lines().count(), 2, "what is wrong and what to do: {complaint}");
    serde_json::from_slice(&output.stdout).expect("JSON")
}

#[test]
fn a_good_stream_is_0() {
    let accepted = json(&["validate", text(&fixture())]);
    assert_eq!((&accepted["outcome"], &accepted["byte"]), (&"accept".into(), &Value::Null));
}

#[test]
fn files_that_are_not_there_are_1() {
    for arguments in [
        &["validate", "no-such.gss"][..],
        &["decode", "no-such.gss", "--dry-run"],
        &["encode", "no-such.ply", "-o", "out.gss"],
        &["compare", "no-such.ply", "no-such.gss"],
    ] {
        let said = fail(1, arguments);
        assert!(said.starts_with("no-such.") && said.contains("check the path"), "{said}");
    }
}

#[test]
fn usage_is_2() {
    let stream = fixture();
    let stream = text(&stream);
    for (arguments, hint) in [
        (&[][..], "Usage"),
        (&["encode", "a.ply"], "--out"),
        (&["encode", "a.ply", "-o", "b.gss", "--layers", "540,high"], "--layers"),
        (&["decode", stream], "--out"),
        (&["decode", stream, "--dry-run", "--op", "r3"], "s0,t0,r2"),
        (&["decode", stream, "--dry-run", "--op", "s0,t0,r9"], "--ops"),
        (&["inspect", stream, "--units", "--stats"], "cannot be used with"),
        (&["inspect", stream, "--hex", "999"], "there is no unit 999"),
    ] {
        let said = fail(2, arguments);
        assert!(said.contains(hint), "{arguments:?}: {said}");
    }
}

#[test]
fn malformed_is_10() {
    let said = verdict(10, |bytes| bytes[0] ^= 1);
    assert_eq!((&said["outcome"], &said["code"]), (&"reject".into(), &"SIGNATURE".into()));
    let said = verdict(10, |bytes| bytes.push(0));
    assert_eq!(said["code"], "TRAILING_BYTES");
}

#[test]
fn invalid_is_11() {
    let mut offset = 0;
    let said = verdict(11, |bytes| {
        let at = unit(bytes, 1);
        offset = at + UNIT_HEADER;
        bytes[offset] = 4;
        seal(bytes, at);
    });
    assert_eq!((&said["outcome"], &said["class"]), (&"reject".into(), &"invalid".into()));
    assert_eq!((&said["clause"], &said["byte"]), (&"6.4".into(), &offset.into()));
    let said = verdict(11, |bytes| {
        let at = unit(bytes, 6);
        bytes[at + UNIT_HEADER + 2] ^= 1;
        seal(bytes, at);
    });
    assert_eq!(said["code"], "DIGEST");
}

#[test]
fn unsupported_is_12() {
    let said = verdict(12, |bytes| {
        bytes[10] = 2;
        let crc = crc32fast::hash(&bytes[..12]);
        bytes[12..16].copy_from_slice(&crc.to_le_bytes());
    });
    assert_eq!((&said["outcome"], &said["code"]), (&"unsupported".into(), &"RESERVED".into()));
}

/// Commands that hold what they work on in memory say before what that takes, and are refused where there is less.
#[test]
fn what_takes_too_much_memory_is_13_before_anything_is_written() {
    let directory = directory();
    let (still, sequence) = (write_still(directory.path()), write_frames(directory.path()));
    let out = directory.path().join("out");
    let network = directory.path().join("network.bin");
    let commands: [&[&str]; 5] = [
        &["demo", "--gaussians", "1000000", "-o", text(&out)],
        &["chart", text(&still), "--quick", "-o", text(&out)],
        &["chart", text(&still), "--stability", "--quick", "-o", text(&out)],
        &["train", text(&sequence), "-o", text(&network)],
        &["train", "--builtin", "1", "-o", text(&network)],
    ];
    for command in commands {
        let said = fail(13, &[command, &["--max-memory", "1M"]].concat());
        assert!(said.contains("or allow it with --max-memory "), "{said}");
    }
    assert!(!network.exists() && !out.join("index.html").exists() && !out.join("demo.gss").exists());
}

/// Nor does a limit of the system end the program: what it leaves is the bound.
#[cfg(target_os = "linux")]
#[test]
fn the_address_space_bounds_what_is_held() {
    let directory = directory();
    let program = env!("CARGO_BIN_EXE_splatstream");
    for command in ["demo --gaussians 1000000 -o out", "train --builtin 1 --frames 1000 -o network.bin"] {
        let line = format!("cd {}; ulimit -v 524288; exec {program} {command}", text(directory.path()));
        let ended = Command::new("sh").args(["-c", &line]).output().unwrap();
        let said = String::from_utf8(ended.stderr).unwrap();
        assert_eq!(ended.status.code(), Some(13), "{said}");
        assert!(said.contains("or allow it with --max-memory "), "{said}");
    }
}

#[test]
fn over_a_limit_is_13() {
    let stream = fixture();
    for command in [&["validate"][..], &["decode", "--dry-run"], &["compare", text(&stream)]] {
        let said = fail(13, &[command, &[text(&stream), "--max-gaussians", "10"]].concat());
        assert!(said.contains("--max-gaussians"), "{said}");
    }
    // What decoding may take is bounded by what the machine has, or as the user says.
    for command in [&["validate"][..], &["decode", "--dry-run"], &["compare", text(&stream)]] {
        let said = fail(13, &[command, &[text(&stream), "--max-memory", "1M"]].concat());
        assert!(said.contains("or allow it with --max-memory "), "{said}");
    }
    // So is encoding, with the scene that is read, before anything is written.
    let directory = directory();
    let (still, out) = (write_still(directory.path()), directory.path().join("out.gss"));
    let sequence = write_frames(directory.path());
    for (input, memory) in [(&still, "10K"), (&still, "4M"), (&sequence, "4M")] {
        let encode = ["encode", text(input), "-o", text(&out), "--preset", "fast"];
        let said = fail(13, &[&encode[..], &["--max-memory", memory]].concat());
        assert!(said.contains("or allow it with --max-memory "), "{said}");
        let needed = said.split("--max-memory ").nth(1).and_then(|rest| rest.split(' ').next()).unwrap();
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 2, "something is left of {said}");
        if memory == "4M" {
            // What is said to be enough is, and the stream is that without a bound.
            succeed(&[&encode[..], &["--max-memory", needed]].concat());
            let bounded = fs::read(&out).unwrap();
            succeed(&encode);
            assert_eq!(bounded, fs::read(&out).unwrap());
            fs::remove_file(&out).unwrap();
        }
    }
    // What no option helps with is not said to be helped by one.
    for vector in ["limit-codebook-values", "limit-payload-length", "limit-gaussians-4294967295"] {
        let vectors = Path::new(env!("CARGO_MANIFEST_DIR")).join("../conformance/vectors/invalid/limit");
        let stream = vectors.join(vector).join("in.gss");
        let said = fail(13, &["validate", text(&stream), "--max-gaussians", "4294967295"]);
        assert!(said.contains("no option raises this limit: it is that of level "), "{said}");
    }
}

#[test]
fn truncated_is_14() {
    for kept in [5, FILE_HEADER, 100, 1000] {
        let said = verdict(14, |bytes| bytes.truncate(kept));
        assert_eq!(said["outcome"], "truncated");
    }
    // A stream that is not cut, but has lost its last unit.
    let said = verdict(14, |bytes| bytes.truncate(unit(bytes, 8)));
    assert_eq!(said["code"], "TRUNCATED");
}

#[test]
fn a_damaged_refinement_costs_no_more_than_it_must() {
    let (directory, path) = changed(|bytes| {
        let second = unit(bytes, 6);
        let second = second + UNIT_HEADER + payload_length(bytes, second);
        bytes[second + UNIT_HEADER + 30] ^= 0x10;
    });
    let out = directory.path().join("out");
    let output = run(&["decode", text(&path), "-o", text(&out), "--json"]);
    assert_eq!(output.status.code(), Some(10));
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    let whole = json(&["decode", text(&fixture()), "--dry-run"]);
    assert_eq!(report["frames"], whole["frames"]);
    assert_eq!(report["digests"][1], whole["digests"][1]);
    let reduced = report["reduced"].as_array().unwrap();
    assert_eq!(
        (reduced.len(), &report["lost"], &report["complete"]),
        (1, &serde_json::json!([]), &false.into())
    );
    assert_eq!((&reduced[0]["frame"], &reduced[0]["level"]), (&0.into(), &1.into()));
    assert_eq!(fs::read_dir(&out).unwrap().count(), 2);
    // Who does not take the damaged refinement does not notice.
    let part = directory.path().join("part.gss");
    for (op, code) in [("s0,t0,r0", 0), ("s0,t0,r1", 10)] {
        assert_eq!(run(&["extract", text(&path), "--op", op, "-o", text(&part)]).status.code(), Some(0));
        assert_eq!(run(&["validate", text(&part)]).status.code(), Some(code), "{op}");
    }
    let strict = run(&["decode", text(&path), "--dry-run", "--strict", "--json"]);
    assert_eq!(strict.status.code(), Some(10));
    let strict: Value = serde_json::from_slice(&strict.stdout).unwrap();
    assert_eq!((&strict["errors"][0]["code"], &strict["complete"]), (&"CHECKSUM".into(), &false.into()));
    assert!(strict["frames"].as_u64().unwrap() < 2, "nothing after the damage: {strict}");
}

#[test]
fn a_cut_stream_gives_the_frames_that_are_there() {
    let (directory, path) = changed(|bytes| bytes.truncate(bytes.len() - 100));
    let out = directory.path().join("out");
    let output = run(&["decode", text(&path), "-o", text(&out), "--json"]);
    assert_eq!(output.status.code(), Some(14));
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&report["frames"], &report["errors"][0]["class"]), (&2.into(), &"truncated".into()));
}

/// Of a single frame too, which there is no other one to compare with.
#[test]
fn a_frame_that_a_cut_has_reduced_is_listed() {
    for (refinement, shown) in [(0, 0), (1, 1), (2, 2)] {
        let (_directory, path) = changed(|bytes| {
            let mut increment = unit(bytes, 6);
            for _ in 0..refinement {
                increment += UNIT_HEADER + payload_length(bytes, increment);
            }
            bytes.truncate(increment + UNIT_HEADER + 9);
        });
        let output = run(&["decode", text(&path), "--dry-run", "--json"]);
        assert_eq!(output.status.code(), Some(14));
        let report: Value = serde_json::from_slice(&output.stdout).unwrap();
        let reduced = report["reduced"].as_array().unwrap();
        assert_eq!(
            (reduced.len(), &report["levels"], &report["complete"]),
            (1, &serde_json::json!([shown]), &false.into())
        );
        assert_eq!((&reduced[0]["frame"], &reduced[0]["level"]), (&0.into(), &shown.into()));
    }
}
