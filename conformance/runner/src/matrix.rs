//! A page of features and decoders, made from reports.

use crate::report::{Report, Tally};
use crate::result::{CaseResult, Outcome};
use std::collections::BTreeSet;

const HEAD: &str = "# Decoders and features\n\nMade by `splatstream conformance matrix` from reports of runs. Yes: every case with this \
    feature in the valid vectors of the whole suite was run and passed. The page is as reliable as the reports; anyone can \
    run the suite again.\n\n";

/// The page.
///
/// Yes means that every valid case with the feature in the whole suite was run and passed. The last rows are about streams
/// with errors and about the runs.
pub fn page(reports: &[Report]) -> String {
    let mut page = HEAD.to_owned();
    let mut row = |first: &str, cell: &dyn Fn(&Report) -> String| {
        let cells: Vec<String> = reports.iter().map(cell).collect();
        page += &format!("| {first} | {} |\n", cells.join(" | "));
    };
    let names = names(reports);
    let name = |report: &Report| {
        let index = reports.iter().position(|other| std::ptr::eq(other, report));
        index.and_then(|index| names.get(index)).cloned().unwrap_or_default()
    };
    row("Feature", &name);
    row("---", &|_| "---".to_owned());
    let features: BTreeSet<&String> = reports.iter().flat_map(|report| report.features.keys()).collect();
    for feature in features {
        row(feature, &|report| word(report, report.features.get(feature).copied().unwrap_or_default()));
    }
    row("streams with errors", &|report| word(report, report.broken));
    row("no crash, no timeout", &|report| word(report, steadiness(report)));
    row("suite", &suite);
    row("day", &|report| report.date.clone());
    if !all_alike(reports) {
        page +=
            "\nThe reports are of different suites: rows can be compared only where the suite is the same.\n";
    }
    page
}

/// The names of decoders; of those with the same name the later ones are numbered.
fn names(reports: &[Report]) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for (index, Report { decoder, .. }) in reports.iter().enumerate() {
        let name = decoder.name.replace('|', "\\|");
        let before = reports.iter().take(index).filter(|other| other.decoder.name == decoder.name).count();
        names.push(if before == 0 { name } else { format!("{name} ({})", before.saturating_add(1)) });
    }
    names
}

/// A tally as text.
fn word(report: &Report, tally: Tally) -> String {
    let Tally { cases, claimed, run, pass } = tally;
    let failed = run.saturating_sub(pass);
    if cases == 0 {
        "not tested".to_owned()
    } else if claimed == 0 {
        "not claimed".to_owned()
    } else if failed > 0 {
        format!("No: {failed} of {run} failed")
    } else if run == 0 {
        "not run".to_owned()
    } else if run < claimed {
        format!("part: {run} of {cases} run")
    } else if claimed < cases {
        format!("{claimed} of {cases} claimed, all passed")
    } else if report.suite.changed.is_some() {
        format!("{pass} of a changed suite, all passed")
    } else {
        "Yes".to_owned()
    }
}

/// All cases; those that ended in a crash or a timeout count as failed.
fn steadiness(report: &Report) -> Tally {
    let is = |case: &CaseResult, outcome: Outcome| {
        case.outcome == outcome || case.failed_as.as_deref() == Some(outcome.name())
    };
    let bad =
        report.cases.iter().filter(|case| is(case, Outcome::Crash) || is(case, Outcome::Timeout)).count();
    Tally { pass: report.all.run.saturating_sub(bad as u64), ..report.all }
}

fn suite(report: &Report) -> String {
    let version = report.suite.version.as_deref().unwrap_or("?");
    let changed = if report.suite.changed.is_some() { ", changed" } else { "" };
    let part = if report.settings.selection.is_everything() { "" } else { ", a part" };
    let interrupted = if report.interrupted.is_some() { ", interrupted" } else { "" };
    format!("{version}{changed}{part}{interrupted}")
}

fn all_alike(reports: &[Report]) -> bool {
    reports.windows(2).all(|pair| match pair {
        [a, b] => a.suite == b.suite,
        _ => true,
    })
}
