//! The wish to end a run before all of its cases were asked.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A wish that all who hold a copy see. Once uttered it stays.
#[derive(Debug, Clone, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Utters the wish. A handler of signals may do so.
    pub fn set(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether the wish was uttered.
    pub fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}
