//! `splatstream conformance list`: what the suite tests.

use super::SuiteArgs;
use crate::console::Console;
use crate::failure::Failure;
use clap::Args;
use serde::Serialize;
use splatstream_conformance::case::Case;
use splatstream_conformance::counted::counted;

/// List the vectors of the suite: what each is for, the right answer, its cases, clauses, features and requirements.
#[derive(Args)]
#[command(after_help = "Examples:\n  splatstream conformance list --kind valid --area temporal\n  \
    splatstream conformance list --requirement SS-PR-003 --json")]
pub(super) struct List {
    #[command(flatten)]
    suite: SuiteArgs,
}

/// A vector, as `--json` prints it.
#[derive(Serialize)]
struct Row<'a> {
    vector: &'a str,
    kind: &'static str,
    area: &'a str,
    purpose: &'a str,
    clauses: &'a [String],
    requirements: &'a [String],
    features: &'a [String],
    expect: String,
    cases: Vec<String>,
}

impl List {
    /// Prints a line a vector.
    pub(super) fn run(&self, console: &Console) -> Result<(), Failure> {
        let suite = self.suite.read()?;
        let cases = self.suite.cases(&suite)?;
        let rows: Vec<Row<'_>> =
            cases.chunk_by(|a, b| a.vector.name == b.vector.name).filter_map(Row::of).collect();
        console.report(&rows, || text(&rows, cases.len()))
    }
}

impl<'a> Row<'a> {
    /// The row of a vector from its cases.
    fn of(cases: &[Case<'a>]) -> Option<Self> {
        let vector = cases.first()?.vector;
        Some(Self {
            vector: &vector.name,
            kind: vector.kind.name(),
            area: &vector.area,
            purpose: &vector.purpose,
            clauses: &vector.clauses,
            requirements: &vector.requirements,
            features: &vector.features,
            expect: vector.expect.to_string(),
            cases: cases.iter().map(|case| format!("{}/{}", case.op(), case.mode())).collect(),
        })
    }
}

fn text(rows: &[Row<'_>], cases: usize) -> String {
    let mut text = String::new();
    for group in rows.chunk_by(|a, b| (a.kind, a.area) == (b.kind, b.area)) {
        let Some(Row { kind, area, .. }) = group.first() else { continue };
        text += &format!("{kind}/{area}\n");
        for Row { vector, purpose, expect, cases, clauses, features, requirements, .. } in group {
            text += &format!("  {vector}: {purpose}\n");
            text += &format!("    {expect}; {}; {}\n", counted(cases.len(), "case"), clauses.join(", "));
            let more: Vec<&str> = features.iter().chain(*requirements).map(String::as_str).collect();
            text += &format!("    {}\n", more.join(", "));
        }
    }
    text + &format!("{}, {}\n", counted(rows.len(), "vector"), counted(cases, "case"))
}
