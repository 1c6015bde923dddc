//! The vectors of `conformance/vectors`: each stream has the outcome and the digests that its file says.
//!
//! Half of the valid ones were written by the independent decoder's generator, not by our encoder.
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed test")]

use serde_json::Value;
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::decode_stream;
use splatstream_format::{Class, Limits};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

fn vectors(folder: &str) -> Vec<(PathBuf, Value)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../conformance/vectors").join(folder);
    let mut streams: Vec<PathBuf> =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    streams.retain(|path| path.extension().is_some_and(|extension| extension == "gss"));
    streams.sort();
    let expected = |path: PathBuf| {
        let text = std::fs::read_to_string(path.with_extension("expect.json")).unwrap();
        let value = serde_json::from_str(&text).unwrap();
        (path, value)
    };
    streams.into_iter().map(expected).collect()
}

fn options() -> Options {
    Options { limits: Limits { max_gaussians: 1 << 24, ..Limits::default() }, ..Options::default() }
}

#[test]
fn valid_vectors_give_their_digests() {
    let vectors = vectors("valid");
    assert!(vectors.len() >= 100, "{} vectors", vectors.len());
    for (path, expected) in vectors {
        let bytes = std::fs::read(&path).unwrap();
        let mut digests = Vec::new();
        let summary = decode_stream(&bytes, &options(), |_, frame| {
            digests.push(format!("{:016x}", frame.digest.unwrap()));
            ControlFlow::Continue(())
        });
        assert_eq!(summary.end, None, "{}", path.display());
        let frames = expected["frames"].as_array().unwrap();
        let wanted: Vec<&str> = frames.iter().map(|frame| frame["digest"].as_str().unwrap()).collect();
        assert_eq!(digests, wanted, "{}", path.display());
    }
}

#[test]
fn invalid_vectors_are_refused_with_their_class_and_code() {
    let vectors = vectors("invalid");
    assert!(vectors.len() >= 100, "{} vectors", vectors.len());
    for (path, expected) in vectors {
        let bytes = std::fs::read(&path).unwrap();
        let error = decode_stream(&bytes, &options(), |_, _| ControlFlow::Continue(())).end;
        let found = error.map(|error| (error.class().name(), error.kind.code()));
        let wanted = (expected["class"].as_str().unwrap(), expected["code"].as_str().unwrap());
        assert_eq!(found, Some(wanted), "{}", path.display());
        assert!(error.is_some_and(|error| error.class() != Class::OverLimit || wanted.0 == "over-limit"));
    }
}
