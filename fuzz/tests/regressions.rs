//! What fuzzing found stays found: every regression and every seed through its target, with any toolchain.
//!
//! `BLESS=1 cargo test --test regressions` turns regressions of `decode` that are edits into the streams they
//! stand for: those keep their meaning when the streams that edits start from change.

use splatstream_fuzz::{ceiling, decode, increments, payload, scene, seal, units};
use std::path::{Path, PathBuf};

/// The files of a folder beside this crate's manifest, by name; none if there is no such folder.
fn files(folder: &str, target: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder).join(target);
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

fn replay(target: &str, run: fn(&[u8])) {
    for path in files("regressions", target).into_iter().chain(files("seeds", target)) {
        // Shown only if the test fails, and then the last line is the cause.
        println!("{}", path.display());
        run(&std::fs::read(path).unwrap());
    }
}

#[test]
fn units_are_delimited() {
    replay("units", units::run);
}

#[test]
fn payloads_come_back() {
    replay("payload", payload::run);
}

#[test]
fn streams_decode_or_are_refused() {
    if std::env::var_os("BLESS").is_some() {
        for path in files("regressions", "decode") {
            let stream = decode::stream_of(&std::fs::read(&path).unwrap()).into_owned();
            std::fs::write(path, seal::seal(stream)).unwrap();
        }
    }
    replay("decode", decode::run);
    // The streams that edits start from.
    for path in files("seeds", "units") {
        decode::run(&std::fs::read(path).unwrap());
    }
}

#[test]
fn increments_come_back_and_decode_or_are_refused() {
    replay("increments", increments::run);
}

#[test]
fn scene_files_read_or_are_refused() {
    replay("scene", scene::run);
}

#[test]
fn the_heap_refuses_what_a_count_on_trust_would_ask_for() {
    let mut bytes: Vec<u8> = Vec::new();
    assert!(bytes.try_reserve_exact(ceiling::MOST).is_ok());
    assert!(bytes.try_reserve_exact(ceiling::MOST + 1).is_err());
}
