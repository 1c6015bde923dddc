//! Pictures of scenes: the cameras that they are drawn from, their figures, and what they may take.

use crate::common::{directory, fail, json, succeed, text};
use splatstream_files::builtin::BuiltinScene;
use splatstream_files::ply;
use std::fs;
use std::path::{Path, PathBuf};

/// A scene of its own number of Gaussians, so that cameras made for it are its own.
fn scene(directory: &Path, gaussians: u32) -> PathBuf {
    let path = directory.join(format!("{gaussians}.ply"));
    let scene = BuiltinScene { gaussians, ..BuiltinScene::default() };
    fs::write(&path, ply::write(&scene.frame(0))).unwrap();
    path
}

#[test]
fn cameras_that_are_written_draw_another_scene_as_this_one() {
    let directory = directory();
    let at = |name: &str| directory.path().join(name);
    let (one, other) = (scene(directory.path(), 400), scene(directory.path(), 900));
    let cameras = at("ring.json");
    let render = |input: &Path, camera: &str, out: &str, more: &[&str]| {
        let out = at(out);
        let arguments = ["render", text(input), "--camera", camera, "-o", text(&out)];
        succeed(&[&arguments[..], more].concat());
        fs::read(out.join("ring_01.png")).unwrap()
    };
    let made = render(&one, "ring:3", "a", &["--height", "30", "--write-cameras", text(&cameras)]);
    assert_eq!(made, render(&one, text(&cameras), "b", &[]), "the same scene");
    let [own, as_one] =
        [render(&other, "ring:3", "c", &["--height", "30"]), render(&other, text(&cameras), "d", &[])];
    assert_ne!(own, as_one, "cameras made for a scene are its own");
    let (camera, out) = (text(&cameras), at("e"));
    let refused = ["render", text(&one), "--camera", camera, "-o", text(&out), "--write-cameras", camera];
    let said = fail(2, &refused);
    assert!(said.contains("ring.json"), "{said}");
    // Nothing is written where nothing is drawn, and lenses that bend lines cannot be.
    let (none, out) = (at("none.json"), at("f"));
    let render = ["render", text(&one), "--write-cameras", text(&none), "-o", text(&out), "--height", "9"];
    fail(2, &[&render[..], &["--camera", "ring:1", "--frames", "5..6"]].concat());
    let lens = at("transforms.json");
    let camera = r#"{"fl_x": 9, "w": 9, "h": 9, "k1": 0.1, "frames": [{"file_path": "a.png", "transform_matrix":
        [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 4], [0, 0, 0, 1]]}]}"#;
    fs::write(&lens, camera).unwrap();
    let said = fail(1, &[&render[..], &["--camera", text(&lens)]].concat());
    assert!(said.contains("bends straight lines"), "{said}");
    assert!(!none.exists());
    succeed(&["render", text(&one), "--camera", text(&lens), "-o", text(&out)]);
}

#[test]
fn figures_of_each_picture_have_the_means_that_are_reported() {
    let directory = directory();
    let (one, other) = (scene(directory.path(), 400), scene(directory.path(), 900));
    let compare = ["compare", text(&one), text(&other), "--cameras", "ring:3", "--height", "30"];
    let report = json(&compare);
    let pictures = report["each_picture"].as_array().unwrap();
    let of = |key: &str| pictures.iter().map(|picture| picture[key].as_f64().unwrap()).collect::<Vec<_>>();
    assert_eq!(
        (pictures.len(), &pictures[2]["view"], &pictures[2]["frame"]),
        (3, &"ring_02".into(), &0.into())
    );
    for key in ["psnr_db", "psnr_masked_db", "yuv_psnr_db", "ssim"] {
        let mean = of(key).iter().sum::<f64>() / 3.0;
        assert!((report[key].as_f64().unwrap() - mean).abs() < 1e-9, "{key}: {report}");
    }
    let lowest = of("psnr_db").into_iter().fold(f64::INFINITY, f64::min);
    let printed = succeed(&compare);
    assert!(printed.contains(&format!("lowest: {lowest:.2} dB, frame 0 from ring_0")), "{printed}");
}

#[test]
fn pictures_that_take_more_than_is_allowed_are_refused() {
    let directory = directory();
    let (one, out) = (scene(directory.path(), 400), directory.path().join("out"));
    let bounded = ["--height", "8640", "--max-memory", "1G"];
    for command in [
        &["render", text(&one), "--camera", "ring:2", "-o", text(&out)][..],
        &["compare", text(&one), text(&one), "--cameras", "ring:2"],
    ] {
        let said = fail(13, &[command, &bounded].concat());
        assert!(said.contains("drawing 2 pictures of up to 15360 x 8640 pixels"), "{said}");
        assert!(said.contains("smaller --height"), "{said}");
    }
    assert!(!out.exists(), "nothing is left");
}
