//! What the inspector prints is part of the interface: it is compared with what it printed before.

use crate::common::{UNIT_HEADER, directory, fail, fixture, json, run, run_with, seal, succeed, text};
use serde_json::Value;
use splatstream_encoder::{Preset, Quality, Settings, ShChoice, encode};
use splatstream_files::builtin::BuiltinScene;
use std::fs;
use std::io::Write;
use std::path::Path;

/// The committed stream is what the encoder wrote once; other encoders may write others. For a change of the
/// bitstream `BLESS=1 cargo test -p splatstream-cli --test command inspect::the_fixture` writes it again.
#[test]
fn the_fixture_is_a_stream_of_today() {
    let scene = BuiltinScene { gaussians: 120, frames: 2, sh_degree: 1, ..BuiltinScene::default() };
    let settings = Settings {
        steps: Quality::Medium.steps(),
        refinements: vec![25, 50, 100],
        block_log2: 6,
        gop: 1,
        preset: Preset::Fast,
        sh: ShChoice::VectorQuantised,
        ..Settings::default()
    };
    if std::env::var_os("BLESS").is_some() {
        let mut stream = Vec::new();
        let mut frames: Vec<_> = (0..scene.frames).map(|number| scene.frame(number)).collect();
        encode(&mut frames, &settings, &mut stream, &mut |_, _| ()).unwrap();
        fs::write(fixture(), stream).unwrap();
    }
    succeed(&["validate", text(&fixture())]);
}

#[test]
fn units_are_listed_one_per_line() {
    insta::assert_snapshot!(succeed(&["inspect", text(&fixture()), "--units"]));
}

#[test]
fn the_tree_has_every_element() {
    let tree = succeed(&["inspect", text(&fixture())]);
    // Up to the second increment every kind of unit has come but the last two; what they hold is short.
    let (start, rest) = tree.split_once("unit 8 ").unwrap();
    let (_, end) = rest.split_once("unit 19 ").unwrap();
    insta::assert_snapshot!(format!("{start}...\nunit 19 {end}"));
}

#[test]
fn the_tree_covers_every_byte_once() {
    let tree = json(&["inspect", text(&fixture()), "--tree"]);
    let bits = |record: &Value| -> u64 {
        record["elements"].as_array().unwrap().iter().map(|element| element["bits"].as_u64().unwrap()).sum()
    };
    let mut end = 0;
    let mut follow = |record: &Value| {
        assert_eq!(record["at_bit"].as_u64(), Some(end), "{record}");
        end += bits(record);
    };
    tree["file_header"].as_array().unwrap().iter().for_each(&mut follow);
    for unit in tree["units"].as_array().unwrap() {
        let at_bit = 8 * unit["at"].as_u64().unwrap();
        follow(&serde_json::json!({ "at_bit": at_bit, "elements": [{ "bits": 8 * UNIT_HEADER }] }));
        assert_eq!(unit["header"].as_object().unwrap().len(), 10);
        unit["records"].as_array().unwrap().iter().for_each(&mut follow);
    }
    let length = fs::metadata(fixture()).unwrap().len();
    assert_eq!((end, &tree["bytes"]), (length * 8, &length.into()));
}

#[test]
fn values_are_typed_and_names_stand_beside_them() {
    let tree = json(&["inspect", text(&fixture())]);
    let units = tree["units"].as_array().unwrap();
    let description = units.iter().find(|unit| unit["type"] == "scene_description").unwrap();
    let elements = description["records"][0]["elements"].as_array().unwrap();
    let expected = serde_json::json!({ "name": "up_axis", "bits": 8, "value": 0, "symbol": "unknown" });
    assert_eq!(elements[0], expected);
    assert_eq!(description["header"]["unit_type"], 10);
    assert!(elements[6]["value"].as_array().unwrap().iter().all(Value::is_number), "{}", elements[6]);
    assert!(tree["records"]["unit_header"]["frame"].is_string());
}

/// A stream of a file header and so many empty units.
fn empty_units(count: usize) -> Vec<u8> {
    let mut bytes = fs::read(fixture()).expect("the fixture")[..16].to_vec();
    for _ in 0..count {
        let at = bytes.len();
        bytes.extend([0; UNIT_HEADER]);
        bytes[at] = 0xF0;
        seal(&mut bytes, at);
    }
    bytes
}

#[test]
fn a_stream_of_any_length_comes_by_a_pipe() {
    let count = 20_000;
    for view in ["--tree", "--units"] {
        let output = run_with(&["inspect", "-", view, "--json"], &empty_units(count));
        assert_eq!(output.status.code(), Some(14), "there is no end unit");
        assert!(output.stdout.len() < 300 * count, "{} bytes", output.stdout.len());
        let shown: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(shown["units"].as_array().unwrap().len(), count);
        assert_eq!(shown["error"]["code"], "TRUNCATED");
    }
}

#[cfg(unix)]
#[test]
fn nothing_is_read_that_nobody_sees() {
    for view in ["--tree", "--units"] {
        let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_splatstream"))
            .args(["inspect", "-", view, "--json"])
            .stdin(std::process::Stdio::piped())
            .stdout(std::process::Stdio::piped())
            .spawn()
            .expect("the binary starts");
        let mut endless = child.stdin.take().expect("a pipe");
        drop(child.stdout.take());
        let units = empty_units(10_000);
        endless.write_all(&units[..16]).expect("it reads the file header");
        // The command ends, and nobody takes the bytes any more.
        while endless.write_all(&units[16..]).is_ok() {}
        assert!(child.wait().expect("it ends").code().is_some(), "{view}");
    }
}

#[test]
fn the_dump_of_a_unit_holds_its_bytes() {
    let bytes = fs::read(fixture()).unwrap();
    let dump = json(&["inspect", text(&fixture()), "--hex", "2"]);
    let (at, length) = (dump["at"].as_u64().unwrap() as usize, dump["bytes"].as_u64().unwrap() as usize);
    let elements = dump["elements"].as_array().unwrap();
    let hex: String = elements.iter().filter_map(|element| element["hex"].as_str()).collect();
    let expected: String = bytes[at..at + length].iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!(hex, expected, "a GOP header has no element that shares a byte with another");
    let shown = succeed(&["inspect", text(&fixture()), "--hex", "2"]);
    assert!(shown.contains("unit_header.unit_type = 2 (gop_header) (5.3)"), "{shown}");
}

#[test]
fn operating_points_are_the_streams_that_extraction_makes() {
    // What a stream has whatever the operating point: file header, twice the sequence parameters, description, index, end.
    let always = 16 + 2 * (20 + 106) + (20 + 30) + (20 + 4 + 2 * 16) + (20 + 16);
    let directory = directory();
    let part = directory.path().join("part.gss");
    let points = json(&["inspect", text(&fixture()), "--ops"]);
    let points = points.as_array().unwrap();
    assert_eq!(points.len(), 3);
    for point in points {
        succeed(&["extract", text(&fixture()), "--op", point["op"].as_str().unwrap(), "-o", text(&part)]);
        assert_eq!(point["bytes"], fs::metadata(&part).unwrap().len() - always);
        assert_eq!(point["gaussians"], json(&["validate", text(&part)])["gaussians"]);
    }
}

#[test]
fn an_extracted_stream_has_no_points_that_were_left_out() {
    let directory = directory();
    let part = directory.path().join("part.gss");
    let points = |path: &Path| -> Vec<String> {
        let points = json(&["inspect", text(path), "--ops"]);
        let points = points.as_array().unwrap().iter();
        points.map(|point| point["op"].as_str().unwrap().to_owned()).collect()
    };
    let all = points(&fixture());
    for (count, point) in (1..).zip(&all) {
        succeed(&["extract", text(&fixture()), "--op", point, "-o", text(&part)]);
        assert_eq!(points(&part), all[..count]);
    }
}

#[test]
fn costs_of_units_add_up_to_the_stream() {
    let costs = json(&["inspect", text(&fixture()), "--stats"]);
    let units = costs["units"].as_array().unwrap();
    let bytes: u64 = units.iter().filter_map(|unit| unit["bytes"].as_u64()).sum();
    assert_eq!(bytes + 16, costs["bytes"], "units and the file header are all there is");
    let attributes = costs["attributes"].as_array().unwrap();
    let bits: f64 = attributes.iter().filter_map(|attribute| attribute["bpg"].as_f64()).sum();
    assert!(bits > 0.0 && bits < costs["bpg"].as_f64().unwrap());
}

#[test]
fn a_cut_stream_is_shown_up_to_the_cut() {
    let directory = directory();
    let path = directory.path().join("cut.gss");
    let bytes = fs::read(fixture()).unwrap();
    fs::write(&path, &bytes[..300]).unwrap();
    for view in ["--tree", "--units"] {
        let output = run(&["inspect", text(&path), view, "--json"]);
        assert_eq!(output.status.code(), Some(14), "{view}");
        let shown: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(shown["units"][0]["type"], "sequence_parameters");
        assert_eq!(shown["error"]["class"], "truncated");
    }
    for view in ["--ops", "--stats", "--tree", "--units"] {
        fail(14, &["inspect", text(&path), view]);
        fail(14, &["inspect", text(&path), view, "-q"]);
    }
}

#[test]
fn a_damaged_unit_is_an_error_of_every_view() {
    let directory = directory();
    let path = directory.path().join("damaged.gss");
    let mut bytes = fs::read(fixture()).unwrap();
    let units = json(&["inspect", text(&fixture()), "--units"]);
    let mut units = units["units"].as_array().unwrap().iter();
    let last = units.rfind(|unit| unit["type"] == "increment").unwrap();
    bytes[last["at"].as_u64().unwrap() as usize + UNIT_HEADER + 2] ^= 1;
    fs::write(&path, bytes).unwrap();
    for view in ["--ops", "--stats", "--tree", "--units"] {
        for more in [&[][..], &["-q"], &["--json"]] {
            fail(10, &[&["inspect", text(&path), view], more].concat());
        }
    }
}
