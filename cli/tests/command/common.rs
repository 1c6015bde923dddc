//! Runs the binary as a user would.

use serde_json::Value;
use splatstream_files::builtin::BuiltinScene;
use splatstream_files::ply;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use tempfile::TempDir;

/// A directory that goes away with the test.
pub(crate) fn directory() -> TempDir {
    tempfile::tempdir().expect("a temporary directory")
}

/// Runs `splatstream` with these arguments.
pub(crate) fn run(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_splatstream")).args(arguments).output().expect("the binary starts")
}

/// Runs `splatstream` with bytes on its standard input.
pub(crate) fn run_with(arguments: &[&str], input: &[u8]) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_splatstream"))
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary starts");
    let mut stdin = child.stdin.take().expect("a pipe");
    let input = input.to_vec();
    // Beside reading: a command may write before it has read everything.
    let writing = std::thread::spawn(move || stdin.write_all(&input));
    let output = child.wait_with_output().expect("it ends");
    // A command that refuses its arguments does not read.
    let _not_read = writing.join().expect("no panic");
    output
}

/// Runs `splatstream`, which shall succeed; gives standard output.
pub(crate) fn succeed(arguments: &[&str]) -> String {
    let output = run(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

/// Runs `splatstream ... --json`, which shall succeed.
pub(crate) fn json(arguments: &[&str]) -> Value {
    let output = succeed(&[arguments, &["--json"]].concat());
    serde_json::from_str(&output).expect("JSON")
}

/// Runs `splatstream`, which shall end with `code`; gives standard error.
pub(crate) fn fail(code: i32, arguments: &[&str]) -> String {
    let output = run(arguments);
    let stderr = String::from_utf8(output.stderr).expect("text");
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {stderr}");
    stderr
}

/// A path as an argument.
pub(crate) fn text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

/// A small moving scene.
pub(crate) fn scene() -> BuiltinScene {
    BuiltinScene { gaussians: 600, frames: 3, sh_degree: 1, ..BuiltinScene::default() }
}

/// Writes the frames of the small scene to `frames` in a directory.
pub(crate) fn write_frames(directory: &Path) -> PathBuf {
    let frames = directory.join("frames");
    std::fs::create_dir(&frames).expect("a directory");
    for number in 0..scene().frames {
        // Without leading zeros and in tens: names sort otherwise than people count.
        let path = frames.join(format!("f{}.ply", 8 + number));
        std::fs::write(path, ply::write(&scene().frame(number))).expect("a file");
    }
    frames
}

/// One frame of the small scene in a file.
pub(crate) fn write_still(directory: &Path) -> PathBuf {
    let path = directory.join("still.ply");
    std::fs::write(&path, ply::write(&scene().frame(0))).expect("a file");
    path
}

/// Encodes the small scene to a stream in a directory.
pub(crate) fn write_stream(directory: &Path) -> PathBuf {
    let frames = write_frames(directory);
    let stream = directory.join("small.gss");
    succeed(&["encode", text(&frames), "-o", text(&stream), "--gop", "2"]);
    stream
}

/// The stream of the snapshots: committed, so that they change with the bitstream and not with the encoder.
pub(crate) fn fixture() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/small.gss")
}

/// The same with a damaged payload, in a directory.
pub(crate) fn write_damaged(directory: &Path) -> PathBuf {
    let path = directory.join("damaged.gss");
    let mut bytes = std::fs::read(fixture()).expect("a file");
    let last = bytes.len() - 200;
    bytes[last] ^= 1;
    std::fs::write(&path, bytes).expect("a file");
    path
}

/// Bytes of a unit_header.
pub(crate) const UNIT_HEADER: usize = 20;

/// Bytes of the payload of the unit at an offset.
pub(crate) fn payload_length(bytes: &[u8], at: usize) -> usize {
    let length: [u8; 4] = bytes[at + 12..at + 16].try_into().expect("four bytes");
    u32::from_le_bytes(length) as usize
}

/// Makes both checksums of a unit right again, so that the change itself is found.
pub(crate) fn seal(bytes: &mut [u8], at: usize) {
    let payload = at + UNIT_HEADER..at + UNIT_HEADER + payload_length(bytes, at);
    let crc = crc32fast::hash(&bytes[payload]);
    bytes[at + 16..at + 20].copy_from_slice(&crc.to_le_bytes());
    let covered = [&bytes[at..at + 6], &bytes[at + 8..at + 20]].concat();
    let check = crc32fast::hash(&covered).to_le_bytes();
    bytes[at + 6..at + 8].copy_from_slice(&check[..2]);
}
