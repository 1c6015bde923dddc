//! What fuzzing found stays found: every regression and every seed through its target, with any toolchain.
//!
//! `BLESS=1 cargo test --test regressions` turns regressions that are edits into the streams they stand for: those
//! keep their meaning when the streams that edits start from change.

use splatstream_fuzz::{ceiling, decode, laws, seal, streams, targets};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The files of a folder beside this crate's manifest, by name; none if there is no such folder.
fn files(folder: &str, target: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder).join(target);
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

/// Runs a target on what it found and what it starts with. An input of `streams` is a stream, or edits of one.
fn replay(target: &str, streams: bool) {
    let run =
        targets::ALL.into_iter().find(|known| known.name == target).expect("a target has this name").run;
    let regressions = files("regressions", target);
    if streams && std::env::var_os("BLESS").is_some() {
        for path in &regressions {
            let stream = decode::stream_of(&std::fs::read(path).unwrap()).into_owned();
            std::fs::write(path, seal::seal(stream)).unwrap();
        }
    }
    let streams = if streams { files("seeds", "units") } else { Vec::new() };
    for path in regressions.into_iter().chain(files("seeds", target)).chain(streams) {
        // Shown only if the test fails, and then the last line is the cause.
        println!("{}", path.display());
        run(&std::fs::read(path).unwrap());
    }
}

#[test]
fn units_are_delimited() {
    replay("units", false);
}

#[test]
fn records_come_back() {
    replay("records", false);
}

#[test]
fn symbols_come_back() {
    replay("entropy", false);
}

#[test]
fn packages_come_back_or_are_refused() {
    replay("packages", false);
}

#[test]
fn scene_files_read_or_are_refused() {
    replay("scene", false);
}

#[test]
fn streams_decode_or_are_refused() {
    replay("decode", true);
}

#[test]
fn streams_cost_what_their_bytes_and_limits_allow() {
    replay("cost", false);
}

#[test]
fn what_is_made_comes_back_and_decodes_or_is_refused() {
    replay("synthetic", false);
}

/// Checksums are compared here, so that damage may be anything.
#[test]
fn valid_streams_keep_their_laws_at_many_choices() {
    for stream in streams::ALL {
        for choice in (0..40_u32).map(|number| number.wrapping_mul(0x9e37_79b9)) {
            laws::hold(stream, choice);
        }
    }
}

#[test]
fn what_is_encoded_decodes() {
    replay("encode", false);
}

#[test]
fn the_independent_decoder_gives_the_same() {
    if Command::new("python3").arg("--version").output().is_err() {
        println!("skipped: python3 is not there");
        return;
    }
    replay("oracle", true);
}

#[test]
fn every_target_is_replayed_and_has_seeds() {
    let this = include_str!("regressions.rs");
    for target in targets::ALL {
        assert!(this.contains(&format!("replay(\"{}\", ", target.name)), "{}", target.name);
        let is_stream = target.name == "oracle";
        assert!(is_stream || !files("seeds", target.name).is_empty(), "{}", target.name);
    }
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("regressions");
    for entry in std::fs::read_dir(folder).unwrap() {
        let name = entry.unwrap().file_name();
        assert!(targets::ALL.iter().any(|target| name == target.name), "{name:?} is no target");
    }
    let listed = targets::ALL.map(|target| target.name).join(" ");
    assert!(
        include_str!("../engine.sh").contains(&format!("targets=({listed})")),
        "engine.sh has other targets"
    );
}

#[test]
fn the_heap_refuses_what_a_count_on_trust_would_ask_for() {
    let mut bytes: Vec<u8> = Vec::new();
    assert!(bytes.try_reserve_exact(ceiling::MAX_REQUEST).is_ok());
    assert!(bytes.try_reserve_exact(ceiling::MAX_REQUEST + 1).is_err());
}

#[test]
fn a_count_on_trust_ends_the_program_that_the_targets_are_in() {
    let input = std::env::temp_dir().join(format!("splatstream-planted-{}", std::process::id()));
    let outcome = |count: u32| {
        std::fs::write(&input, count.to_le_bytes()).unwrap();
        let program = env!("CARGO_BIN_EXE_splatstream-fuzz");
        Command::new(program).arg(&input).env("FUZZ_TARGET", "planted").output().unwrap().status
    };
    let (granted, refused) = (outcome(ceiling::MAX_REQUEST as u32), outcome(ceiling::MAX_REQUEST as u32 + 1));
    std::fs::remove_file(&input).unwrap();
    assert!(granted.success(), "{granted}");
    assert!(!refused.success(), "{refused}");
}
