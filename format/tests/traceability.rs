//! Specification, code and tests name each other: identifiers have tests, clauses exist, tables agree.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "a panic is a failed test")]

use splatstream_format::bits::BitWriter;
use splatstream_format::entropy::model::{ModelTrace, read_models};
use splatstream_format::entropy::token::Alphabet;
use splatstream_format::syntax::TABLES;
use splatstream_format::{Class, Error, ErrorKind};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The crates of the workspace; `fuzz` has one of its own.
const CRATES: [&str; 8] =
    ["format", "scene/gaussians", "scene/files", "decoder", "encoder", "stream", "cli", "cli/chart"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_owned()
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Name and text of the normative parts of the specification, and of annex D, to which code may refer.
fn specification() -> Vec<(String, String)> {
    let mut parts: Vec<(String, String)> = std::fs::read_dir(root().join("spec"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "md"))
        .map(|path| (path.file_name().unwrap().to_string_lossy().into_owned(), read(&path)))
        .filter(|(name, _)| name.starts_with('0') || name.as_bytes().get(1) == Some(&b'-'))
        .collect();
    parts.sort();
    assert!(parts.len() >= 11, "clauses 1 to 9, annexes A and B: found {}", parts.len());
    parts
}

/// Name and text of every Rust file of a folder of each crate, and of the folders in it.
fn sources(folder: &str) -> Vec<(String, String)> {
    let mut files = Vec::new();
    let mut folders: Vec<PathBuf> = CRATES.iter().map(|name| root().join(name).join(folder)).collect();
    while let Some(folder) = folders.pop() {
        let Ok(entries) = std::fs::read_dir(&folder) else { continue };
        for path in entries.map(|entry| entry.unwrap().path()) {
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                files.push((path.display().to_string(), read(&path)));
            }
        }
    }
    assert!(!files.is_empty(), "{folder} has no files");
    files
}

/// The identifiers in a text: `SS-`, letters, `-`, three digits.
fn identifiers(text: &str) -> Vec<String> {
    let is_identifier = |word: &&str| {
        let parts: Vec<&str> = word.split('-').collect();
        matches!(parts[..], ["SS", subject, number]
            if subject.chars().all(|letter| letter.is_ascii_uppercase())
                && number.len() == 3
                && number.chars().all(|digit| digit.is_ascii_digit()))
    };
    let words = text.split(|character: char| !character.is_ascii_alphanumeric() && character != '-');
    words.filter(is_identifier).map(str::to_owned).collect()
}

/// The identifiers that begin a requirement, `**[SS-XX-NNN]**`, with the number of times they do.
fn defined() -> BTreeMap<String, usize> {
    let mut defined = BTreeMap::new();
    for (_, text) in specification() {
        for rest in text.split("**[").skip(1) {
            let Some((inside, _)) = rest.split_once("]**") else { continue };
            for id in identifiers(inside) {
                *defined.entry(id).or_insert(0) += 1;
            }
        }
    }
    defined
}

/// The part of a source file that tests: all of it in a folder of tests, the test modules elsewhere.
fn tested() -> Vec<(String, String)> {
    let of_modules = |(name, text): (String, String)| {
        let (_, module) = text.split_once("#[cfg(test)]")?;
        Some((name, module.to_owned()))
    };
    let mut parts = sources("tests");
    parts.extend(sources("src").into_iter().filter_map(of_modules));
    parts
}

/// The files that describe the conformance vectors.
fn vectors() -> Vec<PathBuf> {
    let mut files = Vec::new();
    let mut folders = vec![root().join("conformance/vectors")];
    while let Some(folder) = folders.pop() {
        let Ok(entries) = std::fs::read_dir(&folder) else { continue };
        for path in entries.map(|entry| entry.unwrap().path()) {
            if path.is_dir() {
                folders.push(path);
            } else if path.file_name().is_some_and(|name| name == "vector.json") {
                files.push(path);
            }
        }
    }
    files
}

/// The identifiers that tests and vectors say they cover, each with the files that say so.
fn cited() -> BTreeMap<String, BTreeSet<String>> {
    let mut cited: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (file, text) in tested() {
        let comments = text.lines().filter_map(|line| line.trim().strip_prefix("// covers:"));
        for id in comments.flat_map(identifiers) {
            cited.entry(id).or_default().insert(file.clone());
        }
    }
    for file in vectors() {
        let text = read(&file);
        let lists = text.lines().filter(|line| line.trim_start().starts_with("\"requirements\""));
        for id in lists.flat_map(identifiers) {
            cited.entry(id).or_default().insert(file.display().to_string());
        }
    }
    cited
}

#[test]
fn an_identifier_is_defined_once() {
    let twice: Vec<_> = defined().into_iter().filter(|(_, times)| *times > 1).collect();
    assert!(twice.is_empty(), "defined more than once: {twice:?}");
    assert!(defined().len() > 90, "the requirements are found");
}

#[test]
fn every_requirement_has_a_test() {
    let cited = cited();
    let missing: Vec<_> = defined().into_keys().filter(|id| !cited.contains_key(id)).collect();
    assert!(missing.is_empty(), "no test covers {missing:?}");
}

#[test]
fn every_identifier_in_a_test_or_in_the_text_is_that_of_a_requirement() {
    let defined = defined();
    let unknown: Vec<_> = cited().into_iter().filter(|(id, _)| !defined.contains_key(id)).collect();
    assert!(unknown.is_empty(), "tests cover what is not defined: {unknown:?}");
    let in_text = specification().into_iter().flat_map(|(_, text)| identifiers(&text));
    let unknown: BTreeSet<_> = in_text.filter(|id| !defined.contains_key(id)).collect();
    assert!(unknown.is_empty(), "the specification refers to {unknown:?}");
}

/// The numbers of all headings: `7`, `7.1.2`, `A`, `A.2`.
fn headings() -> BTreeSet<String> {
    let mut numbers = BTreeSet::new();
    for (_, text) in specification() {
        for line in text.lines().filter(|line| line.starts_with('#')) {
            let title = line.trim_start_matches('#').trim();
            let mut words = title.split_whitespace();
            let first = words.next().unwrap_or_default();
            let number = if first == "Annex" { words.next().unwrap_or_default() } else { first };
            numbers.insert(number.to_owned());
        }
    }
    numbers
}

/// Whether a word is the number of a clause with a point in it: `7.4`, `5.10.1`, `A.2`.
fn is_clause(word: &str) -> bool {
    let mut parts = word.split('.');
    let first = parts.next().unwrap_or_default();
    let numbers: Vec<&str> = parts.collect();
    let is_number = |part: &&str| !part.is_empty() && part.chars().all(|digit| digit.is_ascii_digit());
    (is_number(&first) || ["A", "B", "D"].contains(&first))
        && !numbers.is_empty()
        && numbers.iter().all(is_number)
}

/// The clauses that a line of code cites: string literals, and numbers after "clause" or "annex" in a comment.
fn clauses_cited(line: &str) -> Vec<String> {
    let Some((_, comment)) = line.split_once("//") else {
        return line
            .split('"')
            .skip(1)
            .step_by(2)
            .filter(|literal| is_clause(literal))
            .map(str::to_owned)
            .collect();
    };
    let mut clauses = Vec::new();
    let mut listing = false;
    for word in comment.split_whitespace() {
        let bare = word.trim_matches(|character: char| !character.is_ascii_alphanumeric());
        let is_letter = bare.len() == 1 && ["A", "B", "D"].contains(&bare);
        match bare {
            "clause" | "clauses" | "Clause" | "Clauses" | "annex" | "Annex" => listing = true,
            "to" | "and" | "or" | "" => {}
            _ if listing && (is_clause(bare) || is_letter || bare.parse::<u8>().is_ok()) => {
                clauses.push(bare.to_owned());
                listing = !word.ends_with([';', ':', ')', '.']);
            }
            _ => listing = false,
        }
    }
    // A comment that begins with a number: `/// 6.4.`, `//! 5.7 transform`.
    let first = comment.trim_start_matches(['/', '!']).split_whitespace().next().unwrap_or_default();
    let number = first.trim_end_matches(['.', ',', ':']);
    // Not `1.0 in Q12`: clauses 1 to 3 have nothing that code does.
    let is_cited = is_clause(number) && !number.starts_with(['0', '1', '2', '3']);
    clauses.extend(is_cited.then(|| number.to_owned()));
    clauses
}

#[test]
fn a_clause_that_code_cites_has_a_heading() {
    let headings = headings();
    let mut cited = 0;
    let mut missing = Vec::new();
    let in_format = |(name, _): &(String, String)| name.contains("/format/") || name.contains("/decoder/");
    for (file, text) in sources("src").into_iter().filter(in_format) {
        let code = text.split("#[cfg(test)]").next().unwrap_or_default();
        for (number, line) in (1..).zip(code.lines()) {
            for clause in clauses_cited(line) {
                cited += 1;
                if !headings.contains(&clause) {
                    missing.push(format!("{file}:{number}: {clause}"));
                }
            }
        }
    }
    for table in TABLES {
        for clause in [table.syntax, table.semantics] {
            assert!(headings.contains(clause), "{} cites {clause}", table.name);
        }
    }
    assert!(missing.is_empty(), "no such clause:\n{}", missing.join("\n"));
    assert!(cited > 100, "citations are found: {cited}");
}

#[test]
fn citations_are_read_from_code_and_comments() {
    assert_eq!(clauses_cited(r#"Error::new(at, "7.4", kind)"#), ["7.4"]);
    assert_eq!(clauses_cited("//! Clauses 7.4 to 7.6: values, annex A.2."), ["7.4", "7.6", "A.2"]);
    assert_eq!(clauses_cited("    /// 6.12, as far as it goes"), ["6.12"]);
    assert!(clauses_cited("/// 1.0 in Q12, see 0.5").is_empty());
    assert!(clauses_cited(r#"let name = "position"; // about 0.5 bits"#).is_empty());
}

/// The cells of the rows of a Markdown table under a heading, without its head.
fn rows(file: &str, heading: &str) -> Vec<Vec<String>> {
    let (_, text) = specification().into_iter().find(|(name, _)| name.starts_with(file)).unwrap();
    let under = text.lines().skip_while(|line| line.trim_start_matches('#').trim() != heading);
    let lines = under.skip(1).take_while(|line| !line.starts_with('#'));
    let row = |line: &str| {
        let cells = line.trim().strip_prefix('|')?.strip_suffix('|')?;
        Some(cells.split('|').map(|cell| cell.trim().to_owned()).collect())
    };
    lines.filter_map(row).skip(2).collect()
}

/// One error of each kind of which a stream is the cause.
fn kinds() -> [ErrorKind; 17] {
    let element = "";
    [
        ErrorKind::Truncated { element },
        ErrorKind::Signature,
        ErrorKind::Checksum { element, stored: 0, computed: 0 },
        ErrorKind::ShortSection { element },
        ErrorKind::TrailingBytes { element, bytes: 0 },
        ErrorKind::Number { element },
        ErrorKind::Padding { element },
        ErrorKind::EntropyFinalState,
        ErrorKind::ReservedBits { element, value: 0 },
        ErrorKind::Reserved { element, value: 0 },
        ErrorKind::OutOfRange { element, value: 0, min: 0, max: 0 },
        ErrorKind::Mismatch { element, value: 0, expected: 0 },
        ErrorKind::Constraint { rule: "" },
        ErrorKind::UnexpectedUnit { unit: "" },
        ErrorKind::Undefined { element, id: 0 },
        ErrorKind::Digest { stored: 0, computed: 0 },
        ErrorKind::OverLimit { limit: "", asked: 0, allowed: 0 },
    ]
}

// covers: SS-ER-007
#[test]
fn codes_and_classes_are_those_of_the_table_of_9_2() {
    let specified: Vec<(String, String)> =
        rows("09", "9.2 Codes").into_iter().map(|row| (row[0].clone(), row[1].clone())).collect();
    let coded = kinds().map(|kind| (kind.code().to_owned(), kind.class().name().to_owned()));
    assert_eq!(specified, coded);
    // No kind is forgotten above: the code has as many arms, and one for defects of the decoder.
    let source = read(&root().join("format/src/error.rs"));
    let arms = source.split("fn code(").nth(1).unwrap().split("impl Error").next().unwrap();
    assert_eq!(arms.matches("=> \"").count(), kinds().len() + 1);
    let fault = Error::fault("one length");
    assert!(fault.is_fault() && specified.iter().all(|(code, _)| code != fault.kind.code()));
    assert!(!fault.to_string().contains("clause"), "{fault}");
}

// covers: SS-ER-006
#[test]
fn classes_and_exit_codes_are_those_of_the_table_of_9_1() {
    let specified: Vec<(String, String)> =
        rows("09", "9.1 Classes").into_iter().map(|row| (row[0].clone(), row[1].clone())).collect();
    let classes = [Class::Malformed, Class::Invalid, Class::Unsupported, Class::OverLimit, Class::Truncated];
    assert_eq!(specified, classes.map(|class| (class.name().to_owned(), class.exit_code().to_string())));
}

/// The names of the elements as they are read.
#[derive(Default)]
struct Names(BTreeSet<&'static str>);

impl ModelTrace for Names {
    fn element(&mut self, name: &'static str, _: u64, _: u64, _: i64) {
        self.0.insert(name);
    }
}

/// Two planes: one with every branch of 5.12, one that reuses it.
fn every_branch() -> Vec<u8> {
    let mut bits = BitWriter::new();
    bits.bits(0, 1); // reuse
    bits.signed_exp_golomb(-3); // bias
    bits.bits(1, 3); // direct_log2_minus2
    for source in [5, 8] {
        bits.bits(source, 4);
        bits.bits(1, 4); // two thresholds
        bits.signed_exp_golomb(-7);
        bits.exp_golomb(9);
    }
    // Nine contexts: explicit, token, reference, before, parametric, and token 0.
    bits.bits(3, 2);
    bits.bits(0, 1); // is_parametric
    bits.bits(1, 6); // last
    bits.bits(0, 1); // mode
    bits.signed_exp_golomb(6); // length_delta
    bits.bits(5, 3); // mantissa
    bits.bits(1, 2);
    bits.bits(0, 1); // is_reference
    bits.bits(4, 6); // token
    bits.bits(1, 2);
    bits.bits(1, 1);
    bits.bits(0, 6); // table_index
    bits.bits(2, 2);
    bits.bits(3, 2);
    bits.bits(1, 1); // is_parametric
    bits.bits(9, 6); // last
    bits.bits(2, 2); // shape
    bits.bits(0, 4); // zero_level
    bits.bits(3, 6); // scale
    bits.signed_exp_golomb(-1); // centre
    (0..4).for_each(|_| bits.bits(0, 2));
    bits.bits(1, 1);
    bits.into_bytes()
}

#[test]
fn the_elements_of_a_plane_model_are_the_rows_of_5_12() {
    let table = rows("05", "5.12 plane_model");
    let name = |row: Vec<String>| {
        let name = row[0].trim_start_matches(['·', ' ']).strip_prefix('`')?.strip_suffix('`')?.to_owned();
        (!row[1].is_empty() && name != "padding").then_some(name)
    };
    let specified: BTreeSet<String> = table.into_iter().filter_map(name).collect();
    let mut names = Names::default();
    let section = every_branch();
    let alphabets = [Alphabet::Attribute, Alphabet::Attribute];
    let plain = {
        let mut bits = BitWriter::new();
        bits.bits(0, 1);
        bits.signed_exp_golomb(0);
        bits.bits(1, 3);
        bits.bits(0, 4 + 2);
        bits.into_bytes()
    };
    let model = read_models(&plain, 0, &alphabets[..1], &[None], &mut ()).unwrap().remove(0);
    let models = read_models(&section, 0, &alphabets, &[None, Some(&model)], &mut names).unwrap();
    assert_eq!((models.len(), models[1] == model), (2, true));
    let read: BTreeSet<String> = names.0.into_iter().map(str::to_owned).collect();
    let only_read: Vec<_> = read.difference(&specified).collect();
    let only_specified: Vec<_> = specified.difference(&read).collect();
    assert!(
        only_read.is_empty() && only_specified.is_empty(),
        "read {only_read:?}, specified {only_specified:?}"
    );
}
