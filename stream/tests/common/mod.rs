//! What several tests do with packages.
#![allow(dead_code, clippy::unwrap_used, reason = "every test takes what it needs; a panic is a failed test")]

pub(crate) mod mpd;

use mp4_atom::{Any, Decode, Moof, Moov, Sidx};
use splatstream_format::Limits;
use splatstream_stream::package::{Options, Package};
use std::path::{Path, PathBuf};

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
