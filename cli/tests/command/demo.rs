//! `splatstream demo` leaves what it promises.

use crate::common::{directory, json, succeed, text};
use splatstream_files::{ReadLimits, read_scene};

#[test]
fn the_demo_writes_stream_frames_and_report() {
    let directory = directory();
    let out = directory.path().join("demo");
    let report = json(&["demo", "--out", text(&out), "--gaussians", "800", "--frames", "2"]);
    let points = report["operating_points"].as_array().unwrap();
    assert_eq!(points.len(), 2 * 2 * 3, "spatial layers, temporal layers, refinements");
    let of = |op: &str| points.iter().find(|point| point["op"] == op).unwrap();
    assert_eq!((&of("s1,t1,r2")["gaussians"], &of("s1,t1,r2")["frames"]), (&1600.into(), &2.into()));
    let decibels = ["s0,t0,r0", "s0,t0,r1", "s1,t1,r2"].map(|op| of(op)["psnr_db"].as_f64().unwrap());
    assert!(decibels.is_sorted() && decibels[2] > 40.0, "{decibels:?}");
    assert!(points.iter().all(|point| out.join(point["picture"].as_str().unwrap()).is_file()));
    let written = std::fs::read_to_string(out.join("report.json")).unwrap();
    assert_eq!(serde_json::from_str::<serde_json::Value>(&written).unwrap(), report);
    for file in [
        "demo.gss",
        "demo.html",
        "report.txt",
        "source/frame_0001.ply",
        "decoded/frame_0001.ply",
        "pictures/source.png",
    ] {
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
