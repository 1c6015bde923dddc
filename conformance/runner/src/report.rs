//! What a run found, for machines: `conformance/schema/report.schema.json`. Two runs of the same decoder on the same suite
//! give the same bytes, but for `date`.

pub mod junit;
pub mod markdown;
pub mod summary;

use crate::capabilities::Capabilities;
use crate::error::{Error, Result, read_json};
use crate::limits::Limits;
use crate::result::{CaseResult, Outcome};
use crate::run::Settings;
use crate::selection::Selection;
use crate::suite::Suite;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// What `schema` of a report says.
const SCHEMA: &str = "splatstream-report/1";

/// A report.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Report {
    /// The schema's name and version.
    pub schema: String,
    /// Day of the run, `YYYY-MM-DD`, UTC.
    pub date: String,
    /// What was run.
    pub suite: SuiteRecord,
    /// What ran it.
    pub runner: Runner,
    /// Where.
    pub system: System,
    /// The claim of the decoder under test, its name included.
    pub decoder: Capabilities,
    /// How it was run.
    pub settings: SettingsRecord,
    /// Cases by outcome.
    pub summary: BTreeMap<Outcome, u64>,
    /// Cases by feature of the stream; those of kind valid alone, so that a decoder that rejects everything has none.
    pub features: BTreeMap<String, Tally>,
    /// Entries of the list of expectations that no longer hold.
    pub stale: Vec<String>,
    /// Every case, in the order of the suite.
    pub cases: Vec<CaseResult>,
}

/// The suite of a report.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SuiteRecord {
    /// Of VERSION.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub version: Option<String>,
    /// Version of the specification.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub specification: Option<String>,
    /// Vectors in the suite.
    pub vectors: u64,
    /// SHA-256 over names and streams.
    pub sha256: String,
}

/// The program that made a report.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Runner {
    /// Its name.
    pub name: String,
    /// Its version.
    pub version: String,
}

/// The machine.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct System {
    /// Operating system.
    pub os: String,
    /// Processor architecture.
    pub arch: String,
    /// Processors that were there.
    pub processors: u64,
}

/// How a report came about.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SettingsRecord {
    /// Whether a wrong code was a failure.
    pub strict: bool,
    /// Of a case.
    pub limits: Limits,
    /// Which cases were run; none was left out if it is empty.
    pub selection: Selection,
}

/// Cases by what became of them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Tally {
    /// All of them.
    pub cases: u64,
    /// Passed.
    pub pass: u64,
    /// Not asked, because the decoder does not claim it.
    pub not_claimed: u64,
}

impl Report {
    /// The report of a run on a suite.
    pub fn new(
        suite: &Suite,
        settings: &Settings,
        selection: &Selection,
        cases: Vec<CaseResult>,
        stale: Vec<String>,
    ) -> Self {
        let mut summary: BTreeMap<Outcome, u64> =
            Outcome::ALL.into_iter().map(|outcome| (outcome, 0)).collect();
        for case in &cases {
            *summary.entry(case.outcome).or_default() += 1;
        }
        let processors = std::thread::available_parallelism().map_or(1, usize::from);
        Self {
            schema: SCHEMA.to_owned(),
            date: chrono::Utc::now().format("%Y-%m-%d").to_string(),
            suite: SuiteRecord {
                version: suite.version.clone(),
                specification: suite.specification.clone(),
                vectors: suite.vectors.len() as u64,
                sha256: suite.sha256(),
            },
            runner: Runner {
                name: env!("CARGO_PKG_NAME").to_owned(),
                version: env!("CARGO_PKG_VERSION").to_owned(),
            },
            system: System {
                os: std::env::consts::OS.to_owned(),
                arch: std::env::consts::ARCH.to_owned(),
                processors: processors as u64,
            },
            decoder: settings.capabilities.clone(),
            settings: SettingsRecord {
                strict: settings.strict,
                limits: settings.limits,
                selection: selection.clone(),
            },
            summary,
            features: tallies(suite, &cases),
            stale,
            cases,
        }
    }

    /// Reads a report.
    ///
    /// # Errors
    /// The file cannot be read, or is no report.
    pub fn read(path: &Path) -> Result<Self> {
        let report: Self = read_json(path)?;
        if report.schema != SCHEMA {
            let message = format!("the schema is {}, this runner knows {SCHEMA}", report.schema);
            return Err(Error::content(path, message));
        }
        Ok(report)
    }

    /// Cases with an outcome.
    pub fn count(&self, outcome: Outcome) -> u64 {
        self.summary.get(&outcome).copied().unwrap_or(0)
    }

    /// Cases that failed without being expected to.
    pub fn failures(&self) -> u64 {
        Outcome::ALL
            .into_iter()
            .filter(|outcome| outcome.is_failure())
            .map(|outcome| self.count(outcome))
            .sum()
    }

    /// Whether the decoder did all that it claims: some case passed, none failed, and the list of expectations holds.
    pub fn is_good(&self) -> bool {
        self.failures() == 0 && self.stale.is_empty() && self.count(Outcome::Pass) > 0
    }
}

/// Cases of valid vectors by the features of their streams, and under `profile N` by profile.
fn tallies(suite: &Suite, cases: &[CaseResult]) -> BTreeMap<String, Tally> {
    let vectors: BTreeMap<&str, _> =
        suite.vectors.iter().map(|located| (located.vector.name.as_str(), &located.vector)).collect();
    let mut tallies: BTreeMap<String, Tally> = BTreeMap::new();
    for case in cases.iter().filter(|case| case.kind == crate::vector::Kind::Valid) {
        let Some(vector) = vectors.get(case.vector.as_str()) else { continue };
        for feature in vector.features.iter().cloned().chain([format!("profile {}", vector.profile)]) {
            let tally = tallies.entry(feature).or_default();
            tally.cases += 1;
            tally.pass += u64::from(case.outcome == Outcome::Pass);
            tally.not_claimed += u64::from(case.outcome == Outcome::NotClaimed);
        }
    }
    tallies
}
