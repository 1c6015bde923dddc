use std::io::{self, Cursor, Read, Seek, SeekFrom, Write};

use flate2::Compression;
use flate2::write::GzEncoder;

use super::*;
use crate::error::SceneErrorKind;
use crate::limits::ReadLimits;

/// A file that says to be of three gigabytes, of which only the start is there, and that counts what is read.
struct Sparse {
    start: Cursor<Vec<u8>>,
    size: u64,
    read: u64,
}

const SIZE: u64 = 3 << 30;

impl Read for Sparse {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let read = self.start.read(out)?;
        let read = if read > 0 { read } else { out.len() };
        self.read = self.read.saturating_add(read as u64);
        Ok(read)
    }
}

impl Seek for Sparse {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match to {
            SeekFrom::Start(at) => self.start.seek(SeekFrom::Start(at)),
            _ => Ok(self.size),
        }
    }
}

/// What is said of three gigabytes that begin so, with enough memory allowed for them, and the bytes that were read.
fn said(format: SceneFormat, start: &[u8], max_memory: u64) -> (Option<SceneErrorKind>, u64) {
    let mut file = Sparse { start: Cursor::new(start.to_vec()), size: SIZE, read: 0 };
    let checked = check(format, &mut file, &mut Budget::new(&ReadLimits { max_memory }));
    (checked.err().map(|error| error.kind), file.read)
}

fn words(words: &[u32]) -> Vec<u8> {
    words.iter().flat_map(|word| word.to_le_bytes()).collect()
}

/// A `.ksplat` of a version, with one section at level 0 that has room for so many Gaussians.
fn ksplat(minor: u8, capacity: u32) -> Vec<u8> {
    let mut header = [vec![0, minor, 0, 0], words(&[1, 1, 10, 10, 0])].concat();
    header.resize(4096, 0);
    let mut section = words(&[10, capacity]);
    section.resize(1024, 0);
    [header, section].concat()
}

/// The start of a `.glb` with JSON of so many bytes.
fn glb(version: u32, length: u32, json: u32) -> Vec<u8> {
    [b"glTF".to_vec(), words(&[version, length, json]), b"JSON".to_vec()].concat()
}

/// The header of an SPZ file of 10 Gaussians of degree 0.
fn spz(version: u32, streams: u8) -> Vec<u8> {
    [b"NGSP".to_vec(), words(&[version, 10]), vec![0, 12, 0, streams]].concat()
}

/// An SPZ file of version 4 whose first attribute has so many bytes.
fn spz_4(first: u64, of_attribute: u32) -> Vec<u8> {
    let rest = [10_u32, 30, 30, 40].map(|size| words(&[20, 0, size, 0])).concat();
    let first = first.to_le_bytes().to_vec();
    [spz(4, 5), words(&[32, 0, 0, 0]), first, words(&[of_attribute, 0]), rest].concat()
}

fn gzip(content: &[u8]) -> Vec<u8> {
    let mut out = GzEncoder::new(Vec::new(), Compression::default());
    out.write_all(content).unwrap();
    out.finish().unwrap()
}

#[test]
fn three_gigabytes_are_refused_for_their_start() {
    use SceneFormat::{Gltf, Ksplat, Spz};
    let cases: [(SceneFormat, Vec<u8>, &str); 11] = [
        (Ksplat, ksplat(0, 10), "version 0.0"),
        (Ksplat, ksplat(1, 1 << 30), "needs 47244640256 bytes"),
        (Ksplat, ksplat(1, 9), "10 Gaussians in room for 9"),
        (Gltf, glb(1, 100, 20), "GLB of version 1"),
        (Gltf, glb(2, u32::MAX, 16), "the GLB file needs 4294967295 bytes"),
        (Gltf, glb(2, 100, u32::MAX), "a chunk needs 4294967295 bytes"),
        (Spz, spz(3, 5), "version 3 without gzip"),
        (Spz, b"????".repeat(8), "magic is"),
        (Spz, spz_4(9, 91), "positions is 91 bytes"),
        (Spz, spz_4(1 << 33, 90), "positions needs 8589934592 bytes"),
        (Spz, gzip(&spz(5, 0)), "gzip SPZ of version 5"),
    ];
    for (format, start, expected) in cases {
        let (error, read) = said(format, &start, 1 << 40);
        let error = error.map(|error| error.to_string()).unwrap_or_default();
        assert!(error.contains(expected), "{format:?}: {error}");
        assert!(read < 20_000, "{format:?}: {read} bytes were read before \"{error}\"");
    }
}

#[test]
fn the_file_and_its_frame_count_before_anything_is_read() {
    use SceneFormat::{Gltf, Ksplat, Splat, Spz};
    // 10 Gaussians have 56 bytes each as planes, and 20 as the attributes of an SPZ file; a byte of JSON counts 64 times. The
    // list of sections of a .ksplat file counts too.
    let cases = [
        (Splat, vec![], SIZE / 32 * 56),
        (Ksplat, ksplat(1, 10), 560),
        (Gltf, glb(2, 36, 16), 1024),
        (Spz, spz_4(9, 90), 760),
        (Spz, gzip(&spz(3, 0)), 760),
    ];
    for (format, start, more) in cases {
        let list = if format == Ksplat { 200 } else { 0 };
        assert!(said(format, &start, SIZE + more + list).0.is_none(), "{format:?}");
        let (error, _) = said(format, &start, SIZE + more - 1);
        let Some(SceneErrorKind::OverLimit { asked, .. }) = error else { panic!("{format:?}: {error:?}") };
        assert!((SIZE + more..=SIZE + more + list).contains(&asked), "{format:?}: {asked}");
    }
}
