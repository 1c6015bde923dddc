//! Streams of frames that were pushed, which do not announce how many frames they have.

use crate::common::{directory, fail, json, scene, succeed, text};
use serde_json::json as value;
use splatstream_encoder::{Encoder, Preset, Settings};
use std::fs;
use std::path::{Path, PathBuf};

/// The small scene, pushed: two GOPs and an end unit.
fn pushed(directory: &Path) -> PathBuf {
    let mut bytes = Vec::new();
    let settings = Settings { preset: Preset::Fast, gop: 2, ..Settings::default() };
    let mut encoder = Encoder::new(&mut bytes, settings);
    (0..scene().frames).for_each(|number| encoder.push(scene().frame(number)).unwrap());
    encoder.finish().unwrap();
    let path = directory.join("pushed.gss");
    fs::write(&path, bytes).unwrap();
    path
}

/// The same without its end unit: nothing tells how many frames there were.
fn cut_off(directory: &Path) -> PathBuf {
    let whole = pushed(directory);
    let listing = json(&["inspect", text(&whole), "--units"]);
    let end = listing["units"].as_array().unwrap().last().unwrap()["at"].as_u64().unwrap();
    let path = directory.join("cut.gss");
    fs::write(&path, &fs::read(&whole).unwrap()[..end as usize]).unwrap();
    path
}

#[test]
fn the_end_unit_says_how_many_frames_there_are() {
    let directory = directory();
    let (stream, out) = (pushed(directory.path()), directory.path().join("part.gss"));
    let decoded = json(&["decode", text(&stream), "--dry-run"]);
    assert_eq!((&decoded["frames_in_stream"], &decoded["complete"]), (&value!(3), &value!(true)));
    let extracted = json(&["extract", text(&stream), "--op", "s0,t0,r1", "-o", text(&out)]);
    assert_eq!((&extracted["frames_in_stream"], &extracted["complete"]), (&value!(3), &value!(true)));
    let unknown = json(&["decode", text(&out), "--dry-run"]);
    assert_eq!(unknown["frames_in_stream"], value!(3));
}

#[test]
fn frames_of_unknown_number_do_not_go_into_one_file() {
    let directory = directory();
    let out = directory.path().join("scene.ply");
    fs::write(&out, "as it was").unwrap();
    for stream in [pushed(directory.path()), cut_off(directory.path())] {
        let refused = fail(2, &["decode", text(&stream), "-o", text(&out)]);
        assert!(refused.contains("do not fit in one file"), "{refused}");
        assert_eq!(fs::read_to_string(&out).unwrap(), "as it was");
    }
    succeed(&["decode", text(&pushed(directory.path())), "--frames", "2..3", "-o", text(&out)]);
    assert!(fs::read(&out).unwrap().starts_with(b"ply"));
}

#[test]
fn pictures_of_frames_of_unknown_number_have_names_of_their_own() {
    let directory = directory();
    for (name, stream) in [("whole", pushed(directory.path())), ("cut", cut_off(directory.path()))] {
        let out = directory.path().join(name);
        let drawing = ["render", text(&stream), "--camera", "ring:1", "--height", "32", "-o", text(&out)];
        // What is cut off has an error, of which the exit code tells.
        let _code = crate::common::run(&drawing);
        let names: Vec<_> = (0..3).map(|frame| format!("frame_000{frame}_ring_00.png")).collect();
        assert!(
            names.iter().all(|file| out.join(file).is_file()),
            "{:?}",
            fs::read_dir(&out).unwrap().count()
        );
    }
}
