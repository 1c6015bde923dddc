//! How a case went.

use crate::difference::Difference;
use crate::symptom::Symptom;
use crate::vector::{Kind, Mode};
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// How a case went, in a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// Just as the vector says.
    Pass,
    /// Otherwise; the reason says how.
    Fail,
    /// The decoder said that a stream is unsupported that it should decode.
    Unsupported,
    /// The decoder said that a stream is over a limit that it should decode.
    OverLimit,
    /// The decoder said that a stream is truncated that is not.
    Truncated,
    /// A signal, or an exit code that the protocol does not have.
    Crash,
    /// It took too long.
    Timeout,
    /// The decoder does not claim to do this: it was not asked.
    NotClaimed,
    /// It failed as the list of expectations says.
    ExpectedFailure,
}

impl Outcome {
    /// All of them, in the order of reports.
    pub const ALL: [Self; 9] = [
        Self::Pass,
        Self::Fail,
        Self::Unsupported,
        Self::OverLimit,
        Self::Truncated,
        Self::Crash,
        Self::Timeout,
        Self::NotClaimed,
        Self::ExpectedFailure,
    ];

    /// What a case can be expected to fail with: outcomes, and reasons of `fail`.
    pub const FAILURES: &'static [&'static str] = &[
        "fail",
        "wrong-planes",
        "wrong-outcome",
        "wrong-class",
        "wrong-code",
        "wrong-output",
        "wrong-entropy",
        "missing-files",
        "extra-files",
        "too-much-memory",
        "too-much-output",
        "unsupported",
        "over-limit",
        "truncated",
        "crash",
        "timeout",
    ];

    /// The word in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Fail => "fail",
            Self::Unsupported => "unsupported",
            Self::OverLimit => "over-limit",
            Self::Truncated => "truncated",
            Self::Crash => "crash",
            Self::Timeout => "timeout",
            Self::NotClaimed => "not-claimed",
            Self::ExpectedFailure => "expected-failure",
        }
    }

    /// Whether the decoder is at fault, and nobody said so before.
    pub const fn is_failure(self) -> bool {
        !matches!(self, Self::Pass | Self::NotClaimed | Self::ExpectedFailure)
    }
}

/// What is wrong where the outcome is `fail`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reason {
    /// Files that are right by name have other values.
    WrongPlanes,
    /// Accepted instead of rejected, or the reverse.
    WrongOutcome,
    /// Rejected as something else.
    WrongClass,
    /// Rejected with another code; only if that was asked for.
    WrongCode,
    /// The planes are right, and the f32 values of 7.10 that come of them are not.
    WrongOutput,
    /// The states of the entropy decoder are not those of the vector.
    WrongEntropy,
    /// Frames or attributes were not written.
    MissingFiles,
    /// Something else was written.
    ExtraFiles,
    /// It was killed over the memory limit.
    TooMuchMemory,
    /// It was killed over the limit of what it may write.
    TooMuchOutput,
}

impl Reason {
    /// The word in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::WrongPlanes => "wrong-planes",
            Self::WrongOutcome => "wrong-outcome",
            Self::WrongClass => "wrong-class",
            Self::WrongCode => "wrong-code",
            Self::WrongOutput => "wrong-output",
            Self::WrongEntropy => "wrong-entropy",
            Self::MissingFiles => "missing-files",
            Self::ExtraFiles => "extra-files",
            Self::TooMuchMemory => "too-much-memory",
            Self::TooMuchOutput => "too-much-output",
        }
    }
}

/// A case in a report.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct CaseResult {
    /// Name of the vector.
    pub vector: String,
    /// Its area.
    pub area: String,
    /// Its kind.
    pub kind: Kind,
    /// Operating point.
    pub op: String,
    /// What was shown.
    pub mode: Mode,
    /// How it went.
    pub outcome: Outcome,
    /// What is wrong, of a failure.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<Reason>,
    /// Of an expected failure: the word of the list.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failed_as: Option<String>,
    /// What is right: `accept`, or class and code.
    pub expected: String,
    /// How the decoder ended, in words; none if it was not asked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub answer: Option<String>,
    /// What is wrong, in words.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub detail: Option<String>,
    /// What the fault resembles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub symptom: Option<Symptom>,
    /// The first value that differs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub difference: Option<Difference>,
    /// What is not quite right.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// What differs from the reference and may differ.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    /// Wall time; not in reports that are to be compared.
    #[serde(skip)]
    pub took: Duration,
}

impl CaseResult {
    /// `vector@op/mode`.
    pub fn case_name(&self) -> String {
        format!("{}@{}/{}", self.vector, self.op, self.mode)
    }

    /// The outcome, or the reason of a failure.
    pub fn label(&self) -> &'static str {
        self.reason.map_or(self.outcome.name(), Reason::name)
    }

    /// Whether a word of the list of expectations says how it went.
    pub(crate) fn is_called(&self, word: &str) -> bool {
        self.outcome.is_failure() && (word == self.outcome.name() || word == self.label())
    }
}
