//! 5.14 increment: what one refinement of one layer changes in its frame, and adds to it.

use super::reader::{Reader, leb128_length, write_leb128};
use super::{NO_CODEBOOK, Profile, SequenceParameters, ShHeader, ShMode, Spot, encode, table};
use crate::entropy::section::Section;
use crate::{ErrorKind, Limits, Result};

/// `predictor_block_log2` of a unit whose new Gaussians are not predicted, and `move_block_log2` of one whose moves are
/// not. It does not occur in a stream.
pub const NO_PREDICTOR: u8 = 255;
/// Neighbours of a prediction, at most.
pub const MAX_NEIGHBOURS: u8 = 16;

/// The largest run of new Gaussians, or of moves, with one predictor, log2.
const MAX_PREDICTOR_BLOCK_LOG2: u8 = 16;
/// The largest exponent of a step, in half octaves.
pub const MAX_ATTRIBUTE_STEP: u8 = 24;

table! {
    /// 5.14 — the fixed part of an increment; the elements of `increment_flags` follow, then the sections.
    "5.14" "6.14" increment IncrementStart {
        /// which elements and sections are present
        increment_flags: u16,
        /// digest of the Gaussians of the lists up to this one
        refinement_digest: u64,
    }
}

/// The elements of an increment before its sections. An element that is absent has the value of
/// [`IncrementHeader::PLAIN`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct IncrementHeader {
    /// Which elements are present.
    pub increment_flags: u16,
    /// Digest of the Gaussians of the lists up to this one.
    pub refinement_digest: u64,
    /// Gaussians that the unit may change.
    pub parent_count: u32,
    /// Parents with a position residual.
    pub move_count: u32,
    /// Parents with attribute residuals.
    pub update_count: u32,
    /// Parents that are removed.
    pub remove_count: u32,
    /// Gaussians that the unit adds.
    pub new_count: u32,
    /// Low bits of positions that are not coded, less than `position_bits`.
    pub position_shift: u8,
    /// Exponents of the steps of log_scale, opacity, rotation, dc, sh, in half octaves; 0 to 24.
    pub attribute_step: [u8; 5],
    /// log2 of the new Gaussians that share a predictor, 0 to 16; [`NO_PREDICTOR`] without predictors.
    pub predictor_block_log2: u8,
    /// Neighbours of a prediction, 1 to 16.
    pub neighbour_count: u8,
    /// Weight of distance in the bilateral predictor.
    pub bilateral_spatial: u8,
    /// Weight of attribute differences in the bilateral predictor.
    pub bilateral_feature: u8,
    /// 0 is none, 1 is coefficients, 2 is vector quantised.
    pub sh_mode: u8,
    /// Stages of vector quantisation; 0 unless `sh_mode` is 2.
    pub vq_stage_count: u8,
    /// Codebooks of the stages, 0 to 15; [`NO_CODEBOOK`] for a stage that is not used.
    pub codebook_ids: [u8; 4],
    /// Added to log-scales where the frame is shown up to this refinement, steps.
    pub compensation_log_scale: i8,
    /// Added to opacities where the frame is shown up to this refinement, steps.
    pub compensation_opacity: i8,
    /// log2 of the moves that share a predictor, 0 to 16; [`NO_PREDICTOR`] without move predictors.
    pub move_block_log2: u8,
    /// Whether opacities of parents first go on changing as they did to the reference frame. A flag without an element.
    pub extrapolates_opacity: bool,
}

/// What the frame says about the sizes of the list that an increment changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ListSizes {
    /// Parents of the unit.
    pub parents: u32,
    /// Whether the frame is an I frame, in which nothing is removed.
    pub intra: bool,
    /// The size of the list after the unit, where it is prescribed.
    pub size: Option<u32>,
    /// The largest size that the list may have after the unit.
    pub max_size: u32,
}

impl IncrementHeader {
    /// Bit 0 of `increment_flags`: `parent_count`.
    pub const PARENTS: u16 = 1;
    /// Bit 1: `move_count`.
    pub const MOVES: u16 = 1 << 1;
    /// Bit 2: `update_count`.
    pub const UPDATES: u16 = 1 << 2;
    /// Bit 3: `remove_count`.
    pub const REMOVALS: u16 = 1 << 3;
    /// Bit 4: `new_count`.
    pub const NEW: u16 = 1 << 4;
    /// Bit 5: `position_shift`.
    pub const POSITION_SHIFT: u16 = 1 << 5;
    /// Bit 6: `attribute_step`.
    pub const ATTRIBUTE_STEP: u16 = 1 << 6;
    /// Bit 7: the four elements of prediction.
    pub const PREDICTORS: u16 = 1 << 7;
    /// Bit 8: `sh_mode` and what it needs.
    pub const SH: u16 = 1 << 8;
    /// Bit 9: the two elements of compensation.
    pub const COMPENSATION: u16 = 1 << 9;
    /// Bit 10: `move_block_log2`.
    pub const MOVE_PREDICTORS: u16 = 1 << 10;
    /// Bit 11: opacities are extrapolated. It has no element.
    pub const EXTRAPOLATES_OPACITY: u16 = 1 << 11;
    /// The bits that have a meaning.
    const FLAGS: u16 = (1 << 12) - 1;
    /// The bits that no unit of an I frame has.
    const TEMPORAL: u16 = Self::MOVE_PREDICTORS | Self::EXTRAPOLATES_OPACITY;

    /// The names of the bits of `increment_flags`, from bit 0 on.
    pub const FLAG_NAMES: [&'static str; 12] = [
        "has_parents",
        "has_moves",
        "has_updates",
        "has_removals",
        "has_new",
        "has_position_shift",
        "has_attribute_step",
        "has_predictors",
        "has_sh",
        "has_compensation",
        "has_move_predictors",
        "extrapolates_opacity",
    ];

    /// Of a unit that changes and adds nothing: no element is present.
    pub const PLAIN: Self = Self {
        increment_flags: 0,
        refinement_digest: 0,
        parent_count: 0,
        move_count: 0,
        update_count: 0,
        remove_count: 0,
        new_count: 0,
        position_shift: 0,
        attribute_step: [0; 5],
        predictor_block_log2: NO_PREDICTOR,
        neighbour_count: 1,
        bilateral_spatial: 0,
        bilateral_feature: 0,
        sh_mode: ShMode::None.code(),
        vq_stage_count: 0,
        codebook_ids: [NO_CODEBOOK; 4],
        compensation_log_scale: 0,
        compensation_opacity: 0,
        move_block_log2: NO_PREDICTOR,
        extrapolates_opacity: false,
    };

    /// Reads and checks the header of a payload that stands at offset `at`; gives the bytes after it.
    ///
    /// # Errors
    /// Malformed: bytes are missing, or a number is not in its shortest form. Those of [`Self::validate`].
    pub fn parse<'a>(
        payload: &'a [u8],
        at: u64,
        sequence: &SequenceParameters,
        profile: Profile,
    ) -> Result<(Self, &'a [u8])> {
        let mut reader = Reader::new(payload, at);
        let header = Self::read(&mut reader, sequence, profile)?;
        Ok((header, reader.rest()))
    }

    /// The same from a reader, which is after the header then.
    pub(crate) fn read(
        reader: &mut Reader<'_, '_>,
        sequence: &SequenceParameters,
        profile: Profile,
    ) -> Result<Self> {
        let at = reader.at();
        reader.record(IncrementStart::TABLE.name, IncrementStart::TABLE.syntax);
        let mut header = Self {
            increment_flags: reader.array("increment_flags").map(u16::from_le_bytes)?,
            refinement_digest: reader.array("refinement_digest").map(u64::from_le_bytes)?,
            ..Self::PLAIN
        };
        header.validate_flags(at, profile)?;
        header.read_elements(reader)?;
        header.validate(at, sequence, profile)?;
        Ok(header)
    }

    /// The elements that `increment_flags` announces. What follows depends on `sh_mode` alone, so that it is the
    /// only one to be checked here.
    fn read_elements(&mut self, reader: &mut Reader<'_, '_>) -> Result<()> {
        let flags = self.increment_flags;
        let counts = [
            (Self::PARENTS, "parent_count", &mut self.parent_count),
            (Self::MOVES, "move_count", &mut self.move_count),
            (Self::UPDATES, "update_count", &mut self.update_count),
            (Self::REMOVALS, "remove_count", &mut self.remove_count),
            (Self::NEW, "new_count", &mut self.new_count),
        ];
        for (flag, element, count) in counts {
            if flags & flag != 0 {
                *count = reader.number(element)?;
            }
        }
        if flags & Self::POSITION_SHIFT != 0 {
            self.position_shift = reader.u8("position_shift")?;
        }
        if flags & Self::ATTRIBUTE_STEP != 0 {
            self.attribute_step = reader.array("attribute_step")?;
        }
        if flags & Self::PREDICTORS != 0 {
            self.predictor_block_log2 = reader.u8("predictor_block_log2")?;
            self.neighbour_count = reader.u8("neighbour_count")?;
            self.bilateral_spatial = reader.u8("bilateral_spatial")?;
            self.bilateral_feature = reader.u8("bilateral_feature")?;
        }
        if flags & Self::SH != 0 {
            let sh = ShHeader::read(reader)?;
            ShHeader {
                sh_mode: self.sh_mode,
                vq_stage_count: self.vq_stage_count,
                codebook_ids: self.codebook_ids,
            } = sh;
        }
        if flags & Self::COMPENSATION != 0 {
            self.compensation_log_scale = reader.array("compensation_log_scale").map(i8::from_le_bytes)?;
            self.compensation_opacity = reader.array("compensation_opacity").map(i8::from_le_bytes)?;
        }
        if flags & Self::MOVE_PREDICTORS != 0 {
            self.move_block_log2 = reader.u8("move_block_log2")?;
        }
        self.extrapolates_opacity = flags & Self::EXTRAPOLATES_OPACITY != 0;
        Ok(())
    }

    /// The header with the fewest flags that its values need.
    #[must_use]
    pub fn with_flags(self) -> Self {
        Self { increment_flags: self.needed_flags(), ..self }
    }

    /// The flags without which a value would not be written.
    fn needed_flags(&self) -> u16 {
        let plain = Self::PLAIN;
        let prediction = |header: &Self| {
            let Self { neighbour_count, bilateral_spatial, bilateral_feature, .. } = *header;
            (header.predictor_block_log2, neighbour_count, bilateral_spatial, bilateral_feature)
        };
        let compensation = (self.compensation_log_scale, self.compensation_opacity);
        [
            (self.parent_count > 0, Self::PARENTS),
            (self.move_count > 0, Self::MOVES),
            (self.update_count > 0, Self::UPDATES),
            (self.remove_count > 0, Self::REMOVALS),
            (self.new_count > 0, Self::NEW),
            (self.position_shift > 0, Self::POSITION_SHIFT),
            (self.attribute_step != plain.attribute_step, Self::ATTRIBUTE_STEP),
            (prediction(self) != prediction(&plain), Self::PREDICTORS),
            (self.sh() != plain.sh(), Self::SH),
            (compensation != (0, 0), Self::COMPENSATION),
            (self.move_block_log2 != plain.move_block_log2, Self::MOVE_PREDICTORS),
            (self.extrapolates_opacity, Self::EXTRAPOLATES_OPACITY),
        ]
        .into_iter()
        .filter(|(needed, _)| *needed)
        .fold(0, |flags, (_, flag)| flags | flag)
    }

    /// How the spherical harmonics are coded.
    pub const fn sh(&self) -> ShHeader {
        let Self { sh_mode, vq_stage_count, codebook_ids, .. } = *self;
        ShHeader { sh_mode, vq_stage_count, codebook_ids }
    }

    /// The bytes of the header; refused where [`Self::parse`] would refuse them in every profile, and where a flag
    /// is missing that a value needs.
    ///
    /// # Errors
    /// Those of [`Self::validate`] in the profile Dynamic; invalid without a flag that a value needs.
    pub fn to_bytes(&self, sequence: &SequenceParameters) -> Result<Vec<u8>> {
        self.validate(0, sequence, Profile::Dynamic)?;
        let complete = self.needed_flags() & !self.increment_flags == 0;
        self.spot(0, "increment_flags", 0).rule(complete, "every value has its flag")?;
        let Self { increment_flags, refinement_digest, .. } = *self;
        let mut bytes = encode(&IncrementStart { increment_flags, refinement_digest });
        for (flag, count) in self.counts() {
            if increment_flags & flag != 0 {
                write_leb128(count, &mut bytes);
            }
        }
        let prediction =
            [self.predictor_block_log2, self.neighbour_count, self.bilateral_spatial, self.bilateral_feature];
        let compensation = [self.compensation_log_scale, self.compensation_opacity].map(i8::cast_unsigned);
        let sh = self.sh().to_bytes();
        let rest: [(u16, &[u8]); 6] = [
            (Self::POSITION_SHIFT, &[self.position_shift]),
            (Self::ATTRIBUTE_STEP, &self.attribute_step),
            (Self::PREDICTORS, &prediction),
            (Self::SH, &sh),
            (Self::COMPENSATION, &compensation),
            (Self::MOVE_PREDICTORS, &[self.move_block_log2]),
        ];
        for (_, element) in rest.into_iter().filter(|(flag, _)| increment_flags & flag != 0) {
            bytes.extend_from_slice(element);
        }
        Ok(bytes)
    }

    const fn counts(&self) -> [(u16, u32); 5] {
        [
            (Self::PARENTS, self.parent_count),
            (Self::MOVES, self.move_count),
            (Self::UPDATES, self.update_count),
            (Self::REMOVALS, self.remove_count),
            (Self::NEW, self.new_count),
        ]
    }

    /// The elements after the fixed part, each with its flag and the bytes that it has if it is present.
    fn elements(&self) -> [(&'static str, u16, usize); 17] {
        let [parents, moves, updates, removals, new] = self.counts().map(|(_, count)| leb128_length(count));
        let stages = usize::from(self.vq_stage_count);
        [
            ("parent_count", Self::PARENTS, parents),
            ("move_count", Self::MOVES, moves),
            ("update_count", Self::UPDATES, updates),
            ("remove_count", Self::REMOVALS, removals),
            ("new_count", Self::NEW, new),
            ("position_shift", Self::POSITION_SHIFT, 1),
            ("attribute_step", Self::ATTRIBUTE_STEP, 5),
            ("predictor_block_log2", Self::PREDICTORS, 1),
            ("neighbour_count", Self::PREDICTORS, 1),
            ("bilateral_spatial", Self::PREDICTORS, 1),
            ("bilateral_feature", Self::PREDICTORS, 1),
            ("sh_mode", Self::SH, 1),
            ("vq_stage_count", Self::SH, stages.min(1)),
            ("codebook_ids", Self::SH, stages),
            ("compensation_log_scale", Self::COMPENSATION, 1),
            ("compensation_opacity", Self::COMPENSATION, 1),
            ("move_block_log2", Self::MOVE_PREDICTORS, 1),
        ]
    }

    /// Bytes of the header.
    pub fn size(&self) -> usize {
        let present = self.elements().into_iter().filter(|(_, flag, _)| self.increment_flags & flag != 0);
        present.map(|(_, _, bytes)| bytes).fold(IncrementStart::SIZE, usize::saturating_add)
    }

    /// Offset of an element of a payload that stands at `at`; that of `increment_flags` if the element is absent.
    pub fn at(&self, at: u64, element: &str) -> u64 {
        let start = &IncrementStart::TABLE;
        let mut offset = start.size();
        for (name, flag, bytes) in self.elements() {
            let present = self.increment_flags & flag != 0;
            if name == element && present {
                return super::after(at, offset);
            }
            offset = offset.saturating_add(if present { bytes } else { 0 });
        }
        let known = start.rows.iter().any(|row| row.name == element);
        super::after(at, if known { start.offset(element) } else { 0 })
    }

    /// Index `index` of an element, to be checked by clause 6.14.
    fn spot(&self, at: u64, element: &'static str, index: usize) -> Spot {
        let at = super::after(self.at(at, element), index);
        Spot { at, clause: IncrementStart::TABLE.semantics, element }
    }

    /// 6.14, of `increment_flags` alone.
    fn validate_flags(&self, at: u64, profile: Profile) -> Result<()> {
        let spot = self.spot(at, "increment_flags", 0);
        let flags = self.increment_flags;
        spot.reserved_bits(flags & !Self::FLAGS)?;
        let has = |bit: u16| flags & bit != 0;
        let dynamic = has(Self::PREDICTORS | Self::TEMPORAL);
        let kind = ErrorKind::Reserved { element: "increment_flags", value: flags.into() };
        spot.holds(!dynamic || profile == Profile::Dynamic, kind)?;
        spot.rule(!has(Self::PREDICTORS) || has(Self::NEW), "only new Gaussians are predicted")?;
        spot.rule(!has(Self::MOVE_PREDICTORS) || has(Self::MOVES), "only moves have move predictors")?;
        spot.rule(!has(Self::EXTRAPOLATES_OPACITY) || has(Self::PARENTS), "only parents are extrapolated")
    }

    /// 6.14, as far as it needs nothing but the sequence.
    ///
    /// # Errors
    /// Unsupported: flags or values that are reserved in the profile. Invalid: flags that do not go together,
    /// or a value outside its range.
    pub fn validate(&self, at: u64, sequence: &SequenceParameters, profile: Profile) -> Result<()> {
        self.validate_flags(at, profile)?;
        for ((flag, count), (element, ..)) in self.counts().into_iter().zip(self.elements()) {
            if self.increment_flags & flag != 0 {
                self.spot(at, element, 0).range(count, 1, u32::MAX)?;
            }
        }
        let last_bit = sequence.position_bits.saturating_sub(1);
        self.spot(at, "position_shift", 0).range(self.position_shift, 0, last_bit)?;
        for (index, step) in self.attribute_step.into_iter().enumerate() {
            self.spot(at, "attribute_step", index).range(step, 0, MAX_ATTRIBUTE_STEP)?;
        }
        if self.increment_flags & Self::PREDICTORS != 0 {
            let spot = self.spot(at, "predictor_block_log2", 0);
            spot.range(self.predictor_block_log2, 0, MAX_PREDICTOR_BLOCK_LOG2)?;
            self.spot(at, "neighbour_count", 0).range(self.neighbour_count, 1, MAX_NEIGHBOURS)?;
        }
        if self.increment_flags & Self::SH != 0 {
            self.sh().validate(|element, index| self.spot(at, element, index))?;
        }
        if self.increment_flags & Self::MOVE_PREDICTORS != 0 {
            let spot = self.spot(at, "move_block_log2", 0);
            spot.range(self.move_block_log2, 0, MAX_PREDICTOR_BLOCK_LOG2)?;
        }
        Ok(())
    }

    /// A.2: no more Gaussians than a frame may have, and no more new ones than the payload can hold.
    ///
    /// # Errors
    /// Over limit: there are more.
    pub fn within(&self, at: u64, payload_length: usize, limits: &Limits) -> Result<()> {
        let most = u64::from(limits.max_gaussians);
        let new_at = self.at(at, "new_count");
        Limits::check(self.at(at, "parent_count"), "max_gaussians", self.parent_count.into(), most)?;
        Limits::check(new_at, "max_gaussians", self.new_count.into(), most)?;
        let most = super::after(0, payload_length).saturating_mul(Limits::NEW_PER_BYTE);
        Limits::check(new_at, "new Gaussians of the payload", self.new_count.into(), most)
    }

    /// 6.14 and 7.14: the flags fit the frame, the counts fit the parents there are, and the list has the size that the frame prescribes.
    ///
    /// # Errors
    /// Invalid: they do not, or it has another.
    pub fn validate_counts(&self, at: u64, sizes: &ListSizes) -> Result<()> {
        let equal = |element, value: u32, expected: u32| {
            self.spot(at, element, 0).equal(value.into(), expected.into())
        };
        let (parents, flags) = (sizes.parents, self.increment_flags);
        let allowed = if sizes.intra { flags & !Self::TEMPORAL } else { flags };
        self.spot(at, "increment_flags", 0).equal(flags.into(), allowed.into())?;
        equal("parent_count", self.parent_count, parents)?;
        equal("move_count", self.move_count, self.move_count.min(parents))?;
        equal("update_count", self.update_count, self.update_count.min(parents))?;
        let removable = if sizes.intra { 0 } else { parents };
        equal("remove_count", self.remove_count, self.remove_count.min(removable))?;
        let size = self.list_size();
        let expected = sizes.size.unwrap_or_else(|| size.min(sizes.max_size));
        self.spot(at, "new_count", 0).holds(
            size == expected,
            ErrorKind::Mismatch { element: "new_count", value: size.into(), expected: expected.into() },
        )
    }

    /// Runs of new Gaussians that share a predictor.
    pub fn predictor_count(&self) -> u32 {
        if self.predictor_block_log2 == NO_PREDICTOR {
            return 0;
        }
        self.new_count.div_ceil(1_u32.wrapping_shl(self.predictor_block_log2.into()))
    }

    /// Runs of moves that share a predictor.
    pub fn move_predictor_count(&self) -> u32 {
        if self.move_block_log2 == NO_PREDICTOR {
            return 0;
        }
        self.move_count.div_ceil(1_u32.wrapping_shl(self.move_block_log2.into()))
    }

    /// Gaussians of the list after the unit, where the counts are consistent.
    pub const fn list_size(&self) -> u32 {
        self.parent_count.saturating_sub(self.remove_count).saturating_add(self.new_count)
    }

    /// Whether anything happens to a parent: otherwise every parent is skipped, and the modes are absent.
    pub const fn has_modes(&self) -> bool {
        self.move_count > 0 || self.update_count > 0 || self.remove_count > 0
    }

    /// How many values each plane of a section has; a section without any is absent.
    pub fn count(&self, section: Section) -> u32 {
        match section {
            Section::Cells => 0,
            Section::Modes if !self.has_modes() => 0,
            Section::Modes => self.parent_count,
            Section::MovePredictors => self.move_predictor_count(),
            Section::Moves => self.move_count,
            Section::Updates => self.update_count,
            Section::Predictors => self.predictor_count(),
            Section::New => self.new_count,
        }
    }
}

impl IncrementHeader {
    /// The table of the fixed part.
    pub const TABLE: super::Table = IncrementStart::TABLE;
}
