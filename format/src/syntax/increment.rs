//! 5.14 increment: what one refinement of one layer changes in its frame, and adds to it.

use super::{NO_CODEBOOK, SequenceParameters, ShHeader, ShMode, decode, encode, table};
use crate::entropy::layout::Section;
use crate::{Limits, Result};

/// `predictor_block_log2` of a unit whose new Gaussians are not predicted.
pub const NO_PREDICTOR: u8 = 255;

/// The largest run of new Gaussians with one predictor, log2.
const MAX_PREDICTOR_BLOCK_LOG2: u8 = 16;
/// Neighbours of a prediction, at most.
pub const MAX_NEIGHBOURS: u8 = 16;
/// Shift of an attribute, at most.
const MAX_ATTRIBUTE_SHIFT: u8 = 7;

table! {
    /// 5.14 — the fixed part of an increment; its sections follow.
    "5.14" "6.14" increment IncrementHeader {
        /// digest of the Gaussians of the homes up to this one
        refinement_digest: u64,
        /// digest of what is carried for the homes after this one
        carried_digest: u64,
        /// Gaussians that the unit may change
        parent_count: u32,
        /// cells that move or are stale
        cell_count: u32,
        /// parents with a position residual
        move_count: u32,
        /// parents with attribute residuals
        update_count: u32,
        /// parents that are removed
        remove_count: u32,
        /// Gaussians that the unit adds
        new_count: u32,
        /// low bits of positions that are not coded, less than position_bits
        position_shift: u8,
        /// low bits not coded of log_scale, opacity, rotation, dc, sh; 0 to 7
        attribute_shift: u8[5],
        /// log2 of the side of a cell in lattice points
        cell_log2: u8,
        /// log2 of the new Gaussians that share a predictor, 0 to 16; 255 is none
        predictor_block_log2: u8,
        /// neighbours of a prediction, 1 to 16
        neighbour_count: u8,
        /// weight of distance in the bilateral predictor
        bilateral_spatial: u8,
        /// weight of attribute differences in the bilateral predictor
        bilateral_feature: u8,
        /// 0 is none, 1 is coefficients, 2 is vector quantised
        sh_mode: u8,
        /// stages of vector quantisation; 0 unless sh_mode is 2
        vq_stage_count: u8,
        /// codebooks of the stages, 0 to 15; 255 for a stage not used
        codebook_ids: u8[4],
        /// added to log-scales where the frame is shown up to this refinement, steps
        compensation_log_scale: i8,
        /// added to opacities where the frame is shown up to this refinement, steps
        compensation_opacity: i8,
    }
}

impl IncrementHeader {
    /// Of a unit that changes and adds nothing: no predictors, no shifts, no spherical harmonics.
    pub const PLAIN: Self = Self {
        refinement_digest: 0,
        carried_digest: 0,
        parent_count: 0,
        cell_count: 0,
        move_count: 0,
        update_count: 0,
        remove_count: 0,
        new_count: 0,
        position_shift: 0,
        attribute_shift: [0; 5],
        cell_log2: 0,
        predictor_block_log2: NO_PREDICTOR,
        neighbour_count: 1,
        bilateral_spatial: 0,
        bilateral_feature: 0,
        sh_mode: ShMode::None.code(),
        vq_stage_count: 0,
        codebook_ids: [NO_CODEBOOK; 4],
        compensation_log_scale: 0,
        compensation_opacity: 0,
    };

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

    /// The bytes of the fixed part; refused where [`Self::parse`] would refuse them.
    pub fn to_bytes(&self, sequence: &SequenceParameters) -> Result<Vec<u8>> {
        self.validate(0, sequence)?;
        encode(&Self::TABLE, self)
    }

    /// 6.14, as far as it needs nothing but the sequence.
    pub fn validate(&self, at: u64, sequence: &SequenceParameters) -> Result<()> {
        let check = Self::TABLE.check(at);
        let last_bit = sequence.position_bits.saturating_sub(1);
        check.range("position_shift", self.position_shift, 0, last_bit)?;
        for (place, shift) in self.attribute_shift.into_iter().enumerate() {
            check.range_in("attribute_shift", place, shift, 0, MAX_ATTRIBUTE_SHIFT)?;
        }
        check.range("cell_log2", self.cell_log2, 0, sequence.position_bits)?;
        if self.predictor_block_log2 != NO_PREDICTOR {
            check.range("predictor_block_log2", self.predictor_block_log2, 0, MAX_PREDICTOR_BLOCK_LOG2)?;
        }
        check.range("neighbour_count", self.neighbour_count, 1, MAX_NEIGHBOURS)?;
        self.sh().validate(check)
    }

    /// A.2: as many cells as agreed, and no more Gaussians than a frame may have.
    pub fn within(&self, at: u64, limits: &Limits) -> Result<()> {
        let offset = |element| Self::TABLE.check(at).offset(element, 0);
        let most = u64::from(limits.max_gaussians);
        Limits::check(offset("parent_count"), "max_gaussians", self.parent_count.into(), most)?;
        Limits::check(offset("cell_count"), "max_cells", self.cell_count.into(), limits.max_cells.into())?;
        Limits::check(offset("new_count"), "max_gaussians", self.new_count.into(), most)
    }

    /// 6.14: the counts fit the parents there are, and a frame of `gaussian_count`; only some units have cells.
    pub fn validate_counts(&self, at: u64, parents: u32, has_cells: bool, gaussian_count: u32) -> Result<()> {
        let check = Self::TABLE.check(at);
        check.equal("parent_count", self.parent_count.into(), parents.into())?;
        if !has_cells {
            check.equal("cell_count", self.cell_count.into(), 0)?;
        }
        let most =
            |element, value: u32, most: u32| check.equal(element, value.into(), value.min(most).into());
        most("move_count", self.move_count, parents)?;
        most("update_count", self.update_count, parents)?;
        most("remove_count", self.remove_count, parents)?;
        most("new_count", self.new_count, gaussian_count)
    }

    /// Runs of new Gaussians that share a predictor.
    pub fn predictor_count(&self) -> u32 {
        if self.predictor_block_log2 == NO_PREDICTOR {
            return 0;
        }
        self.new_count.div_ceil(1_u32.wrapping_shl(self.predictor_block_log2.into()))
    }

    /// Gaussians of the home after the unit, where the counts are consistent.
    pub const fn home_count(&self) -> u32 {
        self.parent_count.saturating_sub(self.remove_count).saturating_add(self.new_count)
    }

    /// How many values each plane of a section has; a section without any is absent.
    pub fn count(&self, section: Section) -> u32 {
        match section {
            Section::Cells => self.cell_count,
            Section::Modes => self.parent_count,
            Section::Moves => self.move_count,
            Section::Updates => self.update_count,
            Section::Predictors => self.predictor_count(),
            Section::New => self.new_count,
        }
    }
}
