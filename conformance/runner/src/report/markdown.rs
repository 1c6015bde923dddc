//! A report as Markdown, to be published with a decoder.

use super::causes::{Cause, causes};
use super::summary::explanation;
use super::{Report, Tally};
use crate::counted::counted;
use crate::result::Outcome;

/// The page.
pub fn page(report: &Report) -> String {
    let version = report.suite.version.as_deref().unwrap_or("without a version");
    let mut page = format!("# Conformance of {}\n\n", report.decoder.name);
    page += &format!(
        "Suite {version}, {} (`{}`), {}, {} on {}.\n",
        counted(report.suite.vectors.try_into().unwrap_or(usize::MAX), "vector"),
        report.suite.sha256.get(..16).unwrap_or_default(),
        report.date,
        report.system.os,
        report.system.arch
    );
    if let Some(changed) = &report.suite.changed {
        page += &format!("\nThe vectors are not those of suite {version}: {changed}.\n");
    }
    if !report.settings.selection.is_everything() {
        page += "\nOnly a part of the suite was selected.\n";
    }
    if let Some(selected) = report.interrupted {
        page += &format!("\nThe run was interrupted after {} of {selected} cases.\n", report.cases.len());
    }
    page += "\n| Outcome | Cases |\n|---|---|\n";
    for outcome in Outcome::ALL {
        page += &format!("| {} | {} |\n", outcome.name(), report.count(outcome));
    }
    page += "\n| Feature of valid streams | Cases of the suite | Claimed | Run | Passed |\n|---|---|---|---|---|\n";
    for (feature, Tally { cases, claimed, run, pass }) in &report.features {
        page += &format!("| {feature} | {cases} | {claimed} | {run} | {pass} |\n");
    }
    page + &failures(report)
}

fn failures(report: &Report) -> String {
    let mut text = String::new();
    if report.failures() > 0 {
        text += "\n## Failures\n\n";
    }
    for cause in causes(report.cases.iter()) {
        text += &entry(&cause);
    }
    if !report.stale.is_empty() {
        text += "\n## Stale expectations\n\n";
    }
    for entry in &report.stale {
        text += &format!("- {entry}\n");
    }
    text
}

fn entry(cause: &Cause<'_>) -> String {
    let case = cause.first;
    let mut text = format!("- `{}`: {}{}\n", case.case_name(), case.label(), case.contrast());
    for line in explanation(case).into_iter().chain(cause.others()) {
        text += &format!("  - {line}\n");
    }
    text
}
