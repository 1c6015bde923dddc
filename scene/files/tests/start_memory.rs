//! Files of gigabytes that cannot be read are refused with the memory of their start: a program of its own, so that no other test
//! takes memory meanwhile.
#![expect(clippy::unwrap_used, reason = "a test that meets an error stops there")]

use std::io::Write;

use peak_alloc::PeakAlloc;
use splatstream_files::{ReadLimits, SceneErrorKind, read_scene};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Memory that telling the format of a file takes: its first mebibyte, in a vector that grew to it.
const OF_START: usize = 4 << 20;

/// A ZIP archive with a `meta.json` of another version.
fn sog() -> Vec<u8> {
    let coded = r#"{"mins":0,"maxs":1,"files":["a"]}"#;
    let meta = format!(
        r#"{{"version":9,"count":1,"means":{{"mins":[0,0,0],"maxs":[1,1,1],"files":["a","a"]}},
        "scales":{coded},"quats":{{"files":["a"]}},"sh0":{coded}}}"#
    );
    let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    archive.start_file("meta.json", zip::write::SimpleFileOptions::default()).unwrap();
    archive.write_all(meta.as_bytes()).unwrap();
    archive.finish().unwrap().into_inner()
}

#[test]
fn gigabytes_that_cannot_be_read_take_the_memory_of_their_start() {
    const SIZE: u64 = 2 << 30;
    let archive = sog();
    let (local, directory) = archive.split_at(archive.windows(4).position(|at| at == b"PK\x01\x02").unwrap());
    // What an archive lists is at its end; the member it lists is at the start.
    let cases: [(&str, &[u8], &[u8], &str); 5] = [
        (".ksplat", b"\x00\x01\0\0\x01\0\0\0\0\0\0\0\0\0\0\0\x05", b"", "sections have 0"),
        (".ksplat", b"\x01\x00", b"", ".ksplat of version 1.0"),
        (".glb", b"glTF\x01\x00\x00\x00", b"", "GLB of version 1"),
        (".spz", b"NGSP\x07\x00\x00\x00", b"", "SPZ of version 7"),
        (".sog", local, directory, "SOG version 9"),
    ];
    for (suffix, start, end, expected) in cases {
        let mut file = tempfile::Builder::new().suffix(suffix).tempfile().unwrap();
        file.write_all(start).unwrap();
        file.as_file().set_len(SIZE).unwrap();
        if !end.is_empty() {
            append_directory(&mut file, end, SIZE);
        }
        MEMORY.reset_peak_usage();
        let before = MEMORY.current_usage();
        let error = read_scene(file.path(), &ReadLimits { max_memory: 16 << 30 }).unwrap_err();
        let taken = MEMORY.peak_usage() - before;
        assert!(!matches!(error.kind, SceneErrorKind::OverLimit { .. }), "{error}");
        assert!(error.to_string().contains(expected), "{suffix}: {error}");
        assert!(taken < OF_START, "{suffix}: {taken} bytes of memory before \"{error}\"");
    }
}

/// Puts the list of an archive at the end of a file, and into it where it is now.
fn append_directory(file: &mut tempfile::NamedTempFile, directory: &[u8], at: u64) {
    use std::io::{Seek, SeekFrom};
    let mut directory = directory.to_vec();
    let end = directory.windows(4).position(|at| at == b"PK\x05\x06").unwrap();
    directory[end + 16..end + 20].copy_from_slice(&(at as u32).to_le_bytes());
    file.seek(SeekFrom::Start(at)).unwrap();
    file.write_all(&directory).unwrap();
}
