//! Every case of the vectors through the reference decoder, in one process: what lines and mutants are measured with.
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed test")]

mod common;

use common::{check_all, suite};
use splatstream_conformance::answer::{Answer, Ending};
use splatstream_conformance::case::Case;
use splatstream_conformance::judge::{Rules, judge};
use splatstream_conformance::output::Output;
use splatstream_conformance::protocol::Said;
use splatstream_conformance::reference::Decoded;
use splatstream_conformance::result::Outcome;
use std::time::Duration;

/// Codes of errors, entropy states and output count as planes do.
const RULES: Rules = Rules { strict: true, entropy: true, output: true };

fn decode(case: &Case<'_>) {
    let folder = tempfile::tempdir().unwrap();
    let decoded = Decoded::of(&case.input().unwrap(), case.op().parse().unwrap(), case.mode());
    let (code, diagnosis) = decoded.verdict();
    decoded.write(folder.path()).unwrap();
    let said = diagnosis.map_or(Said::Nothing, Said::Diagnosis);
    let answer =
        Answer { ending: Ending::Code(code), said, fault: None, stderr: String::new(), took: Duration::ZERO };
    let result = judge(case, &answer, &Output::read(folder.path()).unwrap(), RULES);
    assert_eq!(result.outcome, Outcome::Pass, "{case}: {result:#?}");
}

#[test]
fn the_reference_shows_of_every_case_what_its_record_says() {
    let suite = suite();
    let cases = Case::all(&suite);
    assert!(cases.len() >= 1000, "{} cases", cases.len());
    check_all(&cases, |case| match case.prefixes() {
        Some(prefixes) => prefixes.for_each(|prefix| decode(&prefix)),
        None => decode(case),
    });
}
