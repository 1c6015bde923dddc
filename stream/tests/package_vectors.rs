//! Packages with one fault each, and what an unpackager says of them: the vectors of `conformance/packages`. `BLESS=1` writes
//! them again.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

mod common;

use common::{files, package, worked_example};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use splatstream_format::Limits;
use splatstream_stream::manifest::Manifest;
use splatstream_stream::package::{Layout, Options, Package};
use splatstream_stream::unpackage::unpackage;
use std::path::{Path, PathBuf};

type Files = Vec<(String, Vec<u8>)>;

/// A fault: its name, what it is, what it breaks, how it is made, and the file, clause and code of the error.
struct Fault {
    name: &'static str,
    purpose: &'static str,
    requirements: &'static [&'static str],
    make: fn(&mut Files),
    expected: (&'static str, &'static str, &'static str),
}

/// The bytes of a file.
fn file<'a>(files: &'a mut Files, name: &str) -> &'a mut Vec<u8> {
    &mut files.iter_mut().find(|(known, _)| known == name).unwrap().1
}

/// Writes over bytes at an offset from number `number` of a box of a type; the offset counts from the type.
fn patch(files: &mut Files, name: &str, kind: &[u8; 4], number: usize, offset: usize, bytes: &[u8]) {
    let file = file(files, name);
    let at = find(file, kind, number) + offset;
    file[at..at + bytes.len()].copy_from_slice(bytes);
}

fn find(bytes: &[u8], kind: &[u8; 4], number: usize) -> usize {
    bytes.windows(4).enumerate().filter(|(_, four)| four == kind).nth(number).unwrap().0
}

const FAULTS: &[Fault] = &[
    Fault {
        name: "file-cut",
        purpose: "the file of s0 ends inside a box",
        requirements: &["SS-CR-003"],
        make: |files| {
            let length = file(files, "s0.mp4").len();
            file(files, "s0.mp4").truncate(length - 10);
        },
        expected: ("s0.mp4", "C.2", "SHORT_SECTION"),
    },
    Fault {
        name: "movie-missing",
        purpose: "a moof comes without a moov",
        requirements: &["SS-CR-003"],
        make: |files| patch(files, "s0.mp4", b"moov", 0, 0, b"free"),
        expected: ("s0.mp4", "C.2", "CONSTRAINT"),
    },
    Fault {
        name: "configuration-kind",
        purpose: "representation_kind is 2",
        requirements: &["SS-CR-009"],
        make: |files| patch(files, "s0.mp4", b"gssC", 0, 8, &[2]),
        expected: ("s0.mp4", "C.4.2", "RESERVED"),
    },
    Fault {
        name: "configuration-layer",
        purpose: "layer is 4",
        requirements: &["SS-CR-009"],
        make: |files| patch(files, "s0.mp4", b"gssC", 0, 9, &[4]),
        expected: ("s0.mp4", "C.4.2", "RESERVED"),
    },
    Fault {
        name: "configuration-version",
        purpose: "the version of gssC is 1",
        requirements: &["SS-CR-009"],
        make: |files| patch(files, "s0.mp4", b"gssC", 0, 4, &[1]),
        expected: ("s0.mp4", "C.4.2", "RESERVED"),
    },
    Fault {
        name: "configuration-refinements",
        purpose: "refinement_count is 11",
        requirements: &["SS-CR-009"],
        make: |files| patch(files, "s0.mp4", b"gssC", 0, 11, &[11]),
        expected: ("s0.mp4", "C.4.2", "OUT_OF_RANGE"),
    },
    Fault {
        name: "head-differs",
        purpose: "a byte of the head of s1 is not that of s0",
        requirements: &["SS-CR-010"],
        make: |files| patch(files, "s1.mp4", b"gssC", 0, 13, &[0xFF]),
        expected: ("s1.mp4", "C.4.2", "CONSTRAINT"),
    },
    Fault {
        name: "track-number",
        purpose: "the first track_ID is 7",
        requirements: &["SS-CR-008"],
        make: |files| patch(files, "s0.mp4", b"tkhd", 0, 16, &[0, 0, 0, 7]),
        expected: ("s0.mp4", "C.4.1", "MISMATCH"),
    },
    Fault {
        name: "fragment-of-no-track",
        purpose: "a fragment is of a track that is not in the movie",
        requirements: &["SS-CR-012"],
        make: |files| patch(files, "s0.mp4", b"tfhd", 0, 8, &[0, 0, 0, 11]),
        expected: ("s0.mp4", "C.5.1", "UNDEFINED"),
    },
    Fault {
        name: "run-without-sizes",
        purpose: "trun has no sample_size",
        requirements: &["SS-CR-014"],
        make: |files| patch(files, "s0.mp4", b"trun", 0, 6, &[1]),
        expected: ("s0.mp4", "C.5.1", "CONSTRAINT"),
    },
    Fault {
        name: "run-of-more-samples",
        purpose: "sample_count is larger than the entries that there are",
        requirements: &["SS-CR-014"],
        make: |files| patch(files, "s0.mp4", b"trun", 0, 8, &[0xFF; 4]),
        expected: ("s0.mp4", "C.5.1", "SHORT_SECTION"),
    },
    Fault {
        name: "samples-inside-moof",
        purpose: "data_offset leads into the moof",
        requirements: &["SS-CR-014"],
        make: |files| patch(files, "s0.mp4", b"trun", 0, 12, &[0, 0, 0, 8]),
        expected: ("s0.mp4", "C.5.1", "CONSTRAINT"),
    },
    Fault {
        name: "samples-beyond-file",
        purpose: "data_offset leads out of the file",
        requirements: &["SS-CR-014"],
        make: |files| patch(files, "s0.mp4", b"trun", 0, 12, &[0x10, 0, 0, 0]),
        expected: ("s0.mp4", "C.5.1", "TRUNCATED"),
    },
    Fault {
        name: "sample-at-another-frame",
        purpose: "the samples of t0 have the time of the frame after theirs",
        requirements: &["SS-CR-007", "SS-CR-030"],
        make: |files| {
            let count = file(files, "t0.mp4").windows(4).filter(|four| four == b"tfdt").count();
            for number in 0..count {
                let at = find(file(files, "t0.mp4"), b"tfdt", number) + 15;
                file(files, "t0.mp4")[at] += 1;
            }
        },
        expected: ("t0.mp4", "C.3", "CONSTRAINT"),
    },
    Fault {
        name: "tracks-apart",
        purpose: "the samples of the second track have another time than those of the first",
        requirements: &["SS-CR-006"],
        make: |files| patch(files, "s0.mp4", b"tfdt", 1, 14, &[0x77]),
        expected: ("s0.mp4", "C.3", "CONSTRAINT"),
    },
    Fault {
        name: "base-missing",
        purpose: "there is no file of s0",
        requirements: &["SS-CR-030"],
        make: |files| files.retain(|(name, _)| name != "s0.mp4"),
        expected: ("the package", "C.3", "CONSTRAINT"),
    },
    Fault {
        name: "representation-twice",
        purpose: "two files are of s1",
        requirements: &["SS-CR-030"],
        make: |files| {
            let copy = file(files, "s1.mp4").clone();
            files.push(("s1-again.mp4".to_owned(), copy));
        },
        expected: ("s1.mp4", "C.3", "CONSTRAINT"),
    },
    Fault {
        name: "representation-missing",
        purpose: "the file of t0 is missing, so that the counts of the end unit are wrong",
        requirements: &["SS-CR-002"],
        make: |files| files.retain(|(name, _)| name != "t0.mp4"),
        expected: ("the stream in the package", "6.11", "MISMATCH"),
    },
    Fault {
        name: "tail-missing",
        purpose: "s0 has no gssT",
        requirements: &["SS-CR-019"],
        make: |files| patch(files, "s0.mp4", b"gssT", 0, 0, b"free"),
        expected: ("s0.mp4", "C.6", "CONSTRAINT"),
    },
    Fault {
        name: "sample-of-other-refinement",
        purpose: "the first two fragments of t0 have each the track of the other",
        requirements: &["SS-CR-004", "SS-CR-030"],
        make: |files| {
            patch(files, "t0.mp4", b"tfhd", 0, 8, &[0, 0, 0, 2]);
            patch(files, "t0.mp4", b"tfhd", 1, 8, &[0, 0, 0, 1]);
        },
        expected: ("the stream in the package", "B.1", "UNEXPECTED_UNIT"),
    },
    Fault {
        name: "sample-damaged",
        purpose: "a byte of a payload of s0 is changed",
        requirements: &["SS-CR-002"],
        make: |files| {
            let last = file(files, "s0.mp4").len() - 120;
            file(files, "s0.mp4")[last] ^= 1;
        },
        expected: ("the stream in the package", "5.3", "CHECKSUM"),
    },
];

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../conformance/packages")
}

fn whole(stream: &[u8], layout: Layout) -> Files {
    let package = package(stream, &Options { layout, ..Options::default() });
    let mut files = files(&package);
    files.push((Package::MANIFEST.to_owned(), package.manifest.to_json().into_bytes()));
    files.push((Package::MPD.to_owned(), package.mpd.into_bytes()));
    files
}

fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

fn media(files: &Files) -> Vec<(String, &[u8])> {
    let media = files.iter().filter(|(name, _)| name.ends_with(".mp4"));
    media.map(|(name, bytes)| (name.clone(), bytes.as_slice())).collect()
}

fn bless(kind: &str, name: &str, record: &Value, files: &Files) {
    let folder = folder().join(kind).join(name);
    std::fs::create_dir_all(&folder).unwrap();
    for (name, bytes) in files {
        std::fs::write(folder.join(name), bytes).unwrap();
    }
    std::fs::write(folder.join("package.json"), format!("{record:#}\n")).unwrap();
}

/// The record of a vector, and its other files.
fn saved(kind: &str, name: &str) -> (Value, Files) {
    let folder = folder().join(kind).join(name);
    let mut files: Files = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap())
        .map(|entry| (entry.file_name().into_string().unwrap(), std::fs::read(entry.path()).unwrap()))
        .collect();
    files.sort();
    let record = files.iter().position(|(name, _)| name == "package.json").unwrap();
    (serde_json::from_slice(&files.remove(record).1).unwrap(), files)
}

/// Streams that use more than the worked example does: vectors by area and name, and what is in them.
const STREAMS: [(&str, &str); 5] = [
    ("extraction/extraction-skipped-units", "several GOPs, spatial layers, and units that decoders discard"),
    ("codebook/codebook-defined-again", "codebooks between frames"),
    ("temporal/temporal-gops-mixed", "GOPs of different structures"),
    ("temporal/temporal-gop-of-1024", "a long GOP of which most frames are absent"),
    ("learned/learned-registered-layers", "a learned predictor, with spatial layers"),
];

/// The valid packages: name, purpose, stream, layout.
fn valid() -> Vec<(String, String, Vec<u8>, Layout)> {
    let mut all = Vec::new();
    for layout in [Layout::Gop, Layout::Frame] {
        let name = format!("worked-temporal-example-{}", layout.name());
        let purpose = format!("the stream of annex E with the layout {}", layout.name());
        all.push((name, purpose, worked_example(), layout));
    }
    for (path, purpose) in STREAMS {
        let stream = folder().join("../vectors/valid").join(path).join("in.gss");
        let name = path.split_once('/').unwrap().1.to_owned();
        all.push((name, purpose.to_owned(), std::fs::read(stream).unwrap(), Layout::Gop));
    }
    all
}

// covers: SS-CR-002, SS-CR-003
#[test]
fn valid_packages_are_made_and_unpackaged_as_recorded() {
    for (name, purpose, stream, layout) in valid() {
        let mut made = whole(&stream, layout);
        made.sort();
        let manifest = Manifest::parse(&made.iter().find(|(name, _)| name == Package::MANIFEST).unwrap().1);
        assert!(manifest.unwrap().describes(&stream));
        let record = json!({
            "purpose": purpose,
            "requirements": ["SS-CR-001", "SS-CR-002"],
            "expect": {"outcome": "accept", "bytes": stream.len(), "sha256": sha256(&stream)},
        });
        if std::env::var_os("BLESS").is_some() {
            bless("valid", &name, &record, &made);
        }
        let (saved_record, files) = saved("valid", &name);
        assert_eq!(saved_record, record);
        assert!(files == made, "{name}: BLESS=1 writes the packages again");
        assert!(unpackage(&media(&files), &Limits::default()).unwrap() == stream);
    }
}

// covers: SS-CR-003, SS-CR-004, SS-CR-006, SS-CR-007, SS-CR-008, SS-CR-009, SS-CR-010, SS-CR-012, SS-CR-014, SS-CR-019, SS-CR-030
#[test]
fn packages_with_a_fault_are_refused_as_recorded() {
    let stream = worked_example();
    for fault in FAULTS {
        let mut made = whole(&stream, Layout::Gop);
        made.retain(|(name, _)| name.ends_with(".mp4"));
        (fault.make)(&mut made);
        made.sort();
        let result = unpackage(&media(&made), &Limits::default());
        let error = result.err().unwrap_or_else(|| panic!("{} was unpackaged", fault.name));
        let found = (error.file.as_str(), error.error.clause, error.error.kind.code());
        assert_eq!(found, fault.expected, "{}: {error}", fault.name);
        let class = error.error.class().name();
        let record = json!({
            "purpose": fault.purpose,
            "requirements": fault.requirements,
            "expect": {"outcome": "reject", "class": class, "code": found.2, "clause": found.1, "file": found.0},
        });
        if std::env::var_os("BLESS").is_some() {
            bless("invalid", fault.name, &record, &made);
        }
        let (saved_record, files) = saved("invalid", fault.name);
        assert_eq!(saved_record, record);
        assert!(files == made, "{}: BLESS=1 writes the packages again", fault.name);
    }
    let count = std::fs::read_dir(folder().join("invalid")).unwrap().count();
    assert_eq!(count, FAULTS.len(), "every package has its fault in the table");
}
