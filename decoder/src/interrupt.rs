//! Ending a decoder from another thread.

use core::sync::atomic::{AtomicBool, Ordering};
use splatstream_format::{Error, ErrorKind, Result};
use std::sync::Arc;

/// A request to end decoding. Clones share it, so that another thread can make it; the decoder looks at it between the
/// planes of blocks and between runs of Gaussians.
#[derive(Debug, Clone, Default)]
pub struct Interrupt(Option<Arc<AtomicBool>>);

impl Interrupt {
    /// Of work that nobody can end.
    pub const NEVER: &'static Self = &Self(None);

    /// A request that can be made, and has not been.
    pub fn new() -> Self {
        Self(Some(Arc::default()))
    }

    /// Makes the request. Nothing happens to work that nobody can end.
    pub fn request(&self) {
        self.0.iter().for_each(|flag| flag.store(true, Ordering::Relaxed));
    }

    /// Whether it has been made.
    pub fn is_requested(&self) -> bool {
        self.0.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed))
    }

    /// An error where it has been made. The error itself is never reported: nothing is wrong with the stream.
    pub(crate) fn check(&self) -> Result<()> {
        const INTERRUPTED: Error = Error::new(0, "", ErrorKind::Constraint { rule: "not interrupted" });
        if self.is_requested() { Err(INTERRUPTED) } else { Ok(()) }
    }
}
