//! Completions and manual pages, which are made from the options.

use crate::common::{directory, fail, json, succeed, text};
use std::fs;

#[test]
fn every_shell_completes_commands_and_options() {
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let script = succeed(&["completions", shell]);
        for word in ["splatstream", "encode", "refinements"] {
            assert!(script.contains(word), "{shell} does not complete {word}");
        }
        // Elvish and PowerShell complete no values.
        let completes_values = ["bash", "fish", "zsh"].contains(&shell);
        assert_eq!(script.contains("visually-lossless"), completes_values, "{shell}");
        assert_eq!(json(&["completions", shell])["shell"], shell);
    }
    assert!(fail(2, &["completions", "cmd"]).contains("possible values"));
}

#[test]
fn every_command_has_a_manual_page() {
    let directory = directory();
    let out = directory.path().join("man1");
    let said = json(&["manual", "-o", text(&out)]);
    let pages: Vec<&str> =
        said["pages"].as_array().unwrap().iter().map(|page| page.as_str().unwrap()).collect();
    assert_eq!(fs::read_dir(&out).unwrap().count(), pages.len());
    for command in ["encode", "decode", "inspect", "conformance-run", "manual"] {
        assert!(pages.contains(&format!("splatstream-{command}.1").as_str()), "{pages:?}");
    }
    let page = fs::read_to_string(out.join("splatstream-extract.1")).unwrap();
    assert!(page.contains("splatstream extract talk.gss"), "the example is missing: {page}");
    // Pages that are there are written again; a file in the place of the directory stays.
    succeed(&["manual", "-o", text(&out)]);
    let file = out.join("splatstream.1");
    for name in [text(&file), "-", "pages.1"] {
        let said = fail(2, &["manual", "-o", name]);
        assert!(said.contains("manual pages are written to a directory"), "{said}");
    }
}

/// The README of the crate names all commands, and no other.
#[test]
fn the_readme_names_every_command() {
    let directory = directory();
    let pages = json(&["manual", "-o", text(directory.path())]);
    let commands = pages["pages"].as_array().unwrap().iter().filter_map(|page| {
        let name = page.as_str()?.strip_prefix("splatstream-")?.strip_suffix(".1")?;
        (!name.contains('-')).then_some(name)
    });
    let mut commands: Vec<&str> = commands.collect();
    commands.sort_unstable();
    let readme = include_str!("../../README.md");
    let run = readme.lines().filter_map(|line| line.strip_prefix("    splatstream ")?.split(' ').next());
    let others = readme.split("\nAlso: ").nth(1).unwrap().split(". ").next().unwrap();
    let mut named: Vec<&str> = run.chain(others.split('`').skip(1).step_by(2)).collect();
    named.sort_unstable();
    assert_eq!(named, commands);
}
