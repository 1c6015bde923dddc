//! What people and scripts are told: the messages of documented cases, and the JSON beside them.

use crate::common::{
    directory, fail, fixture, json, run, run_with, scene, succeed, text, write_frames, write_still,
};
use serde_json::Value;
use splatstream_files::builtin::BuiltinScene;
use splatstream_files::ply;
use splatstream_gaussians::GaussianFrame;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Three frames in two temporal layers.
fn sequence(directory: &Path) -> PathBuf {
    let (frames, stream) = (write_frames(directory), directory.join("talk.gss"));
    succeed(&["encode", text(&frames), "-o", text(&stream), "--preset", "fast", "--gop", "3"]);
    stream
}

/// A text without the directory of this test.
fn plain(said: &str, directory: &Path) -> String {
    said.replace(text(directory), "DIR")
}

/// A report without the directory of this test, and without times.
fn report(arguments: &[&str], directory: &Path) -> Value {
    let mut report: Value =
        serde_json::from_str(&plain(&json(arguments).to_string(), directory)).expect("JSON");
    for (key, value) in report.as_object_mut().unwrap() {
        if key.contains("second") {
            *value = "redacted".into();
        }
    }
    report
}

#[test]
fn a_scene_for_a_stream_and_a_stream_for_a_scene() {
    let directory = directory();
    let (still, stream) = (write_still(directory.path()), directory.path().join("still.gss"));
    succeed(&["encode", text(&still), "-o", text(&stream), "--preset", "fast", "--psnr", "40"]);
    let validate = fail(10, &["validate", text(&still)]);
    let encode = fail(1, &["encode", text(&stream), "-o", text(&directory.path().join("again.gss"))]);
    insta::assert_snapshot!(plain(&[validate, encode].concat(), directory.path()));
}

#[test]
fn an_empty_input_is_called_empty() {
    let directory = directory();
    let at = |name: &str| directory.path().join(name);
    let names = ["e.gss", "e.ply", "e.splat", "e.zip", "e.json", "e.csv"];
    names.iter().for_each(|name| fs::write(at(name), []).unwrap());
    let (stream, out) = (fixture(), at("out.gss"));
    let [gss, ply, splat, zip, json, csv] = names.map(at);
    let said = [
        fail(14, &["validate", text(&gss)]),
        fail(14, &["inspect", text(&gss)]),
        fail(14, &["decode", text(&gss), "-o", text(&at("out"))]),
        fail(14, &["extract", text(&gss), "--op", "s0,t0,r0", "-o", text(&out)]),
        fail(14, &["package", text(&gss), "-o", text(&at("package"))]),
        fail(14, &["concat", text(&gss), text(&stream), "-o", text(&out)]),
        fail(1, &["encode", text(&ply), "-o", text(&out)]),
        fail(1, &["encode", text(&splat), "-o", text(&out)]),
        fail(1, &["encode", text(&zip), "-o", text(&out)]),
        fail(1, &["compare", text(&stream), text(&ply)]),
        fail(1, &["render", text(&stream), "--camera", text(&json), "-o", text(&at("pictures"))]),
        fail(1, &["play", text(&directory.path().join("package")), "--trace", text(&csv)]),
    ];
    for said in said {
        assert!(said.contains("it is empty"), "{said}");
    }
    let out = text(&out);
    for arguments in [&["encode", "-", "-o", out][..], &["compare", "-", text(&stream)]] {
        let said = String::from_utf8(run_with(arguments, &[]).stderr).unwrap();
        assert!(said.starts_with("standard input: it is empty"), "{said}");
    }
}

#[test]
fn a_scene_may_come_by_standard_input_wherever_frames_are_read() {
    let directory = directory();
    let still = write_still(directory.path());
    let bytes = fs::read(&still).unwrap();
    let compared = run_with(&["compare", "-", text(&still), "--json"], &bytes);
    assert!(compared.status.success(), "{compared:?}");
    let report: Value = serde_json::from_slice(&compared.stdout).unwrap();
    assert_eq!((&report["gaussians_a"], &report["pairs"]), (&600.into(), &600.into()));
    assert_eq!(report["attributes"]["position"]["max"], 0.0);
    let streamed = run_with(&["compare", "-", text(&fixture())], &fs::read(fixture()).unwrap());
    assert!(streamed.status.success(), "{streamed:?}");
    let pictures = directory.path().join("pictures");
    let render = ["render", "-", "-o", text(&pictures), "--camera", "ring:1", "--height", "16"];
    assert!(run_with(&render, &bytes).status.success());
    let refused = run_with(&[&render[..], &["--op", "s0,t0,r0"]].concat(), &bytes);
    let said = String::from_utf8(refused.stderr).unwrap();
    assert!(said.contains("standard input: only a stream has operating points"), "{said}");
}

#[test]
fn a_program_away_from_the_vectors_says_where_they_are() {
    let directory = directory();
    let program = directory.path().join("splatstream");
    fs::copy(env!("CARGO_BIN_EXE_splatstream"), &program).unwrap();
    let away = |arguments: &[&str]| {
        Command::new(&program).args(arguments).current_dir(directory.path()).output().unwrap()
    };
    let output = away(&["conformance", "list"]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("--suite DIR") && said.contains("splatstream-conformance-*.tar.xz"), "{said}");
    let suite = Path::new(env!("CARGO_MANIFEST_DIR")).join("../conformance");
    assert!(away(&["conformance", "list", "--suite", text(&suite)]).status.success());
}

#[test]
fn wrong_settings_are_usage() {
    let directory = directory();
    let (still, out) = (write_still(directory.path()), directory.path().join("out.gss"));
    let encode = ["encode", text(&still), "-o", text(&out)];
    let said = [["--refinements", "10,20"], ["--layers", "1080,540"], ["--refinements", "20,10,100"]]
        .map(|wrong| fail(2, &[&encode[..], &wrong].concat()));
    insta::assert_snapshot!(said.concat());
}

#[test]
fn a_scene_that_takes_too_much_memory_names_the_option() {
    let directory = directory();
    let (still, out) = (write_still(directory.path()), directory.path().join("out.gss"));
    let encode = ["encode", text(&still), "-o", text(&out), "--preset", "fast", "--psnr", "40"];
    let said = fail(1, &[&encode[..], &["--max-input-memory", "100K"]].concat());
    assert!(said.contains("at most 102400 are allowed (max_memory)"), "{said}");
    assert!(said.contains("if you trust the file, give --max-input-memory 1G"), "{said}");
    assert!(said.contains(text(&still)) && !out.exists(), "{said}");
    succeed(&[&encode[..], &["--max-input-memory", "1G"]].concat());
}

#[test]
fn outputs_are_refused_in_words() {
    let directory = directory();
    let stream = sequence(directory.path());
    let at = |name: &str| directory.path().join(name);
    let decode = |out: &Path| fail(2, &["decode", text(&stream), "-o", text(out)]);
    succeed(&["decode", text(&stream), "-o", text(&at("out"))]);
    let said = [
        decode(&at("o.gltf")),
        decode(&at("o.compressed.ply")),
        decode(&at("o.ply")),
        decode(&at("out")),
        decode(Path::new("-")),
        fail(2, &["encode", "x.ply", "-o", "x.spz"]),
        fail(2, &["extract", text(&stream), "--op", "s0,t0,r0", "-o", text(&stream)]),
    ];
    insta::assert_snapshot!(plain(&said.concat(), directory.path()));
}

#[test]
fn errors_are_json_where_json_is_asked_for() {
    let directory = directory();
    let (still, damaged) = (write_still(directory.path()), directory.path().join("damaged.gss"));
    fs::write(&damaged, b"\x89GSS").unwrap();
    let mut said = String::new();
    for (code, arguments) in [
        (1, &["validate", "no-such.gss"][..]),
        (2, &["encode", text(&still), "-o", "x.spz"]),
        (2, &["decode"]),
        (14, &["extract", text(&damaged), "--op", "s0,t0,r0", "-o", "x.gss"]),
    ] {
        let output = run(&[arguments, &["--json"]].concat());
        assert_eq!(output.status.code(), Some(code), "{output:?}");
        let error: Value = serde_json::from_slice(&output.stdout).expect("one JSON value");
        assert_eq!(error["error"]["exit_code"], code);
        assert!(!output.stderr.is_empty(), "people are told too");
        said += &format!("{error:#}\n");
    }
    insta::assert_snapshot!(plain(&said, directory.path()));
    // A report that says it is enough: there is one value on standard output.
    let output = run(&["validate", text(&damaged), "--json"]);
    let verdict: Value = serde_json::from_slice(&output.stdout).expect("one JSON value");
    assert_eq!(verdict["outcome"], "truncated");
}

#[test]
fn a_point_says_how_many_frames_it_shows() {
    let directory = directory();
    let (stream, part) = (sequence(directory.path()), directory.path().join("part.gss"));
    let extract = ["extract", text(&stream), "--op", "s0,t0,r0", "-o", text(&part)];
    assert!(succeed(&extract).contains("2 of 3 frames"));
    let extracted = report(&extract, directory.path());
    assert_eq!((&extracted["complete"], &extracted["lost"]), (&true.into(), &serde_json::json!([])));
    assert_eq!((&extracted["frames"], &extracted["frames_in_stream"]), (&2.into(), &3.into()));
    let decode = ["decode", text(&stream), "--dry-run", "--op", "s0,t0,r0"];
    assert!(succeed(&decode).contains("2 of 3 (1 I, 1 P)"));
    assert_eq!(report(&decode, directory.path())["frames_in_stream"], 3);
    let pictures = directory.path().join("pictures");
    let render = ["render", text(&stream), "-o", text(&pictures), "--op", "s0,t0,r0", "--camera", "ring:1"];
    assert!(succeed(&[&render[..], &["--height", "20"]].concat()).contains("2 pictures of 2 of 3 frames"));
    let keys: Vec<String> = extracted.as_object().unwrap().keys().cloned().collect();
    insta::assert_snapshot!(keys.join(" "));
}

#[test]
fn extract_says_what_is_damaged_and_what_is_not_there() {
    let directory = directory();
    let (stream, part) = (sequence(directory.path()), directory.path().join("part.gss"));
    let units = json(&["inspect", text(&stream), "--units"]);
    let units = units["units"].as_array().unwrap();
    let of = |kind: &str, frame: u64| {
        let unit = units.iter().find(|unit| unit["type"] == kind && unit["frame"] == frame).unwrap();
        (unit["at"].as_u64().unwrap() as usize, unit["bytes"].as_u64().unwrap() as usize)
    };
    let whole = fs::read(&stream).unwrap();
    let extract = |bytes: &[u8]| {
        fs::write(&stream, bytes).unwrap();
        json(&["extract", text(&stream), "--op", "s2,t1,r4", "-o", text(&part)])
    };
    let (at, length) = of("increment", 1);
    let mut damaged = whole.clone();
    damaged[at + length - 1] ^= 1;
    let report = extract(&damaged);
    assert_eq!((&report["damaged"], &report["complete"]), (&serde_json::json!([1]), &false.into()));
    // Without the B frame, its header and increments.
    let own = |unit: &&Value| {
        unit["frame"] == 1 && ["increment", "frame_header"].contains(&unit["type"].as_str().unwrap())
    };
    let mut shorter = whole.clone();
    for unit in units.iter().rev().filter(own) {
        let at = unit["at"].as_u64().unwrap() as usize;
        shorter.drain(at..at + unit["bytes"].as_u64().unwrap() as usize);
    }
    let report = extract(&shorter);
    assert_eq!((&report["lost"], &report["complete"]), (&serde_json::json!([[1, 1]]), &false.into()));
}

#[test]
fn scenes_of_their_own_become_streams_of_their_own() {
    let directory = directory();
    let still = write_still(directory.path());
    let small = BuiltinScene { gaussians: 150, frames: 1, ..scene() };
    let (other, out) = (directory.path().join("other.ply"), directory.path().join("streams"));
    fs::write(&other, ply::write(&small.frame(0))).unwrap();
    let fast = ["--preset", "fast", "--psnr", "40"];
    let each = ["encode", text(&still), text(&other), "no-such.ply", "--each", "-o", text(&out)];
    let output = run(&[&each[..], &fast, &["--json"]].concat());
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(report["failed"][0]["input"], "no-such.ply");
    assert_eq!(report["streams"].as_array().unwrap().len(), 2);
    for (name, gaussians) in [("still.gss", 600), ("other.gss", 150)] {
        let stream = json(&["validate", text(&out.join(name))]);
        assert!(stream["frames"] == 1 && stream["gaussians"].as_u64().unwrap() <= gaussians, "{stream}");
    }
    let twice = ["encode", text(&still), text(&still), "--each", "-o", text(&out)];
    assert!(fail(2, &twice).contains("both would become"));
    // As one sequence they are taken, and that is said.
    let one = directory.path().join("one.gss");
    let encode = ["encode", text(&still), text(&other), "-o", text(&one)];
    let report = json(&[&encode[..], &fast].concat());
    let warnings = report["warnings"].as_array().unwrap();
    let unlike = warnings.iter().find(|warning| warning["code"] == "unlike-frames").unwrap();
    insta::assert_snapshot!(unlike["message"].as_str().unwrap());
}

#[test]
fn files_of_a_directory_that_are_hardly_one_sequence_are_told_from_those_that_are() {
    let directory = directory();
    // Of each frame how many Gaussians it has, and how far it is moved.
    let said = |name: &str, frames: &[(u32, f32)], more: &[&str]| {
        let folder = directory.path().join(name);
        fs::create_dir(&folder).unwrap();
        for (number, &(gaussians, far)) in frames.iter().enumerate() {
            let scene = BuiltinScene { gaussians, frames: 1, sh_degree: 0, ..scene() };
            let mut planes = scene.frame(0).into_planes();
            planes.position[0].iter_mut().for_each(|x| *x += far);
            let frame = GaussianFrame::from_planes(0, planes).unwrap();
            fs::write(folder.join(format!("f{number}.ply")), ply::write(&frame)).unwrap();
        }
        let is_plan = more.contains(&"--write-plan");
        let out = folder.with_extension(if is_plan { "json" } else { "gss" });
        let encode = ["encode", text(&folder), "-o", text(&out), "--preset", "fast", "--psnr", "30"];
        let report = json(&[&encode[..], more].concat());
        let warnings = report["warnings"].as_array().unwrap().clone();
        let unlike = warnings.into_iter().find(|warning| warning["code"] == "unlike-frames");
        unlike.map(|warning| warning["message"].as_str().unwrap().to_owned()).unwrap_or_default()
    };
    assert_eq!(said("alike", &[(90, 0.0), (100, 0.1), (110, 0.2)], &[]), "");
    let cut = [(90, 0.0), (95, 0.0), (250, 0.0), (255, 0.0), (260, 0.0)];
    assert_eq!(said("cut-intra", &cut, &["--all-intra"]), "");
    let others = [(90, 0.0), (250, 1e3), (90, 5e3)];
    insta::assert_snapshot!(
        [
            said("cut", &cut, &[]),
            said("others", &others, &[]),
            said("others-intra", &others, &["--all-intra"]),
            said("elsewhere", &[(90, 0.0), (90, 1e3)], &[]),
            said("planned", &others, &["--write-plan"]),
            said("shards", &others, &["--shard", "1/1"]),
        ]
        .join("\n")
    );
}

#[test]
fn cameras_of_nerf_synthetic_are_taken() {
    let directory = directory();
    let (still, cameras) = (write_still(directory.path()), directory.path().join("transforms.json"));
    let bare = r#"{"camera_angle_x": 0.69, "frames": [{"file_path": "./train/r_0", "rotation": 0.01,
        "transform_matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 4], [0, 0, 0, 1]]}]}"#;
    fs::write(&cameras, bare).unwrap();
    let out = directory.path().join("out");
    let render = ["render", text(&still), "--camera", text(&cameras), "-o", text(&out), "--height", "40"];
    let drawn = json(&render);
    assert_eq!((&drawn["pictures"][0]["width"], &drawn["pictures"][0]["height"]), (&40.into(), &40.into()));
}

#[test]
fn one_frame_is_not_frames() {
    let directory = directory();
    let still = write_still(directory.path());
    let said = succeed(&["compare", text(&still), text(&still)]);
    assert!(said.contains(": 1 frame, ") && said.contains("1 frame compared") && !said.contains("1 frames"));
    // Nor is any other one thing many.
    let at = |name: &str| directory.path().join(name).to_str().unwrap().to_owned();
    let (stream, package, pictures) = (at("one.gss"), at("package"), at("pictures"));
    let fast = ["--preset", "fast", "--psnr", "40", "--layers", "1080"];
    succeed(&[&["encode", text(&still), "-o", &stream][..], &fast].concat());
    let packaged = succeed(&["package", &stream, "-o", &package]);
    assert!(packaged.contains(": 1 GOP, ") && packaged.contains(" 1 I frame, 1 subsegment, "), "{packaged}");
    let played = succeed(&["play", &package, "--no-wait"]);
    assert!(played.contains("1 of 1 GOP by") && played.contains(" in 1 request, "), "{played}");
    let back = succeed(&["unpackage", &package, "-o", &at("back.gss")]);
    assert!(back.contains("from 1 file, as"), "{back}");
    let drawn = succeed(&["render", &stream, "-o", &pictures, "--camera", "ring:1", "--height", "9"]);
    assert!(drawn.contains(": 1 picture of 1 frame;"), "{drawn}");
    assert!(
        succeed(&["extract", &stream, "--op", "s0,t0,r0", "-o", &at("part.gss")]).contains("1 of 1 frame, ")
    );
}

#[test]
fn quiet_leaves_warnings_errors_and_what_is_asked_for() {
    let directory = directory();
    let at = |name: &str| directory.path().join(name).to_str().unwrap().to_owned();
    let still = write_still(directory.path());
    let said = |arguments: &[&str]| {
        let Output { status, stdout, stderr } = run(arguments);
        (status.code(), stdout, String::from_utf8(stderr).unwrap())
    };
    let encode = ["encode", text(&still), "--preset", "fast", "--psnr", "40", "-q", "-o"];
    assert_eq!(said(&[&encode[..], &[&at("out.gss")]].concat()), (Some(0), Vec::new(), String::new()));
    let piped = said(&[&encode[..], &["-"]].concat());
    assert_eq!(piped, (Some(0), fs::read(at("out.gss")).unwrap(), String::new()));
    for quiet in ["validate", "inspect", "compare"] {
        let again = at("out.gss");
        let inputs = if quiet == "compare" { vec![again.as_str(); 2] } else { vec![again.as_str()] };
        let arguments = [&["--quiet", quiet], &inputs[..]].concat();
        assert_eq!(said(&arguments), (Some(0), Vec::new(), String::new()), "{quiet}");
    }
    let (code, json, words) = said(&["validate", &at("out.gss"), "-q", "--json"]);
    assert!(code == Some(0) && words.is_empty() && serde_json::from_slice::<Value>(&json).is_ok());
    let hasty = ["encode", text(&still), "-o", &at("hasty.gss"), "--time-budget", "0.001", "-q"];
    let (code, stdout, warning) = said(&hasty);
    assert_eq!((code, stdout.len(), warning.lines().count()), (Some(0), 0, 1), "{warning}");
    assert!(warning.starts_with("warning: the fast preset"), "{warning}");
    let (code, _, error) = said(&["validate", &at("missing.gss"), "-q"]);
    assert!(code == Some(1) && error.contains("missing.gss: cannot read"), "{error}");
    // Lines of progress, where there is no terminal for a bar.
    let simulate = ["simulate", "-o", &at("capture"), "--views", "2", "--height", "27", "--samples", "1"];
    succeed(&[&simulate[..], &["--points", "200"]].concat());
    let (capture, scene) = (at("capture"), at("scene.ply"));
    let fit = ["fit", &capture, "-o", &scene, "--iterations", "1", "--gaussians", "100", "--hold-out", "0"];
    assert!(!said(&fit).2.is_empty());
    assert_eq!(said(&[&fit[..], &["-q"]].concat()), (Some(0), Vec::new(), String::new()));
}
