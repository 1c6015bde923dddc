//! `play`: packages are fetched, checked and decoded, and reported on.

use crate::common;
use crate::common::{directory, fail, json, run, scene, succeed, text};
use serde_json::Value;
use splatstream_files::builtin::BuiltinScene;
use splatstream_files::ply;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use tempfile::TempDir;

/// A package of a sequence of three GOPs, in a directory. A frame lasts a second: there is time to fetch everything.
fn package(directory: &Path, options: &[&str]) -> PathBuf {
    static STREAM: OnceLock<TempDir> = OnceLock::new();
    let stream = STREAM.get_or_init(|| {
        let directory = common::directory();
        let scene = BuiltinScene { frames: 6, ..scene() };
        let frames: Vec<PathBuf> =
            (0..6).map(|number| directory.path().join(format!("{number}.ply"))).collect();
        for (number, path) in (0..).zip(&frames) {
            fs::write(path, ply::write(&scene.frame(number))).unwrap();
        }
        let stream = directory.path().join("slow.gss");
        let frames: Vec<&str> = frames.iter().map(|path| text(path)).collect();
        succeed(&[&["encode"], &frames[..], &["-o", text(&stream), "--gop", "2", "--fps", "1"]].concat());
        directory
    });
    let (stream, out) = (stream.path().join("slow.gss"), directory.join("package"));
    succeed(&[&["package", text(&stream), "-o", text(&out)], options].concat());
    out
}

fn decoded<'a>(report: &'a Value, key: &str) -> Vec<&'a Value> {
    report["gops"].as_array().unwrap().iter().map(|gop| &gop["decoded"][key]).collect()
}

#[test]
fn a_package_in_a_directory_is_played_by_every_rule() {
    let directory = directory();
    let package = package(directory.path(), &[]);
    for rule in ["layered", "throughput", "buffer", "bola"] {
        let report = json(&["play", text(&package), "--no-wait", "--rule", rule]);
        assert_eq!((&report["rule"], &report["totals"]["complete"]), (&rule.into(), &true.into()));
        assert_eq!(report["losses"], Value::Array(vec![]));
        for key in ["errors", "lost"] {
            assert!(
                decoded(&report, key).iter().all(|list| **list == Value::Array(vec![])),
                "{rule}: {report}"
            );
        }
        assert!(decoded(&report, "frames").iter().all(|frames| frames.as_u64().unwrap() > 0));
        if rule == "layered" {
            assert_eq!(decoded(&report, "frames")[2], 2);
        }
    }
}

#[test]
fn damage_is_named_and_limits_hold() {
    let directory = directory();
    let package = package(directory.path(), &[]);
    let file = package.join("t1.mp4");
    let mut bytes = fs::read(&file).unwrap();
    *bytes.last_mut().unwrap() ^= 1;
    fs::write(&file, bytes).unwrap();
    let out = directory.path().join("report.json");
    let said = succeed(&["play", text(&package), "--no-wait", "-o", text(&out)]);
    let report: Value = serde_json::from_slice(&fs::read(&out).unwrap()).unwrap();
    let losses = report["losses"].as_array().unwrap();
    assert_eq!(losses.len(), 1, "{said}");
    assert_eq!((&losses[0]["gop"], &losses[0]["representation"]), (&2.into(), &"t1".into()));
    assert!(losses[0]["reason"].as_str().unwrap().contains("digest"));
    assert!(said.contains("GOP 2: t1 is left out"), "{said}");
    assert_eq!(report["totals"]["complete"], true);
    assert!(decoded(&report, "errors").iter().all(|errors| **errors == Value::Array(vec![])));
    let report =
        json(&["play", text(&package), "--no-wait", "--limit-layers", "s0,t0", "--limit-gaussians", "1"]);
    for gop in report["gops"].as_array().unwrap() {
        assert_eq!(gop["op"], "s0,i,r0");
    }
}

#[test]
fn traces_are_simulated_for_directories_alone() {
    let directory = directory();
    let package = package(directory.path(), &["--quality"]);
    let trace = directory.path().join("trace.csv");
    fs::write(&trace, "t_s,mbps\n0,0.5\n2,0.1\n").unwrap();
    let report = json(&["play", text(&package), "--trace", text(&trace)]);
    assert_eq!((&report["simulated"], &report["quality_measured"]), (&true.into(), &true.into()));
    assert_eq!(report, json(&["play", text(&package), "--trace", text(&trace)]));
    let said = fail(2, &["play", "http://localhost:1/", "--trace", text(&trace)]);
    assert!(said.contains("the server shapes"), "{said}");
    fs::write(&trace, "t_s,mbps\nx,1\n").unwrap();
    fail(1, &["play", text(&package), "--trace", text(&trace)]);
    fail(1, &["play", text(directory.path()), "--no-wait"]);
}

#[test]
fn the_table_of_qualities_has_every_point_of_every_gop() {
    let directory = directory();
    let package = package(directory.path(), &["--quality"]);
    let manifest: Value = serde_json::from_slice(&fs::read(package.join("manifest.json")).unwrap()).unwrap();
    let stream = &manifest["stream"];
    let layers = ["spatial_layers", "temporal_layers"].map(|key| stream[key].as_u64().unwrap());
    let points = layers[0] * layers[1] * stream["refinements"].as_array().unwrap().len() as u64;
    let table = manifest["quality"].as_array().unwrap();
    assert_eq!(table.len() as u64, points * manifest["gops"].as_array().unwrap().len() as u64);
    let best = format!(
        "s{},t{},r{}",
        layers[0] - 1,
        layers[1] - 1,
        stream["refinements"].as_array().unwrap().len() - 1
    );
    for row in table.iter().filter(|row| row["point"] == best.as_str()) {
        assert_eq!((&row["psnr_db"], &row["ssim"]), (&50.0.into(), &1.0.into()));
    }
    assert!(table.iter().any(|row| row["psnr_db"].as_f64().unwrap() < 50.0));
}

#[test]
fn what_cannot_be_played_at_all_is_an_error() {
    let directory = directory();
    let package = package(directory.path(), &[]);
    let output = run(&["play", text(&package), "--no-wait", "--limit-gaussians", "1"]);
    assert!(output.status.success());
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("more than --limit-gaussians 1; they are played all the same"), "{said}");
    fs::remove_file(package.join("s0.mp4")).unwrap();
    let said = fail(1, &["play", text(&package), "--no-wait"]);
    assert!(said.contains("nothing could be played"), "{said}");
    let said = fail(1, &["unpackage", text(&package), "-o", text(&directory.path().join("back.gss"))]);
    assert!(said.contains("s0.mp4: the file is missing"), "{said}");
}

#[test]
fn a_package_in_a_directory_is_played_at_its_best() {
    let directory = directory();
    let package = package(directory.path(), &["--quality"]);
    let report = json(&["play", text(&package), "--no-wait"]);
    for gop in report["gops"].as_array().unwrap() {
        assert_eq!(gop["quality_db"], 50.0, "{gop}");
    }
    let totals = &report["totals"];
    assert_eq!((&totals["stalls"], &totals["switches"]), (&0.into(), &0.into()));
    // What describes the files is no media that was not shown.
    assert_eq!(totals["unplayed_percent"], 0.0);
}

#[test]
fn a_layer_whose_file_is_missing_is_asked_for_three_times_and_played_without() {
    let directory = directory();
    let package = package(directory.path(), &[]);
    fs::remove_file(package.join("s1.mp4")).unwrap();
    let report = json(&["play", text(&package), "--no-wait"]);
    let gops = report["gops"].as_array().unwrap();
    let failures: u64 = gops.iter().map(|gop| gop["failures"].as_u64().unwrap()).sum();
    assert_eq!(failures, 3, "{report:#}");
    let losses = report["losses"].as_array().unwrap();
    assert_eq!(losses.len(), 3, "{report:#}");
    assert!(losses.iter().all(|loss| loss["representation"] == "s1" && loss["count"] == 1));
    // The rest of every GOP is played at its best.
    assert!(gops.iter().all(|gop| gop["op"].as_str().unwrap().starts_with("s0,")), "{report:#}");
    assert!(decoded(&report, "errors").iter().all(|errors| **errors == Value::Array(vec![])), "{report:#}");
    assert_eq!((&report["totals"]["complete"], &report["totals"]["stalls"]), (&true.into(), &0.into()));
    let said = succeed(&["play", text(&package), "--no-wait"]);
    assert!(said.contains("GOPs 0 to 2: s1 is left out from refinement 0 on"), "{said}");
}

#[test]
fn a_limit_that_keeps_everything_from_being_decoded_is_an_error() {
    let directory = directory();
    let package = package(directory.path(), &[]);
    for (option, value) in [("--max-gaussians", "10"), ("--max-memory", "1M")] {
        let out = directory.path().join("report.json");
        let said = fail(13, &["play", text(&package), "--no-wait", option, value, "-o", text(&out)]);
        assert!(said.contains(option), "{said}");
        let report: Value = serde_json::from_slice(&fs::read(&out).unwrap()).unwrap();
        assert_eq!(report["totals"]["complete"], false);
        assert!(decoded(&report, "frames").iter().all(|frames| **frames == 0));
    }
    // Who decodes nothing needs no memory for it.
    succeed(&["play", text(&package), "--no-wait", "--no-decode", "--max-gaussians", "10"]);
}

#[test]
fn an_address_without_its_scheme_is_named() {
    let directory = directory();
    let package = package(directory.path(), &[]);
    for address in ["127.0.0.1:8080/x/", "localhost/x/", "example.org/talk/manifest.mpd"] {
        let said = fail(1, &["play", address, "--no-wait"]);
        assert!(said.contains("write http:// or https:// before it"), "{said}");
    }
    let said = fail(1, &["play", text(&directory.path().join("none")), "--no-wait"]);
    assert!(!said.contains("http://"), "{said}");
    succeed(&["play", text(&package.join("manifest.mpd")), "--no-wait", "--no-decode"]);
}
