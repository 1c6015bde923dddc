//! What several tests do with packages.
#![allow(dead_code, reason = "every test takes what it needs")]

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

/// The streams of the conformance vectors.
pub(crate) fn vectors() -> Vec<PathBuf> {
    let mut found = Vec::new();
    walk(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../conformance/vectors"), &mut found);
    found.sort();
    found
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

/// A stream of the worked example of annex E: two GOPs of predicted frames.
pub(crate) fn worked_example() -> Vec<u8> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../spec/data/worked-temporal-example.gss");
    std::fs::read(path).unwrap()
}
