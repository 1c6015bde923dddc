//! What every command prints with `--json`: of the committed stream all of it, of streams that an encoder makes the keys and
//! types. Times and the directory of the test are left out.

use crate::common::{directory, fixture, scene, text, write_frames, write_still};
use serde_json::{Map, Value};
use splatstream_files::builtin::BuiltinScene;
use splatstream_files::ply;
use std::fs;
use std::path::Path;
use std::process::Command;

/// Runs a command line in a directory with `--json`.
fn report(directory: &Path, line: &str) -> Value {
    let output = Command::new(env!("CARGO_BIN_EXE_splatstream"))
        .args(line.split(' '))
        .arg("--json")
        .current_dir(directory)
        .output()
        .unwrap();
    let value = serde_json::from_slice(&output.stdout);
    value.unwrap_or_else(|error| panic!("{line}: {error}: {}", String::from_utf8_lossy(&output.stderr)))
}

/// Without times, and with floats that are shown to three digits.
fn pinned(key: &str, value: &Value) -> Value {
    match value {
        Value::Object(fields) => {
            fields.iter().map(|(key, value)| (key.clone(), pinned(key, value))).collect()
        }
        Value::Array(values) => values.iter().map(|value| pinned(key, value)).collect(),
        Value::Number(_) if key.contains("second") => "a time".into(),
        Value::Number(number) if number.is_f64() => format!("{:.3e}", number.as_f64().unwrap()).into(),
        value => value.clone(),
    }
}

/// Keys and types; lists by what their entries have.
fn shape(value: &Value) -> Value {
    match value {
        Value::Null => Value::Null,
        Value::Bool(_) => "boolean".into(),
        Value::Number(_) => "number".into(),
        Value::String(_) => "string".into(),
        Value::Array(values) => Value::Array(values.iter().map(shape).reduce(both).into_iter().collect()),
        Value::Object(fields) => fields.iter().map(|(key, value)| (key.clone(), shape(value))).collect(),
    }
}

/// What two shapes have together: null where one has nothing gives way.
fn both(a: Value, b: Value) -> Value {
    match (a, b) {
        (Value::Null, other) | (other, Value::Null) => other,
        (Value::Object(mut a), Value::Object(b)) => {
            for (key, value) in b {
                let known = a.remove(&key).unwrap_or_default();
                a.insert(key, both(known, value));
            }
            Value::Object(a)
        }
        (Value::Array(a), Value::Array(b)) => {
            Value::Array(a.into_iter().chain(b).reduce(both).into_iter().collect())
        }
        (a, _) => a,
    }
}

/// The committed stream as small.gss, and it damaged, in a directory.
fn streams(directory: &Path) {
    let stream = fs::read(fixture()).unwrap();
    fs::write(directory.join("small.gss"), &stream).unwrap();
    let mut damaged = stream;
    let last = damaged.len() - 200;
    damaged[last] ^= 1;
    fs::write(directory.join("damaged.gss"), damaged).unwrap();
}

#[test]
fn reports_on_the_committed_stream_are_as_before() {
    let directory = directory();
    let at = directory.path();
    streams(at);
    fs::write(at.join("trace.csv"), "t_s,mbps\n0,0.2\n1,0.05\n").unwrap();
    for (name, line) in [
        ("decode", "decode small.gss -o frames"),
        ("decode_spz", "decode small.gss -o packed/ --format spz --frames 0..1"),
        ("decode_splat", "decode small.gss -o plain/ --format splat"),
        ("decode_damaged", "decode damaged.gss --dry-run"),
        ("inspect_units", "inspect small.gss --units"),
        ("inspect_ops", "inspect small.gss --ops"),
        ("inspect_deps", "inspect small.gss --deps"),
        ("inspect_stats", "inspect small.gss --stats"),
        ("inspect_hex", "inspect small.gss --hex 2"),
        ("validate", "validate small.gss"),
        ("validate_damaged", "validate damaged.gss"),
        ("extract", "extract small.gss --op s0,t0,r0 -o part.gss"),
        ("extract_damaged", "extract damaged.gss --op s0,t0,r2 -o rest.gss"),
        ("package", "package small.gss -o package/"),
        ("unpackage", "unpackage package/ -o back.gss"),
        ("concat", "concat small.gss small.gss -o long.gss"),
        ("simulate", "play package/ --trace trace.csv"),
        ("compare", "compare small.gss part.gss --cameras ring:2 --height 40"),
        ("render", "render small.gss -o pictures --camera ring:1 --height 20 --frames 0..1"),
    ] {
        insta::assert_json_snapshot!(name, pinned("", &report(at, line)));
    }
}

#[test]
fn the_tree_of_the_committed_stream_is_as_before() {
    let directory = directory();
    streams(directory.path());
    let mut tree = report(directory.path(), "inspect small.gss");
    // The first of each kind of unit; the meanings are those of the specification.
    let mut kinds = std::collections::BTreeSet::new();
    let units = tree["units"].as_array_mut().unwrap();
    units.retain(|unit| kinds.insert(unit["type"].to_string()));
    tree["records"] = shape(&tree["records"]["end"]);
    insta::assert_snapshot!("inspect_tree", shorter(&pinned("", &tree)));
}

/// JSON with an element or a header a line.
fn shorter(tree: &Value) -> String {
    let mut text = String::new();
    let mut line = |indent: usize, value: &Value| text += &format!("{:indent$}{value}\n", "");
    let top: Map<String, Value> = tree.as_object().unwrap().clone();
    for (key, value) in top.iter().filter(|(key, _)| *key != "units") {
        line(0, &serde_json::json!({ key.as_str(): value }));
    }
    for unit in tree["units"].as_array().unwrap() {
        let mut unit = unit.as_object().unwrap().clone();
        let records = unit.remove("records").unwrap();
        line(0, &unit.into());
        for record in records.as_array().unwrap() {
            let mut record = record.as_object().unwrap().clone();
            let elements = record.remove("elements").unwrap();
            line(2, &record.into());
            elements.as_array().unwrap().iter().for_each(|element| line(4, element));
        }
    }
    text
}

#[test]
fn reports_of_encoders_have_the_keys_they_had() {
    let directory = directory();
    let at = directory.path();
    write_frames(at);
    write_still(at);
    let other = BuiltinScene { gaussians: 150, frames: 1, ..scene() };
    fs::write(at.join("other.ply"), ply::write(&other.frame(0))).unwrap();
    for (name, line) in [
        ("demo", "demo --out demo --gaussians 300 --frames 3"),
        ("encode", "encode frames -o talk.gss --preset fast --psnr 40 --gop 3"),
        ("view", "view talk.gss -o talk.html"),
        ("encode_plan", "encode frames --write-plan -o plan.json --preset fast --psnr 40 --gop 2"),
        ("encode_size", "encode still.ply -o still.gss --preset fast --target-bpg 40"),
        ("encode_each", "encode still.ply other.ply no-such.ply --each -o streams --preset fast --psnr 40"),
        ("train", "train --builtin 1 --frames 2 --quality low -o network.bin"),
        ("capture", "simulate -o capture --views 4 --height 36 --samples 1 --points 300"),
        ("fit", "fit capture -o scene.ply --iterations 4 --hold-out 4"),
        ("track", "track frames -o tracked --cameras ring:4 --views 2 --height 32 --iterations 2 --all"),
        ("completions", "completions bash"),
        ("manual", "manual -o pages"),
    ] {
        insta::assert_json_snapshot!(name, shape(&report(at, line)));
    }
    insta::assert_json_snapshot!("chart", shape(&crate::chart::quick().report));
    insta::assert_json_snapshot!("chart_stability", shape(&crate::chart::stability().1));
}

#[test]
fn reports_of_the_conformance_suite_have_the_keys_they_had() {
    let vectors = Path::new(env!("CARGO_MANIFEST_DIR")).join("../conformance/vectors");
    let directory = directory();
    let at = directory.path();
    let suite = format!("--suite {} --kind invalid --area bytes", text(&vectors));
    let run = shape(&report(at, &format!("conformance run {suite} --report mine.json")));
    let list = shape(&report(at, &format!("conformance list {suite}")));
    let failing = shape(&report(at, &format!("conformance run {suite} --stdio cat")));
    let matrix = shape(&report(at, "conformance matrix mine.json -o page.md"));
    let packages = shape(&report(
        at,
        &format!("conformance packages --packages {}", text(&vectors.join("../packages"))),
    ));
    let all =
        [("run", run), ("list", list), ("failing", failing), ("matrix", matrix), ("packages", packages)];
    insta::assert_json_snapshot!(
        "conformance",
        all.into_iter().collect::<std::collections::BTreeMap<_, _>>()
    );
}
