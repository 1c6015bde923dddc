//! How far fitting has come.

use core::fmt;
use splatstream_decoder::interrupt::Interrupt;
use std::sync::Arc;

/// How far fitting a layer of a frame has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct FinetuneProgress {
    /// The spatial layer.
    pub spatial_layer: u8,
    /// Iterations that are done.
    pub done: u32,
    /// Iterations at most; it may end before.
    pub iterations: u32,
}

/// Someone who is told after each iteration, from whatever thread it is done in, and who may end the work; by default nobody.
///
/// Nothing that is encoded depends on it, so that any two are equal, and look the same.
#[derive(Clone, Default)]
pub struct FinetuneWatch {
    told: Option<Arc<dyn Fn(FinetuneProgress) + Send + Sync>>,
    cancel: Interrupt,
}

impl FinetuneWatch {
    /// Has `told` called.
    #[must_use]
    pub fn new(told: impl Fn(FinetuneProgress) + Send + Sync + 'static) -> Self {
        Self { told: Some(Arc::new(told)), ..Self::default() }
    }

    /// The same who may end the work: with the request fitting gives [`Error::Cancelled`](crate::Error::Cancelled) before its
    /// next iteration. What a [state](crate::FinetuneState) has by then is kept.
    #[must_use]
    pub fn with_cancel(self, cancel: Interrupt) -> Self {
        Self { cancel, ..self }
    }

    pub(super) fn is_cancelled(&self) -> bool {
        self.cancel.is_requested()
    }

    pub(super) fn tell(&self, progress: FinetuneProgress) {
        if let Some(told) = &self.told {
            told(progress);
        }
    }
}

impl PartialEq for FinetuneWatch {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl fmt::Debug for FinetuneWatch {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("FinetuneWatch")
    }
}
