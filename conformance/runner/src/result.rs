//! The result of a case.

use crate::case::Case;
use crate::difference::Difference;
use crate::symptom::Symptom;
use crate::vector::{Kind, Mode};
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// The outcome of a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// As the vector says.
    Pass,
    /// Otherwise; there is a reason.
    Fail,
    /// The decoder called a stream unsupported that it should decode.
    Unsupported,
    /// The decoder called a stream over a limit that it should decode.
    OverLimit,
    /// The decoder called a stream truncated that is complete.
    Truncated,
    /// A signal, or an exit code that the protocol does not have.
    Crash,
    /// It took too long.
    Timeout,
    /// The decoder does not claim to support this: the case was not run.
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

    /// Failures that can be expected: outcomes, and reasons of `fail`.
    pub const FAILURES: &'static [&'static str] = &[
        "fail",
        "wrong-planes",
        "wrong-outcome",
        "wrong-class",
        "wrong-code",
        "wrong-lost",
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

    /// Whether it is a failure that was not expected.
    pub const fn is_failure(self) -> bool {
        !matches!(self, Self::Pass | Self::NotClaimed | Self::ExpectedFailure)
    }
}

/// What is wrong if the outcome is `fail`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reason {
    /// Files with the right names have wrong contents.
    WrongPlanes,
    /// Accepted instead of rejected, or the reverse.
    WrongOutcome,
    /// Rejected with the wrong class.
    WrongClass,
    /// Rejected with the wrong code; only if codes count.
    WrongCode,
    /// The ranges of lost frames are wrong.
    WrongLost,
    /// The planes are right, but the f32 values of 7.10 are not.
    WrongOutput,
    /// Entropy states are wrong.
    WrongEntropy,
    /// Frames or attributes were not written.
    MissingFiles,
    /// Unexpected files were written.
    ExtraFiles,
    /// It was killed because it used too much memory.
    TooMuchMemory,
    /// It was killed because it wrote too much.
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
            Self::WrongLost => "wrong-lost",
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
    /// The mode.
    pub mode: Mode,
    /// The outcome.
    pub outcome: Outcome,
    /// What is wrong, if it is a failure.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<Reason>,
    /// The word of the list, if it is an expected failure.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failed_as: Option<String>,
    /// The right answer: `accept`, or class and code.
    pub expected: String,
    /// How the decoder ended, in words; none if it was not run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub answer: Option<String>,
    /// What is wrong, in words.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub detail: Option<String>,
    /// What the error resembles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub symptom: Option<Symptom>,
    /// The first value that differs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub difference: Option<Difference>,
    /// What should be corrected but is no failure.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// Permitted differences from the reference.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    /// Wall time; not in JSON reports, so that two runs give the same report.
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

    /// What was expected and what was found, if the verdict is wrong.
    pub(crate) fn contrast(&self) -> String {
        match &self.answer {
            Some(answer) if *answer != self.expected => {
                format!("; expected {}, found {answer}", self.expected)
            }
            _ => String::new(),
        }
    }

    /// Says in detail and warnings which prefix of the stream they are about.
    pub(crate) fn name_prefix(&mut self, prefix: &Case<'_>) {
        let Some(bytes) = prefix.cut else { return };
        let texts = self.detail.iter_mut().chain(&mut self.warnings);
        texts.for_each(|text| *text = format!("cut after {bytes} bytes: {text}"));
        if self.outcome.is_failure() && self.detail.is_none() {
            self.detail = Some(format!("cut after {bytes} bytes"));
        }
    }

    /// Whether a word of the list of expectations describes the result.
    pub(crate) fn is_called(&self, word: &str) -> bool {
        self.outcome.is_failure() && (word == self.outcome.name() || word == self.label())
    }
}
