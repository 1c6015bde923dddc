//! A report for people, as text.

use super::Report;
use crate::difference::Difference;
use crate::result::{CaseResult, Outcome};
use std::fmt::Write;

/// Failures that are told in full; the report has all of them.
const SHOWN: usize = 20;

/// The text.
pub fn text(report: &Report) -> String {
    let mut text = String::new();
    let failures: Vec<&CaseResult> = report.cases.iter().filter(|case| case.outcome.is_failure()).collect();
    for case in failures.iter().take(SHOWN) {
        text += &told(case);
    }
    if let Some(more @ 1..) = failures.len().checked_sub(SHOWN) {
        text += &format!("... and {}; --report FILE has all of them\n", counted(more, "more failure"));
    }
    for entry in &report.stale {
        text += &format!("STALE expectation, {entry}\n");
    }
    let warned = report.cases.iter().filter(|case| !case.warnings.is_empty());
    let warnings: Vec<String> = warned
        .flat_map(|case| {
            case.warnings.iter().map(|warning| format!("warning: {}: {warning}\n", case.case_name()))
        })
        .collect();
    text += &warnings.iter().take(SHOWN).map(String::as_str).collect::<String>();
    if let Some(more @ 1..) = warnings.len().checked_sub(SHOWN) {
        text += &format!("... and {}; --strict makes failures of them\n", counted(more, "more warning"));
    }
    if !text.is_empty() {
        text.push('\n');
    }
    text + &last_line(report)
}

/// The lines about a failed case.
fn told(case: &CaseResult) -> String {
    let mut text = format!("FAIL {}: {}{}\n", case.case_name(), case.label(), contrast(case));
    for line in explanation(case) {
        text += &format!("  {line}\n");
    }
    text
}

/// What was expected and what was answered, where that is the fault.
pub(super) fn contrast(case: &CaseResult) -> String {
    match &case.answer {
        Some(answer) if *answer != case.expected => format!("; expected {}, found {answer}", case.expected),
        _ => String::new(),
    }
}

/// What is wrong with a case, line by line.
pub(super) fn explanation(case: &CaseResult) -> Vec<String> {
    let difference = case.difference.as_ref().map(difference).unwrap_or_default();
    let symptom = case.symptom.map(|symptom| format!("looks like: {}", symptom.words()));
    case.detail.iter().cloned().chain(difference).chain(symptom).collect()
}

fn difference(difference: &Difference) -> Vec<String> {
    let Difference { frame, frame_type, attribute, gaussians, .. } = difference;
    let kind = frame_type.as_ref().map_or_else(String::new, |kind| format!(" ({kind})"));
    let mut place = format!("first in the order of coding: frame {frame}{kind}, {attribute}");
    if let Some(value) = difference.value {
        let _infallible = write!(
            place,
            ", Gaussian {} of {gaussians}, component {}: expected {}, found {} ({} wrong here)",
            value.gaussian, value.component, value.expected, value.found, value.differing
        );
    } else if let Some(bytes) = difference.bytes_found {
        let _infallible = write!(place, ": {bytes} bytes are not those of {gaussians} Gaussians");
    }
    let carrier = difference.carrier.as_ref().map(|carrier| {
        format!(
            "carried by unit {} ({}, {} bytes at byte {}; frame {}, spatial layer {}, refinement {})",
            carrier.unit,
            carrier.unit_type,
            carrier.bytes,
            carrier.byte,
            carrier.frame,
            carrier.spatial_layer,
            carrier.refinement
        )
    });
    let read = (!difference.read.is_empty()).then(|| format!("read {}", difference.read.join(", ")));
    std::iter::once(place).chain(carrier).chain(read).collect()
}

/// How many, and the verdict.
fn last_line(report: &Report) -> String {
    let counts: Vec<String> = Outcome::ALL
        .into_iter()
        .filter(|&outcome| report.count(outcome) > 0)
        .map(|outcome| format!("{} {}", report.count(outcome), outcome.name()))
        .collect();
    let vectors = report.cases.chunk_by(|a, b| a.vector == b.vector).count();
    let is_whole = report.all.run == report.all.claimed && report.suite.changed.is_none();
    let verdict = match (report.is_good(), report.count(Outcome::Pass)) {
        (true, _) if is_whole => "good",
        (true, _) => "good as far as it was run",
        (false, 0) => "NOT GOOD: no case passed",
        (false, _) => "NOT GOOD",
    };
    let (cases, vectors) = (counted(report.cases.len(), "case"), counted(vectors, "vector"));
    format!("{}: {verdict}; {cases} of {vectors}: {}\n", report.decoder.name, counts.join(", "))
}

/// A number of things.
pub fn counted(number: usize, what: &str) -> String {
    format!("{number} {what}{}", if number == 1 { "" } else { "s" })
}
