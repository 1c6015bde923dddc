//! Counts of cases of the whole suite and of their results.

use crate::capabilities::Capabilities;
use crate::case::Case;
use crate::result::{CaseResult, Outcome};
use crate::suite::Suite;
use crate::vector::Kind;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Counts of cases.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Tally {
    /// In the suite, selected or not.
    pub cases: u64,
    /// Among these, claimed by the decoder.
    pub claimed: u64,
    /// Among these, run.
    pub run: u64,
    /// Among these, passed.
    pub pass: u64,
}

/// The tallies of a report.
#[derive(Debug, Default)]
pub(super) struct Tallies {
    /// All cases.
    pub(super) all: Tally,
    /// Those of other vectors than valid ones.
    pub(super) broken: Tally,
    /// Those of valid vectors by the features of their streams, and under `profile N` by profile.
    pub(super) features: BTreeMap<String, Tally>,
}

impl Tallies {
    pub(super) fn new(suite: &Suite, claim: &Capabilities, results: &[CaseResult]) -> Self {
        let outcomes: BTreeMap<String, Outcome> =
            results.iter().map(|result| (result.case_name(), result.outcome)).collect();
        let mut tallies = Self::default();
        for case in Case::all(suite) {
            let is_claimed = claim.missing(&case).is_none();
            let outcome = outcomes.get(&case.to_string()).copied().filter(|_| is_claimed);
            tallies.all.add(is_claimed, outcome);
            if case.vector.kind != Kind::Valid {
                tallies.broken.add(is_claimed, outcome);
                continue;
            }
            for feature in
                case.vector.features.iter().cloned().chain([format!("profile {}", case.vector.profile)])
            {
                tallies.features.entry(feature).or_default().add(is_claimed, outcome);
            }
        }
        tallies
    }
}

impl Tally {
    /// Counts a case; `outcome` is none for one that was not run.
    fn add(&mut self, is_claimed: bool, outcome: Option<Outcome>) {
        self.cases += 1;
        self.claimed += u64::from(is_claimed);
        self.run += u64::from(outcome.is_some());
        self.pass += u64::from(outcome == Some(Outcome::Pass));
    }
}
