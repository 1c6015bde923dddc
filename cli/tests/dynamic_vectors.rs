//! The vectors of profile Dynamic, `conformance/vectors/dynamic`, and those of its learned predictor, `learned`: what is
//! decoded at every operating point, shown in full and as a subset, and which errors are reported. All were written by
//! the independent decoder's generator.
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed test")]

use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::operating_point::{OperatingPoint, extract};
use splatstream_decoder::process::{DecodedFrame, Options};
use splatstream_decoder::stream::decode_stream;
use splatstream_format::{Error, Limits};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

fn vectors(folder: &str) -> Vec<(PathBuf, Value)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../conformance/vectors");
    let folders = ["dynamic", "learned"].map(|suite| root.join(suite).join(folder));
    let files = folders.iter().flat_map(|folder| std::fs::read_dir(folder).unwrap());
    let mut streams: Vec<PathBuf> = files.map(|entry| entry.unwrap().path()).collect();
    streams.retain(|path| path.extension().is_some_and(|extension| extension == "gss"));
    streams.sort();
    let record = |path: &PathBuf| std::fs::read_to_string(path.with_extension("expect.json")).unwrap();
    streams.into_iter().map(|path| (path.clone(), serde_json::from_str(&record(&path)).unwrap())).collect()
}

fn options(operating_point: OperatingPoint, subset: bool) -> Options {
    let limits = Limits { max_gaussians: 1 << 24, ..Limits::default() };
    Options { limits, operating_point, subset, tolerant: true, ..Options::default() }
}

/// Frames and the first error, confined or fatal.
fn decoded(bytes: &[u8], options: &Options) -> (Vec<DecodedFrame>, Option<Error>) {
    let mut frames = Vec::new();
    let summary = decode_stream(bytes, options, |_, frame| {
        frames.push(frame);
        ControlFlow::Continue(())
    });
    let first = frames.iter().find_map(|frame| frame.lost).or(summary.end);
    (frames, first)
}

/// SHA-256 of the compensated planes in canonical order, `i32` little-endian.
fn shown(planes: &QuantizedFrame) -> String {
    let mut hash = Sha256::new();
    for plane in &planes.position {
        plane.iter().for_each(|value| hash.update(value.to_le_bytes()));
    }
    for plane in planes.signed_planes() {
        plane.iter().for_each(|value| hash.update(value.to_le_bytes()));
    }
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The fields of a record of a frame, in full.
fn record(frame: &DecodedFrame) -> Value {
    let digest = |digest: Option<u64>| digest.map(|digest| format!("{digest:016x}"));
    json!({
        "frame": frame.number,
        "type": frame.frame_type.name(),
        "refinements": frame.refinements,
        "exact": frame.planes.len() - frame.carried,
        "carried": frame.carried,
        "digest": digest(frame.digest),
        "carried_digest": digest(frame.carried_digest),
        "shown": shown(&frame.clone().into_shown()),
    })
}

/// Compares some fields, as far as the records have them.
fn assert_frames(found: &[Value], wanted: &Value, fields: &[&str], context: &str) {
    let wanted = wanted.as_array().unwrap();
    let known: Vec<&str> = fields
        .iter()
        .copied()
        .filter(|&field| wanted.iter().any(|frame| frame.get(field).is_some()))
        .collect();
    let pick = |value: &Value| known.iter().map(|&field| value[field].clone()).collect::<Vec<_>>();
    let found: Vec<_> = found.iter().map(pick).collect();
    let wanted: Vec<_> = wanted.iter().map(pick).collect();
    assert_eq!(found, wanted, "{context}");
}

const ALL: [&str; 8] =
    ["frame", "type", "refinements", "exact", "carried", "digest", "carried_digest", "shown"];

fn check_point(bytes: &[u8], point: OperatingPoint, wanted: &Value, context: &str) {
    let (frames, error) = decoded(bytes, &options(point, false));
    let verdict = error.map(|error| json!([error.class().name(), error.kind.code()]));
    let expected = match wanted["outcome"].as_str() {
        Some("accept") => None,
        _ => Some(json!([wanted["class"], wanted["code"]])),
    };
    assert_eq!(verdict, expected, "{context}: {error:?}");
    let found: Vec<Value> = frames.iter().map(record).collect();
    assert_frames(&found, &wanted["frames"], &ALL, context);
}

fn check(path: &Path, wanted: &Value) {
    let bytes = std::fs::read(path).unwrap();
    let name = path.file_name().unwrap().to_string_lossy();
    check_point(&bytes, OperatingPoint::ALL, wanted, &name);
    if let Some(subset) = wanted.get("subset") {
        let (frames, _) = decoded(&bytes, &options(OperatingPoint::ALL, true));
        let found: Vec<Value> = frames.iter().map(record).collect();
        assert_frames(&found, subset, &["frame", "shown"], &format!("{name} subset"));
    }
    let points = wanted["points"].as_object();
    for (point, record) in points.into_iter().flatten() {
        // A name stands for the record of another point.
        let wanted = record.as_str().map_or(record, |same| &wanted["points"][same]);
        check_point(&bytes, point.parse().unwrap(), wanted, &format!("{name} at {point}"));
    }
}

// covers: SS-TR-001, SS-TR-002, SS-TR-003, SS-TR-004, SS-TR-005, SS-TR-006, SS-TR-007, SS-TR-008, SS-TR-010, SS-WT-004
#[test]
fn valid_vectors_decode_alike_at_every_point() {
    let vectors = vectors("valid");
    assert!(vectors.len() >= 100, "{} vectors", vectors.len());
    vectors.iter().for_each(|(path, wanted)| check(path, wanted));
}

#[test]
fn extraction_of_valid_vectors_decodes_like_the_point() {
    for (path, wanted) in vectors("valid") {
        let bytes = std::fs::read(&path).unwrap();
        for point in wanted["points"].as_object().into_iter().flatten().map(|(point, _)| point) {
            let point: OperatingPoint = point.parse().unwrap();
            let extracted = extract(&bytes, point, &Limits::default()).unwrap();
            let all = decoded(&extracted, &options(OperatingPoint::ALL, false));
            assert_eq!(all.1, None, "{} extracted at {point}", path.display());
            let direct = decoded(&bytes, &options(point, false));
            assert_eq!(all.0, direct.0, "{} extracted at {point}", path.display());
        }
    }
}

// covers: SS-WT-001, SS-WT-002, SS-WT-003, SS-WT-004, SS-PR-002, SS-PR-008
#[test]
fn invalid_vectors_are_refused_and_shown_as_far_as_they_go() {
    let vectors = vectors("invalid");
    assert!(vectors.len() >= 100, "{} vectors", vectors.len());
    vectors.iter().for_each(|(path, wanted)| check(path, wanted));
}
