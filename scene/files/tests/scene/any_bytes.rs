//! Whatever the bytes are, a reader answers; it does not panic.

use proptest::prelude::*;
use splatstream_files::{SceneError, compressed_ply, gltf, ksplat, ply, sog, splat, spz};
use splatstream_gaussians::GaussianFrame;

use super::samples::{LIMITS, small_files};

type Reader = fn(&[u8], &splatstream_files::ReadLimits) -> Result<GaussianFrame, SceneError>;

const READERS: [Reader; 7] =
    [ply::read, compressed_ply::read, splat::read, spz::read, sog::read_zip, gltf::read, ksplat::read];

/// Every reader on `bytes`; what they say does not matter here.
fn read_all(bytes: &[u8]) {
    for reader in READERS {
        if let Ok(frame) = reader(bytes, &LIMITS) {
            assert_eq!(frame.validate(), Ok(()), "a reader hands out checked frames only");
        }
    }
}

fn reader_of(name: &str) -> Reader {
    match name.split_once('.') {
        Some((_, "ply")) => ply::read,
        Some((_, "compressed.ply")) => compressed_ply::read,
        Some((_, "splat")) => splat::read,
        Some((_, "sog")) => sog::read_zip,
        Some((_, "glb" | "gltf")) => gltf::read,
        Some((_, "ksplat")) => ksplat::read,
        _ => spz::read,
    }
}

#[test]
fn every_small_file_reads() {
    for (name, bytes) in small_files() {
        let frame = reader_of(name)(&bytes, &LIMITS).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(!frame.is_empty(), "{name}");
    }
}

#[test]
fn a_file_cut_at_any_byte_is_an_error() {
    for (name, bytes) in small_files() {
        for length in 0..bytes.len() {
            let result = reader_of(name)(&bytes[..length], &LIMITS);
            // Records have no frame around them: whole ones are a shorter scene.
            let whole_records = name == "a.splat" && length % 32 == 0;
            assert!(whole_records || result.is_err(), "{name} cut to {length} bytes reads");
        }
    }
}

#[test]
fn a_file_with_any_one_byte_changed_does_no_harm() {
    for (name, bytes) in small_files() {
        for at in 0..bytes.len() {
            for flip in [0x01, 0x80, 0xff] {
                let mut changed = bytes.clone();
                changed[at] ^= flip;
                let _ = reader_of(name)(&changed, &LIMITS);
            }
        }
    }
}

proptest! {
    #[test]
    fn any_bytes_do_no_harm(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        read_all(&bytes);
    }

    #[test]
    fn any_bytes_after_a_true_start_do_no_harm(
        which in 0..13_usize,
        kept in 0.0..1.0_f64,
        tail in prop::collection::vec(any::<u8>(), 0..400),
    ) {
        let (_, mut bytes) = small_files().swap_remove(which);
        bytes.truncate((bytes.len() as f64 * kept) as usize);
        bytes.extend(tail);
        read_all(&bytes);
    }

    #[test]
    fn several_changed_bytes_do_no_harm(
        which in 0..13_usize,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
    ) {
        let (_, mut bytes) = small_files().swap_remove(which);
        for (index, value) in changes {
            let at = index.index(bytes.len());
            bytes[at] = value;
        }
        read_all(&bytes);
    }
}
