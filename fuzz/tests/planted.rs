//! The faults that `planted.sh` plants.

use std::path::Path;
use std::process::Command;

/// The patches, by name.
fn patches() -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("planted");
    let names = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name());
    let mut names: Vec<_> = names.map(|name| name.into_string().unwrap()).collect();
    names.sort();
    names
}

/// They fit the sources: a change of these changes the patch too.
#[test]
fn every_fault_can_be_planted() {
    if Command::new("git").arg("--version").output().is_err() {
        println!("skipped: git is not there");
        return;
    }
    for patch in patches() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let file = format!("fuzz/planted/{patch}");
        let checked =
            Command::new("git").args(["apply", "--check", &file]).current_dir(root).output().unwrap();
        assert!(checked.status.success(), "{patch}: {}", String::from_utf8_lossy(&checked.stderr));
    }
}

#[test]
fn every_fault_is_described_and_has_its_name() {
    let readme = include_str!("../README.md");
    for patch in patches() {
        let name = patch.strip_suffix(".patch").unwrap();
        let text =
            std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("planted").join(&patch))
                .unwrap();
        assert!(
            text.contains(&format!("name == \"{name}\"")) && text.contains(&format!("\"planted: {name}\""))
        );
        assert!(readme.contains(&format!("| `{name}` |")), "{name} is not described");
    }
}
