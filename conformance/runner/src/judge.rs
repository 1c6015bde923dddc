//! Whether an answer is correct.

use crate::answer::{Answer, Ending};
use crate::attribute::Attribute;
use crate::case::Case;
use crate::files::Files;
use crate::output::{Output, entropy_name, floats_name};
use crate::protocol::{Diagnosis, Said};
use crate::result::{CaseResult, Outcome, Reason};
use crate::vector::{Acceptance, State, Verdict};
use splatstream_format::Class;
use std::time::Duration;

/// What is compared.
#[derive(Debug, Clone, Copy, Default)]
pub struct Rules {
    /// A wrong code is a failure instead of a warning.
    pub strict: bool,
    /// The decoder claims to write entropy states.
    pub entropy: bool,
    /// The decoder claims to write the output of 7.10.
    pub output: bool,
}

/// The result of a case that was not run: `missing` is not claimed.
pub(crate) fn not_claimed(case: &Case<'_>, missing: String) -> CaseResult {
    let mut result = blank(case);
    result.outcome = Outcome::NotClaimed;
    result.detail = Some(format!("{missing} is not claimed"));
    result
}

/// Judges an answer.
pub fn judge(case: &Case<'_>, answer: &Answer, output: &Output, rules: Rules) -> CaseResult {
    let mut result = blank(case);
    result.answer = Some(words(answer.ending));
    result.took = answer.took;
    let verdicts = case.verdicts();
    let Some(code) = protocol_code(answer.ending) else {
        (result.outcome, result.reason) = broken_off(answer.ending);
        result.detail = explanation(answer);
        return result;
    };
    let right: Vec<&Verdict> = verdicts.iter().filter(|verdict| verdict.exit_code() == code).collect();
    let Some(verdict) = matching(&right, &answer.said) else {
        (result.outcome, result.reason) = contradiction(&verdicts, code);
        result.detail = explanation(answer);
        return result;
    };
    compare_diagnosis(&mut result, case, &right, verdict, &answer.said, rules);
    // The record says what is output if the stream is accepted, or if every right answer is a rejection.
    let is_recorded =
        verdict.outcome == Acceptance::Accept || case.vector.expect.outcome == Acceptance::Reject;
    if let Some(fault) = &output.fault {
        fail(&mut result, Reason::MissingFiles, fault.clone());
    } else if is_recorded {
        compare_files(&mut result, case, output, rules);
    }
    result
}

/// The verdict that a decoder means: of several with its exit code the one with its code.
fn matching<'a>(right: &[&'a Verdict], said: &Said) -> Option<&'a Verdict> {
    let code = match said {
        Said::Diagnosis(diagnosis) => diagnosis.code.as_ref(),
        Said::Nothing | Said::Unclear(_) => None,
    };
    let named = right.iter().find(|verdict| code.is_some() && verdict.code.as_ref() == code);
    named.or(right.first()).copied()
}

/// The result of a case before anything was compared.
fn blank(case: &Case<'_>) -> CaseResult {
    CaseResult {
        vector: case.vector.name.clone(),
        area: case.vector.area.clone(),
        kind: case.vector.kind,
        op: case.op().to_owned(),
        mode: case.mode(),
        outcome: Outcome::Pass,
        reason: None,
        failed_as: None,
        expected: joined(case.verdicts().iter().map(ToString::to_string)),
        answer: None,
        detail: None,
        symptom: None,
        difference: None,
        warnings: Vec::new(),
        notes: Vec::new(),
        took: Duration::ZERO,
    }
}

/// The exit code, if it is one of the protocol.
fn protocol_code(ending: Ending) -> Option<i32> {
    match ending {
        Ending::Code(code) if code == 0 || Class::of_exit_code(code).is_some() => Some(code),
        _ => None,
    }
}

fn words(ending: Ending) -> String {
    match ending {
        Ending::Code(0) => "accept".to_owned(),
        Ending::Code(code) => Class::of_exit_code(code)
            .map_or_else(|| format!("exit code {code}"), |class| class.name().to_owned()),
        Ending::Signal(signal) => format!("signal {signal}"),
        Ending::TimedOut => "killed: too long".to_owned(),
        Ending::TooMuchMemory => "killed: too much memory".to_owned(),
        Ending::TooMuchOutput => "killed: wrote too much".to_owned(),
        Ending::NoAnswer | Ending::Cancelled => "no answer".to_owned(),
    }
}

fn broken_off(ending: Ending) -> (Outcome, Option<Reason>) {
    match ending {
        Ending::TimedOut => (Outcome::Timeout, None),
        Ending::TooMuchMemory => (Outcome::Fail, Some(Reason::TooMuchMemory)),
        Ending::TooMuchOutput => (Outcome::Fail, Some(Reason::TooMuchOutput)),
        Ending::Code(_) | Ending::Signal(_) | Ending::NoAnswer | Ending::Cancelled => (Outcome::Crash, None),
    }
}

/// The outcome for an answer that is not right.
fn contradiction(verdicts: &[Verdict], code: i32) -> (Outcome, Option<Reason>) {
    let accepts = verdicts.first().is_some_and(|verdict| verdict.outcome == Acceptance::Accept);
    match Class::of_exit_code(code) {
        Some(Class::Unsupported) if accepts => (Outcome::Unsupported, None),
        Some(Class::OverLimit) if accepts => (Outcome::OverLimit, None),
        Some(Class::Truncated) if accepts => (Outcome::Truncated, None),
        Some(_) if !accepts => (Outcome::Fail, Some(Reason::WrongClass)),
        _ => (Outcome::Fail, Some(Reason::WrongOutcome)),
    }
}

/// Compares what the decoder reports. The code counts, and class and lost frames if they are given; differences of clause
/// and byte are notes for people.
fn compare_diagnosis(
    result: &mut CaseResult,
    case: &Case<'_>,
    right: &[&Verdict],
    verdict: &Verdict,
    said: &Said,
    rules: Rules,
) {
    if let Said::Diagnosis(said) = said {
        compare_lost(result, case, said);
    }
    if verdict.outcome == Acceptance::Accept {
        return;
    }
    let silence = match said {
        Said::Diagnosis(said) => {
            compare_code(result, right, verdict, said, rules);
            if case.is_whole() {
                compare_location(result, verdict, said);
            }
            said.code.is_none().then(|| "the JSON object has no code".to_owned())
        }
        Said::Nothing => Some("no code: the last line on standard error is not a JSON object".to_owned()),
        Said::Unclear(why) => Some(format!("no code: {why}")),
    };
    if let (Some(why), true) = (silence, rules.strict) {
        fail(result, Reason::WrongCode, why);
    }
}

/// Compares the ranges of lost frames where both the decoder and the record have them.
fn compare_lost(result: &mut CaseResult, case: &Case<'_>, said: &Diagnosis) {
    if let (Some(point), Some(found)) = (case.point, &said.lost)
        && *found != point.lost
    {
        let wanted = &point.lost;
        fail(result, Reason::WrongLost, format!("the lost frames are {found:?} and should be {wanted:?}"));
    }
}

fn compare_code(
    result: &mut CaseResult,
    right: &[&Verdict],
    verdict: &Verdict,
    said: &Diagnosis,
    rules: Rules,
) {
    let mut complain = |message: String| match rules.strict {
        true => fail(result, Reason::WrongCode, message),
        false => result.warnings.push(message),
    };
    let class = verdict.class.map_or("", Class::name);
    if let Some(found) = said.class.as_deref().filter(|&found| found != class) {
        complain(format!("the JSON object says {found}, the exit code {class}"));
    }
    if let (Some(_), Some(found)) = (&verdict.code, &said.code)
        && verdict.code != said.code
    {
        let wanted = joined(right.iter().filter_map(|verdict| verdict.code.clone()));
        complain(format!("the code is {found} and should be {wanted}"));
    }
}

fn compare_location(result: &mut CaseResult, verdict: &Verdict, said: &Diagnosis) {
    if let (Some(wanted), Some(found)) = (&verdict.clause, &said.clause)
        && wanted != found
    {
        result.notes.push(format!("the clause is {found}, the reference says {wanted}"));
    }
    if let (Some(wanted), Some(found)) = (verdict.byte, said.byte)
        && wanted != found
    {
        result.notes.push(format!("the byte is {found}, the reference says {wanted}"));
    }
}

fn joined(texts: impl Iterator<Item = String>) -> String {
    texts.collect::<Vec<_>>().join(" or ")
}

/// Turns a result into a failure, unless it is one already: only the first reason is reported.
fn fail(result: &mut CaseResult, reason: Reason, detail: String) {
    if result.outcome == Outcome::Pass {
        (result.outcome, result.reason, result.detail) = (Outcome::Fail, Some(reason), Some(detail));
    }
}

fn compare_files(result: &mut CaseResult, case: &Case<'_>, output: &Output, rules: Rules) {
    let files = Files::compare(case, output);
    let fault = if !files.missing.is_empty() {
        Some((Reason::MissingFiles, missing(&files)))
    } else if !files.wrong.is_empty() {
        Some((Reason::WrongPlanes, naming("different", files.wrong.iter().map(file_name))))
    } else if !files.extra.is_empty() {
        Some((Reason::ExtraFiles, naming("not expected", files.extra.iter().cloned())))
    } else if let Some(detail) = compare_floats(case, output, rules) {
        Some((Reason::WrongOutput, detail))
    } else {
        compare_entropy(case, output, rules).map(|detail| (Reason::WrongEntropy, detail))
    };
    if let Some((reason, detail)) = fault {
        fail(result, reason, detail);
    }
}

/// Compares the output of 7.10: files that exist, and all that should exist if it is claimed.
fn compare_floats(case: &Case<'_>, output: &Output, rules: Rules) -> Option<String> {
    let states = case.states()?;
    let is_wrong = |state: &&&State| match (output.floats.get(&state.frame), &state.f32) {
        (Some(found), Some(wanted)) => found != wanted,
        (None, Some(_)) => rules.output,
        (_, None) => false,
    };
    states.iter().find(is_wrong).map(|state| {
        let name = floats_name(state.frame);
        let fault =
            if output.floats.contains_key(&state.frame) { "differs" } else { "is claimed and missing" };
        format!("{name} {fault}; the planes are right: read 7.10")
    })
}

/// Compares entropy states: files that exist, and if they are claimed all of the vector at its highest point. Those of a
/// decoder that starts inside a stream are not compared.
fn compare_entropy(case: &Case<'_>, output: &Output, rules: Rules) -> Option<String> {
    let units = &case.vector.units;
    if units.is_empty() || case.vector.inside.is_some() {
        return None;
    }
    let wanted_of = |unit: usize| units.get(unit).and_then(|record| record.entropy.as_ref());
    let is_obliged =
        rules.entropy && case.is_extreme(true) && case.vector.expect.outcome == Acceptance::Accept;
    let is_wrong = |&unit: &usize| match output.entropy.get(&unit) {
        Some(found) => Some(found) != wanted_of(unit),
        None => is_obliged && wanted_of(unit).is_some(),
    };
    let beyond = output.entropy.keys().copied().filter(|&unit| unit >= units.len());
    let wrong: Vec<usize> = (0..units.len()).chain(beyond).filter(is_wrong).collect();
    let &unit = wrong.first()?;
    let is_of_unit_before =
        |(&unit, found): (&usize, &String)| Some(found) == unit.checked_sub(1).and_then(wanted_of);
    let is_shifted = !output.entropy.is_empty() && output.entropy.iter().all(is_of_unit_before);
    let name = entropy_name(unit);
    Some(match (output.entropy.get(&unit), wanted_of(unit)) {
        _ if is_shifted => "the entropy states are those of the units before: units count from 0".to_owned(),
        (None, _) => format!("{name} is claimed and missing; the planes are right"),
        (Some(_), None) => format!("{name}: unit {unit} has no entropy state; the planes are right"),
        (Some(found), Some(wanted)) if found.to_lowercase() == *wanted => {
            format!("{name} is {found}: use lower-case digits")
        }
        (Some(found), Some(wanted)) => {
            let all = wrong.len();
            format!("{name} is {found} and should be {wanted}, {all} in all; the planes are right")
        }
    })
}

fn file_name((state, attribute): &(&State, Attribute)) -> String {
    attribute.file_name(state.frame)
}

/// What is missing, and which unexpected files may be meant instead.
fn missing(files: &Files<'_>) -> String {
    let missing = naming("missing", files.missing.iter().map(file_name));
    if files.extra.is_empty() {
        return missing;
    }
    let found = naming("found instead", files.extra.iter().cloned());
    format!("{missing}; {found}; names are f%04d.ATTRIBUTE.i32")
}

/// `missing: a, b and 3 more`.
fn naming(what: &str, names: impl Iterator<Item = String>) -> String {
    let names: Vec<String> = names.collect();
    let shown = names.iter().take(2).cloned().collect::<Vec<_>>().join(", ");
    match names.len().saturating_sub(2) {
        0 => format!("{what}: {shown}"),
        more => format!("{what}: {shown} and {more} more"),
    }
}

/// What is wrong with an answer: what the runner found, and the decoder's last message.
fn explanation(answer: &Answer) -> Option<String> {
    let said = last_line(&answer.stderr);
    let parts: Vec<String> = answer.fault.iter().cloned().chain(said).collect();
    (!parts.is_empty()).then(|| parts.join("; "))
}

/// The last line of the decoder's messages.
fn last_line(stderr: &str) -> Option<String> {
    let line = stderr.trim_end().lines().next_back()?.trim();
    (!line.is_empty()).then(|| format!("last message: {}", line.chars().take(200).collect::<String>()))
}
