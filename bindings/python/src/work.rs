//! Work that lets other threads of Python run meanwhile, and that Ctrl-C ends.

use pyo3::prelude::*;
use splatstream::Cancel;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Mutex, MutexGuard, TryLockError};
use std::thread::scope;
use std::time::Duration;

/// How often signals are looked for, and progress is told.
const INTERVAL: Duration = Duration::from_millis(50);

/// What a lock guards, once no other thread has it. That thread may need Python to be done, so this one does not keep it.
pub(crate) fn locked<'a, T>(py: Python<'_>, lock: &'a Mutex<T>) -> PyResult<MutexGuard<'a, T>> {
    loop {
        match lock.try_lock() {
            Ok(guard) => return Ok(guard),
            Err(TryLockError::Poisoned(guard)) => return Ok(guard.into_inner()),
            Err(TryLockError::WouldBlock) => py.detach(|| std::thread::sleep(Duration::from_millis(1))),
        }
        py.check_signals()?;
    }
}

/// Does some work on another thread. Meanwhile this one, which Python gives its signals to, has nothing to do but look for
/// them, and calls `told` now and then: what either raises ends the work by way of `cancel`, and is raised.
pub(crate) fn run<T: Send>(
    py: Python<'_>,
    cancel: &Cancel,
    told: &mut (dyn FnMut(Python<'_>) -> PyResult<()> + Send),
    work: impl FnOnce() -> T + Send,
) -> PyResult<T> {
    let (result, raised) = py.detach(|| {
        scope(|scope| {
            let (done, is_done) = channel::<()>();
            let worker = scope.spawn(move || {
                // Dropped after the work, also where that panics.
                let _done = done;
                work()
            });
            let mut raised = None;
            while is_done.recv_timeout(INTERVAL) == Err(RecvTimeoutError::Timeout) {
                if raised.is_none() {
                    raised = Python::attach(|py| py.check_signals().and_then(|()| told(py))).err();
                    if raised.is_some() {
                        cancel.request();
                    }
                }
            }
            (worker.join(), raised)
        })
    });
    match (result, raised) {
        (_, Some(raised)) => Err(raised),
        (Ok(result), None) => Ok(result),
        // pyo3 makes an exception of it.
        (Err(panic), None) => std::panic::resume_unwind(panic),
    }
}
