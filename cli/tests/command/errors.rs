//! What users are told when something goes wrong: exit code and standard error of every documented case, and the JSON beside
//! it.

use crate::common::{directory, fixture, run, run_with, text};
use serde_json::Value;
use splatstream_files::builtin::BuiltinScene;
use splatstream_files::{ply, spz};
use splatstream_gaussians::GaussianFrame;
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// A frame of a few Gaussians with one value changed.
fn changed(change: impl FnOnce(&mut splatstream_gaussians::Planes)) -> Vec<u8> {
    let frame = BuiltinScene { gaussians: 100, sh_degree: 0, ..BuiltinScene::default() }.frame(0);
    let mut planes = frame.into_planes();
    change(&mut planes);
    ply::write(&GaussianFrame::from_planes(0, planes).unwrap())
}

/// An archive of files.
fn zip_of(files: &[(&str, &[u8])]) -> Vec<u8> {
    let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, content) in files {
        archive.start_file(*name, zip::write::SimpleFileOptions::default()).unwrap();
        std::io::Write::write_all(&mut archive, content).unwrap();
    }
    archive.finish().unwrap().into_inner()
}

/// The files that the cases name.
fn write_files(directory: &Path) {
    let write = |name: &str, bytes: &[u8]| fs::write(directory.join(name), bytes).unwrap();
    let stream = fs::read(fixture()).unwrap();
    write("good.gss", &stream);
    write("cut.gss", &stream[..300]);
    write("empty.gss", &[]);
    let mut damaged = stream.clone();
    damaged[0x30] ^= 1;
    write("damaged.gss", &damaged);
    let mut later = stream.clone();
    later[8] = 9;
    let check = crc32fast::hash(&later[..12]);
    later[12..16].copy_from_slice(&check.to_le_bytes());
    write("later.gss", &later);
    write("good.ply", &changed(|_| ()));
    write("nan.ply", &changed(|planes| planes.position[1][7] = f32::NAN));
    write("loud.ply", &changed(|planes| planes.log_scale[0][3] = 1e9));
    write("far.ply", &changed(|planes| (planes.position[0][3], planes.position[0][9]) = (1e15, -1e16)));
    write("text.ply", b"ply\nformat ascii 1.0\nelement vertex 1\nend_header\n");
    write("short.splat", &[0; 33]);
    write("frames.zip", &zip_of(&[("a.ply", b"ply\nx".as_slice()), ("b.ply", b"")]));
    write("mixed.zip", &zip_of(&[("a.ply", b"".as_slice()), ("b.spz", b"")]));
    write("cut.glb", b"glTF\x02\0\0\0\xff\0\0\0");
    write(
        "meshes.gltf",
        br#"{"asset":{"version":"2.0"},"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{}}]}]}"#,
    );
    write("old.ksplat", &[0; 8192]);
    write("cut.splat4d", b"SP4D\x01\0\0\0\x09\0\0\0{");
    write("notes.txt", b"no scene");
    write("cameras.json", b"[{]");
    let frame = BuiltinScene { gaussians: 100, ..BuiltinScene::default() }.frame(0);
    let packed = spz::write(&frame).unwrap();
    write("cut.spz", &packed[..packed.len() / 2]);
    for (folder, files) in
        [("mixed", &["a.ply", "b.splat"][..]), ("none", &[]), ("stale", &["frame_0001.ply"])]
    {
        fs::create_dir(directory.join(folder)).unwrap();
        files.iter().for_each(|file| write(&format!("{folder}/{file}"), b""));
    }
    fs::create_dir(directory.join("taken.gss")).unwrap();
    let of_other =
        format!("splatstream-finetune-state-1\nencoder: {}\npreset: Small\n", env!("CARGO_PKG_VERSION"));
    for (folder, settings) in [("of-other", of_other.as_str()), ("damaged", "splatstream-finetune-state-1\n")]
    {
        fs::create_dir(directory.join(folder)).unwrap();
        write(&format!("{folder}/settings"), settings.as_bytes());
        write(&format!("{folder}/frame-0000-layer-0.fit"), b"");
    }
}

/// Each is a command line; files are in the directory of the test.
const CASES: &[&str] = &[
    // Files that are not there, or not what they should be.
    "validate no-such.gss",
    "decode no-such.gss --dry-run",
    "encode no-such.ply -o out.gss",
    "compare no-such.ply good.gss",
    "validate good.ply",
    "validate notes.txt",
    "encode good.gss -o out.gss",
    "encode notes.txt -o out.gss",
    "encode text.ply -o out.gss",
    "encode short.splat -o out.gss",
    "encode cut.spz -o out.gss",
    "encode frames.zip -o out.gss",
    "encode frames.zip good.ply -o out.gss",
    "encode mixed.zip -o out.gss",
    "encode cut.glb -o out.gss",
    "encode meshes.gltf -o out.gss",
    "encode old.ksplat -o out.gss",
    "encode cut.splat4d -o out.gss",
    "encode mixed -o out.gss",
    "encode none -o out.gss",
    "encode good.ply none -o out.gss",
    // Streams that are damaged, cut, or of a later version.
    "validate empty.gss",
    "validate cut.gss",
    "validate damaged.gss",
    "validate later.gss",
    "decode cut.gss -o out",
    "extract damaged.gss --op s0,t0,r0 -o out.gss",
    "inspect cut.gss --ops",
    "inspect cut.gss --stats",
    "inspect good.gss --hex 999",
    // Limits.
    "validate good.gss --max-gaussians 10",
    "encode good.ply -o out.gss --max-input-memory 1K",
    "encode good.ply -o out.gss --max-memory 10K",
    "encode good.ply -o out.gss --max-memory 4M",
    "demo --gaussians 1000000 -o first-look --max-memory 64M",
    "chart good.ply --quick -o report --max-memory 1M",
    "train --builtin 1 -o network.bin --max-memory 64M",
    // Values that no stream can have.
    "encode nan.ply -o out.gss",
    "encode loud.ply -o out.gss",
    "encode far.ply -o out.gss",
    // Outputs that would lose something.
    "encode good.ply -o good.ply",
    "encode good.ply -o out.spz",
    "encode good.ply -o taken.gss",
    "encode good.ply -o no-such/out.gss",
    "extract good.gss --op s0,t0,r0 -o good.gss",
    "decode good.gss -o out.gltf",
    "decode good.gss -o out.ksplat",
    "decode good.gss -o out.sog",
    "decode good.gss -o out.png",
    "decode good.gss -o out.ply",
    "decode good.gss -o stale",
    "decode good.gss -o -",
    "decode good.gss -o out.ply --format spz --frames 0..1",
    "render good.gss -o out.png",
    "demo --out good.ply",
    // Options.
    "decode good.gss --dry-run --op r3",
    "decode good.gss --dry-run --op s0,t0,r9",
    "decode good.gss --dry-run --op s0;t0;r0",
    "decode good.gss --dry-run --frames 3..1",
    "decode good.gss --dry-run --frames 9..12",
    "decode good.gss --dry-run --format gltf",
    "encode good.ply -o out.gss --preset best",
    "encode good.ply -o out.gss --quality best",
    "encode good.ply -o out.gss --psnr 7",
    "encode good.ply -o out.gss --refinements 10,20",
    "encode good.ply -o out.gss --layers 1080,540",
    "encode good.ply -o out.gss --fps 0",
    "encode good.ply -o out.gss --up north",
    "encode good.ply -o out.gss --max-input-memory 4GB",
    "encode good.ply -o out.gss --cameras cameras.json",
    "encode good.ply -o out.gss --cameras ring:0",
    "encode good.ply -o out.gss --network no-such.bin",
    "encode good.ply -o out.gss --psnr 40 --target-mb 1",
    // States of fitting to pictures.
    "encode good.ply -o out.gss --finetune-state of-other",
    "encode good.ply -o out.gss --finetune 2 --resume",
    "encode good.ply -o out.gss --finetune 0 --finetune-state new",
    "encode good.ply -o out.gss --finetune 2 --finetune-state of-other",
    "encode good.ply -o out.gss --finetune 2 --finetune-state of-other --resume",
    "encode good.ply -o out.gss --finetune 2 --finetune-state damaged --resume",
    "encode good.ply -o out.gss --finetune 2 --finetune-state good.ply",
    "compare good.ply good.gss --background white",
    "inspect good.gss --dot",
    "inspect good.gss --units --stats",
    "encode good.ply good.ply --each -o out",
    "conformance list --suite no-such",
    "conformance list --suite notes.txt",
    "completions tcsh",
    "unknown",
];

/// What a command says on standard error, without what depends on the machine.
fn said(arguments: &[&str], directory: &Path) -> (i32, String, Vec<u8>) {
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_splatstream"))
        .args(arguments)
        .current_dir(directory)
        .output()
        .unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap().replace(text(directory), "DIR");
    (output.status.code().unwrap(), stderr, output.stdout)
}

#[cfg(unix)]
#[test]
fn every_documented_error_is_said_as_before() {
    let directory = directory();
    write_files(directory.path());
    let mut all = String::new();
    for case in CASES {
        let arguments: Vec<&str> = case.split(' ').collect();
        let (code, stderr, _) = said(&arguments, directory.path());
        assert_ne!(code, 0, "{case}");
        writeln!(all, "$ splatstream {case}\n{}\n[exit code {code}]\n", stderr.trim_end()).unwrap();
        let left = fs::read_dir(directory.path()).unwrap().flatten().map(|entry| entry.file_name());
        assert!(left.into_iter().all(|name| !name.to_string_lossy().starts_with(".splatstream-")), "{case}");
    }
    insta::assert_snapshot!(all);
}

#[test]
fn every_error_is_one_json_value_too() {
    let directory = directory();
    write_files(directory.path());
    for case in CASES {
        let arguments: Vec<&str> = case.split(' ').chain(["--json"]).collect();
        let (code, stderr, stdout) = said(&arguments, directory.path());
        assert!(!stderr.is_empty(), "{case}: people are told too");
        let value: Value = serde_json::from_slice(&stdout).unwrap_or_else(|error| panic!("{case}: {error}"));
        // A report that says it is enough.
        if let Some(error) = value.get("error").filter(|error| error.get("exit_code").is_some()) {
            assert_eq!(error["exit_code"], code, "{case}");
            let message = error["message"].as_str().unwrap();
            assert!(stderr.contains(message.lines().next().unwrap()), "{case}: {message}");
        } else {
            assert!(code >= 10, "{case}: {value}");
        }
    }
}

#[cfg(target_os = "linux")]
#[test]
fn full_and_closed_outputs_are_said() {
    let directory = directory();
    write_files(directory.path());
    let mut all = String::new();
    for case in [
        "decode good.gss -o /dev/full --frames 0..1 --format ply",
        "extract good.gss --op s0,t0,r0 -o /dev/full",
        "extract good.gss --op s0,t0,r0 -o /proc/out.gss",
        "encode good.ply -o /dev/full --preset fast --psnr 40",
    ] {
        let arguments: Vec<&str> = case.split(' ').collect();
        let (code, stderr, _) = said(&arguments, directory.path());
        assert_ne!(code, 0, "{case}");
        writeln!(all, "$ splatstream {case}\n{}\n[exit code {code}]\n", stderr.trim_end()).unwrap();
    }
    insta::assert_snapshot!(all);
}

/// What a program ends with, and says, that prints to a full disk.
#[cfg(target_os = "linux")]
fn printed_to_a_full_disk(arguments: &[&str], directory: &Path) -> (i32, String) {
    let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_splatstream"))
        .args(arguments)
        .current_dir(directory)
        .stdout(full)
        .output()
        .unwrap();
    (output.status.code().unwrap(), String::from_utf8(output.stderr).unwrap())
}

#[cfg(target_os = "linux")]
#[test]
fn what_cannot_be_printed_is_a_failure() {
    let directory = directory();
    write_files(directory.path());
    let commands = splatstream_commands();
    let helps = commands.iter().flat_map(|command| {
        [format!("{command} --help"), format!("{command} -h"), format!("help {command}")]
    });
    let others = ["--help", "-h", "help", "--version", "-V", "completions bash", "completions bash --json"]
        .into_iter()
        .chain(["manual -o pages", "manual -o pages --json", "validate good.gss", "inspect good.gss --units"])
        .chain(["conformance run --help", "decode good.gss --dry-run"]);
    for line in others.map(str::to_owned).chain(helps) {
        let (code, said) = printed_to_a_full_disk(&line.split(' ').collect::<Vec<_>>(), directory.path());
        assert_eq!(
            (code, said.as_str()),
            (1, "cannot write to standard output: No space left on device (os error 28)\n"),
            "{line}"
        );
    }
}

/// The names of all commands, from the help.
#[cfg(target_os = "linux")]
fn splatstream_commands() -> Vec<String> {
    let help = crate::common::succeed(&["--help"]);
    let list = help.split("Commands:\n").nth(1).unwrap().split("\n\n").next().unwrap();
    let names = list.lines().filter_map(|line| line.strip_prefix("  ")?.split(' ').next());
    let names: Vec<String> =
        names.filter(|name| !name.is_empty() && *name != "help").map(str::to_owned).collect();
    assert!(names.len() > 20, "{names:?}");
    names
}

/// Commands that read standard input only where they can: what they say otherwise.
#[test]
fn standard_input_that_is_not_read_is_refused_with_one_text() {
    let directory = directory();
    write_files(directory.path());
    for case in [
        "fit - -o out.ply",
        "play -",
        "serve -",
        "unpackage - -o out.gss",
        "concat - good.gss -o out.gss",
        "track good.ply -o out --cameras -",
        "compare good.ply good.ply --cameras -",
        "compare good.ply good.ply --cameras ring:2 --st-lpips -",
        "render good.ply -o out --camera -",
        "play . --trace -",
        "encode good.ply -o out.gss --network -",
        "encode good.ply -o out.gss --plan - --shard 1/2",
        "chart good.ply -o out --quick --peers -",
        "conformance list --suite -",
        "conformance matrix - -o out.md",
        "conformance packages --packages -",
        "conformance run --capabilities -",
    ] {
        let (code, stderr, _) = said(&case.split(' ').collect::<Vec<_>>(), directory.path());
        let text = "-: this command cannot read that from standard input; give a file or a directory\n";
        assert_eq!((code, stderr.as_str()), (1, text), "{case}");
    }
}

#[test]
fn bytes_on_standard_input_that_are_nothing_are_refused() {
    let mut all = String::new();
    for case in ["validate -", "inspect - --units", "encode - -o out.gss", "compare - -"] {
        let arguments: Vec<&str> = case.split(' ').collect();
        let output = run_with(&arguments, b"neither a scene nor a stream");
        let stderr = String::from_utf8(output.stderr).unwrap();
        writeln!(
            all,
            "$ splatstream {case}\n{}\n[exit code {}]\n",
            stderr.trim_end(),
            output.status.code().unwrap()
        )
        .unwrap();
    }
    insta::assert_snapshot!(all);
    assert!(run(&["validate"]).stdout.is_empty());
}

/// The command waits for the rest of its input when it is interrupted.
#[cfg(unix)]
#[test]
fn who_asked_for_json_is_told_of_an_interruption() {
    use std::process::{Command, Stdio};
    let directory = directory();
    let frame = BuiltinScene { gaussians: 20_000, sh_degree: 0, ..BuiltinScene::default() }.frame(0);
    let mut child = Command::new(env!("CARGO_BIN_EXE_splatstream"))
        .args(["encode", "-", "-o", text(&directory.path().join("scene.gss")), "--json"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // More than a pipe holds: when all is written, the command reads.
    let scene = ply::write(&frame);
    assert!(scene.len() > 1 << 20);
    let mut input = child.stdin.take().unwrap();
    std::io::Write::write_all(&mut input, &scene).unwrap();
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    drop(input);
    assert_eq!(output.status.code(), Some(130), "{output:?}");
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(
        (&report["error"]["kind"], &report["error"]["exit_code"]),
        (&"interrupted".into(), &130.into())
    );
    assert!(String::from_utf8_lossy(&output.stderr).starts_with("interrupted: "));
}

#[test]
fn frames_of_two_scenes_are_told_apart_where_one_is_out_of_reach() {
    let directory = directory();
    let frames = directory.path().join("frames");
    fs::create_dir(&frames).unwrap();
    fs::write(frames.join("frame_0.ply"), changed(|_| ())).unwrap();
    let other = changed(|planes| {
        planes.log_scale.iter_mut().flatten().for_each(|value| *value -= 40_000.0);
        planes.position.iter_mut().flatten().for_each(|value| *value *= 50.0);
    });
    fs::write(frames.join("frame_1.ply"), other).unwrap();
    let output = run(&["encode", text(&frames), "-o", text(&directory.path().join("scene.gss"))]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("taken for the frames of one sequence") && said.contains("--each"), "{said}");
}

#[test]
fn a_frame_that_a_directory_seems_to_lack_is_a_warning() {
    let directory = directory();
    let frames = directory.path().join("frames");
    fs::create_dir(&frames).unwrap();
    for number in [0, 1, 3] {
        fs::write(frames.join(format!("frame_{number:04}.ply")), changed(|_| ())).unwrap();
    }
    let stream = directory.path().join("scene.gss");
    let output = run(&["encode", text(&frames), "-o", text(&stream), "--preset", "fast", "--json"]);
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    let warnings = report["warnings"].as_array().unwrap();
    assert!(warnings.iter().any(|warning| warning["code"] == "missing-frames"), "{report}");
}
