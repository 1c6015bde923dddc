//! Live packages as they grow and when they have ended, and manifests of them with one fault each: the vectors of
//! `conformance/packages`. `BLESS=1` writes them again.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

mod common;

use common::{Files, apply};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use splatstream_format::Limits;
use splatstream_stream::control::Layered;
use splatstream_stream::live::{Live, Settings};
use splatstream_stream::manifest::Manifest;
use splatstream_stream::package::{Layout, Options, Package};
use splatstream_stream::playback::{Options as Playing, PlaybackError, Player};
use splatstream_stream::unpackage::unpackage;
use std::path::{Path, PathBuf};

/// The time when the first bytes come.
const START: u64 = 1_767_225_600_000;

fn packages() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../conformance/packages")
}

/// A stream of four GOPs.
fn mixed() -> Vec<u8> {
    let path = packages().join("../vectors/valid/temporal/temporal-gops-mixed/in.gss");
    std::fs::read(path).unwrap()
}

/// A live package after each piece of a stream, and when it has ended. Bytes come at 1,000 a second.
fn history(stream: &[u8], layout: Layout) -> Vec<Files> {
    let settings = Settings { window_ms: 0, ..Settings::new(Options { layout, ..Options::default() }) };
    let (mut live, mut files) = (Live::new(&settings, &Limits::default()), Files::new());
    let mut all = Vec::new();
    for (piece, now_ms) in stream.chunks(50).zip((START..).step_by(50)) {
        apply(&mut files, live.push(piece, now_ms).unwrap());
        all.push(files.clone());
    }
    apply(&mut files, live.finish(START + 100_000).unwrap());
    all.push(files);
    all
}

fn manifest(files: &Files) -> Option<Manifest> {
    files.get(Package::MANIFEST).map(|bytes| Manifest::parse(bytes).unwrap())
}

/// The last moment at which a package grows and has so many GOPs, of which the last is in progress with the layout frame.
fn growing(stream: &[u8], layout: Layout, gops: usize) -> Files {
    let is_then = |files: &Files| {
        let manifest = manifest(files).filter(Manifest::is_growing);
        let is_begun = |manifest: &Manifest| manifest.gops.last().is_some_and(|gop| gop.growing);
        manifest.is_some_and(|manifest| {
            manifest.first_gop() as usize + manifest.gops.len() == gops
                && is_begun(&manifest) == (layout == Layout::Frame)
        })
    };
    history(stream, layout).into_iter().rfind(is_then).unwrap()
}

/// The files of Representations as C.9 puts them together.
fn media(files: &Files) -> Vec<(String, Vec<u8>)> {
    let inits = files.keys().filter_map(|name| name.strip_suffix("-init.mp4"));
    let whole = |id: &str| {
        let numbered = (1..).map_while(|number| files.get(&format!("{id}-{number}.m4s")));
        let parts = files.get(&format!("{id}-init.mp4")).into_iter().chain(numbered);
        parts.chain(files.get(&format!("{id}-end.m4s"))).flatten().copied().collect()
    };
    inits.map(|id| (format!("{id}.mp4"), whole(id))).collect()
}

/// Compares a package with the one that is saved, or saves it.
fn is_saved(place: &str, record: &Value, files: &Files) {
    let folder = packages().join(place);
    if std::env::var_os("BLESS").is_some() {
        std::fs::create_dir_all(&folder).unwrap();
        for (name, bytes) in files {
            std::fs::write(folder.join(name), bytes).unwrap();
        }
        std::fs::write(folder.join("package.json"), format!("{record:#}\n")).unwrap();
    }
    let entries = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap());
    let mut saved: Files = entries
        .map(|entry| (entry.file_name().into_string().unwrap(), std::fs::read(entry.path()).unwrap()))
        .collect();
    let saved_record: Value = serde_json::from_slice(&saved.remove("package.json").unwrap()).unwrap();
    assert_eq!(saved_record, *record, "{place}");
    assert!(saved == *files, "{place}: BLESS=1 writes the packages again");
}

// covers: SS-CR-027, SS-CR-031, SS-CR-032
#[test]
fn live_packages_that_have_ended_are_as_recorded() {
    let stream = mixed();
    for layout in [Layout::Gop, Layout::Frame] {
        let files = history(&stream, layout).pop().unwrap();
        assert!(manifest(&files).unwrap().describes(&stream));
        let media = media(&files);
        let given: Vec<_> = media.iter().map(|(name, bytes)| (name.clone(), bytes.as_slice())).collect();
        assert!(unpackage(&given, &Limits::default()).unwrap() == stream);
        let sha256: String = Sha256::digest(&stream).iter().map(|byte| format!("{byte:02x}")).collect();
        let record = json!({
            "purpose": format!("a live package with the layout {} that has ended", layout.name()),
            "requirements": ["SS-CR-002", "SS-CR-027", "SS-CR-028", "SS-CR-031", "SS-CR-032"],
            "expect": {"outcome": "accept", "bytes": stream.len(), "sha256": sha256},
        });
        is_saved(&format!("valid/live-{}", layout.name()), &record, &files);
    }
}

// covers: SS-CR-031, SS-CR-032
#[test]
fn live_packages_that_grow_are_as_recorded() {
    let stream = mixed();
    for (layout, gops) in [(Layout::Gop, 3), (Layout::Frame, 3)] {
        let files = growing(&stream, layout, gops);
        let manifest = manifest(&files).unwrap();
        let is_begun = manifest.gops.last().is_some_and(|gop| gop.growing && !gop.subsegments.is_empty());
        assert_eq!(is_begun, layout == Layout::Frame);
        let media = media(&files);
        let given: Vec<_> = media.iter().map(|(name, bytes)| (name.clone(), bytes.as_slice())).collect();
        let error = unpackage(&given, &Limits::default()).unwrap_err();
        let (clause, code) = (error.error.clause, error.error.kind.code());
        assert_eq!((clause, code), ("C.6", "CONSTRAINT"), "{error}");
        let record = json!({
            "purpose": format!("a live package with the layout {} that grows: its tail has not come yet", layout.name()),
            "requirements": ["SS-CR-019", "SS-CR-027", "SS-CR-028", "SS-CR-031", "SS-CR-032"],
            "expect": {"outcome": "reject", "class": error.error.class().name(), "code": code, "clause": clause,
                "file": error.file},
            "manifest": {"outcome": "accept"},
        });
        is_saved(&format!("growing/live-{}", layout.name()), &record, &files);
    }
}

/// Which manifest is changed.
#[derive(Clone, Copy, PartialEq)]
enum Of {
    /// Of the worked example, whole.
    Whole,
    /// Of a live package of it that has ended.
    Ended,
    /// Of one with the layout gop that grows.
    Growing,
    /// Of one with the layout frame that grows, whose second GOP is in progress.
    Frames,
}

/// A manifest with a fault: its name, what it is, what is changed, to what or, with no text, removed, and where the error is.
struct Fault {
    name: &'static str,
    purpose: &'static str,
    of: Of,
    path: &'static str,
    value: &'static str,
    at: &'static str,
}

const fn fault(
    name: &'static str,
    purpose: &'static str,
    of: Of,
    [path, value, at]: [&'static str; 3],
) -> Fault {
    Fault { name, purpose, of, path, value, at }
}

const FIRST: &str = "/gops/0/subsegments/0";
const FAULTS: &[Fault] = &[
    fault("state-unknown", "state is paused", Of::Growing, ["/live/state", "\"paused\"", "live.state"]),
    fault("update-zero", "update_ms is 0", Of::Growing, ["/live/update_ms", "0", "live.update_ms"]),
    fault(
        "start-beyond-numbers",
        "started_ms is 2^53 + 1",
        Of::Growing,
        ["/live/started_ms", "9007199254740993", "live.started_ms"],
    ),
    fault(
        "time-beyond-numbers",
        "published_ms is 2^53 + 1",
        Of::Growing,
        ["/live/published_ms", "9007199254740993", "live.published_ms"],
    ),
    fault(
        "too-many-gops",
        "first_gop is 2^32, and a GOP is listed",
        Of::Growing,
        ["/live/first_gop", "4294967296", "live.first_gop"],
    ),
    fault(
        "bytes-of-a-growing-stream",
        "bytes is known while the stream grows",
        Of::Growing,
        ["/stream/bytes", "1000", "stream.bytes"],
    ),
    fault(
        "digest-of-a-growing-stream",
        "digest is known while the stream grows",
        Of::Growing,
        ["/stream/digest", "\"0123456789abcdef\"", "stream.digest"],
    ),
    fault(
        "digest-missing",
        "digest is null though the stream has ended",
        Of::Ended,
        ["/stream/digest", "null", "stream.digest"],
    ),
    fault(
        "bytes-missing",
        "bytes is null in a package that is not live",
        Of::Whole,
        ["/stream/bytes", "null", "stream.bytes"],
    ),
    fault(
        "index-in-live",
        "a Representation of a live package has an index",
        Of::Ended,
        [
            "/representations/0/index",
            "{\"offset\": 0, \"size\": 1, \"digest\": \"0123456789abcdef\"}",
            "representations[0].index",
        ],
    ),
    fault(
        "tail-of-a-growing-stream",
        "s0 has a tail while the stream grows",
        Of::Growing,
        [
            "/representations/0/tail",
            "{\"offset\": 0, \"size\": 1, \"digest\": \"0123456789abcdef\"}",
            "representations[0].tail",
        ],
    ),
    fault(
        "tail-without-file",
        "no file is named for the tail of a live package",
        Of::Ended,
        ["/representations/0/tail_file", "", "representations[0].tail_file"],
    ),
    fault(
        "tail-file-elsewhere",
        "the file of the tail is in another directory",
        Of::Ended,
        ["/representations/0/tail_file", "\"../s0-end.m4s\"", "representations[0].tail_file"],
    ),
    fault(
        "tail-file-of-a-whole-package",
        "a package that is not live has tail_file",
        Of::Whole,
        ["/representations/0/tail_file", "\"s0-end.m4s\"", "representations[0].tail_file"],
    ),
    fault(
        "segment-without-file",
        "no file is named for a subsegment of a live package",
        Of::Growing,
        ["/gops/0/subsegments/0/file", "", "gops[0].subsegments[0].file"],
    ),
    fault(
        "segment-elsewhere",
        "the file of a subsegment is in another directory",
        Of::Growing,
        ["/gops/0/subsegments/0/file", "\"a/s0-1.m4s\"", "gops[0].subsegments[0].file"],
    ),
    fault(
        "segment-of-a-whole-package",
        "a subsegment of a package that is not live has a file",
        Of::Whole,
        ["/gops/0/subsegments/0/file", "\"s0-1.m4s\"", "gops[0].subsegments[0].file"],
    ),
    fault(
        "ranges-overlap",
        "the first level of a subsegment begins before the end of another one in its file",
        Of::Growing,
        ["/gops/0/subsegments/1/file", "\"s0-1.m4s\"", "gops[0].subsegments[1].levels[0]"],
    ),
    fault(
        "levels-apart",
        "there are bytes between two levels of a subsegment",
        Of::Growing,
        ["/gops/0/subsegments/0/levels/1/offset", "100000", "gops[0].subsegments[0].levels[1]"],
    ),
    fault(
        "growing-before-another",
        "a GOP grows that is not the last one",
        Of::Frames,
        ["/gops/0/growing", "true", "gops[0].growing"],
    ),
    fault(
        "growing-though-ended",
        "a GOP grows though the stream has ended",
        Of::Ended,
        ["/gops/0/growing", "true", "gops[0].growing"],
    ),
    fault(
        "growing-by-gop",
        "a GOP grows with the layout gop",
        Of::Growing,
        ["/gops/0/growing", "true", "gops[0].growing"],
    ),
];

/// The manifests to change.
fn bases() -> impl Fn(Of) -> Value {
    let (example, mixed) = (common::worked_example(), mixed());
    let whole = common::package(&example, &Options::default()).manifest.to_json();
    let of = |files: &Files| serde_json::from_slice::<Value>(&files[Package::MANIFEST]).unwrap();
    let ended = of(history(&example, Layout::Gop).last().unwrap());
    let growing = of(&growing(&mixed, Layout::Gop, 1));
    let frames = of(&self::growing(&mixed, Layout::Frame, 2));
    move |base| match base {
        Of::Whole => serde_json::from_str(&whole).unwrap(),
        Of::Ended => ended.clone(),
        Of::Growing => growing.clone(),
        Of::Frames => frames.clone(),
    }
}

/// Sets the value at a path, or removes it.
fn change(manifest: &mut Value, path: &str, value: &str) {
    let (above, key) = path.rsplit_once('/').unwrap();
    let above = manifest.pointer_mut(above).unwrap();
    if value.is_empty() {
        assert!(above.as_object_mut().unwrap().remove(key).is_some(), "{path}");
        return;
    }
    let value = serde_json::from_str(value).unwrap();
    match above.as_array_mut() {
        Some(array) => array[key.parse::<usize>().unwrap()] = value,
        None => above[key] = value,
    }
}

fn with_line(manifest: &Value) -> Vec<u8> {
    format!("{manifest}\n").into_bytes()
}

// covers: SS-CR-025, SS-CR-026, SS-CR-033
#[test]
fn manifests_with_a_fault_are_refused_as_recorded() {
    assert!(FAULTS.iter().any(|fault| fault.path.starts_with(FIRST)));
    let base = bases();
    for fault in FAULTS {
        let mut changed = base(fault.of);
        assert!(Manifest::parse(&with_line(&changed)).is_ok());
        change(&mut changed, fault.path, fault.value);
        let bytes = with_line(&changed);
        let error = Manifest::parse(&bytes).err().unwrap_or_else(|| panic!("{} was read", fault.name));
        assert_eq!((error.at.as_str(), error.clause), (fault.at, "C.8"), "{}: {error}", fault.name);
        let record = json!({
            "purpose": fault.purpose,
            "requirements": ["SS-CR-033"],
            "manifest": {"outcome": "reject", "clause": "C.8", "at": fault.at},
        });
        let files = Files::from([(Package::MANIFEST.to_owned(), bytes)]);
        is_saved(&format!("manifests/{}", fault.name), &record, &files);
    }
}

/// A manifest that is read after another one: its name, what it is, what is changed in it, and the GOP of the error.
type Later = (&'static str, &'static str, &'static [(&'static str, &'static str)], Option<usize>);

const LATER: &[Later] = &[
    ("later-other-stream", "another stream begins", &[("/stream/sh_degree", "3")], None),
    ("later-other-start", "the stream began at another time", &[("/live/started_ms", "1767225600001")], None),
    (
        "later-other-initialisation",
        "an initialisation segment has other bytes",
        &[("/representations/0/init/digest", "\"0123456789abcdef\"")],
        None,
    ),
    (
        "later-other-bytes",
        "a level of a GOP that was listed has other bytes",
        &[("/gops/0/subsegments/0/levels/0/digest", "\"0123456789abcdef\"")],
        Some(0),
    ),
    ("later-fewer-gops", "the last GOPs that were listed are gone", &[("/gops", "[]")], Some(0)),
];

// covers: SS-CR-032, SS-CR-034
#[test]
fn later_manifests_of_something_else_are_refused_as_recorded() {
    let stream = mixed();
    let before = growing(&stream, Layout::Gop, 1).remove(Package::MANIFEST).unwrap();
    let after: Value = serde_json::from_slice(&growing(&stream, Layout::Gop, 2)[Package::MANIFEST]).unwrap();
    let begin = || {
        let manifest = Manifest::parse(&before).unwrap();
        Player::new(manifest, Playing::default(), Layered::default(), 0).unwrap()
    };
    assert_eq!(begin().renew(0, Manifest::parse(&with_line(&after)).unwrap()), Ok(()));
    for (name, purpose, changes, gop) in LATER {
        let mut changed = after.clone();
        changes.iter().for_each(|(path, value)| change(&mut changed, path, value));
        let bytes = with_line(&changed);
        let error = begin().renew(0, Manifest::parse(&bytes).unwrap()).unwrap_err();
        let at = match error {
            PlaybackError::Changed(gop) => gop,
            PlaybackError::Backwards { listed, .. } => Some(listed),
            other => panic!("{name}: {other}"),
        };
        assert_eq!(at, *gop, "{name}: {error}");
        // An older copy of it is discarded.
        let mut older = changed.clone();
        change(&mut older, "/live/published_ms", "1767225600000");
        assert_eq!(begin().renew(0, Manifest::parse(&with_line(&older)).unwrap()), Ok(()), "{name}");
        let record = json!({
            "purpose": format!("{purpose}: later.json is read after manifest.json"),
            "requirements": ["SS-CR-032", "SS-CR-034"],
            "manifest": {"outcome": "accept"},
            "later": {"outcome": "reject", "gop": gop},
        });
        let files =
            Files::from([(Package::MANIFEST.to_owned(), before.clone()), ("later.json".to_owned(), bytes)]);
        is_saved(&format!("manifests/{name}"), &record, &files);
    }
    let count = std::fs::read_dir(packages().join("manifests")).unwrap().count();
    assert_eq!(count, FAULTS.len() + LATER.len(), "every manifest has its fault in a table");
}
