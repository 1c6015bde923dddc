//! Qualities, sizes and faults of scenes, as `encode` and `compare` report them.

use crate::common::{directory, fail, json, run, scene, text, write_frames, write_still};
use serde_json::Value;
use splatstream_files::builtin::BuiltinScene;
use splatstream_files::ply;
use splatstream_gaussians::GaussianFrame;
use std::fs;

/// The codes of the warnings in a report.
fn codes(report: &Value) -> Vec<&str> {
    report["warnings"].as_array().unwrap().iter().filter_map(|warning| warning["code"].as_str()).collect()
}

#[test]
fn a_quality_is_a_psnr_that_is_measured() {
    let directory = directory();
    let (still, stream) = (write_still(directory.path()), directory.path().join("still.gss"));
    for (arguments, wanted) in [(["--quality", "low"], 40.0), (["--psnr", "47"], 47.0)] {
        let report = json(&[&["encode", text(&still), "-o", text(&stream)][..], &arguments].concat());
        let [psnr, fitted] = ["psnr_db", "fitted_psnr_db"].map(|key| report[key].as_f64().unwrap());
        assert_eq!(report["wanted_psnr_db"], wanted);
        // Quantisers of so few Gaussians cannot be set as finely.
        assert!((fitted - wanted).abs() <= 1.0, "{report}");
        let is_met = (fitted - wanted).abs() <= 0.5 && wanted - psnr <= 1.0;
        assert_eq!(is_met, codes(&report).is_empty(), "{report}");
        let views = ["--cameras", "ring:5", "--height", "540"];
        let compared = json(&[&["compare", text(&still), text(&stream)][..], &views].concat());
        // Views of so few Gaussians differ.
        assert!((compared["psnr_db"].as_f64().unwrap() - wanted).abs() < 4.0, "{compared}");
    }
}

#[test]
fn a_sequence_reports_types_and_gops() {
    let directory = directory();
    let (frames, stream) = (write_frames(directory.path()), directory.path().join("small.gss"));
    let report = json(&["encode", text(&frames), "-o", text(&stream), "--preset", "fast", "--gop", "3"]);
    for frame_type in ["I", "P", "B"] {
        assert!(report["psnr_db_by_type"][frame_type].is_number(), "{report}");
    }
    let gop = serde_json::json!({"first_frame": 0, "frames": 3, "cut": false});
    assert_eq!(report["gops"], Value::Array(vec![gop]));
    let said = run(&["encode", text(&frames), "-o", text(&stream), "--preset", "fast", "--gop", "3"]);
    let said = String::from_utf8(said.stdout).unwrap();
    assert!(said.contains("PSNR by type") && said.contains("GOPs               1 of 3 frames"), "{said}");
}

#[test]
fn a_size_is_reached_or_a_warning() {
    let directory = directory();
    let (still, stream) = (write_still(directory.path()), directory.path().join("still.gss"));
    let encode = |arguments: &[&str]| {
        json(&[&["encode", text(&still), "-o", text(&stream), "--preset", "fast"][..], arguments].concat())
    };
    let report = encode(&["--target-bpg", "90"]);
    assert!((report["bpg"].as_f64().unwrap() / 90.0 - 1.0).abs() <= 0.03, "{report}");
    let report = encode(&["--target-mb", "0.006"]);
    assert!((report["bytes"].as_f64().unwrap() / 6000.0 - 1.0).abs() <= 0.03, "{report}");
    assert!(codes(&report).is_empty(), "{report}");
    assert_eq!(codes(&encode(&["--target-bpg", "0.5"])), ["size-missed"]);
    let output =
        run(&["encode", text(&still), "-o", text(&stream), "--preset", "fast", "--target-bpg", "0.5"]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.starts_with("warning: the stream has "), "{said}");
    // Of so coarse quantisers nothing is left of spherical harmonics.
    assert!(said.contains("no coarser quantisers are tried: use fewer layers"), "{said}");
    fail(2, &["encode", text(&still), "-o", text(&stream), "--target-bpg", "8", "--quality", "low"]);
    fail(2, &["encode", text(&still), "-o", text(&stream), "--target-mb", "0"]);
}

/// What a choice of the encoder is, if it was made.
fn chosen<'a>(report: &'a Value, tool: &str) -> Option<&'a str> {
    let choices = report["chosen"].as_array().unwrap();
    choices.iter().find(|choice| choice["tool"] == tool).and_then(|choice| choice["choice"].as_str())
}

#[test]
fn a_time_chooses_what_is_done_and_not_the_clock() {
    let directory = directory();
    let (still, stream) = (write_still(directory.path()), directory.path().join("still.gss"));
    let encode = |arguments: &[&str]| {
        let report = json(&[&["encode", text(&still), "-o", text(&stream)][..], arguments].concat());
        (report, fs::read(&stream).unwrap())
    };
    let (least, _) = encode(&["--time-budget", "0.001"]);
    assert_eq!((chosen(&least, "time budget"), codes(&least)), (Some("fast"), vec!["time-budget-exceeded"]));
    let (some, bytes) = encode(&["--time-budget", "2.5"]);
    assert_eq!(chosen(&some, "time budget"), Some("balanced"));
    assert_eq!(bytes, encode(&["--preset", "balanced"]).1);
    let (none, _) =
        encode(&["--preset", "fast", "--psnr", "40", "--finetune", "3", "--time-budget", "0.001"]);
    assert_eq!(codes(&none), ["nothing-fitted"]);
    let usage = |arguments: &[&str]| {
        fail(
            2,
            &[&["encode", text(&still), "-o", text(&stream), "--time-budget", "1"][..], arguments].concat(),
        )
    };
    assert!(usage(&["--preset", "fast"]).contains("leave out --preset"));
    assert!(usage(&["--finetune", "0"]).contains("nothing to limit"));
}

#[test]
fn refinements_end_where_pictures_gain_if_that_is_asked_for() {
    let directory = directory();
    let (still, stream) = (write_still(directory.path()), directory.path().join("still.gss"));
    let encode = |refinements: &str| {
        let options = ["--psnr", "40", "--refinements", refinements];
        let report = json(&[&["encode", text(&still), "-o", text(&stream)][..], &options].concat());
        (report, fs::read(&stream).unwrap())
    };
    let (report, bytes) = encode("auto:3");
    let percents = chosen(&report, "refinements").and_then(|choice| choice.strip_prefix("3 of up to "));
    let percents = percents.expect("three").trim_end_matches(" %").replace(' ', "");
    assert!(percents.ends_with(",100"), "{percents}");
    assert!(bytes == encode(&percents).1, "{percents}");
}

#[test]
fn the_small_preset_is_fitted_to_pictures_unless_told_otherwise() {
    let directory = directory();
    let [still, stream] = ["still.ply", "still.gss"].map(|name| directory.path().join(name));
    // Of fewer Gaussians, or for less, there may be nothing to gain.
    let frame = BuiltinScene { gaussians: 2_000, ..scene() }.frame(0);
    fs::write(&still, ply::write(&frame)).unwrap();
    let encode = |arguments: &[&str]| {
        let small = ["encode", text(&still), "-o", text(&stream), "--preset", "small", "--psnr", "46"];
        json(&[&small[..], arguments].concat())
    };
    let fitted = encode(&[]);
    assert_eq!(fitted["finetuned"][0]["iterations"], 20, "{fitted}");
    let plain = encode(&["--finetune", "0"]);
    assert_eq!(
        (plain["finetuned"].as_array().map(Vec::len), chosen(&plain, "fitting")),
        (Some(0), Some("none"))
    );
    let frames = write_frames(directory.path());
    let sequence = json(&["encode", text(&frames), "-o", text(&stream), "--preset", "small", "--psnr", "40"]);
    assert_eq!(chosen(&sequence, "fitting"), Some("none"), "{sequence}");
    // Views of so few Gaussians differ.
    let is_missed = 40.0 - sequence["psnr_db"].as_f64().unwrap() > 1.0;
    let expected: &[&str] = if is_missed { &["psnr-missed"] } else { &[] };
    assert_eq!(codes(&sequence), expected, "{sequence}");
}

#[test]
fn invalid_gaussians_are_named_or_left_out() {
    let directory = directory();
    let frames = write_frames(directory.path());
    let mut planes = scene().frame(1).into_planes();
    planes.dc[2][11] = f32::INFINITY;
    planes.sh[0][12] = f32::NAN;
    planes.log_scale[0][12] = f32::NEG_INFINITY;
    let broken = GaussianFrame::from_planes(1, planes).unwrap();
    fs::write(frames.join("f9.ply"), ply::write(&broken)).unwrap();
    let stream = directory.path().join("out.gss");
    let encode = ["encode", text(&frames), "-o", text(&stream), "--preset", "fast"];
    let said = fail(1, &encode);
    for part in ["f9.ply", "frame 1", "Gaussian 11", "f_dc_2 is inf", "1 more", "--drop-invalid"] {
        assert!(said.contains(part), "{part}: {said}");
    }
    let report = json(&[&encode[..], &["--drop-invalid"]].concat());
    assert_eq!((&report["dropped"], codes(&report).contains(&"dropped")), (&2.into(), true), "{report}");
    let decoded = json(&["decode", text(&stream), "--dry-run"]);
    assert_eq!(decoded["gaussians"], report["gaussians"]);
}

#[test]
fn blank_pictures_are_no_quality() {
    let directory = directory();
    let (still, cameras) = (write_still(directory.path()), directory.path().join("cameras.json"));
    let camera = r#"[{"id": 0, "img_name": "away", "width": 64, "height": 48, "position": [0, 0, -1000],
        "rotation": [[-1, 0, 0], [0, 1, 0], [0, 0, -1]], "fx": 50, "fy": 50}]"#;
    fs::write(&cameras, camera).unwrap();
    let compare = ["compare", text(&still), text(&still), "--cameras"];
    let report = json(&[&compare[..], &[text(&cameras)]].concat());
    assert_eq!((&report["psnr_db"], &report["pictures"]), (&Value::Null, &0.into()));
    assert_eq!(report["blank_pictures"], 1);
    let output = run(&[&compare[..], &[text(&cameras)]].concat());
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("1 of 1 picture is blank"), "{said}");
    let report = json(&[&compare[..], &["ring:1", "--height", "60"]].concat());
    assert_eq!((&report["psnr_db"], &report["blank_pictures"]), (&100.0.into(), &0.into()));
}

#[test]
fn a_quality_is_measured_without_a_transform_too() {
    let directory = directory();
    let (path, stream) = (directory.path().join("scene.ply"), directory.path().join("scene.gss"));
    let scene = BuiltinScene { gaussians: 1500, sh_degree: 3, ..BuiltinScene::default() };
    fs::write(&path, ply::write(&scene.frame(0))).unwrap();
    let encode = ["encode", text(&path), "-o", text(&stream), "--psnr", "48"];
    let [with, without] = [&[][..], &["--without", "sh-transform"]].map(|more| {
        let report = json(&[&encode[..], more].concat());
        assert!((report["fitted_psnr_db"].as_f64().unwrap() - 48.0).abs() < 0.5, "{report}");
        report["fitted_psnr_db"].as_f64().unwrap()
    });
    assert_ne!(with, without, "what one was fitted with is not what the other has");
}
