//! How much a file may ask of this machine.

use crate::error::{SceneError, SceneErrorKind};

/// Bounds on what one read may allocate. A stream never sizes an allocation that these have not passed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReadLimits {
    /// Most Gaussians in a frame. Default: 32 Mi (33,554,432).
    pub max_gaussians: u64,
    /// Most bytes in a file, and most bytes that any one part of it may decompress to. Default: 4 GiB.
    pub max_bytes: u64,
}

impl Default for ReadLimits {
    fn default() -> Self {
        Self { max_gaussians: 32 << 20, max_bytes: 4 << 30 }
    }
}

impl ReadLimits {
    /// `count` as a length, if the limit on Gaussians allows it.
    pub(crate) fn gaussians(&self, count: u64) -> Result<usize, SceneError> {
        within("max_gaussians", "Gaussians", count, self.max_gaussians)
    }

    /// `count` as a length, if the limit on bytes allows it.
    pub(crate) fn bytes(&self, count: u64) -> Result<usize, SceneError> {
        within("max_bytes", "bytes", count, self.max_bytes)
    }
}

fn within(limit: &'static str, unit: &'static str, asked: u64, allowed: u64) -> Result<usize, SceneError> {
    let over = || SceneErrorKind::OverLimit { limit, unit, asked, allowed };
    if asked > allowed {
        return Err(over().into());
    }
    usize::try_from(asked).map_err(|_| over().into())
}
