//! 5.4 sequence_parameters: what holds for every frame of a stream.

use super::{Profile, record_io_in_profile, table};
use crate::Result;

/// The most refinements of a frame.
pub const MAX_REFINEMENTS: u8 = 10;
/// The most spatial layers, and the most temporal layers.
pub const MAX_LAYERS: u8 = 4;

/// The largest `linear_log2`: every position of the finest grid is linear.
pub const MAX_LINEAR_LOG2: u8 = 20;
/// The most segments on a side of the companded part of the position grid.
const MAX_SEGMENTS: u32 = 24;
/// The largest weight of a size, an opacity or an anisotropy in a step.
const MAX_WEIGHT: u16 = 8191;

/// Bits of `sequence_flags`.
const CANONICAL_AXES: u8 = 1;
const ANTIALIASED: u8 = 2;
const WHOLE_ANCHOR: u8 = 4;

/// 1 as the bits of a binary32.
const ONE: u32 = 127 << 23;
/// 2^-40, the smallest step.
const MIN_STEP: f32 = f32::from_bits((127 - 40) << 23);
/// 2^20, the largest step.
const MAX_STEP: f32 = f32::from_bits((127 + 20) << 23);
/// 2^40, the largest magnitude of an offset.
const MAX_OFFSET: f32 = f32::from_bits((127 + 40) << 23);
/// -2^40.
const MIN_OFFSET: f32 = f32::from_bits(1 << 31 | (127 + 40) << 23);

table! {
    /// 5.4 — layers, refinements, and the quantisation grids of the attributes.
    "5.4" "6.4" sequence_parameters SequenceParameters {
        /// degree of the spherical harmonics, 0 to 3
        sh_degree: u8,
        /// spatial layers, 1 to 4; 1 in profile Intra
        spatial_layer_count: u8,
        /// temporal layers, 1 to 4; 1 in profile Intra
        temporal_layer_count: u8,
        /// refinements of a frame, 1 to 10
        refinement_count: u8,
        /// share of the Gaussians up to each refinement, percent; increasing to 100, then 0
        refinement_percent: u8[10],
        /// bits of a position on one axis, 1 to 20
        position_bits: u8,
        /// log2 of the entries in an entropy block, 6 to 16
        block_log2: u8,
        /// bit 0 canonical_axes, bit 1 antialiased, bit 2 whole_anchor; the others are zero
        sequence_flags: u8,
        /// positions are linear within 2^linear_log2 steps of the middle of the grid, 0 to 20
        linear_log2: u8,
        /// log2 of the codes of a segment of the companded part, at most linear_log2
        segment_log2: u8,
        /// low bits of attributes that comparisons ignore, 0 to 7
        feature_shift: u8,
        /// how steps follow from the size: log_scale, opacity, rotation, dc, sh; 0 to 8191
        size_weight: u16[5],
        /// how steps follow from the opacity: rotation, dc, sh; 0 to 8191
        opacity_weight: u16[3],
        /// how the step of the rotation follows from the anisotropy, 0 to 8191
        anisotropy_weight: u16,
        /// size at which steps are as announced, -65536 to 65535
        size_reference: i32,
        /// opacity from which steps are as announced, -32768 to 32767
        opacity_reference: i32,
        /// anisotropy from which the step of the rotation is as announced, 0 to 65535
        anisotropy_reference: i32,
        /// frames in the stream; 0 is not known in advance
        frame_count: u32,
        /// ticks in a second, 1 or more
        ticks_per_second: u32,
        /// ticks from a frame to the next
        ticks_per_frame: u32,
        /// position of the expanded coordinates 0, 0, 0, scene units
        position_offset: f32[3],
        /// distance of grid points in the linear part of the grid, scene units
        position_step: f32,
        /// natural log of the semi-axis at 0
        log_scale_offset: f32,
        /// step of the natural log of the semi-axes
        log_scale_step: f32,
        /// step of the quaternion components, at most 1
        rotation_step: f32,
        /// opacity before the sigmoid at 0
        opacity_offset: f32,
        /// step of the opacity before the sigmoid
        opacity_step: f32,
        /// step of the components of the degree 0 colour
        dc_step: f32,
        /// step of the components of the higher degrees
        sh_step: f32,
    }
}

record_io_in_profile!(SequenceParameters);

/// The Gaussians that make `percent` of `gaussian_count`, rounded up: at most all of them for 100 or less.
pub fn prefix_length(percent: u8, gaussian_count: u32) -> u32 {
    // At most 255 * 2^32: no overflow.
    let prefix = u64::from(percent).saturating_mul(gaussian_count.into()).div_ceil(100);
    u32::try_from(prefix).unwrap_or(u32::MAX)
}

impl SequenceParameters {
    /// One layer, one refinement, positions of 20 bits without companding, and steps of 1 that follow from nothing.
    pub const PLAIN: Self = Self {
        sh_degree: 0,
        spatial_layer_count: 1,
        temporal_layer_count: 1,
        refinement_count: 1,
        refinement_percent: [100, 0, 0, 0, 0, 0, 0, 0, 0, 0],
        position_bits: 20,
        block_log2: 16,
        sequence_flags: 0,
        linear_log2: MAX_LINEAR_LOG2,
        segment_log2: 0,
        feature_shift: 0,
        size_weight: [0; 5],
        opacity_weight: [0; 3],
        anisotropy_weight: 0,
        size_reference: 0,
        opacity_reference: 0,
        anisotropy_reference: 0,
        frame_count: 0,
        ticks_per_second: 30,
        ticks_per_frame: 1,
        position_offset: [0; 3],
        position_step: ONE,
        log_scale_offset: 0,
        log_scale_step: ONE,
        rotation_step: ONE,
        opacity_offset: 0,
        opacity_step: ONE,
        dc_step: ONE,
        sh_step: ONE,
    };

    /// 6.4.
    ///
    /// # Errors
    /// Unsupported: flags that are reserved in the profile. Invalid: a value outside its range, or values
    /// that do not fit each other.
    pub fn validate(&self, at: u64, profile: Profile) -> Result<()> {
        let check = Self::TABLE.check(at);
        let layers = if profile == Profile::Intra { 1 } else { MAX_LAYERS };
        check.range("sh_degree", self.sh_degree, 0, 3)?;
        check.range("spatial_layer_count", self.spatial_layer_count, 1, layers)?;
        check.range("temporal_layer_count", self.temporal_layer_count, 1, layers)?;
        check.range("refinement_count", self.refinement_count, 1, MAX_REFINEMENTS)?;
        self.validate_percents(at)?;
        check.range("position_bits", self.position_bits, 1, 20)?;
        check.range("block_log2", self.block_log2, 6, 16)?;
        let dynamic = if profile == Profile::Intra { 0 } else { WHOLE_ANCHOR };
        let known = CANONICAL_AXES | ANTIALIASED | dynamic;
        check.reserved_bits("sequence_flags", 0, self.sequence_flags & !known)?;
        self.validate_companding(at)?;
        self.validate_steps(at)?;
        check.range("ticks_per_second", self.ticks_per_second, 1, u32::MAX)?;
        self.validate_grids(at)
    }

    /// Bit 0 of `sequence_flags`: axes are sorted by falling scale.
    pub const fn canonical_axes(&self) -> bool {
        self.sequence_flags & CANONICAL_AXES != 0
    }

    /// Bit 1 of `sequence_flags`: opacities were fitted for an antialiasing renderer.
    pub const fn antialiased(&self) -> bool {
        self.sequence_flags & ANTIALIASED != 0
    }

    /// Bit 2 of `sequence_flags`: predicted frames refer to all refinements of their I frame.
    pub const fn whole_anchor(&self) -> bool {
        self.sequence_flags & WHOLE_ANCHOR != 0
    }

    /// `sequence_flags` of these properties.
    pub fn flags(canonical_axes: bool, antialiased: bool, whole_anchor: bool) -> u8 {
        let bits =
            [(canonical_axes, CANONICAL_AXES), (antialiased, ANTIALIASED), (whole_anchor, WHOLE_ANCHOR)];
        bits.into_iter().filter(|(set, _)| *set).fold(0, |flags, (_, bit)| flags | bit)
    }

    /// Gaussians in a second, rounded up, of frames that have `gaussian_count` each; 0 where the rate of frames is
    /// not stated.
    pub fn gaussian_rate(&self, gaussian_count: u32) -> u64 {
        // Below 2^64: no overflow.
        let ticks = u64::from(gaussian_count).saturating_mul(self.ticks_per_second.into());
        match u64::from(self.ticks_per_frame) {
            0 => 0,
            ticks_per_frame => ticks.div_ceil(ticks_per_frame),
        }
    }

    /// Spherical-harmonics planes of a frame: 0, 9, 24 or 45.
    pub const fn sh_dimension(&self) -> u8 {
        match self.sh_degree {
            0 => 0,
            1 => 9,
            2 => 24,
            _ => 45,
        }
    }

    /// P(r): how many of a frame's `gaussian_count` Gaussians are there after refinement `refinement`.
    /// Beyond the last refinement, all.
    pub fn prefix_length(&self, refinement: u8, gaussian_count: u32) -> u32 {
        let percent = match self.refinement_percent.get(usize::from(refinement)) {
            Some(percent) if refinement < self.refinement_count => *percent,
            _ => 100,
        };
        prefix_length(percent, gaussian_count)
    }

    /// P(r) - P(r-1): how many Gaussians refinement `refinement` adds to a frame of `gaussian_count`.
    pub fn refinement_length(&self, refinement: u8, gaussian_count: u32) -> u32 {
        let before = refinement.checked_sub(1).map_or(0, |before| self.prefix_length(before, gaussian_count));
        self.prefix_length(refinement, gaussian_count).saturating_sub(before)
    }

    /// Strictly increasing to 100 over the refinements in use, then zero.
    fn validate_percents(&self, at: u64) -> Result<()> {
        let check = Self::TABLE.check(at);
        let element = "refinement_percent";
        let used = usize::from(self.refinement_count);
        let mut min = 1_u8;
        for (index, percent) in self.refinement_percent.into_iter().enumerate() {
            if index >= used {
                check.range_in(element, index, percent, 0, 0)?;
            } else if index.saturating_add(1) == used {
                check.range_in(element, index, percent, 100, 100)?;
            } else {
                // 99: the last one in use is 100 and greater than this one.
                check.range_in(element, index, percent, min, 99)?;
                min = percent.saturating_add(1);
            }
        }
        Ok(())
    }

    /// The codes outside the linear part fill no more segments than a position has room for.
    fn validate_companding(&self, at: u64) -> Result<()> {
        let check = Self::TABLE.check(at);
        check.range("linear_log2", self.linear_log2, 0, MAX_LINEAR_LOG2)?;
        check.range("segment_log2", self.segment_log2, 0, self.linear_log2)?;
        let half = 1_u32.wrapping_shl(u32::from(self.position_bits).saturating_sub(1));
        let outside = half.saturating_sub(1_u32.wrapping_shl(self.linear_log2.into()));
        let segments = outside.div_ceil(1_u32.wrapping_shl(self.segment_log2.into()));
        let rule = "the companded part of the position grid has at most 24 segments on a side";
        check.rule(segments <= MAX_SEGMENTS, "segment_log2", 0, rule)
    }

    /// What the steps of attributes follow from.
    fn validate_steps(&self, at: u64) -> Result<()> {
        let check = Self::TABLE.check(at);
        check.range("feature_shift", self.feature_shift, 0, 7)?;
        for (index, weight) in self.size_weight.into_iter().enumerate() {
            check.range_in("size_weight", index, weight, 0, MAX_WEIGHT)?;
        }
        for (index, weight) in self.opacity_weight.into_iter().enumerate() {
            check.range_in("opacity_weight", index, weight, 0, MAX_WEIGHT)?;
        }
        check.range("anisotropy_weight", self.anisotropy_weight, 0, MAX_WEIGHT)?;
        check.range("size_reference", self.size_reference, -65_536, 65_535)?;
        check.range("opacity_reference", self.opacity_reference, -32_768, 32_767)?;
        check.range("anisotropy_reference", self.anisotropy_reference, 0, 65_535)
    }

    fn validate_grids(&self, at: u64) -> Result<()> {
        const OFFSET: &str = "an offset is finite and between -2^40 and 2^40";
        const STEP: &str = "a step is between 2^-40 and 2^20";
        const ROTATION_STEP: &str = "the rotation step is between 2^-40 and 1";
        let check = Self::TABLE.check(at);
        // A NaN is in no range.
        let offset = |element, index, value: f32| {
            check.rule((MIN_OFFSET..=MAX_OFFSET).contains(&value), element, index, OFFSET)
        };
        let step = |element, value: f32| check.rule((MIN_STEP..=MAX_STEP).contains(&value), element, 0, STEP);
        for (index, value) in self.position_offset().into_iter().enumerate() {
            offset("position_offset", index, value)?;
        }
        step("position_step", self.position_step())?;
        offset("log_scale_offset", 0, self.log_scale_offset())?;
        step("log_scale_step", self.log_scale_step())?;
        check.rule((MIN_STEP..=1.0).contains(&self.rotation_step()), "rotation_step", 0, ROTATION_STEP)?;
        offset("opacity_offset", 0, self.opacity_offset())?;
        step("opacity_step", self.opacity_step())?;
        step("dc_step", self.dc_step())?;
        step("sh_step", self.sh_step())
    }

    /// The position of grid point 0, scene units.
    pub fn position_offset(&self) -> [f32; 3] {
        self.position_offset.map(f32::from_bits)
    }

    /// The distance of grid points, scene units.
    pub const fn position_step(&self) -> f32 {
        f32::from_bits(self.position_step)
    }

    /// The natural log of the semi-axis at 0.
    pub const fn log_scale_offset(&self) -> f32 {
        f32::from_bits(self.log_scale_offset)
    }

    /// The step of the natural log of the semi-axes.
    pub const fn log_scale_step(&self) -> f32 {
        f32::from_bits(self.log_scale_step)
    }

    /// The step of the quaternion components.
    pub const fn rotation_step(&self) -> f32 {
        f32::from_bits(self.rotation_step)
    }

    /// Opacity before the sigmoid at 0.
    pub const fn opacity_offset(&self) -> f32 {
        f32::from_bits(self.opacity_offset)
    }

    /// The step of the opacity before the sigmoid.
    pub const fn opacity_step(&self) -> f32 {
        f32::from_bits(self.opacity_step)
    }

    /// The step of the components of the degree 0 colour.
    pub const fn dc_step(&self) -> f32 {
        f32::from_bits(self.dc_step)
    }

    /// The step of the components of the higher degrees.
    pub const fn sh_step(&self) -> f32 {
        f32::from_bits(self.sh_step)
    }
}
