//! Encode, decode, extract, compare.

use crate::common::{directory, fail, json, run, scene, succeed, text, write_frames, write_stream};
use std::fs;
use std::path::{Path, PathBuf};

/// The files of a directory in order of their names.
fn files(directory: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> =
        fs::read_dir(directory).expect("a directory").map(|entry| entry.expect("an entry").path()).collect();
    files.sort();
    files
}

#[test]
fn what_is_decoded_is_close_to_what_was_encoded() {
    let directory = directory();
    let frames = write_frames(directory.path());
    let stream = directory.path().join("small.gss");
    let encoded = json(&["encode", text(&frames), "-o", text(&stream), "--quality", "visually-lossless"]);
    assert_eq!(encoded["frames"], 3);
    assert_eq!(encoded["bytes"], fs::metadata(&stream).unwrap().len());
    let decoded = directory.path().join("decoded");
    let report = json(&["decode", text(&stream), "-o", text(&decoded)]);
    assert_eq!(report["digests"], encoded["digests"]);
    assert_eq!(report["gaussians"], encoded["gaussians"]);
    assert_eq!(files(&decoded).len(), 3);
    for other in [&stream, &decoded] {
        let height = encoded["view_height"].to_string();
        let views = ["--cameras", "ring:3", "--height", &height];
        let compared = json(&[&["compare", text(&frames), text(other)][..], &views].concat());
        assert_eq!(compared["frames"], 3);
        let mean = |attribute: &str| compared["attributes"][attribute]["rmse"].as_f64().unwrap();
        // Steps follow what pictures show: a Gaussian that hardly shows may be farther off than the mean.
        assert!(mean("position") <= 0.02, "{}", mean("position"));
        let psnr = compared["psnr_db"].as_f64().unwrap();
        // Other views than those of the encoder: how much of a picture the scene fills changes the PSNR.
        let [fitted, verified] = ["fitted_psnr_db", "psnr_db"].map(|key| encoded[key].as_f64().unwrap());
        assert!(fitted >= 56.5 && psnr >= verified - 3.0, "{fitted}, {verified} and {psnr} dB");
    }
}

#[test]
fn a_sequence_compared_with_itself_flickers_as_much_and_one_frame_does_not() {
    let directory = directory();
    let frames = write_frames(directory.path());
    let views = ["--cameras", "ring:2", "--height", "60"];
    let of = |a: &Path| json(&[&["compare", text(a), text(a)][..], &views].concat());
    let sequence = of(&frames);
    let flicker = |report: &serde_json::Value| {
        ["temporal_psnr_a_db", "temporal_psnr_b_db", "still_percent"].map(|key| report[key].as_f64())
    };
    let [Some(a), Some(b), Some(still)] = flicker(&sequence) else { panic!("{sequence}") };
    assert!(a == b && (0.0..=100.0).contains(&still), "{sequence}");
    assert_eq!(flicker(&of(&files(&frames)[0])), [None; 3]);
}

#[test]
fn frames_come_in_the_order_that_people_count_in() {
    let directory = directory();
    let stream = write_stream(directory.path());
    // f8, f9, f10: by order of names, frame 0 of the stream would be f10.
    let apart = |name: &str| {
        let first = directory.path().join("frames").join(name);
        let compared = json(&["compare", text(&first), text(&stream), "--match", "nearest"]);
        assert_eq!((&compared["frames"], &compared["frames_b"]), (&1.into(), &3.into()));
        compared["attributes"]["position"]["rmse"].as_f64().unwrap()
    };
    assert!(apart("f8.ply") < apart("f10.ply"), "{} {}", apart("f8.ply"), apart("f10.ply"));
}

#[test]
fn a_scene_is_itself_by_order_and_by_position() {
    let directory = directory();
    let frames = write_frames(directory.path());
    for (matching, matched_by) in [("auto", "order"), ("order", "order"), ("nearest", "nearest")] {
        let compared = json(&["compare", text(&frames), text(&frames), "--match", matching]);
        assert_eq!(compared["matched_by"], serde_json::json!([matched_by, matched_by, matched_by]));
        for attribute in ["position", "log_scale", "opacity_logit", "rotation", "dc", "sh"] {
            assert_eq!(compared["attributes"][attribute]["max"], 0.0, "{matching} {attribute}");
        }
    }
}

#[test]
fn decoding_an_extracted_stream_is_decoding_at_its_operating_point() {
    let directory = directory();
    let stream = write_stream(directory.path());
    // Two GOPs: an I frame and a B frame, an I frame.
    for (op, frames) in [("s0,t0,r0", 2), ("s2,t0,r4", 2), ("s0,t1,r2", 3), ("s2,t1,r1", 3), ("s2,t1,r4", 3)]
    {
        let part = directory.path().join("part.gss");
        succeed(&["extract", text(&stream), "--op", op, "-o", text(&part)]);
        succeed(&["validate", text(&part)]);
        let [whole, extracted] = ["whole", "extracted"].map(|name| directory.path().join(name));
        succeed(&["decode", text(&stream), "--op", op, "-o", text(&whole), "--force"]);
        succeed(&["decode", text(&part), "-o", text(&extracted), "--force"]);
        let contents = |place: &Path| -> Vec<Vec<u8>> {
            files(place).iter().map(|path| fs::read(path).unwrap()).collect()
        };
        assert_eq!(contents(&whole).len(), frames, "{op}");
        assert_eq!(contents(&whole), contents(&extracted), "{op}");
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bytes_and_digests() {
    let directory = directory();
    let frames = write_frames(directory.path());
    let of = |threads: &str| {
        let stream = directory.path().join(format!("{threads}.gss"));
        let encoded = json(&["encode", text(&frames), "-o", text(&stream), "--threads", threads]);
        let decoded = json(&["--threads", threads, "decode", text(&stream), "--dry-run"]);
        assert_eq!(encoded["digests"], decoded["digests"]);
        (fs::read(stream).unwrap(), decoded["digests"].clone(), encoded["verified"].clone())
    };
    assert_eq!(of("1"), of("2"));
}

#[test]
fn a_span_of_frames_is_what_is_written() {
    let directory = directory();
    let stream = write_stream(directory.path());
    let out = directory.path().join("out");
    let all = json(&["decode", text(&stream), "--dry-run"]);
    let part = json(&["decode", text(&stream), "-o", text(&out), "--frames", "1..3"]);
    assert_eq!(part["digests"].as_array().unwrap(), &all["digests"].as_array().unwrap()[1..3]);
    let names: Vec<_> = files(&out).iter().map(|path| path.file_name().unwrap().to_owned()).collect();
    assert_eq!(names, ["frame_0001.ply", "frame_0002.ply"]);
    fail(2, &["decode", text(&stream), "-o", text(&out), "--frames", "7..9"]);
}

#[test]
fn one_frame_can_go_to_a_file_of_any_format() {
    let directory = directory();
    let stream = write_stream(directory.path());
    for name in ["one.ply", "one.spz", "one.splat", "one.glb", "one.sog", "one.compressed.ply"] {
        let file = directory.path().join(name);
        succeed(&["decode", text(&stream), "-o", text(&file), "--frames", "0..1"]);
        let compared = json(&["compare", text(&file), text(&stream)]);
        assert_eq!(compared["gaussians_a"], u64::from(scene().gaussians), "{name}");
    }
    let said = fail(2, &["decode", text(&stream), "-o", text(&directory.path().join("all.ply"))]);
    assert!(said.contains("3 frames do not fit in one file"), "{said}");
}

#[test]
fn what_fails_leaves_nothing_behind() {
    let directory = directory();
    let broken = directory.path().join("broken.ply");
    fs::write(&broken, b"ply\nnot a header").unwrap();
    let stream = directory.path().join("out.gss");
    let said = fail(1, &["encode", text(&broken), "-o", text(&stream)]);
    assert!(said.contains("broken.ply"), "{said}");
    assert_eq!(files(directory.path()), std::slice::from_ref(&broken));
    let said = fail(2, &["encode", text(&broken), "-o", text(&broken)]);
    assert!(said.contains("another name"), "{said}");
    fail(10, &["decode", text(&broken), "-o", text(&directory.path().join("out"))]);
    assert_eq!(files(directory.path()), [broken]);
}

#[cfg(unix)]
#[test]
fn a_result_has_the_permissions_of_any_other_file() {
    use std::os::unix::fs::PermissionsExt;
    let directory = directory();
    let stream = write_stream(directory.path());
    let plain = directory.path().join("plain");
    fs::write(&plain, b"").unwrap();
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
    assert_eq!(mode(&stream), mode(&plain));
}

#[test]
fn every_command_has_help_with_an_example() {
    for command in ["demo", "encode", "decode", "inspect", "validate", "extract", "compare", "conformance"] {
        let help = succeed(&[command, "--help"]);
        let example = help.rsplit_once("Example").map_or("", |(_, example)| example);
        assert!(example.contains(&format!("splatstream {command}")), "{help}");
    }
    assert_eq!(run(&["--version"]).status.code(), Some(0));
}

#[test]
fn what_is_said_about_a_scene_is_in_the_stream_and_viewers_take_it() {
    let directory = directory();
    let frames = write_frames(directory.path());
    let [stream, pictures, cameras] =
        ["up.gss", "pictures", "cameras.json"].map(|name| directory.path().join(name));
    let camera = r#"[{"id": 0, "img_name": "left", "width": 64, "height": 48, "position": [0, 0, -8],
        "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "fx": 50, "fy": 50}]"#;
    fs::write(&cameras, camera).unwrap();
    let said = ["--title", "A talk", "--up", "y", "--metres-per-unit", "0.5", "--background", "1,0.5,0"];
    let encode =
        ["encode", text(&frames), "-o", text(&stream), "--preset", "fast", "--cameras", text(&cameras)];
    succeed(&[&encode[..], &said].concat());
    let tree = succeed(&["inspect", text(&stream), "--tree"]);
    for value in ["3 (+y)", "\"A talk\"", "[1, 0.5, 0]", "bounds_min", "vertical_field_of_view"] {
        assert!(tree.contains(value), "{value}: {tree}");
    }
    let drawn = json(&["render", text(&stream), "-o", text(&pictures), "--height", "9", "--frames", "0..1"]);
    assert_eq!(
        (&drawn["pictures"][0]["view"], &drawn["pictures"][0]["width"]),
        (&"camera_00".into(), &16.into())
    );
    let corner =
        splatstream_render::Image::from_png(&fs::read(files(&pictures)[0].clone()).unwrap()).unwrap();
    let orange =
        corner.pixels()[0].iter().zip([1.0, 0.5, 0.0]).all(|(part, asked)| (part - asked).abs() < 0.05);
    assert!(orange, "{:?}", corner.pixels()[0]);
    let said = succeed(&[
        "render",
        text(&frames),
        "-o",
        text(&pictures),
        "--camera",
        "ring:1",
        "--height",
        "9",
        "--force",
    ]);
    assert!(said.contains("give --up"), "{said}");
    let said = fail(2, &["extract", text(&stream), "--op", "s0,t0,r0", "-o", text(&stream)]);
    assert!(said.contains("another name"), "{said}");
}
