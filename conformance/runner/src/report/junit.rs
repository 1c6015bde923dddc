//! A report as JUnit XML for continuous integration: a test suite for each area, a test for each case.

use super::Report;
use super::summary::explanation;
use crate::result::{CaseResult, Outcome};
use quick_junit::{NonSuccessKind, TestCase, TestCaseStatus, TestSuite};
use std::io;

/// The document.
///
/// # Errors
/// It cannot be written as XML.
pub fn xml(report: &Report) -> io::Result<String> {
    let mut document =
        quick_junit::Report::new(format!("splatstream conformance of {}", report.decoder.name));
    for cases in report.cases.chunk_by(|a, b| (a.kind, &a.area) == (b.kind, &b.area)) {
        let Some(first) = cases.first() else { continue };
        let mut suite = TestSuite::new(format!("{}.{}", first.kind.name(), first.area));
        suite.add_test_cases(cases.iter().map(test));
        document.add_test_suite(suite);
    }
    if !report.stale.is_empty() {
        let mut suite = TestSuite::new("expectations");
        suite.add_test_cases(report.stale.iter().map(|entry| {
            let mut status = TestCaseStatus::non_success(NonSuccessKind::Failure);
            status.set_type("stale").set_message(entry.as_str());
            TestCase::new(entry.as_str(), status)
        }));
        document.add_test_suite(suite);
    }
    document.to_string().map_err(io::Error::other)
}

fn test(case: &CaseResult) -> TestCase {
    let status = match case.outcome {
        Outcome::Pass => TestCaseStatus::success(),
        Outcome::NotClaimed | Outcome::ExpectedFailure => {
            let mut status = TestCaseStatus::skipped();
            status.set_message(case.detail.clone().unwrap_or_else(|| case.outcome.name().to_owned()));
            status
        }
        _ => failed(case),
    };
    let mut test = TestCase::new(case.case_name(), status);
    test.set_time(case.took);
    test
}

/// A crash or a timeout is an error in terms of JUnit: the test could not be finished.
fn failed(case: &CaseResult) -> TestCaseStatus {
    let broke_off = matches!(case.outcome, Outcome::Crash | Outcome::Timeout);
    let kind = if broke_off { NonSuccessKind::Error } else { NonSuccessKind::Failure };
    let mut status = TestCaseStatus::non_success(kind);
    let answer = case.answer.as_deref().unwrap_or("nothing");
    status
        .set_type(case.label())
        .set_message(format!("expected {}, found {answer}", case.expected))
        .set_description(explanation(case).join("\n"));
    status
}
