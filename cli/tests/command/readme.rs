//! The commands of README.md, section "Use", run as they are written, on small scenes under the names that they mention.

use crate::common::directory;
use splatstream_files::builtin::{BuiltinScene, Tracking};
use splatstream_files::{ply, spz};
use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::Command;

const README: &str = include_str!("../../../README.md");

/// Commands that other tests run, since they need another machine or some minutes; here their options are parsed only. Each by
/// words that it has, and why.
const ONLY_PARSED: [Parsed; 9] = [
    never("splatstream serve", "it serves until it is ended: serve.rs"),
    never("splatstream play https", "it needs a server: serve.rs, play.rs"),
    slow("splatstream chart", "it encodes dozens of times: chart.rs has a quick one"),
    slow("splatstream simulate", "it traces large pictures: fit.rs"),
    slow("splatstream fit", "it trains for minutes: fit.rs"),
    slow("splatstream train", "it trains for minutes: json_reports.rs"),
    never("splatstream conformance run", "it takes minutes, and another decoder: conformance.rs"),
    slow("--finetune", "it draws hundreds of pictures: the encoder's own tests of it"),
    slow("--time-budget", "it may fit values to pictures for as long: targets.rs"),
];

/// Where this is set, what is slow is run too: `.ci/reports commands` does.
const ALL: &str = "SPLATSTREAM_ALL_COMMANDS";

/// Commands that have some words.
struct Parsed {
    words: &'static str,
    why: &'static str,
    /// Whether they could be run, given time.
    is_slow: bool,
}

const fn slow(words: &'static str, why: &'static str) -> Parsed {
    Parsed { words, why, is_slow: true }
}

const fn never(words: &'static str, why: &'static str) -> Parsed {
    Parsed { words, why, is_slow: false }
}

/// The commands of the section, without what they are for.
fn commands() -> Vec<&'static str> {
    let section =
        README.split("\n## Use\n").nth(1).expect("a section").split("\n## ").next().expect("its text");
    let lines = section.lines().filter_map(|line| line.strip_prefix("    "));
    lines
        .map(|line| line.split(" # ").next().unwrap_or(line).trim())
        .filter(|line| !line.is_empty())
        .collect()
}

fn is_only_parsed(command: &str) -> bool {
    let is_asked = std::env::var_os(ALL).is_some();
    let of = |parsed: &&Parsed| command.contains(parsed.words);
    ONLY_PARSED.iter().filter(of).any(|parsed| !(parsed.is_slow && is_asked))
}

/// Runs a line by the shell in a folder, with the command in its path.
fn shell(folder: &Path, line: &str) {
    let binary = Path::new(env!("CARGO_BIN_EXE_splatstream")).parent().expect("a folder");
    let path = format!("{}:{}", binary.display(), std::env::var("PATH").unwrap_or_default());
    let output = Command::new("sh").args(["-ec", line]).current_dir(folder).env("PATH", path).output();
    let output = output.expect("a shell");
    assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
}

fn scene(gaussians: u32, frames: u32) -> BuiltinScene {
    BuiltinScene { gaussians, frames, sh_degree: 1, ..BuiltinScene::default() }
}

fn write(path: &Path, bytes: &[u8]) {
    fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
    fs::write(path, bytes).expect("a file");
}

fn write_frames(folder: &Path, scene: &BuiltinScene) {
    (0..scene.frames).for_each(|number| {
        write(&folder.join(format!("{number:03}.ply")), &ply::write(&scene.frame(number)))
    });
}

/// What the commands read that none of them has written.
fn prepare(folder: &Path) {
    let moving = scene(100, 9);
    let still = ply::write(&moving.frame(0));
    for name in ["scene.ply", "a.ply", "head.ply"] {
        write(&folder.join(name), &still);
    }
    for name in ["b.spz", "found.spz"] {
        write(&folder.join(name), &spz::write(&moving.frame(1)).expect("a scene that SPZ has"));
    }
    for name in ["frames", "talk"] {
        write_frames(&folder.join(name), &moving);
    }
    // Frames that have nothing in common: many Gaussians are new in each.
    for (name, gaussians) in [("trained", 100), ("dance", 2000)] {
        let tracking = Tracking::Untracked;
        write_frames(&folder.join(name), &BuiltinScene { tracking, ..scene(gaussians, 9) });
    }
    let mut archive = zip::ZipWriter::new(fs::File::create(folder.join("frames.zip")).expect("a file"));
    for number in 0..moving.frames {
        let options = zip::write::SimpleFileOptions::default();
        archive.start_file(format!("{number}.ply"), options).expect("an entry");
        archive.write_all(&ply::write(&moving.frame(number))).expect("its bytes");
    }
    archive.finish().expect("an archive");
    let camera = r#"[{"id": 0, "img_name": "0", "width": 960, "height": 540, "position": [0, 0, -4],
        "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "fy": 800, "fx": 800}]"#;
    write(&folder.join("cameras.json"), camera.as_bytes());
}

#[test]
fn commands_run_as_they_are_written() {
    let directory = directory();
    let folder = directory.path();
    prepare(folder);
    let mut run = 0;
    for command in commands() {
        let is_of_shards = ["--write-plan", "--plan", "concat"].iter().any(|word| command.contains(word));
        match command {
            _ if is_of_shards => continue,
            _ if is_only_parsed(command) => shell(folder, &format!("{command} --help > help.txt")),
            // Its input has a name of its own.
            "splatstream inspect - --json < long.gss" => {
                shell(folder, &format!("cp talk.gss long.gss && {command}"))
            }
            // The folder is one of frames before.
            _ if command.starts_with("splatstream package talk.gss") => {
                shell(folder, &format!("mv talk talking && {command} && rm -r talk && mv talking talk"));
            }
            _ if command.contains("package - -o talk/") => {
                shell(folder, &format!("mv talk talking && {command} && rm -r talk && mv talking talk"));
            }
            _ => shell(folder, command),
        }
        run += 1;
    }
    assert!(run > 25, "{run} commands");
}

/// As many GOPs as the commands name parts. That the bytes are those of a single run is shown in shards.rs.
#[test]
fn shards_join_as_they_are_written() {
    let directory = directory();
    let folder = directory.path();
    write_frames(&folder.join("frames"), &scene(30, 16 * 8));
    let of = |word: &str| commands().into_iter().find(|command| command.contains(word)).expect("a command");
    shell(folder, of("--write-plan"));
    let second = of("--plan plan.json");
    shell(folder, second);
    for part in [1, 3, 4, 5, 6, 7, 8] {
        shell(
            folder,
            &second.replace("2/8", &format!("{part}/8")).replace("shard-2", &format!("shard-{part}")),
        );
    }
    shell(folder, of("concat"));
}

#[test]
fn what_is_only_parsed_is_there() {
    for Parsed { words, why, .. } in ONLY_PARSED {
        assert!(commands().iter().any(|command| command.contains(words)), "no command has {words}: {why}");
    }
}
