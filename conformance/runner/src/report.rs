//! The report of a run, `conformance/schema/report.schema.json`. Two runs of the same decoder on the same suite give the
//! same bytes except for `date`.

mod causes;
pub mod junit;
pub mod markdown;
pub mod summary;
mod tally;

pub use tally::Tally;

use crate::capabilities::Capabilities;
use crate::case::Case;
use crate::error::{Error, Result, read_text};
use crate::limits::Limits;
use crate::result::{CaseResult, Outcome};
use crate::run::Settings;
use crate::selection::Selection;
use crate::suite::Suite;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use tally::Tallies;

/// What `schema` of a report says.
const SCHEMA: &str = "splatstream-report/3";

/// A report.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Report {
    /// The schema's name and version.
    pub schema: String,
    /// Day of the run, `YYYY-MM-DD`, UTC.
    pub date: String,
    /// The suite.
    pub suite: SuiteRecord,
    /// The program that ran it.
    pub runner: Runner,
    /// The machine.
    pub system: System,
    /// The claim of the decoder under test, with its name.
    pub decoder: Capabilities,
    /// The settings of the run.
    pub settings: SettingsRecord,
    /// Cases by outcome.
    pub summary: BTreeMap<Outcome, u64>,
    /// If the run was cancelled: the number of cases that were selected.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interrupted: Option<u64>,
    /// All cases of the suite.
    pub all: Tally,
    /// Those of kind invalid and either.
    pub broken: Tally,
    /// Cases of kind valid by feature of the stream.
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
    /// How the vectors differ from those of the version, in words.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub changed: Option<String>,
    /// Vectors in the suite.
    pub vectors: u64,
    /// SHA-256 over names and records.
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
    /// Number of processors.
    pub processors: u64,
}

/// The settings of a run.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SettingsRecord {
    /// Whether a wrong code was a failure.
    pub strict: bool,
    /// Limits of a case.
    pub limits: Limits,
    /// Which cases were selected; all if it is empty.
    pub selection: Selection,
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
        let selected = selection.of(Case::all(suite)).map_or(0, |selected| selected.len());
        let Tallies { all, broken, features } = Tallies::new(suite, &settings.capabilities, &cases);
        let processors = std::thread::available_parallelism().map_or(1, usize::from);
        Self {
            schema: SCHEMA.to_owned(),
            date: chrono::Utc::now().format("%Y-%m-%d").to_string(),
            suite: SuiteRecord {
                version: suite.version.clone(),
                specification: suite.specification.clone(),
                changed: suite.changed.clone(),
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
            interrupted: (cases.len() < selected).then_some(selected as u64),
            all,
            broken,
            features,
            stale,
            cases,
        }
    }

    /// Reads a report.
    ///
    /// # Errors
    /// The file cannot be read or is not a report.
    pub fn read(path: &Path) -> Result<Self> {
        let wrong = |what: String| {
            let advice = "`splatstream conformance run --report FILE.json` writes one";
            Error::content(path, format!("{what}\n  {advice}"))
        };
        let text = read_text(path)?;
        let value: serde_json::Value =
            serde_json::from_str(&text).map_err(|error| wrong(format!("not a report of a run: {error}")))?;
        match value.get("schema").and_then(serde_json::Value::as_str) {
            Some(SCHEMA) => {}
            Some(other) => {
                return Err(wrong(format!("the schema is {other} instead of {SCHEMA}")));
            }
            None => return Err(wrong("not a report of a run: it has no schema".to_owned())),
        }
        serde_json::from_value(value).map_err(|error| wrong(error.to_string()))
    }

    /// Cases with an outcome.
    pub fn count(&self, outcome: Outcome) -> u64 {
        self.summary.get(&outcome).copied().unwrap_or(0)
    }

    /// Cases that failed unexpectedly.
    pub fn failures(&self) -> u64 {
        Outcome::ALL
            .into_iter()
            .filter(|outcome| outcome.is_failure())
            .map(|outcome| self.count(outcome))
            .sum()
    }

    /// Whether some case passed, none failed, and the list of expectations holds.
    pub fn is_good(&self) -> bool {
        self.failures() == 0 && self.stale.is_empty() && self.count(Outcome::Pass) > 0
    }
}
