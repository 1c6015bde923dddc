//! What commands write: whole files under the names that they were given, in the place of nothing that somebody needs.

use crate::common::{directory, fail, json, run, run_with, succeed, text, write_still, write_stream};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// A directory with a scene, and a stream of three frames.
fn files() -> (TempDir, PathBuf, PathBuf) {
    let directory = directory();
    let stream = write_stream(directory.path());
    let still = write_still(directory.path());
    (directory, still, stream)
}

/// The names in a directory.
fn names(directory: &Path) -> Vec<String> {
    let name = |entry: std::io::Result<fs::DirEntry>| entry.unwrap().file_name().into_string().unwrap();
    let mut names: Vec<String> = fs::read_dir(directory).unwrap().map(name).collect();
    names.sort();
    names
}

#[cfg(unix)]
#[test]
fn no_output_replaces_an_input() {
    let (directory, still, stream) = files();
    let (link, hard) = (directory.path().join("link.gss"), directory.path().join("hard.gss"));
    std::os::unix::fs::symlink(&stream, &link).unwrap();
    fs::hard_link(&stream, &hard).unwrap();
    let before = fs::read(&stream).unwrap();
    for out in [&stream, &link, &hard] {
        let said = fail(2, &["extract", text(&stream), "--op", "s0,t0,r0", "-o", text(out)]);
        assert!(said.contains("this command reads that file"), "{said}");
    }
    let (scene, frame) = (directory.path().join("scene.gss"), directory.path().join("frame.ply"));
    fs::hard_link(&still, &scene).unwrap();
    fail(2, &["encode", text(&still), "-o", text(&scene), "--preset", "fast"]);
    fs::hard_link(&stream, &frame).unwrap();
    fail(2, &["decode", text(&stream), "-o", text(&frame), "--frames", "0..1"]);
    let frames = directory.path().join("out");
    fs::create_dir(&frames).unwrap();
    fs::hard_link(&stream, frames.join("frame_0001.ply")).unwrap();
    fail(2, &["decode", text(&stream), "-o", text(&frames), "--force"]);
    assert_eq!(fs::read(&stream).unwrap(), before);
    assert_eq!(names(&frames), ["frame_0001.ply"]);
}

/// The bytes of every file in a directory and below it, by path.
fn contents(directory: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut contents = BTreeMap::new();
    for path in fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().path()) {
        match path.is_dir() {
            true => contents.extend(self::contents(&path)),
            false => _ = contents.insert(path.clone(), fs::read(&path).unwrap()),
        }
    }
    contents
}

#[test]
fn no_file_that_belongs_to_an_input_is_replaced() {
    let (directory, still, stream) = files();
    let at = |name: &str| directory.path().join(name).to_str().unwrap().to_owned();
    let (package, capture, trace, start) = (at("package"), at("capture"), at("t.json"), at("st.ply"));
    succeed(&["package", text(&stream), "-o", &package]);
    let small = ["--views", "3", "--height", "27", "--samples", "1", "--points", "200"];
    succeed(&[&["simulate", "-o", &capture][..], &small].concat());
    fs::write(&trace, "t_s,mbps\n0,100\n").unwrap();
    fs::copy(at("frames/f8.ply"), &start).unwrap();
    fs::hard_link(format!("{package}/manifest.mpd"), at("linked.json")).unwrap();
    fs::hard_link(format!("{package}/manifest.json"), at("linked.gss")).unwrap();
    let sog = directory.path().join("sog");
    fs::create_dir(&sog).unwrap();
    fs::write(sog.join("meta.json"), "{}").unwrap();
    fs::write(sog.join("means_l.webp"), "no picture").unwrap();
    fs::hard_link(sog.join("means_l.webp"), at("picture.gss")).unwrap();
    let before = contents(directory.path());
    let (cameras, points) = (format!("{capture}/transforms.json"), format!("{capture}/sparse_pc.ply"));
    let (manifest, images) = (format!("{package}/manifest.json"), format!("{capture}/images"));
    let (frames, frame) = (at("frames"), at("frames/f8.ply"));
    fs::hard_link(&frame, at("linked.bin")).unwrap();
    let cases: [&[&str]; 11] = [
        &["play", &package, "--no-wait", "-o", &manifest],
        &["play", &manifest, "--no-wait", "-o", &manifest],
        &["play", &package, "--no-wait", "-o", &at("linked.json")],
        &["play", &package, "--trace", &trace, "-o", &trace],
        &["unpackage", &package, "-o", &at("linked.gss")],
        &["train", &frames, "--builtin", "1", "-o", &at("linked.bin")],
        &["fit", &capture, "-o", &points],
        &["fit", &capture, "--start", &start, "-o", &start],
        &["fit", &capture, "--start", &frame, "-o", &frame],
        &["render", text(&still), "--cameras", &cameras, "-o", &images],
        &["encode", text(&sog), "-o", &at("picture.gss")],
    ];
    for case in cases {
        let said = fail(2, case);
        assert!(said.contains("this command reads that file"), "{case:?}: {said}");
    }
    fs::remove_file(at("linked.bin")).unwrap();
    assert!(contents(directory.path()) == before);
}

#[cfg(unix)]
#[test]
fn links_devices_and_modes_stay() {
    use std::os::unix::fs::{FileTypeExt, PermissionsExt, symlink};
    let (directory, _, stream) = files();
    let (link, target) = (directory.path().join("link.gss"), directory.path().join("target.gss"));
    let extract = |out: &Path| run(&["extract", text(&stream), "--op", "s0,t0,r0", "-o", text(out)]);
    // Through a link to nothing, and to a file with a mode of its own.
    symlink("target.gss", &link).unwrap();
    assert!(extract(&link).status.success());
    fs::set_permissions(&target, fs::Permissions::from_mode(0o600)).unwrap();
    assert!(extract(&link).status.success());
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!(fs::metadata(&target).unwrap().permissions().mode() & 0o777, 0o600);
    // Devices take what is written to them.
    let full = extract(Path::new("/dev/full"));
    assert_eq!(full.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&full.stderr).contains("make room"), "{full:?}");
    assert!(extract(Path::new("/dev/null")).status.success());
    for device in ["/dev/full", "/dev/null"] {
        assert!(fs::metadata(device).unwrap().file_type().is_char_device(), "{device}");
    }
    assert_eq!(extract(directory.path()).status.code(), Some(1));
}

#[test]
fn names_say_what_is_written() {
    let (directory, still, stream) = files();
    let before = names(directory.path());
    let at = |name: &str| directory.path().join(name);
    for name in ["o.gltf", "o.ksplat", "o.splatv", "o.png"] {
        let said = fail(2, &["decode", text(&stream), "-o", text(&at(name)), "--frames", "0..1"]);
        assert!(said.contains(".glb, .sog or .compressed.ply") && said.contains("directory in /"), "{said}");
    }
    for name in ["x.spz", "x.ply"] {
        let said = fail(2, &["encode", text(&still), "-o", text(&at(name))]);
        assert!(said.contains("ends in .gss"), "{said}");
        fail(2, &["extract", text(&stream), "--op", "s0,t0,r0", "-o", text(&at(name))]);
    }
    let report = at("report.json");
    let others: [(&[&str], &str, &str); 6] = [
        (&["view", text(&stream), "-o"], "x.pdf", ".html"),
        (&["conformance", "matrix", text(&report), "-o"], "x.exe", ".md"),
        (&["conformance", "run", "--report"], "x.txt", ".json"),
        (&["conformance", "run", "--junit"], "x.json", ".xml"),
        (&["train", "--builtin", "1", "-o"], "x.ply", ".bin"),
        (&["play", text(directory.path()), "-o"], "x.txt", ".json"),
    ];
    for (command, name, ending) in others {
        let said = fail(2, &[command, &[text(&at(name))]].concat());
        assert!(said.contains(&format!("give it a name that ends in {ending}")), "{said}");
    }
    let said = fail(2, &["render", text(&stream), "-o", text(&at("x.png")), "--height", "20"]);
    assert!(said.contains("looks like the name of a file"), "{said}");
    fail(2, &["render", text(&stream), "-o", "-", "--height", "20"]);
    fail(2, &["chart", text(&still), "-o", text(&at("x.html"))]);
    assert_eq!(names(directory.path()), before);
    // Who means it gets it.
    let out = at("run.2/");
    succeed(&["decode", text(&stream), "-o", text(&out), "--frames", "0..1"]);
    assert_eq!(names(&out), ["frame_0000.ply"]);
}

#[test]
fn a_dash_is_a_pipe() {
    let (directory, still, stream) = files();
    let bytes = fs::read(&stream).unwrap();
    let file = directory.path().join("file");
    let part = ["extract", "-", "--op", "s0,t0,r0", "-o", "-"];
    succeed(&["extract", text(&stream), "--op", "s0,t0,r0", "-o", text(&file)]);
    assert_eq!(run_with(&part, &bytes).stdout, fs::read(&file).unwrap());
    let frame = ["decode", "-", "-o", "-", "--frames", "1..2", "--format", "spz"];
    let decoded = run_with(&frame, &bytes);
    assert!(decoded.status.success() && decoded.stdout.starts_with(&[0x1f, 0x8b]), "{decoded:?}");
    assert!(String::from_utf8_lossy(&decoded.stderr).contains("1 of 3"), "the report is beside it");
    let encode = ["encode", "-", "-o", "-", "--preset", "fast", "--psnr", "40"];
    let encoded = run_with(&encode, &fs::read(&still).unwrap());
    assert!(encoded.stdout.starts_with(b"\x89GSS"), "{encoded:?}");
    for arguments in [&["validate", "-"][..], &["inspect", "-"], &["compare", "-", text(&stream)]] {
        assert!(run_with(arguments, &bytes).status.success(), "{arguments:?}");
    }
    // Two things do not go through one pipe.
    fail(2, &["decode", text(&stream), "-o", "-"]);
    fail(2, &["extract", text(&stream), "--op", "s0,t0,r0", "-o", "-", "--json"]);
    fail(2, &["compare", "-", "-"]);
    assert!(!Path::new("-").exists());
    let wrong = run_with(&["encode", "-", "-o", text(&file)], b"no scene");
    assert!(String::from_utf8_lossy(&wrong.stderr).starts_with("standard input: "), "{wrong:?}");
}

#[cfg(unix)]
#[test]
fn an_input_without_an_end_is_refused() {
    let (directory, still, stream) = files();
    let program = env!("CARGO_BIN_EXE_splatstream");
    // Less memory than the file has bytes: it cannot be held as a whole.
    let run =
        |line: &str| Command::new("sh").args(["-c", &format!("ulimit -v 3000000; {line}")]).output().unwrap();
    let (holey, out) = (directory.path().join("holey.gss"), directory.path().join("out.gss"));
    fs::copy(&stream, &holey).unwrap();
    fs::OpenOptions::new().write(true).open(&holey).unwrap().set_len(6 << 30).unwrap();
    let (holey, out) = (text(&holey), text(&out));
    for (code, line) in [
        (10, format!("{program} validate {holey}")),
        (10, format!("{program} extract {holey} --op s0,t0,r0 -o {out}")),
        (10, format!("{program} validate - <{holey}")),
    ] {
        let ended = run(&line);
        assert_eq!(ended.status.code(), Some(code), "{line}: {ended:?}");
    }
    let (package, trace) = (directory.path().join("package"), directory.path().join("trace.csv"));
    succeed(&["package", text(&stream), "-o", text(&package)]);
    let huge = |path: &Path, bytes: u64| {
        fs::OpenOptions::new().create(true).append(true).open(path).unwrap().set_len(bytes).unwrap();
    };
    huge(&trace, 1 << 32);
    let (played, trace) = (text(&package), text(&trace));
    let plan = format!("--plan={trace}");
    for arguments in [
        ["play", played, "--trace", trace],
        ["play", played, "--trace", "/dev/zero"],
        ["chart", text(&still), "--peers", trace],
        ["encode", text(&still), "--shard=1/1", &plan],
    ] {
        let name = match arguments[0] {
            "play" => "out.json",
            "chart" => "report",
            _ => "out.gss",
        };
        let said = fail(1, &[&arguments[..], &["-o", text(&directory.path().join(name))]].concat());
        assert!(said.contains("more than 268435456 bytes"), "{said}");
    }
    huge(&package.join("s0.mp4"), 9 << 30);
    let said = fail(1, &["unpackage", played, "-o", out]);
    assert!(said.contains("at most 8,589,934,592 are read"), "{said}");
    let head = text(&still);
    for (line, said) in [
        (format!("{program} encode - -o {out} </dev/zero"), "no known scene format"),
        (
            format!("cat {head} /dev/zero | {program} encode - -o {out} --max-input-memory 4M"),
            "it has more than 4194304 bytes",
        ),
    ] {
        let ended = run(&line);
        let stderr = String::from_utf8_lossy(&ended.stderr);
        assert_eq!(ended.status.code(), Some(1), "{line}: {stderr}");
        assert!(stderr.starts_with("standard input: ") && stderr.contains(said), "{stderr}");
    }
}

#[test]
fn frames_of_an_earlier_run_are_not_mixed_with_new_ones() {
    let (directory, _, stream) = files();
    let out = directory.path().join("out");
    succeed(&["decode", text(&stream), "-o", text(&out)]);
    for name in ["notes.txt", "frame_12.ply", "frame_0009.spz"] {
        fs::write(out.join(name), "mine").unwrap();
    }
    let again = ["decode", text(&stream), "-o", text(&out), "--frames", "0..2"];
    let said = fail(2, &again);
    assert!(said.contains("has 4 files with names of frames") && said.contains("--force"), "{said}");
    json(&[&again[..], &["--force"]].concat());
    assert_eq!(names(&out), ["frame_0000.ply", "frame_0001.ply", "frame_12.ply", "notes.txt"]);
}

#[test]
fn pictures_of_an_earlier_run_are_not_mixed_with_new_ones() {
    let (directory, still, stream) = files();
    let out = directory.path().join("pictures");
    let render = ["render", "-o", text(&out), "--height", "9", "--camera"];
    succeed(&[&render[..], &["ring:2", text(&stream)]].concat());
    for name in ["notes.txt", "logo.png", "frame_0001.png", "ring_a.png"] {
        fs::write(out.join(name), "mine").unwrap();
    }
    let again = [&render[..], &["ring:1", text(&still)]].concat();
    let said = fail(2, &again);
    assert!(said.contains("has 6 files with names of pictures") && said.contains("--force"), "{said}");
    succeed(&[&again[..], &["--force"]].concat());
    assert_eq!(names(&out), ["frame_0001.png", "logo.png", "notes.txt", "ring_00.png", "ring_a.png"]);
    // The names of cameras in a file are those of their pictures, too.
    let capture = directory.path().join("capture");
    let cameras = capture.join("transforms.json");
    let small = ["simulate", "-o", text(&capture), "--views", "2", "--height", "27"];
    succeed(&[&small[..], &["--samples", "1", "--points", "50"]].concat());
    let seen = directory.path().join("seen");
    let of_file = ["render", text(&still), "-o", text(&seen), "--height", "9", "--camera", text(&cameras)];
    succeed(&of_file);
    fs::write(seen.join("logo.png"), "mine").unwrap();
    assert!(fail(2, &of_file).contains("has 2 files with names of pictures"));
    succeed(&[&of_file[..], &["--force"]].concat());
    assert_eq!(names(&seen), ["logo.png", "view_000.png", "view_001.png"]);
    // Photographs stay, whatever is asked for.
    let images = capture.join("images");
    fail(2, &["render", text(&still), "--camera", text(&cameras), "-o", text(&images), "--force"]);
    // So do cameras that are given by their directory.
    let plan = ["encode", text(&still), "--cameras", text(&capture), "--write-plan", "-o", text(&cameras)];
    assert!(fail(2, &plan).contains("transforms.json"));
    assert_eq!(names(&images), ["view_000.png", "view_001.png"]);
}

#[test]
fn captures_of_an_earlier_run_are_not_mixed_with_new_ones() {
    let directory = directory();
    let out = directory.path().join("walk");
    let small = ["--height", "27", "--samples", "1", "--points", "200"];
    let simulate = ["simulate", "-o", text(&out)];
    let of = |more: &[&'static str]| [&simulate[..], &small, more].concat();
    succeed(&of(&["--frames", "3", "--views", "4"]));
    fs::write(out.join("frame_0002/notes.txt"), "mine").unwrap();
    let said = fail(2, &of(&["--frames", "2", "--views", "3"]));
    assert!(said.contains("has 27 files with names of captures") && said.contains("--force"), "{said}");
    succeed(&of(&["--frames", "2", "--views", "3", "--force"]));
    assert_eq!(names(&out), ["frame_0000", "frame_0001", "frame_0002"]);
    assert_eq!(names(&out.join("frame_0002")), ["notes.txt"]);
    assert_eq!(names(&out.join("frame_0000/images")), ["view_000.png", "view_001.png", "view_002.png"]);
    // Frames that are trained of them, too.
    let frames = directory.path().join("frames");
    let fit = [
        "fit",
        text(&out),
        "-o",
        text(&frames),
        "--iterations",
        "1",
        "--gaussians",
        "100",
        "--hold-out",
        "0",
    ];
    succeed(&fit);
    let one = [&fit[..], &["--frames", "0..1"]].concat();
    assert!(fail(2, &one).contains("has 2 files with names of frames"));
    succeed(&[&one[..], &["--force"]].concat());
    assert_eq!(names(&frames), [".fit-settings.json", "frame_0000.ply"]);
}

/// Whether a process has a file open in a directory, with or without a name.
#[cfg(target_os = "linux")]
fn is_writing(process: u32, directory: &Path) -> bool {
    let open = fs::read_dir(format!("/proc/{process}/fd")).into_iter().flatten().flatten();
    open.filter_map(|entry| fs::read_link(entry.path()).ok()).any(|file| file.starts_with(directory))
}

#[cfg(all(unix, not(target_os = "linux")))]
fn is_writing(_process: u32, directory: &Path) -> bool {
    names(directory).iter().any(|name| name.starts_with(".splatstream-"))
}

/// Starts a long encoding in a directory, and gives it back once its unfinished file is there.
#[cfg(unix)]
fn encoding(directory: &Path, still: &Path) -> std::process::Child {
    let child = Command::new(env!("CARGO_BIN_EXE_splatstream"))
        .args(["encode", text(still), "-o", text(&directory.join("out.gss")), "--preset", "small"])
        .stderr(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let start = Instant::now();
    while !is_writing(child.id(), directory) {
        assert!(start.elapsed() < Duration::from_secs(20), "it never began to write");
        std::thread::sleep(Duration::from_millis(2));
    }
    child
}

#[cfg(unix)]
#[test]
fn signals_leave_nothing_behind() {
    let (directory, still, _) = files();
    for signal in ["INT", "TERM", "HUP"] {
        let out = directory.path().join(signal);
        fs::create_dir(&out).unwrap();
        fs::write(out.join("out.gss"), "old").unwrap();
        let child = encoding(&out, &still);
        let id = child.id().to_string();
        assert!(Command::new("kill").args([&format!("-{signal}"), &id]).status().unwrap().success());
        let ended = child.wait_with_output().unwrap();
        assert_eq!(ended.status.code(), Some(130), "{ended:?}");
        assert_eq!(names(&out), ["out.gss"]);
        assert_eq!(fs::read(out.join("out.gss")).unwrap(), b"old");
    }
}

/// What a program cannot notice leaves nothing behind either: the file has no name until it is whole.
#[cfg(target_os = "linux")]
#[test]
fn a_program_that_is_killed_leaves_nothing_behind() {
    let (directory, still, _) = files();
    let out = directory.path().join("killed");
    fs::create_dir(&out).unwrap();
    let child = encoding(&out, &still);
    let id = child.id().to_string();
    assert!(Command::new("kill").args(["-KILL", &id]).status().unwrap().success());
    assert_eq!(child.wait_with_output().unwrap().status.code(), None);
    assert!(names(&out).is_empty(), "{:?}", names(&out));
}

#[cfg(target_os = "linux")]
#[test]
fn where_nothing_can_be_written_nothing_is_left_and_no_other_name_is_told() {
    let (_directory, _, stream) = files();
    let said = fail(1, &["extract", text(&stream), "--op", "s0,t0,r0", "-o", "/proc/out.gss"]);
    assert!(said.starts_with("/proc/out.gss: cannot write") && !said.contains(".splatstream-"), "{said}");
}

#[cfg(unix)]
#[test]
fn a_full_disk_leaves_nothing_behind() {
    let (directory, _, stream) = files();
    let out = directory.path().join("out");
    fs::create_dir(&out).unwrap();
    // A limit of no bytes for files does what a full disk does: writing fails.
    let program = env!("CARGO_BIN_EXE_splatstream");
    let (stream, file) = (text(&stream), out.join("a.gss"));
    let line = format!(
        "trap '' XFSZ; ulimit -f 0; exec {program} extract {stream} --op s0,t0,r4 -o {}",
        text(&file)
    );
    let ended = Command::new("sh").args(["-c", &line]).output().unwrap();
    assert_eq!(ended.status.code(), Some(1), "{ended:?}");
    assert!(names(&out).is_empty(), "{:?}", names(&out));
}
