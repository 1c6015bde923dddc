//! 5.9 refinement: the Gaussians that a refinement adds to its frame.

use super::{MAX_ID, SequenceParameters, decode, table};
use crate::{Limits, Result};

/// A place of `codebook_ids` that is not used.
pub const NO_CODEBOOK: u8 = 255;

/// Stages of vector quantisation, at most.
const MAX_STAGES: u8 = 4;

table! {
    /// 5.9 — the fixed part of a refinement; models and blocks follow.
    "5.9" "6.9" refinement RefinementHeader {
        /// digest of the frame up to this refinement
        refinement_digest: u64,
        /// Gaussians that this refinement adds
        gaussian_count: u32,
        /// low bits of a position that are not coded, less than position_bits
        position_shift: u8,
        /// log2 of the entropy states of a block, 0 to 5
        lanes_log2: u8,
        /// 0 is none, 1 is coefficients, 2 is vector quantised
        sh_mode: u8,
        /// stages of vector quantisation; 0 unless sh_mode is 2
        vq_stage_count: u8,
        /// codebooks of the stages, 0 to 15; 255 for a stage not used
        codebook_ids: u8[4],
    }
}

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

impl RefinementHeader {
    /// How the higher degrees are coded; `None` for a header that [`Self::validate`] refuses.
    pub const fn mode(&self) -> Option<ShMode> {
        ShMode::from_code(self.sh_mode)
    }

    /// The codebooks of the stages in use.
    pub fn codebooks(&self) -> impl Iterator<Item = u8> + use<> {
        self.codebook_ids.into_iter().take(self.vq_stage_count.into())
    }

    /// Reads and checks the fixed part of a payload that stands at offset `at`; gives the bytes after it.
    pub fn parse<'a>(payload: &'a [u8], at: u64, sequence: &SequenceParameters) -> Result<(Self, &'a [u8])> {
        let (header, rest): (Self, _) = decode(&Self::TABLE, payload, at)?;
        header.validate(at, sequence)?;
        Ok((header, rest))
    }

    /// 6.9, as far as it needs no other unit of the frame.
    pub fn validate(&self, at: u64, sequence: &SequenceParameters) -> Result<()> {
        let check = Self::TABLE.check(at);
        check.range("position_shift", self.position_shift, 0, sequence.position_bits.saturating_sub(1))?;
        check.range("lanes_log2", self.lanes_log2, 0, 5)?;
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

    /// ceil(gaussian_count / 2^block_log2).
    pub fn block_count(&self, sequence: &SequenceParameters) -> u32 {
        self.gaussian_count.div_ceil(1_u32.wrapping_shl(sequence.block_log2.into()))
    }

    /// A.2: the unit adds no more than a frame may have.
    pub fn within(&self, at: u64, limits: &Limits) -> Result<()> {
        let at = Self::TABLE.check(at).offset("gaussian_count", 0);
        Limits::check(at, "max_gaussians", self.gaussian_count.into(), limits.max_gaussians.into())
    }
}
