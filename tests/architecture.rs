//! ARCHITECTURE.md says what is: the arrows are those of the manifests, and the tests that it names are there.
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed test")]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Crates that may use all others: the command, charts, and what tests them.
const FREE: [&str; 6] = [
    "splatstream-cli",
    "splatstream-chart",
    "splatstream-fuzz",
    "splatstream-conformance",
    "splatstream-planted",
    "splatstream-vectors",
];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: impl AsRef<Path>) -> String {
    let path = root().join(path);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The text between two quotes, from the first on.
fn quoted(text: &str) -> impl Iterator<Item = &str> {
    text.split('"').skip(1).step_by(2)
}

/// The folders of the workspace's crates.
fn members() -> Vec<PathBuf> {
    let manifest = read("Cargo.toml");
    let list = manifest.lines().find(|line| line.starts_with("members = ")).unwrap();
    quoted(list).map(PathBuf::from).chain([PathBuf::new()]).collect()
}

/// The name of a crate and the crates of this workspace that it depends on, but for its tests.
fn arrows_of(manifest: &str) -> (String, Vec<String>) {
    let name = manifest
        .lines()
        .find(|line| line.starts_with("name = "))
        .and_then(|line| quoted(line).next())
        .unwrap();
    let section = manifest.split("\n[dependencies]\n").nth(1).unwrap_or_default();
    let lines = section.lines().take_while(|line| !line.starts_with('['));
    let names = lines
        .filter_map(|line| line.split(['.', ' ', '=']).next())
        .filter(|name| name.starts_with("splatstream"));
    let mut names: Vec<String> = names.map(str::to_owned).collect();
    names.sort();
    (name.to_owned(), names)
}

#[test]
fn the_arrows_are_those_of_the_manifests() {
    let page = read("ARCHITECTURE.md");
    let stated = page.lines().filter_map(|line| line.strip_prefix("    splatstream")?.split_once("->"));
    let stated: BTreeMap<String, Vec<String>> = stated
        .map(|(from, to)| {
            (format!("splatstream{}", from.trim()), to.split_whitespace().map(str::to_owned).collect())
        })
        .collect();
    let all = members().into_iter().map(|member| arrows_of(&read(member.join("Cargo.toml"))));
    let found: BTreeMap<String, Vec<String>> =
        all.filter(|(name, _)| !FREE.contains(&name.as_str())).collect();
    assert_eq!(stated, found);
}

#[test]
fn every_test_that_the_page_names_is_there() {
    let page = read("ARCHITECTURE.md");
    let rows = page.lines().filter(|line| line.starts_with("| ") && line.contains('`'));
    let mut count = 0;
    for row in rows {
        let column = row.rsplit('|').nth(1).unwrap();
        for guard in column.split(';') {
            let words: Vec<&str> = guard.split('`').skip(1).step_by(2).collect();
            let (path, names) = words.split_first().unwrap();
            let text = read(path);
            for name in names {
                assert!(text.contains(name), "{path} has no {name}");
            }
            count += 1;
        }
    }
    assert!(count > 20, "{count} guards");
}
