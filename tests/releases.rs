//! What a release and the forge run is there: scripts and their parts, and one version everywhere.
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed test")]

use std::path::Path;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: impl AsRef<Path>) -> String {
    let path = root().join(path);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The text between two marks, from the first on.
fn between<'a>(text: &'a str, start: &str, end: &str) -> &'a str {
    text.split(start).nth(1).and_then(|rest| rest.split(end).next()).unwrap()
}

/// The files of the forge, by name and text.
fn workflows() -> Vec<(String, String)> {
    let entries = std::fs::read_dir(root().join(".github/workflows")).unwrap();
    let paths = entries.map(|entry| entry.unwrap().path());
    paths.map(|path| (path.file_name().unwrap().to_str().unwrap().to_owned(), read(&path))).collect()
}

/// The files of this repository that a workflow names outside its comments.
fn files(text: &str) -> impl Iterator<Item = &str> {
    let folders = [".ci/", "bindings/", "examples/", "fuzz/", "site/", "conformance/"];
    text.lines()
        .filter(|line| !line.trim_start().starts_with('#'))
        .flat_map(|line| line.split(|letter: char| letter.is_whitespace() || "\"'();".contains(letter)))
        .filter(move |word| folders.iter().any(|folder| word.starts_with(folder)))
}

#[test]
fn every_file_that_the_forge_runs_is_there() {
    let mut count = 0;
    for (name, text) in workflows() {
        for file in files(&text) {
            assert!(root().join(file).exists(), "{name} names {file}, which is not there");
            count += 1;
        }
    }
    assert!(count > 10, "{count} files");
}

#[test]
fn every_part_that_the_forge_and_the_documents_ask_for_is_one() {
    let release = read(".ci/release");
    let reports = read(".ci/reports");
    let parts_of_release: Vec<&str> = between(&release, "\nall=(", ")").split(' ').collect();
    let parts_of_reports: Vec<&str> = between(&reports, "parts are ", "\"").split(", ").collect();
    let documents = [".github/CONTRIBUTING.md", ".github/RELEASING.md", "README.md", "conformance/README.md"];
    let texts = documents.into_iter().map(|path| (path.to_owned(), read(path))).chain(workflows());
    let mut count = 0;
    for (name, text) in texts {
        for (script, parts) in [(".ci/release ", &parts_of_release), (".ci/reports ", &parts_of_reports)] {
            for call in text.split(script).skip(1) {
                let call = call.split(['`', '\n']).next().unwrap();
                // Explanations stand apart.
                for part in call.split("  ").next().unwrap().split_whitespace() {
                    assert!(parts.contains(&part), "{name}: {script}{call}");
                    count += 1;
                }
            }
        }
    }
    assert!(count >= 8, "{count} names of parts");
}

#[test]
fn everything_has_the_version_of_the_workspace() {
    let version = between(&read("Cargo.toml"), "[workspace.package]\nversion = \"", "\"").to_owned();
    for package in ["decoder", "player"] {
        let manifest = read(format!("bindings/web/{package}/package.json"));
        assert_eq!(between(&manifest, "\"version\": \"", "\""), version, "{package}");
    }
    let jobs = read("examples/cluster/kubernetes.yaml");
    let images: Vec<&str> = jobs.lines().filter_map(|line| line.trim().strip_prefix("image: ")).collect();
    assert_eq!(images, vec![format!("splatstream:{version}"); 3]);
    let needed =
        between(&read("bindings/web/player/package.json"), "\"@splatstream/decoder\": \"", "\"").to_owned();
    assert_eq!(needed.trim_start_matches(['^', '~', '=']), version);
}
