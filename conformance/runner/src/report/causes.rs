//! Failures grouped by their cause, so that a list of them does not repeat one cause for many cases.

use std::collections::{BTreeMap, BTreeSet};

use crate::counted::counted;
use crate::result::{CaseResult, Outcome, Reason};

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

/// What cases of one cause have in common: the verdict, what the files resemble, for wrong values the attribute and the clause
/// to read first, and how the decoder ended otherwise. Names, numbers, codes and what the decoder says itself are left out: with
/// them nearly every case would have a cause of its own.
fn key(case: &CaseResult) -> String {
    let kind = match &case.difference {
        Some(difference) => format!("{} {:?}", difference.attribute, difference.read.first()),
        None if has_verdict(case) => {
            format!("{:?} {:?}", classes(&case.expected), case.answer.as_deref().map(classes))
        }
        None => format!("{:?} {}", case.answer, fault(case.detail.as_deref().unwrap_or_default())),
    };
    format!("{} {:?} {kind}", case.label(), case.symptom)
}

/// Whether the decoder came to a verdict, right or wrong: it did not break off.
fn has_verdict(case: &CaseResult) -> bool {
    let was_killed = matches!(case.reason, Some(Reason::TooMuchMemory | Reason::TooMuchOutput));
    !was_killed && !matches!(case.outcome, Outcome::Crash | Outcome::Timeout)
}

/// The classes in a verdict or in several, without the codes, which are in capitals.
fn classes(verdicts: &str) -> BTreeSet<&str> {
    let is_code = |word: &str| word.contains(|letter: char| letter.is_ascii_uppercase());
    verdicts.split(' ').filter(|word| *word != "or" && !is_code(word)).collect()
}

/// What the runner found, of a description that may have the decoder's last message too: without what is quoted, without numbers,
/// and without the prefix of the stream.
fn fault(detail: &str) -> String {
    let found = without_numbers(&without_quotes(detail));
    let found = found.split("last message: ").next().unwrap_or_default();
    found.trim_start_matches("cut after # bytes").trim_start_matches(": ").to_owned()
}

/// A text without the content of what is quoted in it; a backslash keeps a quote inside.
fn without_quotes(text: &str) -> String {
    let (mut out, mut is_quoted, mut is_escaped) = (String::new(), false, false);
    for letter in text.chars() {
        let is_quote = letter == '"' && !is_escaped;
        is_escaped = is_quoted && letter == '\\' && !is_escaped;
        is_quoted ^= is_quote;
        if !is_quoted || is_quote {
            out.push(letter);
        }
    }
    out
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
    /// What is said of the other cases, in lines: their names, not too many, and the verdicts that were right for all, where these
    /// differ.
    pub(super) fn others(&self) -> Vec<String> {
        const NAMED: usize = 6;
        if self.others.is_empty() {
            return Vec::new();
        }
        let names = self.others.iter().map(|case| case.case_name());
        let named = shortened(names, NAMED);
        let likewise = format!("likewise {}: {named}", counted(self.others.len(), "case"));
        std::iter::once(likewise)
            .chain(self.expected().map(|all| format!("expected of all: {all}")))
            .collect()
    }

    /// The right verdicts and of how many cases they are, the most frequent first.
    fn expected(&self) -> Option<String> {
        const NAMED: usize = 8;
        let mut verdicts: BTreeMap<&str, usize> = BTreeMap::new();
        for case in std::iter::once(&self.first).chain(&self.others) {
            *verdicts.entry(&case.expected).or_default() += 1;
        }
        if verdicts.len() < 2 || !has_verdict(self.first) {
            return None;
        }
        let mut verdicts: Vec<(&str, usize)> = verdicts.into_iter().collect();
        verdicts.sort_by_key(|&(_, count)| std::cmp::Reverse(count));
        let verdicts = verdicts.into_iter().map(|(verdict, count)| format!("{verdict} ({count})"));
        Some(shortened(verdicts, NAMED))
    }
}

/// The first of some texts, and how many more there are.
fn shortened(texts: impl Iterator<Item = String>, shown: usize) -> String {
    let texts: Vec<String> = texts.collect();
    let rest = match texts.len().saturating_sub(shown) {
        0 => String::new(),
        rest => format!(" and {rest} more"),
    };
    let texts: Vec<String> = texts.into_iter().take(shown).collect();
    format!("{}{rest}", texts.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_are_told_apart_by_what_the_runner_found() {
        for (detail, found) in [
            (
                r#"the answer "/a/7.gss\"s0\t"... does not start; only"#,
                r#"the answer ""... does not start; only"#,
            ),
            ("cut after 17 bytes: no answer within 10 s", "no answer within # s"),
            ("the process ended; last message: line 3 of \"in.gss", "the process ended; "),
            ("last message: thread panicked", ""),
        ] {
            assert_eq!(fault(detail), found);
        }
        assert_eq!(classes("invalid OUT_OF_RANGE or invalid CONSTRAINT"), ["invalid"].into());
        assert_eq!(classes("over limit"), ["over", "limit"].into());
    }
}
