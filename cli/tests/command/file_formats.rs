//! Formats of scenes on the way in and out: files of many frames, what readers note, and what each output keeps.

use crate::common;
use crate::common::{directory, fail, json, run, scene, succeed, text, write_frames};
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

/// The frames of a folder as a ZIP archive, in the order in which it has them.
fn zip(folder: &Path, name: &str) -> PathBuf {
    let path = folder.with_file_name(name);
    let mut archive = zip::ZipWriter::new(fs::File::create(&path).unwrap());
    for entry in fs::read_dir(folder).unwrap() {
        let file = entry.unwrap().path();
        let name = format!("frames/{}", file.file_name().unwrap().to_str().unwrap());
        archive.start_file(name, zip::write::SimpleFileOptions::default()).unwrap();
        archive.write_all(&fs::read(file).unwrap()).unwrap();
    }
    archive.finish().unwrap();
    path
}

#[test]
fn an_archive_is_encoded_as_the_folder_in_it() {
    let directory = directory();
    let frames = write_frames(directory.path());
    let archive = zip(&frames, "talk.zip");
    let encode = |input: &Path, out: &str| {
        let out = directory.path().join(out);
        succeed(&["encode", text(input), "-o", text(&out), "--preset", "fast", "--psnr", "40"]);
        fs::read(out).unwrap()
    };
    assert!(encode(&archive, "a.gss") == encode(&frames, "b.gss"), "the streams differ");
    let compared = json(&["compare", text(&archive), text(&frames)]);
    assert_eq!((&compared["frames"], &compared["attributes"]["position"]["rmse"]), (&3.into(), &0.0.into()));
    // By a pipe too.
    let bytes = fs::read(&archive).unwrap();
    let piped = directory.path().join("c.gss");
    let output =
        common::run_with(&["encode", "-", "-o", text(&piped), "--preset", "fast", "--psnr", "40"], &bytes);
    assert!(output.status.success(), "{output:?}");
    assert!(fs::read(piped).unwrap() == fs::read(directory.path().join("a.gss")).unwrap());
    let said = fail(2, &["encode", text(&archive), text(&archive), "-o", "x.gss"]);
    assert!(said.contains("holds many frames; give it by itself, or use --each"), "{said}");
}

#[test]
fn each_output_holds_every_gaussian() {
    let directory = directory();
    let frames = write_frames(directory.path());
    let stream = directory.path().join("talk.gss");
    succeed(&[
        "encode",
        text(&frames),
        "-o",
        text(&stream),
        "--preset",
        "fast",
        "--psnr",
        "45",
        "--all-intra",
    ]);
    for (format, suffix) in [("glb", "glb"), ("sog", "sog"), ("compressed-ply", "compressed.ply")] {
        let out = directory.path().join(format);
        let report = json(&["decode", text(&stream), "-o", text(&out), "--format", format]);
        assert_eq!(report["frames"], 3);
        assert!(out.join(format!("frame_0002.{suffix}")).is_file(), "{format}");
        let compared =
            json(&["compare", text(&out), text(&stream), "--cameras", "ring:2", "--height", "120"]);
        assert_eq!(compared["gaussians_a"], 3 * u64::from(scene().gaussians), "{format}");
        let psnr = compared["psnr_db"].as_f64().unwrap_or(f64::INFINITY);
        assert!(psnr > if format == "glb" { 90.0 } else { 38.0 }, "{format}: {psnr} dB");
        // A second run finds the frames of the first.
        fail(2, &["decode", text(&stream), "-o", text(&out), "--format", format]);
        succeed(&["decode", text(&stream), "-o", text(&out), "--format", format, "--force"]);
    }
}

#[test]
fn what_a_reader_leaves_out_is_said() {
    let directory = directory();
    let flat = directory.path().join("flat.ply");
    let names = "x y z opacity f_dc_0 f_dc_1 f_dc_2 scale_0 scale_1 rot_0 rot_1 rot_2 rot_3";
    let properties: String = names.split(' ').map(|name| format!("property float {name}\n")).collect();
    let rows: String =
        (0..40).map(|at| format!("{} {} 2 3 0.5 0 0 -3 -3 1 0 0 0\n", at % 7, at / 7)).collect();
    fs::write(&flat, format!("ply\nformat ascii 1.0\nelement vertex 40\n{properties}end_header\n{rows}"))
        .unwrap();
    let out = directory.path().join("flat.gss");
    let output =
        run(&["encode", text(&flat), "-o", text(&out), "--preset", "fast", "--psnr", "40", "--json"]);
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let warning =
        report["warnings"].as_array().unwrap().iter().find(|warning| warning["code"] == "flat").unwrap();
    let message = warning["message"].as_str().unwrap();
    assert!(message.contains("flat.ply: Gaussians have two semi-axes (2DGS)"), "{message}");
    assert!(String::from_utf8_lossy(&output.stderr).contains(&format!("warning: {message}")), "{output:?}");
}
