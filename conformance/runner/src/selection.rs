//! Which cases of a suite are run.

use crate::case::Case;
use crate::error::{Error, Result};
use crate::feature;
use crate::suggest::closest;
use crate::vector::Kind;
use globset::{Glob, GlobMatcher};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// Conditions that a case has to meet to be run.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Selection {
    /// Patterns with `*` and `?` as in file names, one of which shall match the name of the vector, or, if the pattern has
    /// an `@`, `vector@op` or `vector@op/mode`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub filter: Vec<String>,
    /// An area.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub area: Option<String>,
    /// A kind.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kind: Option<Kind>,
    /// A feature that a decoder needs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub feature: Option<String>,
    /// A requirement that the vector tests, such as SS-PR-003.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub requirement: Option<String>,
}

impl Selection {
    /// The cases to run.
    ///
    /// # Errors
    /// A pattern is not valid or selects nothing, or no case is left.
    pub fn of<'a>(&self, cases: Vec<Case<'a>>) -> Result<Vec<Case<'a>>> {
        let filter = self.filter.iter().map(|pattern| Pattern::new(pattern)).collect::<Result<Vec<_>>>()?;
        if let Some(idle) = filter.iter().find(|pattern| !cases.iter().any(|case| pattern.takes(case))) {
            let core: String = idle.text.split('@').next().unwrap_or_default().replace(['*', '?'], "");
            let similar = closest(&core, cases.iter().map(|case| case.vector.name.as_str())).join(", ");
            let message = format!("no case is called {}; similar vectors are {similar}", idle.text);
            return Err(Error::Usage(message));
        }
        self.check_words(&cases)?;
        let takes = |case: &Case<'_>| {
            self.takes(case) && (filter.is_empty() || filter.iter().any(|pattern| pattern.takes(case)))
        };
        let selected: Vec<Case<'a>> = cases.into_iter().filter(takes).collect();
        if selected.is_empty() {
            let message = "each of these options selects cases, but no case is selected by all of them\n  \
                `splatstream conformance list` shows names, areas, features and requirements";
            return Err(Error::Usage(message.to_owned()));
        }
        Ok(selected)
    }

    /// Whether all cases are run.
    pub fn is_everything(&self) -> bool {
        *self == Self::default()
    }

    fn takes(&self, case: &Case<'_>) -> bool {
        let vector = case.vector;
        let among = |wanted: &Option<String>, list: &[String]| {
            wanted.as_ref().is_none_or(|wanted| list.contains(wanted))
        };
        self.area.as_ref().is_none_or(|area| *area == vector.area)
            && self.kind.is_none_or(|kind| kind == vector.kind)
            && among(&self.feature, &vector.features)
            && among(&self.requirement, &vector.requirements)
    }

    /// Refuses an area, a feature or a requirement that no vector has.
    fn check_words(&self, cases: &[Case<'_>]) -> Result<()> {
        let vectors = || cases.iter().map(|case| case.vector);
        let areas: BTreeSet<&str> = vectors().map(|vector| vector.area.as_str()).collect();
        let requirements: BTreeSet<&str> =
            vectors().flat_map(|vector| &vector.requirements).map(String::as_str).collect();
        let is_known = |word: &Option<String>, known: &BTreeSet<&str>| {
            word.as_ref().is_none_or(|word| known.contains(word.as_str()))
        };
        let features: BTreeSet<&str> = feature::names().collect();
        let list = |what: &str, word: &str, known: &BTreeSet<&str>| {
            let known: Vec<&str> = known.iter().copied().collect();
            Err(Error::Usage(format!("there is no {what} '{word}'; there are {}", known.join(", "))))
        };
        match self {
            Self { area: Some(area), .. } if !is_known(&self.area, &areas) => list("area", area, &areas),
            Self { feature: Some(feature), .. } if !is_known(&self.feature, &features) => {
                list("feature", feature, &features)
            }
            Self { requirement: Some(wanted), .. } if !is_known(&self.requirement, &requirements) => {
                let similar = closest(wanted, requirements).join(", ");
                Err(Error::Usage(format!("no vector tests '{wanted}'; similar requirements are {similar}")))
            }
            _ => Ok(()),
        }
    }
}

/// A pattern on cases.
struct Pattern<'p> {
    text: &'p str,
    matcher: GlobMatcher,
}

impl<'p> Pattern<'p> {
    fn new(text: &'p str) -> Result<Self> {
        let glob =
            Glob::new(text).map_err(|error| Error::Usage(format!("--filter {text}: {}", error.kind())))?;
        Ok(Self { text, matcher: glob.compile_matcher() })
    }

    fn takes(&self, case: &Case<'_>) -> bool {
        let name = &case.vector.name;
        match self.text.contains('@') {
            false => self.matcher.is_match(name),
            true => {
                self.matcher.is_match(case.to_string())
                    || self.matcher.is_match(format!("{name}@{}", case.op()))
            }
        }
    }
}
