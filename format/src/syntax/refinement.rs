//! 5.9 refinement: the Gaussians that a refinement adds to its frame.

use super::{SequenceParameters, ShHeader, decode, table};
use crate::{Limits, Result};

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

impl RefinementHeader {
    /// How the spherical harmonics are coded.
    pub const fn sh(&self) -> ShHeader {
        let Self { sh_mode, vq_stage_count, codebook_ids, .. } = *self;
        ShHeader { sh_mode, vq_stage_count, codebook_ids }
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
        self.sh().validate(check)
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
