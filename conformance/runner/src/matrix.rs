//! Which decoder does what: a page of features and decoders. Every word of it comes from reports.

use crate::report::{Report, Tally};
use crate::result::Outcome;
use std::collections::BTreeSet;

/// The page.
///
/// A Yes means that every valid case with the feature was run and passed. The last rows are about broken streams and about
/// the runs themselves.
pub fn page(reports: &[Report]) -> String {
    let mut page = "# What decoders do\n\nMade by `splatstream conformance matrix` from reports of runs; nothing here was \
        written by hand. Yes: every valid case with this feature was run and passed.\n\n"
        .to_owned();
    let row = |first: &str, cells: Vec<String>| format!("| {first} | {} |\n", cells.join(" | "));
    page += &row("Feature", reports.iter().map(|report| report.decoder.name.clone()).collect());
    page += &row("---", reports.iter().map(|_| "---".to_owned()).collect());
    let features: BTreeSet<&String> = reports.iter().flat_map(|report| report.features.keys()).collect();
    for feature in features {
        let cell = |report: &Report| word(report.features.get(feature).copied().unwrap_or_default());
        page += &row(feature, reports.iter().map(cell).collect());
    }
    page += &row(
        "broken streams refused, and rightly",
        reports.iter().map(|report| word(broken(report))).collect(),
    );
    page += &row("no crash, no timeout", reports.iter().map(steadiness).collect());
    page += &row("suite", reports.iter().map(suite).collect());
    page += &row("day", reports.iter().map(|report| report.date.clone()).collect());
    if !all_alike(reports) {
        page +=
            "\nThe reports are of different suites: rows can be compared only where the suite is the same.\n";
    }
    page
}

/// What a tally amounts to.
fn word(tally: Tally) -> String {
    let Tally { cases, pass, not_claimed } = tally;
    match (cases, pass) {
        (0, _) => "not tested".to_owned(),
        _ if not_claimed == cases => "not claimed".to_owned(),
        _ if pass == cases => "Yes".to_owned(),
        (_, 0) => "No".to_owned(),
        _ => format!("partly, {pass} of {cases}"),
    }
}

/// Cases that are not of valid vectors.
fn broken(report: &Report) -> Tally {
    let mut tally = Tally::default();
    for case in report.cases.iter().filter(|case| case.kind != crate::vector::Kind::Valid) {
        tally.cases += 1;
        tally.pass += u64::from(case.outcome == Outcome::Pass);
        tally.not_claimed += u64::from(case.outcome == Outcome::NotClaimed);
    }
    tally
}

fn steadiness(report: &Report) -> String {
    let is = |case: &crate::result::CaseResult, outcome: Outcome| {
        case.outcome == outcome || case.failed_as.as_deref() == Some(outcome.name())
    };
    let bad =
        report.cases.iter().filter(|case| is(case, Outcome::Crash) || is(case, Outcome::Timeout)).count();
    if bad == 0 { "Yes".to_owned() } else { format!("No, {bad} cases") }
}

fn suite(report: &Report) -> String {
    let version = report.suite.version.as_deref().unwrap_or("?");
    let part = if report.settings.selection.is_everything() { "" } else { ", a part" };
    format!("{version}{part}")
}

fn all_alike(reports: &[Report]) -> bool {
    reports.windows(2).all(|pair| match pair {
        [a, b] => a.suite == b.suite,
        _ => true,
    })
}
