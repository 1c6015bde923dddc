//! The tables of `spec/05-syntax.md` are the tables of the code.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

use splatstream_format::payload::VARIABLE_ROWS;
use splatstream_format::syntax::{TABLES, Table};
use std::path::Path;

/// Name, type and clause of semantics of an element.
type Row = (String, String, String);

fn clause_5() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../spec/05-syntax.md");
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The rows of the table under the heading `## clause record`.
fn specified(text: &str, table: &Table) -> Vec<Row> {
    let heading = format!("{} {}", table.syntax, table.name);
    let is_heading = |line: &str| line.starts_with('#');
    let under_heading =
        text.lines().skip_while(|line| !is_heading(line) || line.trim_start_matches('#').trim() != heading);
    let rows: Vec<Row> = under_heading.skip(1).take_while(|line| !is_heading(line)).filter_map(row).collect();
    assert!(!rows.is_empty(), "spec/05-syntax.md has no table under the heading `{heading}`");
    rows
}

/// `| `element` | type | clause |`, with dots before an element under a condition; the head of the table, conditions
/// and other lines are none.
fn row(line: &str) -> Option<Row> {
    let mut cells = line.strip_prefix('|')?.split('|').map(str::trim);
    let name = cells.next()?.trim_start_matches(['·', ' ']).strip_prefix('`')?.strip_suffix('`')?;
    Some((name.to_owned(), cells.next()?.to_owned(), cells.next()?.to_owned()))
}

/// An element whose semantics have another clause than those of its record.
const SEMANTICS_ELSEWHERE: (&str, &str, &str) = ("network", "parameters", "6.17.2");

/// The fixed rows of the code, and the variable ones after them.
fn coded(table: &Table) -> Vec<Row> {
    let fixed = table.rows.iter().map(|row| (row.name, row.type_name));
    let variable = VARIABLE_ROWS.iter().filter(|row| row.record == table.name);
    let variable = variable.map(|row| (row.name, row.type_name));
    let (record, element, clause) = SEMANTICS_ELSEWHERE;
    let semantics =
        |name: &str| if (table.name, name) == (record, element) { clause } else { table.semantics };
    let row =
        |(name, type_name): (&str, &str)| (name.to_owned(), type_name.to_owned(), semantics(name).to_owned());
    fixed.chain(variable).map(row).collect()
}

#[test]
fn every_syntax_table_is_that_of_the_specification() {
    let text = clause_5();
    for table in TABLES {
        let (specified, coded) = (specified(&text, &table), coded(&table));
        for (index, (specified, coded)) in specified.iter().zip(&coded).enumerate() {
            assert_eq!(specified, coded, "{}, row {}: specification, code", table.name, index + 1);
        }
        let extra = specified.iter().skip(coded.len()).chain(coded.iter().skip(specified.len()));
        let extra: Vec<_> = extra.collect();
        assert!(extra.is_empty(), "{}: rows on one side only: {extra:?}", table.name);
    }
}

#[test]
fn every_table_of_the_specification_is_in_the_code() {
    // 5.1 has no table; 5.12 and 5.13 are bit sections, which clause 8 reads; 5.15 has no fixed part.
    let text = clause_5();
    let headings = text.lines().filter_map(|line| line.trim_start_matches('#').trim().split_once(' '));
    let headings = headings.filter(|(clause, _)| clause.starts_with("5."));
    let fixed = headings.filter(|(clause, _)| !["5.1", "5.12", "5.13", "5.15"].contains(clause));
    for (clause, record) in fixed {
        let known = TABLES.iter().any(|table| (table.syntax, table.name) == (clause, record));
        assert!(known, "{clause} {record} has no record in the code");
    }
}

#[test]
fn rows_and_sizes_agree() {
    let sizes = TABLES.map(|table| (table.name, table.size()));
    let expected: [(&str, usize); 17] = [
        ("file_header", 16),
        ("unit_header", 20),
        ("sequence_parameters", 106),
        ("gop_header", 12),
        ("frame_header", 8),
        ("transform", 4),
        ("codebook", 5),
        ("scene_description", 6),
        ("camera", 32),
        ("index", 4),
        ("index_entry", 16),
        ("end", 16),
        ("increment", 10),
        ("operating_points", 4),
        ("operating_point", 24),
        ("weights", 1),
        ("network", 18),
    ];
    assert_eq!(sizes, expected);
}
