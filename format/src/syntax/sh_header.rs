//! The elements of 5.9 and 5.14 that say how spherical harmonics are coded.

use super::{Check, MAX_ID};
use crate::Result;

/// A place of `codebook_ids` that is not used.
pub const NO_CODEBOOK: u8 = 255;

/// Stages of vector quantisation, at most.
const MAX_STAGES: u8 = 4;

/// How the spherical harmonics of the higher degrees are coded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ShMode {
    /// 0: not at all; they are zero.
    None,
    /// 1: one plane for each component of the transform.
    Coefficients,
    /// 2: one plane of codebook places for each stage.
    VectorQuantised,
}

impl ShMode {
    /// The mode with a code.
    pub const fn from_code(code: u8) -> Option<Self> {
        match code {
            0 => Some(Self::None),
            1 => Some(Self::Coefficients),
            2 => Some(Self::VectorQuantised),
            _ => None,
        }
    }

    /// The code of the mode.
    pub const fn code(self) -> u8 {
        match self {
            Self::None => 0,
            Self::Coefficients => 1,
            Self::VectorQuantised => 2,
        }
    }

    /// The name used in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Coefficients => "coefficients",
            Self::VectorQuantised => "vector quantised",
        }
    }
}

/// How a unit codes its spherical harmonics: elements that refinements and increments share.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ShHeader {
    /// 0 is none, 1 is coefficients, 2 is vector quantised.
    pub sh_mode: u8,
    /// Stages of vector quantisation; 0 unless `sh_mode` is 2.
    pub vq_stage_count: u8,
    /// Codebooks of the stages, 0 to 15; 255 for a stage not used.
    pub codebook_ids: [u8; 4],
}

impl ShHeader {
    /// How the higher degrees are coded; `None` for a header that is refused.
    pub const fn mode(&self) -> Option<ShMode> {
        ShMode::from_code(self.sh_mode)
    }

    /// The codebooks of the stages in use.
    pub fn codebooks(&self) -> impl Iterator<Item = u8> + use<> {
        self.codebook_ids.into_iter().take(self.vq_stage_count.into())
    }

    /// 6.9: the ranges of the three elements of the record that `check` stands for.
    pub(super) fn validate(&self, check: Check) -> Result<()> {
        check.known(self.mode().is_some(), "sh_mode", self.sh_mode)?;
        let vector_quantised = self.mode() == Some(ShMode::VectorQuantised);
        let (min, max) = if vector_quantised { (1, MAX_STAGES) } else { (0, 0) };
        check.range("vq_stage_count", self.vq_stage_count, min, max)?;
        for (place, id) in self.codebook_ids.into_iter().enumerate() {
            let used = place < usize::from(self.vq_stage_count);
            let (min, max) = if used { (0, MAX_ID) } else { (NO_CODEBOOK, NO_CODEBOOK) };
            check.range_in("codebook_ids", place, id, min, max)?;
        }
        Ok(())
    }
}
