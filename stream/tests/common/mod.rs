//! What several tests do with packages.
#![allow(dead_code, clippy::unwrap_used, reason = "every test takes what it needs; a panic is a failed test")]

pub(crate) mod broadcast;
pub(crate) mod mpd;
pub(crate) mod played;

use mp4_atom::{Any, Decode, Moof, Moov, Sidx};
use splatstream_format::Limits;
use splatstream_format::syntax::UnitType;
use splatstream_format::unit::{Stream, Unit, write_unit};
use splatstream_stream::live::Change;
use splatstream_stream::package::{Options, Package};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Files by their names.
pub(crate) type Files = BTreeMap<String, Vec<u8>>;

/// Writes what a live package changes.
pub(crate) fn apply(files: &mut Files, changes: Vec<Change>) {
    for Change { name, bytes, appends } in changes {
        let file = files.entry(name).or_default();
        if !appends {
            file.clear();
        }
        file.extend(bytes);
    }
}

/// A package of a stream that can be packaged.
pub(crate) fn package<'a>(stream: &'a [u8], options: &Options) -> Package<'a> {
    Package::of(stream, options, &Limits::default()).unwrap()
}

/// The files of the Representations.
pub(crate) fn files(package: &Package<'_>) -> Vec<(String, Vec<u8>)> {
    let file = |name: &str| {
        let mut bytes = Vec::new();
        package.write(name, &mut bytes).unwrap();
        (name.to_owned(), bytes)
    };
    package.files().map(file).collect()
}

/// A file as another reader of boxes sees it.
pub(crate) struct File {
    pub(crate) name: String,
    pub(crate) bytes: Vec<u8>,
    /// Offset and end of each box, and the box.
    pub(crate) boxes: Vec<(usize, usize, Any)>,
}

impl File {
    pub(crate) fn parse(name: &str, bytes: &[u8]) -> Self {
        let (mut boxes, mut rest) = (Vec::new(), bytes);
        while !rest.is_empty() {
            let at = bytes.len() - rest.len();
            let found = Any::decode(&mut rest).unwrap();
            boxes.push((at, bytes.len() - rest.len(), found));
        }
        Self { name: name.to_owned(), bytes: bytes.to_vec(), boxes }
    }

    /// The types of its boxes.
    pub(crate) fn kinds(&self) -> Vec<String> {
        self.boxes.iter().map(|(_, _, found)| found.kind().to_string()).collect()
    }

    pub(crate) fn moov(&self) -> &Moov {
        self.boxes
            .iter()
            .find_map(|(_, _, found)| if let Any::Moov(moov) = found { Some(moov) } else { None })
            .unwrap()
    }

    /// Offset and content of every `moof`.
    pub(crate) fn fragments(&self) -> Vec<(usize, &Moof)> {
        let boxes = self.boxes.iter();
        boxes
            .filter_map(|(at, _, found)| if let Any::Moof(moof) = found { Some((*at, moof)) } else { None })
            .collect()
    }

    /// The end and the content of `sidx`.
    pub(crate) fn index(&self) -> (usize, &Sidx) {
        let boxes = self.boxes.iter();
        let mut found = boxes.filter_map(
            |(_, end, found)| if let Any::Sidx(sidx) = found { Some((*end, sidx)) } else { None },
        );
        found.next().unwrap()
    }

    /// The bytes of a box whose type occurs once, without size and type.
    pub(crate) fn body(&self, kind: &str) -> Option<&[u8]> {
        let found = self.boxes.iter().find(|(_, _, found)| found.kind().to_string() == kind)?;
        self.bytes.get(found.0 + 8..found.1)
    }
}

/// The files of a package as another reader sees them.
pub(crate) fn read(package: &Package<'_>) -> Vec<File> {
    files(package).iter().map(|(name, bytes)| File::parse(name, bytes)).collect()
}

/// The numbers of 32 bits that bytes are.
pub(crate) fn words(bytes: &[u8]) -> Vec<u32> {
    bytes.chunks_exact(4).map(|word| u32::from_be_bytes(word.try_into().unwrap())).collect()
}

/// The streams of the conformance vectors.
pub(crate) fn vectors() -> Vec<PathBuf> {
    let mut found = Vec::new();
    walk(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../conformance/vectors"), &mut found);
    found.sort();
    found
}

/// Whether the whole stream of a vector is conforming. Those that are only read from somewhere inside need not be.
pub(crate) fn is_conforming(vector: &Path) -> bool {
    let inside = vector.parent().unwrap().file_name().unwrap().to_string_lossy().starts_with("inside-");
    vector.components().any(|part| part.as_os_str() == "valid") && !inside
}

fn walk(directory: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(directory).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            walk(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "gss") {
            found.push(path);
        }
    }
}

/// The stream of annex E: spatial and temporal layers, predicted frames, refinements.
pub(crate) fn worked_example() -> Vec<u8> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../spec/data/worked-temporal-example.gss");
    std::fs::read(path).unwrap()
}

/// A stream whose GOPs come several times, with frames of some milliseconds, and without an index.
pub(crate) fn repeated(stream: &[u8], times: u32, frame_ms: u32) -> Vec<u8> {
    let parsed = Stream::open(stream, &Limits::default()).unwrap();
    let units: Vec<_> = parsed.units().map(Result::unwrap).collect();
    let is = |kind: UnitType| move |unit: &&Unit<'_>| unit.header.unit_type() == kind;
    let is_tail =
        |unit: &Unit<'_>| ["operating_points", "index", "end"].contains(&unit.header.unit_type().name());
    let first = units.iter().position(|unit| is(UnitType::GopHeader)(&unit)).unwrap();
    let (head, rest) = units.split_at(first);
    let gops: Vec<&Unit<'_>> = rest.iter().take_while(|unit| !is_tail(unit)).collect();
    let number =
        |unit: &Unit<'_>, at: usize| u32::from_le_bytes(unit.payload[at..at + 4].try_into().unwrap());
    let headers: Vec<_> = gops.iter().copied().filter(is(UnitType::GopHeader)).collect();
    let length: u32 = headers.iter().map(|unit| number(unit, 4)).sum();
    let mut out = stream[..units[0].at as usize].to_vec();
    for unit in head {
        let mut payload = unit.payload.to_vec();
        if unit.header.unit_type() == UnitType::SequenceParameters {
            // frame_count, ticks_per_second, ticks_per_frame.
            payload[50..62].copy_from_slice(&[0_u32, 1000, frame_ms].map(u32::to_le_bytes).concat());
        }
        write_unit(&mut out, unit.header.id(), &payload).unwrap();
    }
    for time in 0..times {
        for unit in &gops {
            let (mut id, mut payload) = (unit.header.id(), unit.payload.to_vec());
            if id.unit_type == UnitType::GopHeader {
                let index = number(unit, 0) + time * headers.len() as u32;
                payload[..4].copy_from_slice(&index.to_le_bytes());
            }
            id.frame += time * length;
            write_unit(&mut out, id, &payload).unwrap();
        }
    }
    let frames = times * gops.iter().copied().filter(is(UnitType::FrameHeader)).count() as u32;
    let count = head.len() as u32 + times * gops.len() as u32;
    let payload = [frames, count, 0, 0].map(u32::to_le_bytes).concat();
    write_unit(&mut out, units.last().unwrap().header.id(), &payload).unwrap();
    out
}
