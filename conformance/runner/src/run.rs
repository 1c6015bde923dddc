//! Runs cases: sends them to decoders and turns the answers into results.

use crate::answer::Ending;
use crate::cancel::Cancel;
use crate::capabilities::Capabilities;
use crate::case::Case;
use crate::difference::explain;
use crate::error::Result;
use crate::judge::{Rules, judge, not_claimed};
use crate::limits::Limits;
use crate::output::Output;
use crate::result::{CaseResult, Outcome, Reason};
use crate::session::{Decoder, Session};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::Duration;

/// How to run.
#[derive(Debug, Clone)]
pub struct Settings {
    /// The decoder under test.
    pub decoder: Decoder,
    /// What it claims.
    pub capabilities: Capabilities,
    /// Resources that it may use for a case.
    pub limits: Limits,
    /// Whether a wrong code is a failure.
    pub strict: bool,
    /// Cases that run at the same time.
    pub jobs: usize,
    /// Ends the run early.
    pub cancel: Cancel,
}

/// Runs cases; the results are in the order of the cases, and there are fewer if the run was cancelled. `on_result` gets
/// each result as it comes, from any thread.
///
/// # Errors
/// The decoder does not start, or folders for its output cannot be made or read.
pub fn run(
    cases: &[Case<'_>],
    settings: &Settings,
    on_result: impl Fn(&CaseResult) + Sync,
) -> Result<Vec<CaseResult>> {
    let next = AtomicUsize::new(0);
    let results = Mutex::new(Vec::with_capacity(cases.len()));
    let work = || -> Result<()> {
        let mut session = Session::new(&settings.decoder, &settings.limits, &settings.cancel)?;
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let case = cases.get(index).filter(|_| !settings.cancel.is_set());
            let Some(case) = case else { return Ok(()) };
            // A worker that cannot go on ends the others too: they find no more cases.
            let result = ask(&mut session, case, settings)
                .inspect_err(|_| next.store(cases.len(), Ordering::Relaxed))?;
            let Some(result) = result else { return Ok(()) };
            on_result(&result);
            results.lock().unwrap_or_else(PoisonError::into_inner).push((index, result));
        }
    };
    thread::scope(|scope| {
        let workers: Vec<_> =
            (0..settings.jobs.clamp(1, cases.len().max(1))).map(|_| scope.spawn(work)).collect();
        workers.into_iter().try_for_each(|worker| match worker.join() {
            Ok(done) => done,
            Err(panic) => std::panic::resume_unwind(panic),
        })
    })?;
    let mut results = results.into_inner().unwrap_or_else(PoisonError::into_inner);
    results.sort_unstable_by_key(|(index, _)| *index);
    Ok(results.into_iter().map(|(_, result)| result).collect())
}

/// Runs a case and judges the answer; none if the run was cancelled.
fn ask(session: &mut Session<'_>, case: &Case<'_>, settings: &Settings) -> Result<Option<CaseResult>> {
    if let Some(missing) = settings.capabilities.missing(case) {
        return Ok(Some(not_claimed(case, missing)));
    }
    match case.prefixes() {
        Some(prefixes) => ask_prefixes(session, prefixes, settings),
        None => ask_once(session, case, settings),
    }
}

/// Runs the cases of the prefixes of a stream up to the first failure; the result is that of the first prefix with a
/// failure, or else with a warning.
fn ask_prefixes<'a>(
    session: &mut Session<'_>,
    prefixes: impl Iterator<Item = Case<'a>>,
    settings: &Settings,
) -> Result<Option<CaseResult>> {
    let (mut first, mut took) = (None::<CaseResult>, Duration::ZERO);
    for prefix in prefixes {
        let Some(mut result) = ask_once(session, &prefix, settings)? else { return Ok(None) };
        took = took.saturating_add(result.took);
        result.took = took;
        result.name_prefix(&prefix);
        let has_failed = result.outcome != Outcome::Pass;
        match &mut first {
            Some(first) if !has_failed && !first.warnings.is_empty() => first.took = took,
            first => *first = Some(result),
        }
        if has_failed {
            break;
        }
    }
    Ok(first)
}

fn ask_once(session: &mut Session<'_>, case: &Case<'_>, settings: &Settings) -> Result<Option<CaseResult>> {
    if settings.cancel.is_set() {
        return Ok(None);
    }
    let Capabilities { entropy, output, .. } = settings.capabilities;
    let rules = Rules { strict: settings.strict, entropy, output };
    let answer = session.ask(case)?;
    if answer.ending == Ending::Cancelled {
        return Ok(None);
    }
    let output = Output::read(&session.out())?;
    let mut result = judge(case, &answer, &output, rules);
    let by_files =
        matches!(result.reason, Some(Reason::WrongPlanes | Reason::MissingFiles | Reason::ExtraFiles));
    if by_files && output.fault.is_none() {
        (result.symptom, result.difference) = explain(case, &output);
    }
    Ok(Some(result))
}
