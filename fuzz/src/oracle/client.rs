//! The protocol of `conformance/adapters`, from the side that asks.

use crate::laws::Decoded;
use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_format::Error;
use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

/// The independent decoder, answering many requests.
const ADAPTER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../conformance/adapters/python/adapter.py");
/// The interpreter that runs it.
const PYTHON: &str = "python3";

/// What a decoder is asked.
pub(super) struct Request<'a> {
    pub(super) stream: &'a [u8],
    pub(super) point: OperatingPoint,
    pub(super) subset: bool,
}

impl core::fmt::Debug for Request<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "at {} in mode {}", self.point, self.mode())
    }
}

impl Request<'_> {
    fn mode(&self) -> &'static str {
        if self.subset { "subset" } else { "full" }
    }
}

/// What it answers.
pub(super) struct Answer {
    /// Exit code and code of the error; 0 and nothing of a stream that is accepted.
    pub(super) verdict: (i32, Option<String>),
    /// The planes shown, by name of file.
    pub(super) planes: BTreeMap<String, Vec<u8>>,
}

impl Answer {
    /// What the decoder answers that gave these frames, and found this error first.
    pub(super) fn of(error: Option<Error>, decoded: Decoded) -> Self {
        let verdict = error.map_or((0, None), |error| {
            (error.class().exit_code().into(), Some(error.kind.code().to_owned()))
        });
        let has_sh = decoded.sequence.is_some_and(|sequence| sequence.sh_degree > 0);
        let files = decoded.frames.into_iter().flat_map(|frame| {
            let number = frame.number;
            let attributes = attributes(&frame.into_shown()).into_iter();
            let there = attributes.filter(move |(attribute, _)| *attribute != "sh" || has_sh);
            there.map(move |(attribute, bytes)| (format!("f{number:04}.{attribute}.i32"), bytes))
        });
        Self { verdict, planes: files.collect() }
    }
}

/// The canonical planes of a frame in the groups that are files.
fn attributes(frame: &QuantizedFrame) -> [(&'static str, Vec<u8>); 6] {
    let signed =
        |planes: &[Vec<i32>]| planes.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
    [
        ("position", frame.position.iter().flatten().flat_map(|value| value.to_le_bytes()).collect()),
        ("log_scale", signed(&frame.log_scale)),
        ("opacity", signed(std::slice::from_ref(&frame.opacity))),
        ("rotation", signed(&frame.rotation)),
        ("dc", signed(&frame.dc)),
        ("sh", signed(&frame.sh)),
    ]
}

/// The process, and where streams and planes are passed.
pub(super) struct Oracle {
    // Ends when its input does, which is when this program does.
    _process: Child,
    requests: ChildStdin,
    answers: BufReader<ChildStdout>,
    folder: PathBuf,
}

impl Oracle {
    /// Starts it. Without it there is nothing to compare with.
    pub(super) fn start() -> Self {
        let folder = std::env::temp_dir().join(format!("splatstream-fuzz-{}", std::process::id()));
        fs::create_dir_all(folder.join("out")).expect("there is room for files");
        let mut process = Command::new(PYTHON)
            .args([ADAPTER, "--stdio"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap_or_else(|error| panic!("{PYTHON}, which the independent decoder needs: {error}"));
        let requests = process.stdin.take().expect("it is piped");
        let answers = BufReader::new(process.stdout.take().expect("it is piped"));
        Self { _process: process, requests, answers, folder }
    }

    pub(super) fn ask(&mut self, request: &Request<'_>) -> Answer {
        let (stream, out) = (self.folder.join("in.gss"), self.folder.join("out"));
        fs::write(&stream, request.stream).expect("there is room for files");
        let (op, mode) = (request.point, request.mode());
        writeln!(self.requests, "{}\t{op}\t{mode}\t{}", stream.display(), out.display()).expect("it listens");
        let mut line = String::new();
        self.answers.read_line(&mut line).expect("it answers in text");
        Answer { verdict: verdict(&line), planes: planes(&out) }
    }
}

/// `exit-code`, or `exit-code TAB JSON`.
fn verdict(line: &str) -> (i32, Option<String>) {
    let (exit_code, diagnosis) = line.trim_end().split_once('\t').unwrap_or((line.trim_end(), "{}"));
    let exit_code = exit_code.parse().unwrap_or_else(|_| panic!("the independent decoder gave up: '{line}'"));
    let diagnosis: serde_json::Value = serde_json::from_str(diagnosis).expect("a diagnosis is JSON");
    (exit_code, diagnosis["code"].as_str().map(str::to_owned))
}

/// The planes in a folder, which is empty after.
fn planes(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut planes = BTreeMap::new();
    for entry in fs::read_dir(folder).expect("the folder is there") {
        let path = entry.expect("its files can be listed").path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        // Other files may be written too; they are about the same planes.
        if name.ends_with(".i32") {
            planes.insert(name, fs::read(&path).expect("a file that is there can be read"));
        }
        fs::remove_file(path).expect("a file that is there can be removed");
    }
    planes
}
