//! A report as text for people.

use super::Report;
use super::causes::{Cause, causes};
use crate::SourceUnit;
use crate::counted::counted;
use crate::difference::Difference;
use crate::result::{CaseResult, Outcome};
use std::fmt::Write;

/// Causes and warnings that are printed; the report has all of them.
const SHOWN: usize = 20;

/// The text.
pub fn text(report: &Report) -> String {
    let mut text = String::new();
    let causes = causes(report.cases.iter());
    for cause in causes.iter().take(SHOWN) {
        text += &described(cause);
    }
    if let Some(more @ 1..) = causes.len().checked_sub(SHOWN) {
        text +=
            &format!("... and failures of {}; --report FILE has all of them\n", counted(more, "other cause"));
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
        text += &format!("... and {}; with --strict they are failures\n", counted(more, "more warning"));
    }
    if !text.is_empty() {
        text.push('\n');
    }
    text + &last_line(report)
}

/// The lines about the failures of one cause.
fn described(cause: &Cause<'_>) -> String {
    let case = cause.first;
    let mut text = format!("FAIL {}: {}{}\n", case.case_name(), case.label(), case.contrast());
    for line in explanation(case).into_iter().chain(cause.others()) {
        text += &format!("  {line}\n");
    }
    text
}

/// What is wrong with a case, in lines.
pub(super) fn explanation(case: &CaseResult) -> Vec<String> {
    let difference = case.difference.as_ref().map(difference).unwrap_or_default();
    let symptom = case.symptom.map(|symptom| format!("looks like: {}", symptom.words()));
    case.detail.iter().cloned().chain(difference).chain(symptom).collect()
}

fn difference(difference: &Difference) -> Vec<String> {
    let Difference { frame, frame_type, attribute, gaussians, .. } = difference;
    let kind = frame_type.as_ref().map_or_else(String::new, |kind| format!(" ({kind})"));
    let mut first = format!("first in coding order: frame {frame}{kind}, {attribute}");
    if let Some(value) = difference.value {
        let _infallible = write!(
            first,
            ", Gaussian {} of {gaussians}, component {}: expected {}, found {} ({} wrong here)",
            value.gaussian, value.component, value.expected, value.found, value.differing
        );
    } else if let Some(bytes) = difference.bytes_found {
        let _infallible = write!(first, ": {bytes} bytes is not the size of {gaussians} Gaussians");
    }
    let unit = difference.unit.as_ref().map(|source| {
        let SourceUnit { unit, unit_type, byte, bytes, frame, spatial_layer, refinement } = source;
        format!(
            "decoded from unit {unit} ({unit_type}, {bytes} bytes at byte {byte}; frame {frame}, spatial layer \
            {spatial_layer}, refinement {refinement})"
        )
    });
    let read = (!difference.read.is_empty()).then(|| format!("read {}", difference.read.join(", ")));
    std::iter::once(first).chain(unit).chain(read).collect()
}

/// The verdict and the counts.
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
        (true, _) => "good, but only a part was run",
        (false, 0) => "NOT GOOD: no case passed",
        (false, _) => "NOT GOOD",
    };
    let (cases, vectors) = (counted(report.cases.len(), "case"), counted(vectors, "vector"));
    format!("{}: {verdict}; {cases} of {vectors}: {}\n", report.decoder.name, counts.join(", "))
}
