//! Increments that are missing without a trace: what extraction and decoding say of the frames.

use crate::common::{UNIT_HEADER, directory, fixture, json, payload_length, run, text};
use serde_json::{Value, json as value};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A stream in a directory that goes away with the test.
struct Part {
    directory: TempDir,
    path: PathBuf,
}

impl Part {
    /// A stream without the increments of some frames and refinements, in its highest spatial layer.
    fn without(stream: &Path, gone: &[(u64, u64)]) -> Self {
        let listing = json(&["inspect", text(stream), "--units"]);
        let units = listing["units"].as_array().unwrap();
        let mut bytes = fs::read(stream).unwrap();
        for (frame, refinement) in gone {
            let is_it = |unit: &&Value| {
                unit["type"] == "increment" && unit["frame"] == *frame && unit["refinement"] == *refinement
            };
            let found = units.iter().filter(is_it).max_by_key(|unit| unit["spatial_layer"].as_u64()).unwrap();
            let at = found["at"].as_u64().unwrap() as usize;
            // From the last one on: those before it stay where they are.
            let length = UNIT_HEADER + payload_length(&bytes, at);
            bytes.drain(at..at + length);
        }
        let directory = directory();
        let path = directory.path().join("part.gss");
        fs::write(&path, bytes).unwrap();
        Self { directory, path }
    }

    /// What extraction at a point says is reduced, and whether all is there.
    fn extracted(&self, point: &str) -> (Value, Value) {
        let out = self.directory.path().join("out.gss");
        let report = json(&["extract", text(&self.path), "--op", point, "-o", text(&out)]);
        (report["reduced"].clone(), report["complete"].clone())
    }

    /// Which frames decoding says are reduced, and whether all is there.
    fn decoded(&self) -> (Vec<u64>, Value) {
        let output = run(&["decode", text(&self.path), "--dry-run", "--json"]);
        let report: Value = serde_json::from_slice(&output.stdout).unwrap();
        let reduced = report["reduced"].as_array().unwrap();
        (reduced.iter().filter_map(|frame| frame["frame"].as_u64()).collect(), report["complete"].clone())
    }
}

/// Two frames of three refinements, without a list of operating points.
#[test]
fn without_a_list_the_end_unit_and_other_frames_tell() {
    let last = Part::without(&fixture(), &[(1, 2)]);
    assert_eq!(last.extracted("s0,t0,r2"), (value!([1]), value!(false)));
    assert_eq!(last.extracted("s0,t0,r1"), (value!([]), value!(true)), "nothing of the point is missing");
    assert_eq!(last.decoded(), (vec![1], value!(false)));
    let all = Part::without(&fixture(), &[(1, 2), (0, 2)]);
    assert_eq!(all.extracted("s0,t0,r2"), (value!([0, 1]), value!(false)), "no frame has more");
    assert_eq!(all.decoded(), (vec![0, 1], value!(false)));
}

/// An extracted stream has fewer increments than it announces, and lacks none.
#[test]
fn what_was_left_out_on_purpose_is_not_missing() {
    let whole = Part::without(&fixture(), &[]);
    let lower = whole.directory.path().join("lower.gss");
    json(&["extract", text(&whole.path), "--op", "s0,t0,r1", "-o", text(&lower)]);
    let again = Part::without(&lower, &[]);
    assert_eq!(again.extracted("s0,t0,r2"), (value!([]), value!(true)));
    assert_eq!(again.decoded(), (vec![], value!(true)));
    let less = Part::without(&lower, &[(0, 1)]);
    assert_eq!(less.extracted("s0,t0,r2"), (value!([0]), value!(false)));
}

/// Ten frames in layers, of which the stream lists what it has at each point.
#[test]
fn the_list_of_operating_points_tells() {
    let dynamic = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/dynamic.gss");
    assert_eq!(Part::without(&dynamic, &[]).extracted("s1,t2,r2"), (value!([]), value!(true)));
    let part = Part::without(&dynamic, &[(5, 1), (3, 2)]);
    assert_eq!(part.extracted("s1,t2,r2"), (value!([3, 5]), value!(false)));
    assert_eq!(part.extracted("s1,t2,r1"), (value!([5]), value!(false)));
    assert_eq!(part.extracted("s1,t2,r0"), (value!([]), value!(true)));
    assert_eq!(
        part.extracted("s0,t2,r2"),
        (value!([]), value!(true)),
        "they are of the higher spatial layer"
    );
}
