//! Fitting to pictures that is killed: another run goes on with it.
#![cfg(unix)]

use crate::common::{directory, fail, json, text};
use splatstream_files::builtin::BuiltinScene;
use splatstream_files::ply;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::Duration;

/// A fit that has been kept in a directory.
fn kept_in(state: &Path) -> Option<PathBuf> {
    let paths = fs::read_dir(state).into_iter().flatten().flatten().map(|entry| entry.path());
    paths.into_iter().find(|path| path.extension().is_some_and(|ending| ending == "fit"))
}

fn words(arguments: &[String]) -> Vec<&str> {
    arguments.iter().map(String::as_str).collect()
}

/// What a run says and how it ends that gets a signal once it has kept a state.
fn ended(arguments: &[&str], state: &Path, signal: &str) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_splatstream"))
        .args(arguments)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    while kept_in(state).is_none() && child.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(2));
    }
    if kept_in(state).is_none() {
        panic!("it came to its end before: {:?}", child.wait_with_output());
    }
    assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
    child.wait_with_output().unwrap()
}

#[test]
fn a_killed_run_is_gone_on_with_and_writes_the_same_stream() {
    let around = directory();
    let path = |name: &str| around.path().join(name);
    let (scene, whole, again, state) =
        (path("still.ply"), path("whole.gss"), path("again.gss"), path("state"));
    let frame = BuiltinScene { gaussians: 1_000, sh_degree: 1, ..BuiltinScene::default() }.frame(0);
    fs::write(&scene, ply::write(&frame)).unwrap();
    let fit = |out: &Path, more: &[&str]| -> Vec<String> {
        let own = ["encode", text(&scene), "-o", text(out), "--preset", "fast", "--psnr", "40"];
        let own = own.iter().chain(&["--layers", "200", "--finetune", "60"]).chain(more);
        own.map(|&word| word.to_owned()).collect()
    };
    let plain = json(&words(&fit(&whole, &[])));
    for signal in ["-KILL", "-INT"] {
        let keeping = fit(&again, &["--finetune-state", text(&state)]);
        let output = ended(&words(&keeping), &state, signal);
        let said = String::from_utf8(output.stderr).unwrap();
        match signal {
            "-INT" => {
                assert_eq!(output.status.code(), Some(130), "{said}");
                assert!(said.contains("with --resume goes on"), "{said}");
            }
            _ => assert_eq!(output.status.code(), None, "{said}"),
        }
        assert!(!again.exists());
        let resuming = fit(&again, &["--finetune-state", text(&state), "--resume"]);
        // What was kept is what it goes on with.
        let kept = kept_in(&state).expect("a file");
        let bytes = fs::read(&kept).unwrap();
        fs::write(&kept, &bytes[1..]).unwrap();
        let refused = fail(1, &words(&resuming));
        assert!(refused.contains("the state is damaged") && refused.contains(text(&kept)), "{refused}");
        fs::write(&kept, &bytes).unwrap();
        let report = json(&words(&resuming));
        assert!(fs::read(&again).unwrap() == fs::read(&whole).unwrap(), "{signal}");
        assert_eq!(report["finetuned"][0]["psnr_db_after"], plain["finetuned"][0]["psnr_db_after"]);
        // Nobody needs it any more.
        assert!(!state.exists());
        fs::remove_file(&again).unwrap();
    }
}

#[test]
fn who_resumes_where_nothing_was_left_begins() {
    let around = directory();
    let path = |name: &str| around.path().join(name);
    let frame = BuiltinScene { gaussians: 100, sh_degree: 0, ..BuiltinScene::default() }.frame(0);
    fs::write(path("still.ply"), ply::write(&frame)).unwrap();
    let (scene, stream, state) = (path("still.ply"), path("still.gss"), path("state"));
    let own = [
        "encode",
        text(&scene),
        "-o",
        text(&stream),
        "--preset",
        "fast",
        "--layers",
        "64",
        "--finetune",
        "2",
    ];
    let plain = json(&own);
    let whole = fs::read(&stream).unwrap();
    let report = json(&[&own[..], &["--finetune-state", text(&state), "--resume"]].concat());
    assert!(fs::read(&stream).unwrap() == whole);
    assert_eq!(report["finetuned"].as_array().map(Vec::len), plain["finetuned"].as_array().map(Vec::len));
    assert!(!state.exists());
}

#[test]
fn what_is_refused_leaves_no_state() {
    let directory = directory();
    let (path, state) = (directory.path().join("scene.ply"), directory.path().join("state"));
    let mut frame = BuiltinScene { gaussians: 100, ..BuiltinScene::default() }.frame(0);
    frame.planes_mut().dc[0][7] = f32::NAN;
    fs::write(&path, ply::write(&frame)).unwrap();
    let stream = directory.path().join("scene.gss");
    let arguments = ["encode", text(&path), "-o", text(&stream), "--finetune", "1", "--psnr", "40"];
    let arguments = [&arguments[..], &["--finetune-state", text(&state)]].concat();
    fail(1, &arguments);
    assert!(!state.exists());
    json(&[&arguments[..], &["--drop-invalid"]].concat());
    assert!(!state.exists());
}
