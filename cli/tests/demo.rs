//! `splatstream demo` leaves what it promises.

mod common;

use common::{directory, json, succeed, text};
use splatstream_files::{ReadLimits, read_scene};

#[test]
fn the_demo_writes_stream_frames_and_report() {
    let directory = directory();
    let out = directory.path().join("demo");
    let report = json(&["demo", "--out", text(&out), "--gaussians", "800", "--frames", "2"]);
    let points = report["operating_points"].as_array().unwrap();
    assert_eq!(points.len(), 5);
    let gaussians: Vec<u64> = points.iter().filter_map(|point| point["gaussians"].as_u64()).collect();
    assert_eq!(gaussians, [160, 320, 480, 800, 1600]);
    let written = std::fs::read_to_string(out.join("report.json")).unwrap();
    assert_eq!(serde_json::from_str::<serde_json::Value>(&written).unwrap(), report);
    for file in ["demo.gss", "report.txt", "source/frame_0001.ply", "decoded-s0t0r4/frame_0001.ply"] {
        assert!(out.join(file).is_file(), "{file}");
    }
    succeed(&["validate", text(&out.join("demo.gss"))]);
}

#[test]
fn the_demo_says_what_to_try_next() {
    let directory = directory();
    let out = text(directory.path());
    let said = succeed(&["demo", "--out", out, "--gaussians", "100", "--frames", "1"]);
    assert!(said.contains(&format!("splatstream inspect --stats {out}/demo.gss")), "{said}");
}

#[test]
fn an_untracked_demo_has_frames_that_differ_in_their_gaussians() {
    let directory = directory();
    let out = directory.path().join("demo");
    let settings = ["--gaussians", "2000", "--frames", "2"];
    let report = json(&[&["demo", "--untracked", "--out", text(&out)][..], &settings].concat());
    let count = |number: u32| {
        let path = out.join(format!("source/frame_000{number}.ply"));
        read_scene(&path, &ReadLimits::default()).unwrap().len() as u64
    };
    assert_ne!(count(0), count(1), "Gaussians vanish and split");
    assert_eq!(report["scene"]["gaussians"], count(0) + count(1));
    succeed(&["validate", text(&out.join("demo.gss"))]);
}
