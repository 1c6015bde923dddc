//! Work that lets other threads of Python run meanwhile, and that Ctrl-C ends.

use crate::errors::call_error;
use pyo3::prelude::*;
use splatstream::Cancel;
use std::cell::RefCell;
use std::ops::{Deref, DerefMut};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Mutex, MutexGuard, TryLockError};
use std::thread::scope;
use std::time::Duration;

/// How often signals are looked for, and progress is told.
const INTERVAL: Duration = Duration::from_millis(50);

/// What a thread works for: the calls that are on its stack, and for a thread that [`run`] has started, also the call that
/// it does the work of and all that this one works for. None of these calls goes on before the thread is done.
#[derive(Clone)]
struct Calls {
    /// The locks that they have, by address.
    locks: Vec<usize>,
    /// What ends those that wait for this thread.
    cancels: Vec<Cancel>,
}

thread_local! {
    static CALLS: RefCell<Calls> = const { RefCell::new(Calls { locks: Vec::new(), cancels: Vec::new() }) };
}

/// Something that one call uses at a time.
pub(crate) struct Shared<T> {
    value: Mutex<T>,
    /// What it is, for messages.
    name: &'static str,
}

/// The right of a call to use it.
pub(crate) struct Guard<'a, T>(MutexGuard<'a, T>);

impl<T> Shared<T> {
    pub(crate) const fn new(name: &'static str, value: T) -> Self {
        Self { value: Mutex::new(value), name }
    }

    /// The value, once no other thread uses it. That thread may need Python to be done, so this one does not keep it.
    ///
    /// A call that has the value may run Python: a file object, a progress function, a handler of a signal. If that asks for
    /// the value again, it would wait for itself.
    pub(crate) fn lock(&self, py: Python<'_>) -> PyResult<Guard<'_, T>> {
        let address = std::ptr::from_ref(&self.value).addr();
        if CALLS.with_borrow(|calls| calls.locks.contains(&address)) {
            let name = self.name;
            let message =
                format!("the {name} is in use by the call that runs this code, which cannot use it too");
            return Err(call_error(py, message, "in-use"));
        }
        loop {
            let guard = match self.value.try_lock() {
                Ok(guard) => Some(guard),
                Err(TryLockError::Poisoned(guard)) => Some(guard.into_inner()),
                Err(TryLockError::WouldBlock) => None,
            };
            if let Some(guard) = guard {
                CALLS.with_borrow_mut(|calls| calls.locks.push(address));
                return Ok(Guard(guard));
            }
            py.detach(|| std::thread::sleep(Duration::from_millis(1)));
            check(py)?;
        }
    }
}

impl<T> Deref for Guard<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.0
    }
}

impl<T> DerefMut for Guard<'_, T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.0
    }
}

impl<T> Drop for Guard<'_, T> {
    fn drop(&mut self) {
        // Guards of a thread are dropped in the reverse order, those of a call before it returns.
        CALLS.with_borrow_mut(|calls| calls.locks.pop());
    }
}

/// Raises what a signal has raised. Only the main thread gets signals: others learn from what cancels their work.
fn check(py: Python<'_>) -> PyResult<()> {
    py.check_signals()?;
    match CALLS.with_borrow(|calls| calls.cancels.iter().any(Cancel::is_requested)) {
        true => Err(call_error(py, "the call that runs this code was cancelled".to_owned(), "cancelled")),
        false => Ok(()),
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
    let mut calls = CALLS.with_borrow(Calls::clone);
    calls.cancels.push(cancel.clone());
    let (result, raised) = py.detach(|| {
        scope(|scope| {
            let (done, is_done) = channel::<()>();
            let worker = scope.spawn(move || {
                // Dropped after the work, also where that panics.
                let _done = done;
                CALLS.set(calls);
                work()
            });
            let mut raised = None;
            while is_done.recv_timeout(INTERVAL) == Err(RecvTimeoutError::Timeout) {
                if raised.is_none() {
                    raised = Python::attach(|py| check(py).and_then(|()| told(py))).err();
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
