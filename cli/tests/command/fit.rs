//! From simulated pictures to scenes.

use crate::common::{directory, fail, json, succeed, text};
use std::fs;
use std::path::Path;

/// Two frames of a capture of four small views.
fn simulated(at: &Path) -> String {
    let out = at.join("walk");
    let simulate =
        ["simulate", "-o", text(&out), "--frames", "2", "--fps", "5", "--views", "5", "--height", "36"];
    succeed(&[simulate.as_slice(), &["--samples", "1", "--points", "400", "--rig", "forward"]].concat());
    text(&out).to_owned()
}

#[test]
fn a_sequence_is_trained_warm_measured_and_resumed() {
    let directory = directory();
    let at = directory.path();
    let walk = simulated(at);
    let frames = at.join("frames");
    let fit =
        ["fit", &walk, "-o", text(&frames), "--iterations", "20", "--gaussians", "500", "--sh-degree", "1"];
    let fit = [fit.as_slice(), &["--warm", "--warm-iterations", "5", "--hold-out", "5"]].concat();
    let report = json(&fit);
    let all = report["frames"].as_array().unwrap();
    assert_eq!((&all[0]["iterations"], &all[1]["iterations"]), (&20.into(), &5.into()));
    // Warm frames have the same Gaussians.
    assert_eq!(all[0]["gaussians"], all[1]["gaussians"]);
    assert!(report["held_out_psnr_db"].as_f64().unwrap() > 8.0);
    assert_eq!(all[0]["views"].as_array().unwrap().iter().filter(|view| view["held_out"] == true).count(), 1);

    // Only measured, the scene is worth what it was when it was trained.
    let measure = ["fit", &walk, "--start", text(&frames), "--iterations", "0", "--hold-out", "5"];
    let measured = json(&measure);
    assert!(measured["output"].is_null());
    for key in ["psnr_db", "held_out_psnr_db"] {
        // Rotations are brought to unit length again where they are read.
        let [found, expected] = [&measured, &report].map(|report| report[key].as_f64().unwrap());
        assert!((found - expected).abs() < 1e-3, "{key} {found} {expected}");
    }

    // A lost frame comes back as it was, from the one before; the other is kept.
    let second = frames.join("frame_0001.ply");
    let before = fs::read(&second).unwrap();
    fs::remove_file(&second).unwrap();
    let resumed = json(&[fit.as_slice(), &["--resume"]].concat());
    assert_eq!((&resumed["frames"][0]["kept"], &resumed["frames"][1]["kept"]), (&true.into(), &false.into()));
    assert!(fs::read(&second).unwrap() == before);

    // Frames of other settings are not kept, and nothing is made beside them.
    fs::remove_file(&second).unwrap();
    let said = fail(2, &[fit.as_slice(), &["--resume", "--hold", "0.9"]].concat());
    assert!(said.contains("hold is 0.9, and was 0.2"), "{said}");
    let cameras = Path::new(&walk).join("frame_0001/transforms.json");
    let other = format!("{}\n", fs::read_to_string(&cameras).unwrap());
    fs::write(&cameras, other).unwrap();
    let said = fail(2, &[fit.as_slice(), &["--resume"]].concat());
    assert!(said.contains("other inputs: there is") && said.contains("frame_0001"), "{said}");
    assert!(!second.exists());
}

#[test]
fn what_cannot_be_trained_is_said() {
    let directory = directory();
    let at = directory.path();
    let walk = simulated(at);
    let one = format!("{walk}/frame_0000");
    let out = at.join("scene.ply");
    // What training takes follows from Gaussians and pictures, and is told before any of it is taken.
    let many = ["fit", &one, "-o", text(&out), "--gaussians", "10000000"];
    let said = fail(13, &[&many[..], &["--max-memory", "64M"]].concat());
    assert!(
        said.contains("5 pictures takes up to ") && said.contains("allow it with --max-memory "),
        "{said}"
    );
    assert!(fail(1, &["fit", text(at), "-o", text(&out)]).contains("transforms.json"));
    assert!(fail(1, &["fit", text(&at.join("none")), "-o", text(&out)]).contains("check the path"));
    assert!(fail(2, &["fit", &one, "-o", text(&at.join("scene.gss"))]).contains("ends in .ply"));
    assert!(fail(2, &["fit", &one, "--start", &one]).contains("--iterations 0"));
    assert!(fail(2, &["fit", &walk, "-o", text(&out)]).contains("looks like the name of a file"));
    fs::remove_file(at.join("walk/frame_0000/images/view_001.png")).unwrap();
    assert!(fail(1, &["fit", &one, "-o", text(&out)]).contains("view_001"));
    assert!(!out.exists());
}

#[test]
fn a_stream_is_fitted_to_the_photographs_of_its_scene() {
    let directory = directory();
    let at = directory.path();
    let capture = at.join("capture");
    let simulate = ["simulate", "-o", text(&capture), "--views", "9", "--height", "36", "--samples", "1"];
    succeed(&[simulate.as_slice(), &["--points", "300", "--rig", "forward"]].concat());
    let scene = at.join("scene.ply");
    let fit = ["fit", text(&capture), "-o", text(&scene), "--iterations", "5", "--gaussians", "300"];
    succeed(&[fit.as_slice(), &["--sh-degree", "0"]].concat());
    let (stream, images) = (at.join("scene.gss"), capture.join("images"));
    let encode = ["encode", text(&scene), "-o", text(&stream), "--psnr", "36", "--preset", "fast"];
    let to_images = ["--finetune", "10", "--images", text(&images)];
    let cameras = ["--cameras", text(&capture)];
    let report = json(&[&encode[..], &to_images, &cameras].concat());
    let [before, after] =
        ["psnr_db_before", "psnr_db_after"].map(|key| report["finetuned"][0][key].as_f64().unwrap());
    assert!(after >= before, "{before} {after}");
    assert_eq!(report["warnings"].as_array().unwrap().len(), 0, "{report}");

    assert!(fail(2, &[&encode[..], &to_images, &["--cameras", "ring:8"]].concat()).contains("took them"));
    let several = ["encode", text(&scene), text(&scene), "-o", text(&stream), "--all-intra"];
    assert!(fail(2, &[&several[..], &to_images, &cameras].concat()).contains("there are 2 frames"));
    fs::remove_file(images.join("view_001.png")).unwrap();
    assert!(fail(1, &[&encode[..], &to_images, &cameras].concat()).contains("view_001"));
}

#[test]
fn pictures_are_the_same_again() {
    let directory = directory();
    let [one, other] = ["one", "other"].map(|name| directory.path().join(name));
    for (out, threads) in [(&one, "1"), (&other, "3")] {
        let simulate = ["simulate", "-o", text(out), "--views", "1", "--height", "27", "--threads", threads];
        succeed(&[simulate.as_slice(), &["--samples", "2", "--points", "50"]].concat());
    }
    for file in ["images/view_000.png", "transforms.json", "sparse_pc.ply", "sparse/0/images.txt"] {
        assert_eq!(fs::read(one.join(file)).unwrap(), fs::read(other.join(file)).unwrap(), "{file}");
    }
}
