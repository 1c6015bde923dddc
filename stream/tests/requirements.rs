//! Every requirement of annex C has a test that says it covers it. `BLESS=1` writes the table of
//! `conformance/coverage/carriage.csv` again.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

use std::collections::BTreeMap;
use std::path::Path;

/// The requirement, and the clause that it stands in.
fn requirements(annex: &str) -> Vec<(String, String)> {
    let (mut clause, mut found) = (String::new(), Vec::new());
    for line in annex.lines() {
        if let Some(title) = line.strip_prefix('#') {
            clause = title.trim_start_matches('#').split_whitespace().next().unwrap().to_owned();
        }
        if let Some((name, _)) = line.strip_prefix("**[").and_then(|rest| rest.split_once("]**")) {
            found.push((name.to_owned(), clause.clone()));
        }
    }
    found
}

/// The tests that say they cover each requirement.
fn cited(source: &str, tests: &mut BTreeMap<String, Vec<String>>) {
    let mut waiting = Vec::new();
    for line in source.lines().map(str::trim_start) {
        if let Some(comment) = line.strip_prefix("// covers:") {
            let words = comment.split([',', ' ']).filter(|word| word.starts_with("SS-CR-"));
            waiting.extend(words.map(str::to_owned));
        } else if let Some(rest) = line.strip_prefix("fn ") {
            let name = rest.split(['(', '<']).next().unwrap();
            for requirement in waiting.drain(..) {
                tests.entry(requirement).or_default().push(name.to_owned());
            }
        }
    }
}

#[test]
fn every_requirement_of_the_annex_has_a_test() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut tests = BTreeMap::new();
    let mut sources: Vec<_> =
        std::fs::read_dir(here.join("tests")).unwrap().map(|entry| entry.unwrap().path()).collect();
    sources.sort();
    for source in sources.iter().filter(|path| path.extension().is_some_and(|extension| extension == "rs")) {
        cited(&std::fs::read_to_string(source).unwrap(), &mut tests);
    }
    let annex = std::fs::read_to_string(here.join("../spec/c-carriage.md")).unwrap();
    let mut table = "requirement,clause,tests\n".to_owned();
    for (requirement, clause) in requirements(&annex) {
        let of_it = tests.remove(&requirement).unwrap_or_default();
        assert!(!of_it.is_empty(), "{requirement} has no test");
        table += &format!("{requirement},{clause},{}\n", of_it.join(" "));
    }
    assert!(tests.is_empty(), "the annex does not have {:?}", tests.keys());
    let path = here.join("../conformance/coverage/carriage.csv");
    if std::env::var_os("BLESS").is_some() {
        std::fs::write(&path, &table).unwrap();
    }
    assert_eq!(std::fs::read_to_string(path).unwrap_or_default(), table, "BLESS=1 writes the table again");
}
