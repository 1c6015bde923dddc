//! Streams of profile Dynamic: layers, predicted frames, operating points, losses, cuts.

use crate::common::{UNIT_HEADER, directory, fail, fixture, json, run, seal, succeed, text};
use serde_json::Value;
use splatstream_encoder::{Preset, Quality, Settings, Structure, encode};
use splatstream_files::builtin::BuiltinScene;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Frames of a GOP, and refinements.
const GOP: u64 = 5;
const REFINEMENTS: usize = 3;

/// Ten frames in two GOPs, two spatial and three temporal layers, three refinements. Committed, so that tests change
/// with the bitstream and not with the encoder.
fn dynamic() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/dynamic.gss")
}

/// For a change of the bitstream `BLESS=1 cargo test -p splatstream-cli --test command dynamic::the_fixture` writes it again.
#[test]
fn the_fixture_is_a_stream_of_today() {
    let scene = BuiltinScene { gaussians: 150, frames: 10, sh_degree: 1, ..BuiltinScene::default() };
    let settings = Settings {
        steps: Quality::Medium.steps(),
        refinements: vec![25, 50, 100],
        block_log2: 6,
        gop: GOP as u32,
        preset: Preset::Fast,
        structure: Structure::Predicted { layers: 3 },
        spatial_layers: 2,
        ..Settings::default()
    };
    if std::env::var_os("BLESS").is_some() {
        let mut stream = Vec::new();
        let mut frames: Vec<_> = (0..scene.frames).map(|number| scene.frame(number)).collect();
        encode(&mut frames, &settings, &mut stream, &mut |_, _| ()).unwrap();
        fs::write(dynamic(), stream).unwrap();
    }
    let verdict = json(&["validate", text(&dynamic())]);
    assert_eq!((&verdict["outcome"], &verdict["frames"]), (&"accept".into(), &10.into()));
}

/// A changed copy of the fixture in a directory that goes away with the test.
fn changed(change: impl FnOnce(&mut Vec<u8>)) -> (TempDir, PathBuf) {
    let directory = directory();
    let path = directory.path().join("changed.gss");
    let mut bytes = fs::read(dynamic()).unwrap();
    change(&mut bytes);
    fs::write(&path, bytes).unwrap();
    (directory, path)
}

/// The unit of a type, frame, spatial layer and refinement: offset and bytes.
fn unit(kind: &str, frame: u64, layer: u64, refinement: u64) -> (usize, usize) {
    let listing = json(&["inspect", text(&dynamic()), "--units"]);
    let units = listing["units"].as_array().unwrap();
    let is_it = |unit: &&Value| {
        let keys = ["frame", "spatial_layer", "refinement"].map(|key| unit[key].as_u64());
        unit["type"] == kind && keys == [Some(frame), Some(layer), Some(refinement)]
    };
    let found = units.iter().find(is_it).unwrap();
    (found["at"].as_u64().unwrap() as usize, found["bytes"].as_u64().unwrap() as usize)
}

/// Damages the payload of an increment.
fn damage(bytes: &mut [u8], frame: u64, layer: u64, refinement: u64) {
    let (at, length) = unit("increment", frame, layer, refinement);
    bytes[at + length - 1] ^= 0x10;
}

/// What `decode --dry-run --json` prints of a stream that is at fault.
fn decode_faulty(code: i32, path: &Path, arguments: &[&str]) -> Value {
    let output = run(&[&["decode", text(path), "--dry-run", "--json"], arguments].concat());
    assert_eq!(output.status.code(), Some(code), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// What `decode` says to people of a stream that is at fault.
fn said_of(path: &Path) -> String {
    String::from_utf8(run(&["decode", text(path), "--dry-run"]).stdout).unwrap()
}

fn numbers(report: &Value, key: &str) -> Vec<u64> {
    report[key].as_array().unwrap().iter().map(|number| number.as_u64().unwrap()).collect()
}

fn sum(rows: &Value, key: &str) -> f64 {
    rows.as_array().unwrap().iter().map(|row| row[key].as_f64().unwrap()).sum()
}

#[test]
fn decode_says_what_frames_are_and_what_is_carried() {
    let all = json(&["decode", text(&dynamic()), "--dry-run"]);
    let types: Vec<&str> = all["types"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
    assert_eq!(types, ["I", "B", "B", "B", "P", "I", "B", "B", "B", "P"]);
    assert_eq!(numbers(&all, "numbers"), (0..10).collect::<Vec<_>>());
    assert_eq!((numbers(&all, "carried"), numbers(&all, "spatial_layers")), (vec![0; 10], vec![1; 10]));
    let nothing = Value::Array(Vec::new());
    assert_eq!((&all["seek"], &all["complete"]), (&Value::Null, &true.into()));
    assert_eq!([&all["errors"], &all["lost"], &all["reduced"]], [&nothing; 3]);
    let part = json(&["decode", text(&dynamic()), "--dry-run", "--op", "s1,t1,r1"]);
    assert_eq!(numbers(&part, "numbers"), [0, 2, 4, 5, 7, 9]);
    assert_eq!((numbers(&part, "levels"), numbers(&part, "carried")), (vec![2; 6], vec![0; 6]));
    // Below the highest spatial layer predicted frames are the I frame, carried along.
    let base = json(&["decode", text(&dynamic()), "--dry-run", "--op", "s0,t1,r1"]);
    assert_eq!(
        (numbers(&base, "numbers"), &base["frames_in_stream"]),
        (numbers(&part, "numbers"), &10.into())
    );
    assert_eq!(numbers(&base, "levels"), [2, 0, 0, 2, 0, 0]);
    let carried = numbers(&base, "carried");
    assert!(carried[0] == 0 && carried[1] > 0 && carried[2] > 0, "{carried:?}");
    assert_eq!(base["complete"], true);
    let said = succeed(&["decode", text(&dynamic()), "--dry-run", "--op", "s0,t1,r1"]);
    assert!(said.contains("6 of 10 (2 I, 2 P, 2 B)") && said.contains("carried from I frames"), "{said}");
}

#[test]
fn decoding_starts_at_the_gop_that_holds_the_first_frame() {
    let all = json(&["decode", text(&dynamic()), "--dry-run"]);
    let part = json(&["decode", text(&dynamic()), "--dry-run", "--frames", "7..9"]);
    let (gop, _) = unit("gop_header", GOP, 0, 0);
    assert_eq!((&part["seek"]["frame"], &part["seek"]["byte"]), (&GOP.into(), &gop.into()));
    assert_eq!(numbers(&part, "numbers"), [7, 8]);
    let whole = all["digests"].as_array().unwrap();
    assert_eq!(part["digests"].as_array().unwrap(), &whole[7..9]);
    // What stands before the GOP is not read.
    let (_directory, path) = changed(|bytes| damage(bytes, 0, 0, 0));
    let beside = json(&["decode", text(&path), "--dry-run", "--frames", "7..9"]);
    assert_eq!(beside["digests"], part["digests"]);
    // Without an index, or with one that is wrong, it is.
    let (index, _) = unit("index", 0, 0, 0);
    for change in [
        (|bytes, _| bytes.truncate(bytes.len() - 1)) as fn(&mut Vec<u8>, usize),
        |bytes, index| bytes[index + UNIT_HEADER] ^= 1,
        |bytes, index| {
            bytes[index + UNIT_HEADER + 4 + 16 + 8] ^= 1;
            seal(bytes, index);
        },
    ] {
        let (_directory, path) = changed(|bytes| change(bytes, index));
        let scanned = json(&["decode", text(&path), "--dry-run", "--frames", "7..9"]);
        assert_eq!((&scanned["seek"], &scanned["digests"]), (&Value::Null, &part["digests"]));
    }
    let said = fail(2, &["decode", text(&dynamic()), "--dry-run", "--frames", "10..12"]);
    assert!(said.contains("no such frames"), "{said}");
    let said = fail(2, &["decode", text(&dynamic()), "--dry-run", "--frames", "1..2", "--op", "s0,t0,r1"]);
    assert!(said.contains("none of these frames is at the operating point s0,t0,r1"), "{said}");
}

#[test]
fn what_is_shown_of_a_damaged_frame_is_said() {
    // Frame 3 refers to frame 2.
    let (_directory, path) = changed(|bytes| {
        damage(bytes, 2, 1, 2);
        damage(bytes, 3, 1, 0);
    });
    let report = decode_faulty(10, &path, &[]);
    assert_eq!(numbers(&report, "levels"), [3, 3, 2, 0, 3, 3, 3, 3, 3, 3]);
    insta::assert_json_snapshot!(report, {
        ".digests" => "[digests]", ".seconds" => 0, ".seconds_total" => 0, ".gaussians_per_second" => 0,
    });
    let subset = decode_faulty(10, &path, &["--subset"]);
    let carried = numbers(&subset, "carried");
    assert_eq!((carried[2], carried[3] > 0, &subset["subset"]), (0, true, &true.into()));
    assert_eq!(subset["digests"], report["digests"], "digests know nothing of what is carried");
    let said = said_of(&path);
    assert!(said.contains("  frame 2 (B) shows 2 of 3 refinements and "), "{said}");
    assert!(said.contains("  frame 3 (B) shows 0 of 3 refinements and "), "{said}");
    assert_eq!(said.matches("byte 0x").count(), 2, "{said}");
    // Of a list of the I frame the layer below is left, and no later frame of the GOP has it.
    let (_directory, path) = changed(|bytes| damage(bytes, 0, 1, 1));
    let report = decode_faulty(10, &path, &[]);
    assert_eq!(numbers(&report, "spatial_layers")[0], 0);
    let reduced = report["reduced"].as_array().unwrap();
    let frames: Vec<u64> = reduced.iter().filter_map(|frame| frame["frame"].as_u64()).collect();
    assert_eq!(frames, (0..GOP).collect::<Vec<_>>());
    assert!(reduced[0]["error"]["code"] == "CHECKSUM" && reduced[1]["error"].is_null(), "{reduced:?}");
}

#[test]
fn decoding_resumes_at_the_next_gop_and_lost_frames_are_named() {
    let (frame, _) = unit("frame_header", 2, 0, 0);
    for change in [
        // A header checksum, after which the end of the unit is not known, and a payload.
        (|bytes: &mut Vec<u8>, at: usize| bytes[at + 7] ^= 1) as fn(&mut Vec<u8>, usize),
        |bytes, at| bytes[at + UNIT_HEADER] ^= 1,
    ] {
        let (directory, path) = changed(|bytes| change(bytes, frame));
        let report = decode_faulty(10, &path, &[]);
        assert_eq!(numbers(&report, "numbers"), [0, 1, 5, 6, 7, 8, 9]);
        assert_eq!((&report["lost"], &report["complete"]), (&serde_json::json!([[2, 4]]), &false.into()));
        assert!(said_of(&path).contains("  lost         frames 2..=4\n"));
        let verdict = run(&["validate", text(&path), "--json"]);
        let verdict: Value = serde_json::from_slice(&verdict.stdout).unwrap();
        assert_eq!((&verdict["code"], &verdict["frames"]), (&"CHECKSUM".into(), &7.into()));
        let strict = decode_faulty(10, &path, &["--strict"]);
        assert!(numbers(&strict, "numbers").len() < 3 && strict["complete"] == false, "{strict}");
        // Drawing and comparing go on as well, and end with the verdict.
        let pictures = directory.path().join("pictures");
        let draw =
            ["render", text(&path), "-o", text(&pictures), "--camera", "ring:1", "--height", "8", "--json"];
        let drawn = run(&draw);
        assert_eq!(drawn.status.code(), Some(10));
        let drawn: Value = serde_json::from_slice(&drawn.stdout).unwrap();
        assert_eq!((&drawn["frames"], &drawn["errors"][0]["code"]), (&7.into(), &"CHECKSUM".into()));
    }
}

/// Frames inside of a GOP too: those of a temporal layer that was left out are not missed, all others are.
#[test]
fn a_frame_without_a_header_is_lost_and_one_that_was_left_out_is_not() {
    let (at, length) = unit("frame_header", 3, 0, 0);
    let (directory, path) = changed(|bytes| drop(bytes.drain(at..at + length)));
    let report = decode_faulty(11, &path, &[]);
    assert_eq!(numbers(&report, "numbers"), [0, 1, 2, 4, 5, 6, 7, 8, 9]);
    assert_eq!((&report["lost"], &report["complete"]), (&serde_json::json!([[3, 3]]), &false.into()));
    assert!(said_of(&path).contains("  lost         frame 3\n"));
    let extracted =
        json(&["extract", text(&path), "--op", "s1,t2,r2", "-o", text(&directory.path().join("all.gss"))]);
    assert_eq!(extracted["lost"], report["lost"], "extraction says the same");
    let lower = json(&["decode", text(&path), "--dry-run", "--op", "s1,t1,r2", "--frames", "0..5"]);
    assert_eq!((numbers(&lower, "numbers"), &lower["complete"]), (vec![0, 2, 4], &true.into()));

    let part = directory.path().join("part.gss");
    json(&["extract", text(&dynamic()), "--op", "s1,t1,r2", "-o", text(&part)]);
    let again =
        json(&["extract", text(&part), "--op", "s1,t1,r0", "-o", text(&directory.path().join("again.gss"))]);
    assert_eq!((&again["lost"], &again["complete"]), (&serde_json::json!([]), &true.into()));
    let mut bytes = fs::read(&part).unwrap();
    let listing = json(&["inspect", text(&part), "--units"]);
    let units = listing["units"].as_array().unwrap();
    let last = units.iter().rev().find(|unit| unit["type"] == "increment").unwrap();
    bytes[last["at"].as_u64().unwrap() as usize + UNIT_HEADER] ^= 1;
    fs::write(&part, bytes).unwrap();
    let damaged = decode_faulty(10, &part, &[]);
    assert_eq!(damaged["lost"], serde_json::json!([]), "{}", damaged["numbers"]);
}

#[test]
fn of_a_cut_file_the_lost_frames_are_those_that_it_announces() {
    let (last, _) = unit("increment", 4, 1, 2);
    let (_directory, path) = changed(|bytes| bytes.truncate(last + 50));
    let report = decode_faulty(14, &path, &[]);
    assert_eq!(report["errors"][0]["class"], "truncated");
    assert_eq!(
        (numbers(&report, "levels"), &report["lost"]),
        (vec![3, 3, 3, 3, 2], &serde_json::json!([[5, 9]]))
    );
    assert_eq!(report["reduced"][0]["frame"], 4);
    let part = decode_faulty(14, &path, &["--frames", "0..7"]);
    assert_eq!(part["lost"], serde_json::json!([[5, 6]]), "only of those asked for");
}

#[test]
fn operating_points_agree_with_decoding_and_with_extraction() {
    let directory = directory();
    let part = directory.path().join("part.gss");
    let points = json(&["inspect", text(&dynamic()), "--ops"]);
    let points = points.as_array().unwrap();
    assert_eq!(points.len(), 18);
    for point in points {
        let op = point["op"].as_str().unwrap();
        assert_eq!(point["listed"], true, "{op}");
        let decoded = json(&["decode", text(&dynamic()), "--dry-run", "--op", op]);
        assert_eq!(point["frames"], decoded["frames"], "{op}");
        let exact = decoded["gaussians"].as_u64().unwrap() - numbers(&decoded, "carried").iter().sum::<u64>();
        assert_eq!(point["gaussians"], exact, "{op}");
        let digests = point["digests"].as_array().unwrap();
        let of_frames: Vec<&Value> = digests.iter().map(|frame| &frame["digest"]).collect();
        assert_eq!(of_frames, decoded["digests"].as_array().unwrap().iter().collect::<Vec<_>>(), "{op}");
        succeed(&["extract", text(&dynamic()), "--op", op, "-o", text(&part)]);
        let extracted = json(&["decode", text(&part), "--dry-run"]);
        for key in ["numbers", "digests", "carried_digests", "gaussians"] {
            assert_eq!(extracted[key], decoded[key], "{key} at {op}");
        }
        let bytes = json(&["inspect", text(&part), "--stats"])["units"].clone();
        let of_frames = |row: &&Value| {
            let kinds = ["gop_header", "frame_header", "transform", "codebook", "increment"];
            kinds.iter().any(|kind| row["type"] == *kind)
        };
        let bytes: u64 =
            bytes.as_array().unwrap().iter().filter(of_frames).filter_map(|row| row["bytes"].as_u64()).sum();
        assert_eq!(point["bytes"], bytes, "{op}");
    }
    let said = succeed(&["inspect", text(&dynamic()), "--ops"]);
    assert!(said.contains("lists 18 points: all agree"), "{said}");
    for op in ["s2,t0,r0", "s1,t3,r0", "s1,t2,r3"] {
        let said = fail(2, &["extract", text(&dynamic()), "--op", op, "-o", text(&part)]);
        assert!(said.contains(op) && said.contains("--ops"), "{said}");
    }
}

#[test]
fn a_list_of_points_that_is_wrong_is_named() {
    // The frame count of the third entry.
    let (at, _) = unit("operating_points", 0, 0, 0);
    let (_directory, path) = changed(|bytes| {
        bytes[at + UNIT_HEADER + 4 + 2 * 24 + 4] += 1;
        seal(bytes, at);
    });
    let output = run(&["inspect", text(&path), "--ops"]);
    let said = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(11));
    assert!(said.contains("other figures than the units (clause 6.16): s0,t0,r2\n"), "{said}");
    let said = fail(11, &["validate", text(&path)]);
    assert!(said.contains("clause 6.16") && said.contains("frame_count"), "{said}");
}

#[test]
fn dependencies_are_those_of_the_structure() {
    let shown = json(&["inspect", text(&dynamic()), "--deps"]);
    let gops = shown["gops"].as_array().unwrap();
    assert_eq!((gops.len(), &shown["profile"], &shown["error"]), (2, &"Dynamic".into(), &Value::Null));
    let frames = gops[0]["frames"].as_array().unwrap();
    let references: Vec<Option<u64>> = frames.iter().map(|frame| frame["reference"].as_u64()).collect();
    assert_eq!(references, [None, Some(0), Some(0), Some(2), Some(0)]);
    let needs = |frame: usize, unit: usize| -> Vec<[u64; 3]> {
        let needs = frames[frame]["units"][unit]["needs"].as_array().unwrap();
        let keys = ["frame", "spatial_layer", "refinement"];
        needs.iter().map(|need| keys.map(|key| need[key].as_u64().unwrap())).collect()
    };
    assert_eq!(needs(0, 0), [[0; 3]; 0]);
    assert_eq!(needs(0, REFINEMENTS + 1), [[0, 1, 0], [0, 0, 1]]);
    assert_eq!(needs(1, 0), [[0, 1, 0]]);
    assert_eq!(needs(3, 1), [[3, 1, 0], [2, 1, 1]]);
    assert_eq!(frames[3]["units"][1]["needs"][1]["unit"], frames[2]["units"][1]["unit"]);
    assert_eq!(frames[0]["transforms"].as_array().unwrap().len(), 2);
    let list = succeed(&["inspect", text(&dynamic()), "--deps"]);
    assert!(list.starts_with("GOP 0  unit 2 at 0xc0: frames 0..=4, predicted, temporal depth 2\n"), "{list}");
    assert!(list.contains("\n  frame 3  B  t2  unit 20  refers to frame 2\n"), "{list}");
    let intra = succeed(&["inspect", text(&fixture()), "--deps"]);
    assert!(intra.contains("every frame by itself") && intra.contains("needs codebook unit"), "{intra}");
}

#[test]
fn dependencies_of_a_stream_with_gaps_are_shown() {
    let (first, _) = unit("frame_header", 2, 0, 0);
    let (next, _) = unit("frame_header", 3, 0, 0);
    let (_directory, path) = changed(|bytes| drop(bytes.drain(first..next)));
    let list = succeed(&["inspect", text(&path), "--deps"]);
    assert!(list.contains("refers to frame 2, which is absent"), "{list}");
    assert!(list.contains("needs frame 2 s1,r0 (absent)"), "{list}");
    let (_directory, path) = changed(|bytes| bytes.truncate(next + 100));
    let said = fail(14, &["inspect", text(&path), "--deps"]);
    assert!(said.contains("byte 0x"), "{said}");
}

#[test]
fn the_graph_of_dependencies_names_only_units_that_it_has() {
    let graph = succeed(&["inspect", text(&dynamic()), "--deps", "--dot"]);
    assert_eq!(graph.matches('{').count(), graph.matches('}').count());
    let nodes: Vec<&str> = graph
        .lines()
        .filter_map(|line| line.trim().split_once(" [label").map(|(node, _)| node))
        .filter(|node| node.starts_with('u'))
        .collect();
    let edges: Vec<(&str, &str)> =
        graph.lines().filter_map(|line| line.trim().trim_end_matches(';').split_once(" -> ")).collect();
    assert!(edges.len() > 40, "{graph}");
    assert!(edges.iter().all(|(from, to)| nodes.contains(from) && nodes.contains(to)), "{graph}");
    for arguments in
        [&["--deps", "--dot", "--json"][..], &["--dot"], &["--dot", "--ops"], &["--deps", "--ops"]]
    {
        fail(2, &[&["inspect", text(&dynamic())], arguments].concat());
    }
}

#[test]
fn costs_are_given_by_section_and_by_type_of_frame() {
    let costs = json(&["inspect", text(&dynamic()), "--stats"]);
    let kinds: Vec<&str> =
        costs["frame_types"].as_array().unwrap().iter().filter_map(|row| row["type"].as_str()).collect();
    assert_eq!(kinds, ["I", "P", "B"]);
    assert_eq!(sum(&costs["frame_types"], "frames"), 10.0);
    assert_eq!(sum(&costs["frame_types"], "gaussians"), costs["gaussians"].as_f64().unwrap());
    let of_frames = |row: &&Value| row["type"] == "frame_header" || row["type"] == "increment";
    let units = costs["units"].as_array().unwrap();
    let bytes: f64 = units.iter().filter(of_frames).filter_map(|row| row["bytes"].as_f64()).sum();
    assert_eq!(sum(&costs["frame_types"], "bytes"), bytes);
    assert!((sum(&costs["sections"], "bpg") - sum(&costs["attributes"], "bpg")).abs() < 1e-9);
    assert!(sum(&costs["sections"], "bpg") < costs["bpg"].as_f64().unwrap());
    // Entries are what the headers of the units announce.
    let listing = json(&["inspect", text(&dynamic()), "--units"]);
    let announced = |key: &str| -> u64 {
        let units = listing["units"].as_array().unwrap();
        units.iter().filter_map(|unit| unit["increment"][key].as_u64()).sum()
    };
    let sections = costs["sections"].as_array().unwrap();
    for (section, attribute, key) in
        [("moves", "move", "moves"), ("updates", "dc", "updates"), ("new", "position", "new")]
    {
        let row = sections.iter().find(|row| row["section"] == section && row["attribute"] == attribute);
        assert_eq!(row.unwrap()["entries"], announced(key), "{section}");
    }
    let cells: u64 =
        listing["units"].as_array().unwrap().iter().filter_map(|unit| unit["cells"].as_u64()).sum();
    let moved = sections.iter().find(|row| row["section"] == "cells" && row["attribute"] == "stale");
    assert_eq!(moved.map_or(0, |row| row["entries"].as_u64().unwrap()), cells);
    let intra = json(&["inspect", text(&fixture()), "--stats"]);
    assert!(intra["sections"].as_array().unwrap().iter().all(|row| row["section"] == "new"));
    assert_eq!(intra["attributes"].as_array().unwrap().len(), 6);
    let said = succeed(&["inspect", text(&dynamic()), "--stats"]);
    assert!(said.contains("\nsection ") && said.contains("\nframe type "), "{said}");
}

#[test]
fn units_are_listed_with_what_increments_do() {
    let listing = json(&["inspect", text(&dynamic()), "--units"]);
    let units = listing["units"].as_array().unwrap();
    assert_eq!(units[0]["frame_type"], Value::Null);
    let of_i = units.iter().find(|unit| unit["type"] == "increment").unwrap();
    assert_eq!((&of_i["frame_type"], &of_i["increment"]["parents"]), (&"I".into(), &0.into()));
    assert_eq!(of_i["increment"]["sections"], serde_json::json!(["new"]));
    let of_p = units.iter().find(|unit| unit["frame"] == 4 && unit["type"] == "increment").unwrap();
    assert_eq!(of_p["frame_type"], "P");
    let said = succeed(&["inspect", text(&dynamic()), "--units"]);
    assert!(said.contains("  P: ") && said.contains(" parents"), "{said}");
}

#[test]
fn frames_are_compared_and_drawn_by_their_display_index() {
    let directory = directory();
    let part = directory.path().join("part.gss");
    succeed(&["extract", text(&dynamic()), "--op", "s1,t0,r2", "-o", text(&part)]);
    let compared = json(&["compare", text(&dynamic()), text(&part)]);
    assert_eq!((&compared["frames_a"], &compared["frames_b"]), (&10.into(), &4.into()));
    assert_eq!(compared["frames"], 4);
    for attribute in ["position", "log_scale", "opacity_logit", "rotation", "dc", "sh"] {
        assert_eq!(compared["attributes"][attribute]["max"], 0.0, "{attribute}");
    }
    let pictures = directory.path().join("pictures");
    let arguments = ["--camera", "ring:1", "--height", "16", "--op", "s1,t0,r2", "--frames", "4..6"];
    let drawn = json(&[&["render", text(&dynamic()), "-o", text(&pictures)], &arguments[..]].concat());
    let frames: Vec<u64> = drawn["pictures"]
        .as_array()
        .unwrap()
        .iter()
        .filter_map(|picture| picture["frame"].as_u64())
        .collect();
    assert_eq!(frames, [4, 5]);
}

/// Valid streams have units that decoders discard, whose payload may be anything.
#[test]
fn every_view_shows_the_vectors_of_predicted_frames() {
    let vectors = Path::new(env!("CARGO_MANIFEST_DIR")).join("../conformance/vectors/valid");
    let folders = ["cells", "learned", "survivors", "temporal"].map(|area| vectors.join(area));
    let entries = folders.iter().flat_map(|folder| fs::read_dir(folder).unwrap());
    let mut shown = 0;
    for path in entries.map(|entry| entry.unwrap().path().join("in.gss")) {
        for view in ["--tree", "--units", "--deps", "--stats"] {
            succeed(&["inspect", text(&path), view]);
        }
        let points = succeed(&["inspect", text(&path), "--ops"]);
        assert!(!points.contains("other figures"), "{}: {points}", path.display());
        shown += 1;
    }
    assert!(shown >= 60, "{shown} vectors");
}
