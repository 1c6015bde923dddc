//! A run: cases to decoders, answers to results.

use crate::answer::Ending;
use crate::capabilities::Capabilities;
use crate::case::Case;
use crate::difference::explain;
use crate::error::Result;
use crate::judge::{Rules, judge, not_claimed};
use crate::limits::Limits;
use crate::output::Output;
use crate::result::{CaseResult, Reason};
use crate::session::{Decoder, Session};
use crate::stop::Stop;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;

/// How to run.
#[derive(Debug, Clone)]
pub struct Settings {
    /// The decoder under test.
    pub decoder: Decoder,
    /// What it claims.
    pub capabilities: Capabilities,
    /// How much it may take for a case.
    pub limits: Limits,
    /// Whether a wrong code is a failure.
    pub strict: bool,
    /// Cases at a time.
    pub jobs: usize,
    /// Ends the run early.
    pub stop: Stop,
}

/// Runs cases; the results are in the order of the cases, and fewer if the run was stopped. `on_result` is told of each
/// as it comes, from any thread.
///
/// # Errors
/// The decoder does not start, or folders for what it writes cannot be made or read.
pub fn run(
    cases: &[Case<'_>],
    settings: &Settings,
    on_result: impl Fn(&CaseResult) + Sync,
) -> Result<Vec<CaseResult>> {
    let next = AtomicUsize::new(0);
    let results = Mutex::new(Vec::with_capacity(cases.len()));
    let work = || -> Result<()> {
        let mut session = Session::new(&settings.decoder, &settings.limits, &settings.stop)?;
        loop {
            let place = next.fetch_add(1, Ordering::Relaxed);
            let Some(case) = cases.get(place) else { return Ok(()) };
            // Who cannot go on stops the others too: they find no more cases.
            let result = ask(&mut session, case, settings)
                .inspect_err(|_| next.store(cases.len(), Ordering::Relaxed))?;
            let Some(result) = result else { return Ok(()) };
            on_result(&result);
            results.lock().unwrap_or_else(PoisonError::into_inner).push((place, result));
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
    results.sort_unstable_by_key(|(place, _)| *place);
    Ok(results.into_iter().map(|(_, result)| result).collect())
}

/// Asks a case and judges the answer; none if the run was stopped.
fn ask(session: &mut Session<'_>, case: &Case<'_>, settings: &Settings) -> Result<Option<CaseResult>> {
    if settings.stop.is_set() {
        return Ok(None);
    }
    if let Some(missing) = settings.capabilities.missing(case) {
        return Ok(Some(not_claimed(case, missing)));
    }
    let Capabilities { entropy, output, .. } = settings.capabilities;
    let rules = Rules { strict: settings.strict, entropy, output };
    let answer = session.ask(case.stream, case.op(), case.mode())?;
    if answer.ending == Ending::Stopped {
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
