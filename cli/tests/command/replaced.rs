//! A file that is there under the name of an output: it stays as it was where the command fails, and is replaced where the
//! command succeeds.

use crate::common::{directory, fail, run, succeed, text, write_frames, write_still};
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// What is in a file before a command writes it.
const OLD: &str = "of an earlier run";

/// Commands that replace files: their lines, and one of the files of each.
const REPLACING: [(&str, &str); 19] = [
    ("encode still.ply -o out.gss --preset fast --psnr 30", "out.gss"),
    ("encode still.ply -o out.html --preset fast --psnr 30", "out.html"),
    ("encode frames --write-plan -o out.json --preset fast --psnr 30 --gop 2", "out.json"),
    ("encode frames --shard 1/2 -o out.gss --preset fast --psnr 30 --gop 2", "out.gss"),
    ("encode still.ply --each -o out --preset fast --psnr 30", "out/still.gss"),
    ("decode talk.gss -o out.ply --frames 0..1", "out.ply"),
    ("decode talk.gss -o out.sog --frames 0..1", "out.sog"),
    ("extract talk.gss --op s0,t0,r0 -o out.gss", "out.gss"),
    ("concat talk.gss talk.gss -o out.gss", "out.gss"),
    ("unpackage package -o out.gss", "out.gss"),
    ("view talk.gss -o out.html", "out.html"),
    ("play package --no-wait -o out.json", "out.json"),
    ("train --builtin 1 --frames 2 --quality low -o out.bin", "out.bin"),
    ("fit capture -o out.ply --iterations 1 --gaussians 100 --hold-out 0", "out.ply"),
    ("chart still.ply -o out --quick --qualities low --cameras ring:1 --height 20", "out/points.csv"),
    ("demo -o out --gaussians 100 --frames 2", "out/demo.gss"),
    ("manual -o out", "out/splatstream.1"),
    ("conformance run --suite SUITE --report out.json --filter codebook-two-*", "out.json"),
    ("conformance matrix report.json -o out.md", "out.md"),
];

/// Commands whose names say nothing to whom they belong: they refuse a directory with files of such names, unless they are to
/// replace them.
const REFUSING: [(&str, &str); 6] = [
    ("decode talk.gss -o out", "out/frame_0000.ply"),
    ("render still.ply -o out --camera ring:1 --height 9", "out/ring_00.png"),
    ("track frames -o out --cameras ring:2 --views 1 --height 32 --iterations 1 --all", "out/frame_0000.ply"),
    ("simulate -o out --views 2 --height 18 --samples 1 --points 50", "out/transforms.json"),
    (
        "fit walk -o out --iterations 1 --warm --warm-iterations 1 --gaussians 100 --hold-out 0",
        "out/frame_0000.ply",
    ),
    ("package talk.gss -o out", "out/manifest.json"),
];

/// The same with much to do, and a file of an earlier run that the new one has none in the place of.
#[cfg(unix)]
const LONG: [(&str, &str); 5] = [
    ("decode long.gss -o out --format sog", "out/frame_9999.ply"),
    ("render still.ply -o out --camera ring:1000 --height 540", "out/ring_1234.png"),
    ("track frames -o out --cameras ring:2 --iterations 1000000 --all", "out/frame_0009.ply"),
    ("simulate -o out --views 100", "out/images/view_999.png"),
    ("fit walk -o out --iterations 1 --warm --warm-iterations 1000000 --gaussians 100", "out/frame_0009.ply"),
];

/// The streams, frames and so on that the cases read.
fn write_inputs(directory: &Path) {
    write_frames(directory);
    write_still(directory);
    let at = |name: &str| text(&directory.join(name)).to_owned();
    let (frames, talk) = (at("frames"), at("talk.gss"));
    succeed(&["encode", &frames, "-o", &talk, "--preset", "fast", "--psnr", "30", "--gop", "2"]);
    succeed(&["package", &talk, "-o", &at("package")]);
    let small = ["--views", "3", "--height", "27", "--samples", "1", "--points", "100"];
    succeed(&[&["simulate", "-o", &at("capture")][..], &small].concat());
    succeed(&[&["simulate", "--frames", "2", "-o", &at("walk")][..], &small].concat());
    let suite = format!("conformance run --suite {} --filter codebook-two-*", suite());
    let report = at("report.json");
    succeed(&suite.split(' ').chain(["--report", &report]).collect::<Vec<_>>());
}

fn suite() -> String {
    text(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../conformance/vectors")).to_owned()
}

/// What is in a directory and below it, but for files of one name.
fn others(directory: &Path, file: &Path) -> Vec<String> {
    let mut found = Vec::new();
    for path in fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().path()) {
        match path.is_dir() {
            true => found.extend(others(&path, file)),
            false if path == file => {}
            false => found.push(path.display().to_string()),
        }
    }
    found.sort();
    found
}

/// Writes the inputs and then, case by case, a file of an earlier run that the case would write; gives the directory, and the file.
fn with_earlier(cases: &[(&str, &str)], check: impl Fn(&Path, &str, &Path)) {
    let directory = directory();
    write_inputs(directory.path());
    for (line, name) in cases {
        let file = directory.path().join(name);
        fs::create_dir_all(file.parent().unwrap()).unwrap();
        fs::write(&file, OLD).unwrap();
        check(directory.path(), &line.replace("SUITE", &suite()), &file);
        // The next case finds nothing of this one.
        fs::remove_file(&file).unwrap();
        let _none = fs::remove_dir_all(directory.path().join("out"));
    }
}

/// Runs a line in a directory where files may have no bytes, which does what a full disk does, or any.
#[cfg(unix)]
fn run_in(directory: &Path, line: &str, is_full: bool) -> Output {
    let program = env!("CARGO_BIN_EXE_splatstream");
    let limit = if is_full { "trap '' XFSZ; ulimit -f 0;" } else { "" };
    // Patterns are for the command, not for the shell.
    let script = format!("set -f; {limit} exec {program} {line}");
    Command::new("sh").args(["-c", &script]).current_dir(directory).output().unwrap()
}

#[cfg(unix)]
#[test]
fn an_earlier_file_stays_where_writing_fails_and_is_replaced_where_it_does_not() {
    with_earlier(&REPLACING, |directory, line, file| {
        let before = others(directory, file);
        let failed = run_in(directory, line, true);
        assert_eq!(failed.status.code(), Some(1), "{line}: {failed:?}");
        assert_eq!(fs::read_to_string(file).unwrap_or_default(), OLD, "{line}: {failed:?}");
        assert_eq!(others(directory, file), before, "{line}");
        let done = run_in(directory, line, false);
        assert!(done.status.success(), "{line}: {done:?}");
        assert!(fs::read(file).unwrap() != OLD.as_bytes(), "{line}");
    });
}

#[cfg(unix)]
#[test]
fn files_with_names_of_an_earlier_run_are_refused_and_replaced_where_that_is_asked_for() {
    with_earlier(&REFUSING, |directory, line, file| {
        let refused = run_in(directory, line, false);
        assert_eq!(refused.status.code(), Some(2), "{line}: {refused:?}");
        assert!(String::from_utf8_lossy(&refused.stderr).contains("--force"), "{line}: {refused:?}");
        assert_eq!(fs::read_to_string(file).unwrap_or_default(), OLD, "{line}");
        let done = run_in(directory, &format!("{line} --force"), false);
        assert!(done.status.success(), "{line}: {done:?}");
        assert!(fs::read(file).unwrap() != OLD.as_bytes(), "{line}");
        assert_eq!(hidden(&directory.join("out")), 0, "{line}");
    });
}

/// Files of an earlier run stay where a run that is to replace them fails: as files cannot be written, or as the stream has an
/// error. Nothing of that run stays.
#[cfg(unix)]
#[test]
fn files_of_an_earlier_run_stay_where_the_next_one_fails() {
    with_earlier(&REFUSING, |directory, line, file| {
        let before = others(directory, file);
        let failed = run_in(directory, &format!("{line} --force"), true);
        assert_eq!(failed.status.code(), Some(1), "{line}: {failed:?}");
        assert_eq!(fs::read_to_string(file).unwrap_or_default(), OLD, "{line}: {failed:?}");
        assert_eq!(others(directory, file), before, "{line}");
        assert!(!String::from_utf8_lossy(&failed.stderr).contains(".splatstream-"), "{failed:?}");
        // Of a stream whose last frame is damaged there are frames to write, but not all.
        if !line.contains("talk.gss") {
            return;
        }
        let mut damaged = fs::read(directory.join("talk.gss")).unwrap();
        let at = damaged.len() * 4 / 5;
        damaged[at] ^= 1;
        fs::write(directory.join("damaged.gss"), damaged).unwrap();
        let line = line.replace("talk.gss", "damaged.gss");
        let before = others(directory, file);
        for line in [&line, &line.replace("decode", "render --camera ring:1 --height 9")] {
            fs::write(directory.join("out/frame_0000_ring_00.png"), OLD).unwrap();
            let failed = run_in(directory, &format!("{line} --force"), false);
            fs::remove_file(directory.join("out/frame_0000_ring_00.png")).unwrap();
            assert!(failed.status.code().is_some_and(|code| code >= 10), "{line}: {failed:?}");
            assert_eq!(fs::read_to_string(file).unwrap_or_default(), OLD, "{line}: {failed:?}");
            assert_eq!(others(directory, file), before, "{line}");
            if !line.contains("package") {
                let said = String::from_utf8_lossy(&failed.stderr);
                assert!(said.contains("files of an earlier run stay as they were"), "{said}");
            }
        }
    });
}

/// Players read a live package while it comes: the earlier one goes with the first GOP, and stays where none comes.
#[cfg(unix)]
#[test]
fn an_earlier_package_stays_where_no_live_one_comes() {
    let live = "package talk.gss -o out --live --force";
    with_earlier(&[(live, "out/manifest.json")], |directory, line, file| {
        fs::write(directory.join("out/t1-9.m4s"), OLD).unwrap();
        let failed = run_in(directory, &line.replace("talk.gss", "still.ply"), false);
        assert_eq!(failed.status.code(), Some(10), "{failed:?}");
        assert_eq!(fs::read_to_string(file).unwrap(), OLD);
        assert!(directory.join("out/t1-9.m4s").exists());
        let done = run_in(directory, line, false);
        assert!(done.status.success(), "{done:?}");
        assert!(fs::read(file).unwrap() != OLD.as_bytes());
        assert!(!directory.join("out/t1-9.m4s").exists());
    });
}

/// How many hidden files and directories are in a directory.
#[cfg(unix)]
fn hidden(directory: &Path) -> usize {
    let names = fs::read_dir(directory).into_iter().flatten().map(|entry| entry.unwrap().file_name());
    let names = names.map(|name| name.to_string_lossy().into_owned());
    // What frames were made with stays beside them.
    names.filter(|name| name.starts_with('.') && !name.ends_with("-settings.json")).count()
}

/// Starts a long line in a directory, and gives it back once it has begun to write to `out`.
#[cfg(unix)]
fn begin(directory: &Path, line: &str) -> Child {
    let child = Command::new(env!("CARGO_BIN_EXE_splatstream"))
        .args(line.split(' '))
        .current_dir(directory)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let start = Instant::now();
    while hidden(&directory.join("out")) == 0 {
        assert!(start.elapsed() < Duration::from_secs(60), "{line}: it never began to write");
        std::thread::sleep(Duration::from_millis(1));
    }
    child
}

#[cfg(unix)]
fn send(signal: &str, child: Child) -> Output {
    let id = child.id().to_string();
    assert!(Command::new("kill").args([&format!("-{signal}"), &id]).status().unwrap().success());
    child.wait_with_output().unwrap()
}

#[cfg(unix)]
#[test]
fn files_of_an_earlier_run_stay_where_the_next_one_is_interrupted_or_killed() {
    let cases: Vec<(String, &str)> =
        LONG.iter().map(|(line, name)| (format!("{line} --force"), *name)).collect();
    let cases: Vec<(&str, &str)> = cases.iter().map(|(line, name)| (line.as_str(), *name)).collect();
    with_earlier(&cases, |directory, line, file| {
        if line.contains("long.gss") {
            let parts = vec!["talk.gss"; 100].join(" ");
            let made = run_in(directory, &format!("concat {parts} -o long.gss"), false);
            assert!(made.status.success(), "{made:?}");
        }
        let before = others(directory, file);
        for signal in ["INT", "TERM"] {
            let ended = send(signal, begin(directory, line));
            assert_eq!(ended.status.code(), Some(130), "{line}: {ended:?}");
            let said = String::from_utf8_lossy(&ended.stderr);
            assert!(said.contains("files of an earlier run stay as they were"), "{line}: {said}");
            assert_eq!(fs::read_to_string(file).unwrap_or_default(), OLD, "{line}");
            assert_eq!(others(directory, file), before, "{line}");
        }
        // A run that is killed cannot tidy up.
        assert_eq!(send("KILL", begin(directory, line)).status.code(), None, "{line}");
        assert_eq!(fs::read_to_string(file).unwrap_or_default(), OLD, "{line}");
        assert_eq!(hidden(&directory.join("out")), 1, "{line}");
    });
}

/// What a run has left that was killed is no frame of any, and goes away with the next that replaces: but not files of a run
/// before it that were about to be replaced, which are replaced or stay as others.
#[cfg(unix)]
#[test]
fn what_a_killed_run_has_left_is_cleared() {
    let simulate = "simulate -o out --views 2 --height 18 --samples 1 --points 50";
    with_earlier(&[(simulate, "out/transforms.json")], |directory, line, _| {
        let out = directory.join("out");
        let (new, earlier) = (out.join(".splatstream-run-1/new"), out.join(".splatstream-run-1/earlier"));
        let again = format!("{line} --force");
        for has_earlier in [false, true] {
            fs::create_dir_all(&new).unwrap();
            fs::write(new.join("transforms.json"), "of a killed run").unwrap();
            if has_earlier {
                fs::create_dir_all(earlier.join("images")).unwrap();
                fs::write(earlier.join("images/view_000.png"), OLD).unwrap();
                fs::remove_file(out.join("transforms.json")).unwrap();
                fs::remove_file(out.join("sparse_pc.ply")).unwrap();
                fs::remove_dir_all(out.join("sparse")).unwrap();
                fs::remove_dir_all(out.join("images")).unwrap();
                let refused = run_in(directory, line, false);
                let said = String::from_utf8_lossy(&refused.stderr).into_owned();
                assert!(said.contains("has 1 file with names of captures"), "{said}");
                let failed = run_in(directory, &again, true);
                assert_eq!(failed.status.code(), Some(1), "{failed:?}");
                assert_eq!(fs::read_to_string(earlier.join("images/view_000.png")).unwrap(), OLD);
            }
            let done = run_in(directory, &again, false);
            assert!(done.status.success(), "{done:?}");
            assert_eq!(hidden(&out), 0);
            assert!(fs::read_to_string(out.join("transforms.json")).unwrap().contains("frames"));
        }
    });
}

/// Files cannot be moved to another disk, which is said at once; nothing is lost.
#[cfg(target_os = "linux")]
#[test]
fn a_part_of_a_directory_on_another_disk_is_refused() {
    use std::os::unix::fs::MetadataExt;
    let line = "simulate -o out --views 2 --height 18 --samples 1 --points 50";
    with_earlier(&[(line, "out/transforms.json")], |directory, line, file| {
        let disk_of = |path: &Path| path.metadata().unwrap().dev();
        // The memory of the machine, unless that is where the test writes.
        let other = ["/dev/shm", "/var/tmp"].into_iter().map(Path::new);
        let mut other = other.filter(|path| path.is_dir() && disk_of(path) != disk_of(directory));
        let Some(other) = other.next() else { return };
        let other = tempfile::tempdir_in(other).unwrap();
        fs::write(other.path().join("view_000.png"), OLD).unwrap();
        std::os::unix::fs::symlink(other.path(), directory.join("out/images")).unwrap();
        let refused = run_in(directory, &format!("{line} --force"), false);
        assert_eq!(refused.status.code(), Some(1), "{refused:?}");
        assert!(String::from_utf8_lossy(&refused.stderr).contains("on another disk"), "{refused:?}");
        assert_eq!(fs::read_to_string(other.path().join("view_000.png")).unwrap(), OLD);
        assert_eq!(fs::read_to_string(file).unwrap(), OLD);
        fs::remove_file(directory.join("out/images")).unwrap();
    });
}

/// Two runs do not mix their files in one directory.
#[cfg(unix)]
#[test]
fn a_directory_to_which_a_run_writes_is_refused_to_others() {
    let long = "simulate -o out --views 100 --force";
    with_earlier(&[(long, "out/transforms.json")], |directory, line, file| {
        let first = begin(directory, line);
        let link = directory.join("link");
        std::os::unix::fs::symlink("out", &link).unwrap();
        for line in ["simulate -o out --force", "decode talk.gss -o link/../out", "package talk.gss -o link"]
        {
            let refused = run_in(directory, line, false);
            assert_eq!(refused.status.code(), Some(1), "{line}: {refused:?}");
            let said = String::from_utf8_lossy(&refused.stderr).into_owned();
            assert!(said.contains("another run is writing to this directory"), "{line}: {said}");
        }
        assert_eq!(send("TERM", first).status.code(), Some(130));
        fs::remove_file(link).unwrap();
        assert_eq!(fs::read_to_string(file).unwrap(), OLD);
    });
}

/// A command that writes files is among the cases, or is known not to write any that it is given a name for.
#[test]
fn every_command_that_writes_is_among_them() {
    let help = succeed(&["--help"]);
    let list = help.split("Commands:\n").nth(1).unwrap().split("\n\n").next().unwrap();
    let commands = list.lines().filter_map(|line| line.strip_prefix("  ")?.split(' ').next());
    for command in commands.filter(|name| !["", "help"].contains(name)) {
        let writes = String::from_utf8(run(&[command, "--help"]).stdout).unwrap().contains("--out <");
        let has_case =
            REPLACING.iter().chain(&REFUSING).any(|(line, _)| line.split(' ').next() == Some(command));
        assert!(has_case || !writes, "{command}");
    }
    assert!(fail(2, &["validate", "-o", "out.json"]).contains("unexpected argument"));
}
