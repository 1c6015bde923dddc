//! Which cases of a suite are run.

use crate::case::Case;
use crate::error::{Error, Result};
use crate::vector::Kind;
use globset::{Glob, GlobMatcher};
use serde::{Deserialize, Serialize};

/// What a case has to be to be run; what is not given is not asked for.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Selection {
    /// A pattern on names of vectors: `*` and `?` as in file names.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub filter: Option<String>,
    /// An area.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub area: Option<String>,
    /// A kind.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kind: Option<Kind>,
    /// A feature that a decoder needs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub feature: Option<String>,
    /// A rule that the vector is about, such as SS-PR-003.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub requirement: Option<String>,
}

impl Selection {
    /// The cases to run.
    ///
    /// # Errors
    /// The pattern is none, or no case is left.
    pub fn of<'a>(&self, cases: Vec<Case<'a>>) -> Result<Vec<Case<'a>>> {
        let name = self.filter.as_deref().map(matcher).transpose()?;
        let takes = |case: &Case<'_>| {
            self.takes(case) && name.as_ref().is_none_or(|name| name.is_match(&case.vector.name))
        };
        let selected: Vec<Case<'a>> = cases.into_iter().filter(takes).collect();
        if selected.is_empty() {
            let message =
                "no case is selected; `splatstream conformance list` shows names, areas and features";
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
}

fn matcher(pattern: &str) -> Result<GlobMatcher> {
    let glob =
        Glob::new(pattern).map_err(|error| Error::Usage(format!("--filter {pattern}: {}", error.kind())))?;
    Ok(glob.compile_matcher())
}
