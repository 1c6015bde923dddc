//! A report as Markdown: what a project puts beside its decoder.

use super::Report;
use super::summary::{contrast, explanation};
use crate::result::{CaseResult, Outcome};

/// The page.
pub fn page(report: &Report) -> String {
    let version = report.suite.version.as_deref().unwrap_or("without a version");
    let mut page = format!("# Conformance of {}\n\n", report.decoder.name);
    page += &format!(
        "Suite {version}, {} vectors (`{}`), {}, {} on {}.\n",
        report.suite.vectors,
        report.suite.sha256.get(..16).unwrap_or_default(),
        report.date,
        report.system.os,
        report.system.arch
    );
    if !report.settings.selection.is_everything() {
        page += "\nOnly a part of the suite was run.\n";
    }
    page += "\n| Outcome | Cases |\n|---|---|\n";
    for outcome in Outcome::ALL {
        page += &format!("| {} | {} |\n", outcome.name(), report.count(outcome));
    }
    page += "\n| Feature of valid streams | Cases | Passed | Not claimed |\n|---|---|---|---|\n";
    for (feature, tally) in &report.features {
        page += &format!("| {feature} | {} | {} | {} |\n", tally.cases, tally.pass, tally.not_claimed);
    }
    page + &failures(report)
}

fn failures(report: &Report) -> String {
    let mut text = String::new();
    if report.failures() > 0 {
        text += "\n## Failures\n\n";
    }
    for case in report.cases.iter().filter(|case| case.outcome.is_failure()) {
        text += &entry(case);
    }
    if !report.stale.is_empty() {
        text += "\n## Stale expectations\n\n";
    }
    for entry in &report.stale {
        text += &format!("- {entry}\n");
    }
    text
}

fn entry(case: &CaseResult) -> String {
    let mut text = format!("- `{}`: {}{}\n", case.case_name(), case.label(), contrast(case));
    for line in explanation(case) {
        text += &format!("  - {line}\n");
    }
    text
}
