//! Failures grouped by their cause, so that a list of them does not repeat one cause for many cases.

use crate::result::CaseResult;

/// Failed cases that look as if they had the same cause; the first is described for all of them.
#[derive(Debug)]
pub(super) struct Cause<'a> {
    pub(super) first: &'a CaseResult,
    pub(super) others: Vec<&'a CaseResult>,
}

/// Groups failures by cause, in the order of their first cases.
pub(super) fn causes<'a>(cases: impl Iterator<Item = &'a CaseResult>) -> Vec<Cause<'a>> {
    let mut causes: Vec<(String, Cause<'a>)> = Vec::new();
    for case in cases.filter(|case| case.outcome.is_failure()) {
        let key = key(case);
        match causes.iter_mut().find(|(other, _)| *other == key) {
            Some((_, cause)) => cause.others.push(case),
            None => causes.push((key, Cause { first: case, others: Vec::new() })),
        }
    }
    causes.into_iter().map(|(_, cause)| cause).collect()
}

/// What cases of one cause have in common: verdict and symptom, and for wrong values the attribute and the clause to read
/// first, for everything else the description without its numbers.
fn key(case: &CaseResult) -> String {
    let detail = match &case.difference {
        Some(difference) => format!("{} {:?}", difference.attribute, difference.read.first()),
        None => without_numbers(case.detail.as_deref().unwrap_or_default()),
    };
    format!("{} {} {:?} {detail}", case.label(), case.contrast(), case.symptom)
}

fn without_numbers(text: &str) -> String {
    let is_number = |a: char, b: char| a.is_ascii_digit() && b.is_ascii_digit();
    let parts: Vec<char> = text.chars().collect();
    let parts = parts.chunk_by(|&a, &b| is_number(a, b));
    let part = |part: &[char]| match part {
        [first, ..] if first.is_ascii_digit() => "#".to_owned(),
        other => other.iter().collect(),
    };
    parts.map(part).collect()
}

impl Cause<'_> {
    /// The names of the other cases, not too many.
    pub(super) fn others(&self) -> Option<String> {
        const NAMED: usize = 6;
        let names: Vec<String> = self.others.iter().take(NAMED).map(|case| case.case_name()).collect();
        let rest = match self.others.len().saturating_sub(NAMED) {
            0 => String::new(),
            rest => format!(" and {rest} more"),
        };
        (!names.is_empty()).then(|| {
            format!(
                "likewise {}: {}{rest}",
                crate::counted::counted(self.others.len(), "case"),
                names.join(", ")
            )
        })
    }
}
