//! Frames that were trained apart become one sequence.

use crate::common::{directory, fail, json, run, succeed, text};
use splatstream_files::builtin::{BuiltinScene, Tracking};
use splatstream_files::ply;
use std::fs;
use std::path::Path;

/// Frames of a moving scene with other Gaussians in each.
fn write_apart(folder: &Path, frames: u32) {
    write(folder, frames, Tracking::Untracked);
}

fn write(folder: &Path, frames: u32, tracking: Tracking) {
    let scene = BuiltinScene { gaussians: 400, frames, tracking, ..BuiltinScene::default() };
    fs::create_dir_all(folder).unwrap();
    (0..frames).for_each(|number| {
        fs::write(folder.join(format!("{number:03}.ply")), ply::write(&scene.frame(number))).unwrap();
    });
}

/// The command for small pictures, with more options.
fn track<'a>(input: &'a Path, out: &'a Path, more: &[&'a str]) -> Vec<&'a str> {
    let of_all = ["track", text(input), "-o", text(out), "--cameras", "forward:6", "--gop", "3"];
    let small = ["--views", "12", "--height", "48", "--iterations", "40"];
    [of_all.as_slice(), &small, more].concat()
}

#[test]
fn frames_trained_apart_become_a_sequence_that_is_predicted() {
    let directory = directory();
    let [apart, out] = ["apart", "tracked"].map(|name| directory.path().join(name));
    write_apart(&apart, 5);
    let report = json(&track(&apart, &out, &[]));
    let frames = report["frames"].as_array().unwrap();
    let origins: Vec<&str> = frames.iter().map(|frame| frame["origin"].as_str().unwrap()).collect();
    assert_eq!(origins, ["source", "tracked", "tracked", "source", "tracked"]);
    // The first of a GOP is what it was; the others have its Gaussians, and look more like their own source.
    for number in [0, 3] {
        let [source, made] =
            [apart.join(format!("{number:03}.ply")), out.join(format!("frame_{number:04}.ply"))];
        assert_eq!(fs::read(source).unwrap(), fs::read(made).unwrap());
    }
    assert_eq!(frames[1]["gaussians"], frames[0]["gaussians"]);
    assert!(
        report["psnr_db"].as_f64().unwrap() > report["psnr_before_db"].as_f64().unwrap() + 1.0,
        "{report}"
    );

    let bytes = |frames: &Path| {
        let stream = directory.path().join("out.gss");
        let encode =
            ["encode", text(frames), "-o", text(&stream), "--preset", "fast", "--psnr", "40", "--gop", "3"];
        json(&[encode.as_slice(), &["--layers", "1080"]].concat())
    };
    let [alone, together] = [&apart, &out].map(|frames| bytes(frames)["bytes"].as_u64().unwrap());
    assert!(together * 10 < alone * 9, "{together} of {alone} bytes");

    // Where nothing can be predicted, encode says what would help.
    let other = directory.path().join("other");
    fs::create_dir_all(&other).unwrap();
    for seed in 0..3 {
        let scene = BuiltinScene { gaussians: 400, seed, ..BuiltinScene::default() };
        fs::write(other.join(format!("{seed}.ply")), ply::write(&scene.frame(0))).unwrap();
    }
    let said = bytes(&other)["warnings"].to_string();
    assert!(said.contains("short-gops") && said.contains("splatstream track"), "{said}");
}

#[test]
fn a_gop_can_be_made_by_itself_again_and_is_the_same() {
    let directory = directory();
    let [apart, out] = ["apart", "tracked"].map(|name| directory.path().join(name));
    write_apart(&apart, 5);
    json(&track(&apart, &out, &["--threads", "1"]));
    let part = directory.path().join("part");
    let report = json(&track(&apart, &part, &["--frames", "4..5", "--threads", "3"]));
    assert_eq!(report["frames"].as_array().unwrap().len(), 2, "{report}");
    for name in ["frame_0003.ply", "frame_0004.ply"] {
        assert_eq!(fs::read(out.join(name)).unwrap(), fs::read(part.join(name)).unwrap(), "{name}");
    }
    // A lost frame comes back; the others are kept.
    let lost = out.join("frame_0002.ply");
    let before = fs::read(&lost).unwrap();
    fs::remove_file(&lost).unwrap();
    let resumed = json(&track(&apart, &out, &["--resume"]));
    let kept: Vec<_> =
        resumed["frames"].as_array().unwrap().iter().map(|frame| frame["kept"] == true).collect();
    assert_eq!(kept, [true, true, false, true, true]);
    assert_eq!(fs::read(&lost).unwrap(), before);
    // But not with other settings or inputs, and not where nobody knows the settings.
    let resume = |input: &Path, more: &[&str]| fail(2, &track(input, &out, &[&["--resume"], more].concat()));
    let said = resume(&apart, &["--hold", "0.5"]);
    assert!(said.contains("hold is 0.5, and was 0.3") && said.contains("--force"), "{said}");
    let other = directory.path().join("other");
    write_apart(&other, 5);
    let larger = BuiltinScene { gaussians: 401, ..BuiltinScene::default() };
    fs::write(other.join("003.ply"), ply::write(&larger.frame(0))).unwrap();
    let said = resume(&other, &[]);
    assert!(said.contains("other inputs: there is") && said.contains("003.ply"), "{said}");
    fs::remove_file(out.join(".track-settings.json")).unwrap();
    let said = resume(&apart, &[]);
    assert!(said.contains("no .track-settings.json"), "{said}");
    let tracked = json(&track(&apart, &out, &["--force"]));
    assert!(tracked["frames"].as_array().unwrap().iter().all(|frame| frame["kept"] == false));
    let resumed = json(&track(&apart, &out, &["--resume"]));
    assert!(resumed["frames"].as_array().unwrap().iter().all(|frame| frame["kept"] == true));
    // Frames that another command has put there are of no settings.
    let stream = directory.path().join("apart.gss");
    succeed(&["encode", text(&apart), "-o", text(&stream), "--preset", "fast", "--quality", "low"]);
    succeed(&["decode", text(&stream), "-o", text(&out), "--force"]);
    let said = resume(&apart, &[]);
    assert!(said.contains("no .track-settings.json"), "{said}");
}

#[test]
fn frames_that_are_a_sequence_are_kept_as_they_are() {
    let directory = directory();
    let [walk, out] = ["walk", "tracked"].map(|name| directory.path().join(name));
    write(&walk, 3, Tracking::Tracked);
    let report = json(&track(&walk, &out, &[]));
    for (number, frame) in report["frames"].as_array().unwrap().iter().enumerate() {
        assert_eq!(frame["origin"], if number == 0 { "source" } else { "alike" });
        let made = out.join(format!("frame_{number:04}.ply"));
        assert_eq!(fs::read(walk.join(format!("{number:03}.ply"))).unwrap(), fs::read(made).unwrap());
    }
    assert_eq!(report["frames"][1]["in_common"], 1.0);
    let said = succeed(&track(&walk, &out, &["--force"]));
    assert!(said.contains("alike        2 frames as they are"), "{said}");
    let all = json(&track(&walk, &out, &["--force", "--all"]));
    assert_eq!(all["frames"][1]["origin"], "tracked");
}

#[test]
fn what_is_too_far_off_is_kept_as_it_is() {
    let directory = directory();
    let [apart, out] = ["apart", "tracked"].map(|name| directory.path().join(name));
    write_apart(&apart, 3);
    let report = json(&track(&apart, &out, &["--cut", "99"]));
    let origins: Vec<_> = report["frames"].as_array().unwrap().iter().map(|frame| &frame["origin"]).collect();
    assert_eq!(origins, ["source", "cut", "cut"]);
    assert!(report["psnr_db"].is_null());
    assert_eq!(fs::read(apart.join("002.ply")).unwrap(), fs::read(out.join("frame_0002.ply")).unwrap());
    let said = succeed(&track(&apart, &out, &["--cut", "99", "--force"]));
    assert!(said.contains("2 frames as they are"), "{said}");
}

#[test]
fn nothing_is_lost_and_what_is_wrong_is_said() {
    let directory = directory();
    let [apart, out] = ["apart", "tracked"].map(|name| directory.path().join(name));
    write_apart(&apart, 2);
    let said = |code, more: &[&str]| fail(code, &track(&apart, &out, more));
    assert!(said(2, &["--hold", "1.5"]).contains("0 to 1"));
    assert!(said(2, &["--frames", "2..3"]).contains("there are 2 frames"));
    assert!(!out.exists());
    let without = run(&["track", text(&apart), "-o", text(&out)]);
    assert!(
        without.status.code() == Some(2) && String::from_utf8_lossy(&without.stderr).contains("--cameras")
    );

    // Frames of an earlier run are in the way, those that are read even more so.
    fs::rename(apart.join("000.ply"), apart.join("frame_0000.ply")).unwrap();
    assert!(fail(2, &track(&apart, &apart, &["--force"])).contains("frame_0000.ply"));
    assert!(apart.join("frame_0000.ply").exists());
    fs::create_dir_all(&out).unwrap();
    fs::write(out.join("frame_0009.ply"), "old").unwrap();
    assert!(said(2, &[]).contains("--force"));
    json(&track(&apart, &out, &["--force"]));
    assert!(!out.join("frame_0009.ply").exists() && out.join("frame_0001.ply").exists());
}
