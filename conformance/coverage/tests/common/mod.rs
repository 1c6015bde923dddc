//! The vectors, and a check of each of their cases.

use splatstream_conformance::case::Case;
use splatstream_conformance::suite::Suite;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

pub(crate) fn suite() -> Suite {
    Suite::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../vectors")).unwrap()
}

/// Checks every case, on all processors; the first failure ends all.
pub(crate) fn check_all(cases: &[Case<'_>], check: impl Fn(&Case<'_>) + Sync) {
    let next = AtomicUsize::new(0);
    let work = || {
        while let Some(case) = cases.get(next.fetch_add(1, Ordering::Relaxed)) {
            if let Err(panic) = catch_unwind(AssertUnwindSafe(|| check(case))) {
                next.store(cases.len(), Ordering::Relaxed);
                resume_unwind(panic);
            }
        }
    };
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(work);
        }
    });
}
