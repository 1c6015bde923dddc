//! The protocol of `conformance/adapters`, from the side that asks.

use crate::laws::Decoded;
use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::operating_point::OperatingPoint;
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

impl core::fmt::Debug for Answer {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(&self.verdict)
    }
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
    /// Offset of the first error; none of a stream that is accepted.
    pub(super) error_at: Option<u64>,
    /// Its class and code, to be shown.
    verdict: String,
    /// Ranges of display indices of frames that never came out.
    pub(super) lost: Vec<[u32; 2]>,
    /// The planes shown, by name of file.
    pub(super) planes: BTreeMap<String, Vec<u8>>,
}

impl Answer {
    /// What the decoder answers that gave this.
    pub(super) fn of(decoded: Decoded) -> Self {
        let error = decoded.errors.first();
        let error_at = error.map(|error| error.at);
        let verdict = error.map_or_else(|| "accepted".to_owned(), ToString::to_string);
        let lost = decoded.lost.iter().map(|range| [*range.start(), *range.end()]).collect();
        let has_sh = decoded.sequence.is_some_and(|sequence| sequence.sh_degree > 0);
        let files = decoded.frames.into_iter().flat_map(|frame| {
            let number = frame.index;
            let attributes = attributes(&frame.into_shown()).into_iter();
            let there = attributes.filter(move |(attribute, _)| *attribute != "sh" || has_sh);
            there.map(move |(attribute, bytes)| (format!("f{number:04}.{attribute}.i32"), bytes))
        });
        Self { error_at, verdict, lost, planes: files.collect() }
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
        Answer { planes: planes(&out), ..diagnosed(&line) }
    }
}

/// `exit-code`, or `exit-code TAB JSON`.
fn diagnosed(line: &str) -> Answer {
    let (exit_code, diagnosis) = line.trim_end().split_once('\t').unwrap_or((line.trim_end(), "{}"));
    assert!(exit_code.parse::<u8>().is_ok(), "the independent decoder gave up: '{line}'");
    let diagnosis: serde_json::Value = serde_json::from_str(diagnosis).expect("a diagnosis is JSON");
    let lost = diagnosis["lost"].as_array().into_iter().flatten();
    let range = |range: &serde_json::Value| [0, 1].map(|end| range[end].as_u64().unwrap_or(0) as u32);
    let error_at = diagnosis["byte"].as_u64();
    Answer {
        error_at,
        verdict: diagnosis.to_string(),
        lost: lost.map(range).collect(),
        planes: BTreeMap::new(),
    }
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
