//! Ending a decoder from another thread.

use core::any::Any;
use core::sync::atomic::{AtomicBool, Ordering};
use splatstream_format::{Error, ErrorKind, Result};
use std::sync::{Arc, Mutex, PoisonError};

/// Values that are freed at another time.
type Left = Mutex<Vec<Box<dyn Any + Send>>>;

/// A request to end decoding. Clones share it, so that another thread can make it; the decoder looks at it between the
/// planes of blocks and between runs of Gaussians.
#[derive(Debug, Clone, Default)]
pub struct Interrupt {
    flag: Option<Arc<AtomicBool>>,
    /// What interrupted work has left, in a decoder.
    left: Option<Arc<Left>>,
}

impl Interrupt {
    /// Of work that nobody can end.
    pub const NEVER: &'static Self = &Self { flag: None, left: None };

    /// A request that can be made, and has not been.
    pub fn new() -> Self {
        Self { flag: Some(Arc::default()), left: None }
    }

    /// Makes the request. Nothing happens to work that nobody can end.
    pub fn request(&self) {
        self.flag.iter().for_each(|flag| flag.store(true, Ordering::Relaxed));
    }

    /// Whether it has been made.
    pub fn is_requested(&self) -> bool {
        self.flag.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed))
    }

    /// The same request, for a decoder.
    pub(crate) fn of_decoder(self) -> Self {
        Self { left: Some(Arc::default()), ..self }
    }

    /// Takes what is large and needed no more. Where the request has been made, it is freed with the decoder: that takes longer
    /// than who has made it may wait.
    pub(crate) fn leave(&self, large: impl Any + Send) {
        if let Some(left) = self.left.as_ref().filter(|_| self.is_requested()) {
            left.lock().unwrap_or_else(PoisonError::into_inner).push(Box::new(large));
        }
    }

    /// An error where it has been made. The error itself is never reported: nothing is wrong with the stream.
    pub(crate) fn check(&self) -> Result<()> {
        const INTERRUPTED: Error = Error::new(0, "", ErrorKind::Constraint { rule: "not interrupted" });
        if self.is_requested() { Err(INTERRUPTED) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_is_freed_with_the_decoder_once_the_request_is_made() {
        let (interrupt, large) = (Interrupt::new(), Arc::new(0));
        let of_decoder = interrupt.clone().of_decoder();
        of_decoder.leave(Arc::clone(&large));
        assert_eq!(Arc::strong_count(&large), 1, "nobody waits");
        interrupt.request();
        of_decoder.clone().leave(Arc::clone(&large));
        assert_eq!(Arc::strong_count(&large), 2);
        drop(of_decoder);
        assert_eq!(Arc::strong_count(&large), 1);
    }
}
