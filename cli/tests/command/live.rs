//! `package --live`, `serve` and `play` at the same time: a stream is packaged while it is written, and played while it grows.

use crate::common;
use crate::common::{json, scene, succeed, text};
use serde_json::Value;
use splatstream_files::builtin::BuiltinScene;
use splatstream_files::ply;
use splatstream_format::Limits;
use splatstream_stream::division::Division;
use std::fs::{self, File};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::OnceLock;
use std::thread::{self, JoinHandle, sleep};
use std::time::{Duration, Instant};

/// GOPs of the stream, frames of each, and seconds of a GOP.
const GOPS: usize = 10;
const FRAMES: usize = 2;
const GOP: Duration = Duration::from_millis(400);

fn program(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_splatstream"));
    command.args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// A stream, which is encoded once.
fn stream() -> &'static [u8] {
    static STREAM: OnceLock<Vec<u8>> = OnceLock::new();
    STREAM.get_or_init(|| {
        let directory = common::directory();
        let scene = BuiltinScene { frames: (GOPS * FRAMES) as u32, ..scene() };
        let frames: Vec<PathBuf> =
            (0..GOPS * FRAMES).map(|number| directory.path().join(format!("{number:02}.ply"))).collect();
        for (number, path) in (0..).zip(&frames) {
            fs::write(path, ply::write(&scene.frame(number))).unwrap();
        }
        let stream = directory.path().join("whole.gss");
        let frames: Vec<&str> = frames.iter().map(|path| text(path)).collect();
        let how = ["-o", text(&stream), "--gop", "2", "--fps", "5", "--preset", "fast"];
        succeed(&[&["encode"], &frames[..], &how].concat());
        fs::read(stream).unwrap()
    })
}

/// The stream in pieces, one for each GOP; the first has what comes before, the last what comes after.
fn pieces() -> Vec<Vec<u8>> {
    let bytes = stream();
    let division = Division::of(bytes, &Limits::default()).unwrap();
    assert_eq!(division.gops.len(), GOPS);
    let starts: Vec<usize> = division.gops.iter().skip(1).map(|gop| gop.start as usize).collect();
    let starts: Vec<usize> = [0].into_iter().chain(starts).chain([bytes.len()]).collect();
    starts.windows(2).map(|pair| bytes[pair[0]..pair[1]].to_vec()).collect()
}

/// Writes pieces in real time.
fn write(mut out: impl Write + Send + 'static, pieces: Vec<Vec<u8>>) -> JoinHandle<()> {
    thread::spawn(move || {
        let begun = Instant::now();
        for (piece, number) in pieces.iter().zip(0..) {
            sleep((GOP * number).saturating_sub(begun.elapsed()));
            out.write_all(piece).unwrap();
            out.flush().unwrap();
        }
    })
}

/// Waits until there is a file.
fn appears(path: &Path) {
    let begun = Instant::now();
    while !path.exists() {
        assert!(begun.elapsed() < Duration::from_secs(60), "{} does not appear", path.display());
        sleep(Duration::from_millis(5));
    }
}

/// A server of a directory, and its address.
fn serve(directory: &Path) -> (Child, String) {
    let mut child = program(&["serve", "--port", "0", text(directory)]).spawn().unwrap();
    let mut line = String::new();
    BufReader::new(child.stderr.take().unwrap()).read_line(&mut line).unwrap();
    let url = line.split(" at ").nth(1).unwrap_or_else(|| panic!("{line}")).trim().to_owned();
    (child, url)
}

/// Every frame of the GOPs that were played, from one on, was decoded, and nothing was lost.
fn is_whole(report: &Value, first: usize) {
    assert_eq!(report["losses"], Value::Array(vec![]), "{report:#}");
    assert_eq!(report["totals"]["complete"], true, "{report:#}");
    let gops = report["gops"].as_array().unwrap();
    let numbers: Vec<u64> = gops.iter().map(|gop| gop["gop"].as_u64().unwrap()).collect();
    assert_eq!(numbers, (first as u64..GOPS as u64).collect::<Vec<_>>());
    for gop in gops {
        let decoded = &gop["decoded"];
        assert_eq!(decoded["errors"], Value::Array(vec![]), "{gop}");
        assert_eq!(decoded["lost"], Value::Array(vec![]), "{gop}");
        assert!(gop["op"].as_str().unwrap().contains(",i,") || decoded["frames"] == FRAMES, "{gop}");
        let latency = gop["latency_seconds"].as_f64().unwrap();
        assert!((0.0..10.0).contains(&latency), "{gop}");
    }
    assert!(report["totals"]["latency_seconds"].as_f64().unwrap() > 0.1);
}

#[test]
fn a_pipe_is_packaged_served_and_played_while_it_is_written() {
    for layout in ["gop", "frame"] {
        let directory = common::directory();
        let (pieces, out) = (pieces(), directory.path().join("live"));
        let mut packager =
            program(&["package", "-", "-o", text(&out), "--live", "--layout", layout, "--window", "60"])
                .stdin(Stdio::piped())
                .spawn()
                .unwrap();
        let writing = write(packager.stdin.take().unwrap(), pieces);
        appears(&out.join("manifest.json"));
        let (mut server, url) = serve(&out);
        let report = json(&["play", &url, "--from-start"]);
        is_whole(&report, 0);
        writing.join().unwrap();
        let packaged = packager.wait_with_output().unwrap();
        assert!(packaged.status.success(), "{}", String::from_utf8_lossy(&packaged.stderr));
        // What has ended is played as any package, and gives the stream back.
        let later = json(&["play", &url, "--no-wait"]);
        assert_eq!(
            (&later["totals"]["complete"], later["losses"].as_array().unwrap().len()),
            (&true.into(), 0)
        );
        assert_eq!(later["totals"]["latency_seconds"], Value::Null);
        server.kill().unwrap();
        server.wait().unwrap();
        let back = directory.path().join("back.gss");
        assert_eq!(json(&["unpackage", text(&out), "-o", text(&back)])["verified"], true);
        assert!(fs::read(&back).unwrap() == stream());
    }
}

#[test]
fn a_file_that_grows_is_joined_near_its_end() {
    let directory = common::directory();
    let (pieces, out) = (pieces(), directory.path().join("live"));
    let growing = directory.path().join("growing.gss");
    let writing = write(File::create(&growing).unwrap(), pieces);
    let packager = program(&["package", text(&growing), "-o", text(&out), "--live"]).spawn().unwrap();
    appears(&out.join("s0-5.m4s"));
    appears(&out.join("manifest.json"));
    let report = json(&["play", text(&out), "--target-latency", "0.8"]);
    let first = report["gops"][0]["gop"].as_u64().unwrap() as usize;
    assert!((2..=7).contains(&first), "{report:#}");
    is_whole(&report, first);
    writing.join().unwrap();
    assert!(packager.wait_with_output().unwrap().status.success());
}

#[test]
fn a_presentation_that_stops_is_an_error() {
    let directory = common::directory();
    let (pieces, out) = (pieces(), directory.path().join("live"));
    let mut packager =
        program(&["package", "-", "-o", text(&out), "--live"]).stdin(Stdio::piped()).spawn().unwrap();
    let mut stdin = packager.stdin.take().unwrap();
    stdin.write_all(&pieces[..3].concat()).unwrap();
    stdin.flush().unwrap();
    appears(&out.join("manifest.json"));
    let said = common::fail(1, &["play", text(&out), "--patience", "1"]);
    assert!(said.contains("has not grown") && said.contains("ended"), "{said}");
    drop(stdin);
    assert_eq!(packager.wait().unwrap().code(), Some(14));
}

#[test]
fn a_package_that_has_not_ended_gives_a_stream_of_what_is_there() {
    for layout in ["gop", "frame"] {
        let directory = common::directory();
        let (pieces, out) = (pieces(), directory.path().join("live"));
        let mut packager = program(&["package", "-", "-o", text(&out), "--live", "--layout", layout])
            .stdin(Stdio::piped())
            .spawn()
            .unwrap();
        packager.stdin.take().unwrap().write_all(&pieces[..3].concat()).unwrap();
        assert_eq!(packager.wait().unwrap().code(), Some(14));
        let back = directory.path().join("back.gss");
        let said = common::fail(11, &["unpackage", text(&out), "-o", text(&back)]);
        assert!(said.contains("has not ended") && said.contains("--incomplete") && !back.exists(), "{said}");
        let output = common::run(&["unpackage", text(&out), "-o", text(&back), "--incomplete", "--json"]);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && said.contains("has not ended"), "{said}");
        let report: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!((&report["complete"], &report["verified"]), (&false.into(), &false.into()));
        // What is there are the first GOPs, and an end.
        let bytes = fs::read(&back).unwrap();
        let gops = Division::of(&bytes, &Limits::default()).unwrap().gops;
        let pieces = gops.iter().flat_map(|gop| gop.pieces.iter().skip(1));
        let mut pieces = pieces.map(|piece| piece.start as usize..piece.end as usize);
        assert!((2..=3).contains(&gops.len()) && pieces.all(|at| bytes[at.clone()] == stream()[at]));
        assert_eq!(common::json(&["validate", text(&back)])["outcome"], "accept");
        // Without the manifest nobody knows which GOPs are complete.
        fs::remove_file(out.join("manifest.json")).unwrap();
        let said = common::fail(1, &["unpackage", text(&out), "-o", text(&back)]);
        assert!(said.contains("s0-end.m4s") && said.contains("live and has not ended"), "{said}");
    }
}
