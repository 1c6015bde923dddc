//! Extraction has no case of its own, since a decoder need not offer it: the reference's is compared here.
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed test")]

mod common;

use common::sha256;
use splatstream_conformance::suite::Suite;
use splatstream_decoder::operating_point::extract;
use splatstream_format::Limits;
use std::path::Path;

// covers: SS-OP-004, SS-OP-008
#[test]
fn the_reference_extracts_the_bytes_of_every_vector() {
    let suite = Suite::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../vectors")).unwrap();
    let mut extractions = 0;
    for located in &suite.vectors {
        let stream = std::fs::read(&located.stream).unwrap();
        for point in &located.vector.points {
            let Some(wanted) = &point.extraction else { continue };
            let extracted = extract(&stream, point.op.parse().unwrap(), &Limits::default()).unwrap();
            assert_eq!(sha256(&extracted), *wanted, "{} at {}", located.vector.name, point.op);
            extractions += 1;
        }
    }
    assert!(extractions >= 500, "{extractions} extractions");
}
