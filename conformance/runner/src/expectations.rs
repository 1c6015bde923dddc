//! The list of expected failures.
//!
//! A line is `vector[@op[/mode]] outcome  # why`. It stands for every case of the vector, or of its operating point; there
//! are no patterns. Each of these cases has to have this outcome, or the run fails, so that the list stays up to date.

use crate::case::Case;
use crate::error::{Error, Result, read_text};
use crate::result::{CaseResult, Outcome};
use crate::suggest::closest;
use crate::suite::Suite;
use std::path::Path;

/// The list.
#[derive(Debug, Clone, Default)]
pub struct Expectations {
    entries: Vec<Entry>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
struct Entry {
    line: usize,
    /// `vector`, `vector@op` or `vector@op/mode`.
    case: String,
    /// An outcome, or the reason of a failure.
    outcome: String,
}

impl Expectations {
    /// Reads a list.
    ///
    /// # Errors
    /// The file cannot be read, a line is no entry, or it names no case of the suite.
    pub fn read(path: &Path, suite: &Suite) -> Result<Self> {
        let refused = |message: String| Error::content(path, message);
        let list = Self::parse(&read_text(path)?).map_err(refused)?;
        let cases: Vec<String> = Case::all(suite).iter().map(ToString::to_string).collect();
        let idle = list.entries.iter().find(|entry| !cases.iter().any(|case| entry.is_about(case)));
        match idle {
            None => Ok(list),
            Some(Entry { line, case, .. }) => {
                let name = case.split('@').next().unwrap_or_default();
                let similar = match cases.iter().any(|known| known.split('@').next() == Some(name)) {
                    true => closest(case, cases.iter().map(String::as_str)),
                    false => closest(name, suite.vectors.iter().map(|located| located.vector.name.as_str())),
                };
                Err(refused(format!(
                    "line {line}: there is no case {case}; similar ones are {}",
                    similar.join(", ")
                )))
            }
        }
    }

    fn parse(text: &str) -> std::result::Result<Self, String> {
        let mut entries = Vec::new();
        for (index, line) in text.lines().enumerate() {
            let (entry, why) = line.split_once('#').unwrap_or((line, ""));
            let line = index.saturating_add(1);
            let words: Vec<&str> = entry.split_whitespace().collect();
            let [case, outcome] = words.as_slice() else {
                if words.is_empty() {
                    continue;
                }
                return Err(format!("line {line}: write `vector[@op[/mode]] outcome  # why`"));
            };
            if why.trim().is_empty() {
                return Err(format!("line {line}: say after a # why {case} is expected to fail"));
            }
            if case.contains(['*', '?']) {
                return Err(format!("line {line}: patterns are not allowed: name each vector"));
            }
            if !Outcome::FAILURES.contains(outcome) {
                return Err(format!("line {line}: {outcome} is not one of {}", Outcome::FAILURES.join(", ")));
            }
            entries.push(Entry { line, case: (*case).to_owned(), outcome: (*outcome).to_owned() });
        }
        Ok(Self { entries })
    }

    /// Marks the failures that were expected; returns the entries that no longer hold, in words.
    pub fn apply(&self, results: &mut [CaseResult]) -> Vec<String> {
        self.entries.iter().flat_map(|entry| entry.apply(results)).collect()
    }
}

impl Entry {
    fn apply(&self, results: &mut [CaseResult]) -> Vec<String> {
        let Self { line, outcome, .. } = self;
        let mut stale = Vec::new();
        for result in results.iter_mut().filter(|result| self.is_about(&result.case_name())) {
            if result.is_called(outcome) {
                result.failed_as = Some(outcome.clone());
                result.outcome = Outcome::ExpectedFailure;
            } else if result.outcome != Outcome::ExpectedFailure && result.outcome != Outcome::NotClaimed {
                stale.push(format!(
                    "line {line}: {} is {} and not {outcome}",
                    result.case_name(),
                    result.label()
                ));
            }
        }
        stale
    }

    /// Whether the entry stands for a case, `vector@op/mode`.
    fn is_about(&self, name: &str) -> bool {
        name.strip_prefix(&self.case).is_some_and(|rest| rest.is_empty() || rest.starts_with(['@', '/']))
    }
}
