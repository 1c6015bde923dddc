//! C.10: `unpackage` gives the bytes of the stream, whatever the stream.

#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

mod common;

use arbitrary::{Arbitrary, Unstructured};
use common::{files, is_conforming, package, vectors};
use proptest::prelude::*;
use splatstream_format::arbitrary_stream::ArbitraryStream;
use splatstream_format::{Class, Limits};
use splatstream_stream::manifest::Manifest;
use splatstream_stream::package::{Layout, Options, Package};
use splatstream_stream::unpackage::unpackage;

/// Ways to package that share nothing.
fn options() -> [Options; 4] {
    let gop = Options::default();
    let frame = Options { layout: Layout::Frame, ..gop };
    // A GOP of small frames becomes several subsegments.
    [gop, frame, Options { max_subsegment: 20_000, ..gop }, Options { max_subsegment: 20_000, ..frame }]
}

/// Packages in every way, and compares. Gives the number of packages.
fn check(stream: &[u8]) -> Result<usize, splatstream_format::Error> {
    let mut made = 0;
    for options in options() {
        let package = match Package::of(stream, &options, &Limits::default()) {
            Ok(package) => package,
            // A frame that is larger than a subsegment may be.
            Err(error) if error.class() == Class::OverLimit && error.clause == "C.5.2" => continue,
            Err(error) => return Err(error),
        };
        let files = files(&package);
        let given: Vec<_> = files.iter().map(|(name, bytes)| (name.clone(), bytes.as_slice())).collect();
        let back = unpackage(&given, &Limits::default()).unwrap();
        assert!(back == stream, "the stream came back different");
        let manifest = Manifest::parse(package.manifest.to_json().as_bytes()).unwrap();
        assert_eq!(manifest, package.manifest);
        made += 1;
    }
    Ok(made)
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(192) })]

    // covers: SS-CR-002
    #[test]
    fn every_stream_that_obeys_the_syntax_comes_back(seed in proptest::collection::vec(any::<u8>(), 0..6000)) {
        let stream = ArbitraryStream::arbitrary(&mut Unstructured::new(&seed)).unwrap().to_bytes().unwrap();
        prop_assert!(check(&stream).unwrap() >= 2);
    }

    #[test]
    fn a_changed_byte_is_an_error_or_the_stream(
        seed in proptest::collection::vec(any::<u8>(), 1000..4000),
        at in any::<prop::sample::Index>(),
        change in 1_u8..,
    ) {
        let stream = ArbitraryStream::arbitrary(&mut Unstructured::new(&seed)).unwrap().to_bytes().unwrap();
        let made = package(&stream, &Options::default());
        let mut files = files(&made);
        let all: usize = files.iter().map(|(_, bytes)| bytes.len()).sum();
        let mut at = at.index(all);
        for (_, bytes) in &mut files {
            if at < bytes.len() {
                bytes[at] ^= change;
                break;
            }
            at -= bytes.len();
        }
        let given: Vec<_> = files.iter().map(|(name, bytes)| (name.clone(), bytes.as_slice())).collect();
        if let Ok(back) = unpackage(&given, &Limits::default()) {
            // Payloads that decoders discard, and the last units, have no checksum that is looked at here.
            prop_assert_eq!(back.len(), stream.len());
        }
    }
}

// covers: SS-CR-001, SS-CR-002
#[test]
fn every_vector_that_is_packaged_comes_back() {
    let (mut whole, mut refused) = (0, 0);
    for path in vectors() {
        let stream = std::fs::read(&path).unwrap();
        match check(&stream) {
            Ok(made) => {
                assert!(made >= 2, "{}", path.display());
                whole += 1;
            }
            Err(error) => {
                assert!(!is_conforming(&path), "{}: {error}", path.display());
                refused += 1;
            }
        }
    }
    assert!(whole > 100 && refused > 100, "{whole} came back, {refused} were refused");
}
