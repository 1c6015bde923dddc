//! What is done with a part of a stream: of one that was cut, and of frames that are some of a sequence.

use crate::common::{directory, fail, json, run, succeed, text};
use std::fs;
use std::path::{Path, PathBuf};

/// Ten frames in two GOPs of five.
fn dynamic() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/dynamic.gss")
}

#[test]
fn the_complete_gops_of_a_stream_that_was_cut_are_a_stream() {
    let directory = directory();
    let [cut, part] = ["cut.gss", "part.gss"].map(|name| directory.path().join(name));
    let whole = fs::read(dynamic()).unwrap();
    let units = json(&["inspect", text(&dynamic()), "--units"]);
    let second = units["units"].as_array().unwrap().iter().filter(|unit| unit["type"] == "gop_header").nth(1);
    let second = second.unwrap()["at"].as_u64().unwrap() as usize;
    // In the second GOP, before its end, and in the units after it.
    for (end, frames) in [(second + 200, 5), (whole.len() - 1, 10)] {
        fs::write(&cut, &whole[..end]).unwrap();
        let said = fail(14, &["extract", text(&cut), "--op", "s1,t2,r2", "-o", text(&part)]);
        assert!(said.contains("extract") && said.contains("--incomplete"), "{said}");
        let report = json(&["extract", text(&cut), "--incomplete", "-o", text(&part)]);
        assert_eq!((&report["frames"], &report["complete"]), (&frames.into(), &(frames == 10).into()));
        let verdict = json(&["validate", text(&part)]);
        assert_eq!((&verdict["outcome"], &verdict["frames"]), (&"accept".into(), &frames.into()));
        let compared = json(&["compare", text(&dynamic()), text(&part)]);
        assert_eq!(compared["attributes"]["dc"]["max"], 0.0);
    }
    // Nothing is complete.
    fs::write(&cut, &whole[..second - 10]).unwrap();
    fail(14, &["extract", text(&cut), "--incomplete", "-o", text(&part)]);
    let said = fail(2, &["extract", text(&cut), "-o", text(&part)]);
    assert!(said.contains("--op"), "{said}");
}

#[test]
fn some_frames_of_a_sequence_are_compared_with_those_of_their_numbers() {
    let directory = directory();
    let [part, first] = ["part", "first"].map(|name| directory.path().join(name));
    succeed(&["decode", text(&dynamic()), "-o", text(&part), "--frames", "7..9"]);
    let said = String::from_utf8(run(&["compare", text(&part), text(&dynamic())]).stderr).unwrap();
    assert!(said.contains("not compared: 8 frames that only B has"), "{said}");
    assert!(said.contains("frames of A are those that their names number"), "{said}");
    let compared = json(&["compare", text(&dynamic()), text(&part)]);
    assert_eq!((&compared["frames"], &compared["attributes"]["dc"]["max"]), (&2.into(), &0.0.into()));
    // As many frames are compared in their order, whatever their numbers.
    succeed(&["decode", text(&dynamic()), "-o", text(&first), "--frames", "0..2"]);
    let compared = json(&["compare", text(&first), text(&part)]);
    assert_eq!(compared["frames"], 2);
}

#[test]
fn files_of_packages_and_pages_are_no_streams() {
    let directory = directory();
    let [package, page] = ["package", "page.html"].map(|name| directory.path().join(name));
    succeed(&["package", text(&dynamic()), "-o", text(&package)]);
    let said = fail(10, &["validate", text(&package.join("s0.mp4"))]);
    assert!(said.contains("a file of a package"), "{said}");
    fs::write(&page, "<!DOCTYPE html>\n<title>talk</title>").unwrap();
    let said = fail(10, &["decode", text(&page), "--dry-run"]);
    assert!(said.contains("a web page, not a stream"), "{said}");
}
