//! The increments of a frame: counts that fit the parents, and their sections.

use super::coded::{Values, coded};
use super::dynamic::{ArbitraryIncrement, DynamicFrame, LayeredCodebook};
use super::section;
use crate::entropy::layout::{Layout, Section, ShCoding};
use crate::payload::{SectionBytes, Transform};
use crate::syntax::{
    FrameHeader, IncrementHeader, MAX_NEIGHBOURS, NO_CODEBOOK, NO_PREDICTOR, PlaceInGop, SequenceParameters,
    ShMode, TransformKind,
};
use arbitrary::{Result, Unstructured};

/// Most Gaussians of a frame: enough for two blocks.
const MAX_GAUSSIANS: u32 = 150;
/// Most cells of a frame.
const MAX_CELLS: u32 = 70;

/// Gaussians of each home that a frame has, as far as its increments go.
pub(super) type Homes = Vec<u32>;

/// What the frames of a group share.
pub(super) struct Tools {
    /// Identifier and rank.
    dc: (u8, u8),
    sh: Option<(u8, u8)>,
    /// Codebooks and the temporal layers that define them.
    codebooks: Vec<(u8, u8)>,
    has_network: bool,
}

impl Tools {
    pub(super) fn new(transforms: &[Transform], has_network: bool) -> Self {
        let find = |kind| {
            let found = transforms.iter().find(|transform| transform.header.kind() == Some(kind));
            found.map(|transform| (transform.header.transform_id, transform.header.rank))
        };
        let dc = find(TransformKind::Dc).unwrap_or_default();
        Self { dc, sh: find(TransformKind::Sh), codebooks: Vec::new(), has_network }
    }

    pub(super) fn sh_rank(&self) -> Option<u8> {
        self.sh.map(|(_, rank)| rank)
    }

    pub(super) fn layer_of(&self, id: u8) -> Option<u8> {
        self.codebooks.iter().find(|(known, _)| *known == id).map(|(_, layer)| *layer)
    }

    pub(super) fn define(&mut self, id: u8, temporal_layer: u8) {
        if self.layer_of(id).is_none() {
            self.codebooks.push((id, temporal_layer));
        }
    }

    /// The codebooks that a unit of a temporal layer may use.
    fn stages(&self, temporal_layer: u8) -> Vec<u8> {
        let usable = self.codebooks.iter().filter(|(_, layer)| *layer <= temporal_layer);
        usable.map(|(id, _)| *id).collect()
    }
}

/// Makes the increments of one frame.
struct Maker<'f> {
    sequence: &'f SequenceParameters,
    tools: &'f Tools,
    stages: Vec<u8>,
    has_cells: bool,
    intra: bool,
}

/// A frame at a place of its group, and what frames that refer to it find. `is_whole`: others may refer to it if it is
/// an intra frame.
pub(super) fn frame(
    u: &mut Unstructured<'_>,
    sequence: &SequenceParameters,
    tools: &Tools,
    (number, place, codebooks): (u32, &PlaceInGop, Vec<LayeredCodebook>),
    reference: Option<&Homes>,
    is_whole: bool,
) -> Result<(DynamicFrame, Homes)> {
    let stages = tools.stages(place.temporal_layer);
    let intra = place.reference.is_none();
    let maker = Maker { sequence, tools, stages, has_cells: !intra, intra };
    let (increments, homes, gaussians) = match reference {
        Some(reference) => maker.predicted(u, reference)?,
        None => maker.layers(u, is_whole)?,
    };
    let sh = tools.sh.map(|(id, _)| id);
    let header = FrameHeader::new(place.frame_type, tools.dc.0, sh, gaussians);
    Ok((DynamicFrame { place: number, codebooks, header, increments }, homes))
}

type Made = (Vec<ArbitraryIncrement>, Homes, u32);

impl Maker<'_> {
    /// The increments of an intra frame, layer by layer.
    fn layers(&self, u: &mut Unstructured<'_>, is_whole: bool) -> Result<Made> {
        let gaussians = u.int_in_range(0..=MAX_GAUSSIANS)?;
        let layers = self.sequence.spatial_layer_count;
        let (top, all) = (layers.saturating_sub(1), self.sequence.refinement_count);
        let mut homes: Homes = vec![0; all.into()];
        let mut increments = Vec::new();
        let cut = !is_whole && u.arbitrary()?;
        let last_layer = if cut { u.int_in_range(0..=top)? } else { top };
        let mut width = all;
        for layer in 0..=last_layer {
            width = if cut { u.int_in_range(1..=width)? } else { width };
            for (refinement, home) in (0..width).zip(&mut homes) {
                let most = self.sequence.refinement_length(refinement, gaussians);
                let least = (*home).min(most);
                let after = if layer == top { most } else { u.int_in_range(least..=most)? };
                let added = after.saturating_sub(*home);
                increments.push(self.increment(u, (layer, refinement), *home, (0, added))?);
                *home = after;
            }
        }
        Ok((increments, homes, gaussians))
    }

    /// The increments of a frame that refers to another.
    fn predicted(&self, u: &mut Unstructured<'_>, reference: &Homes) -> Result<Made> {
        let top = self.sequence.spatial_layer_count.saturating_sub(1);
        let all = self.sequence.refinement_count;
        let most = u8::try_from(reference.len()).unwrap_or(all).clamp(1, all);
        let count = if u.ratio(3_u8, 4_u8)? { most } else { u.int_in_range(1..=most)? };
        let mut homes: Homes = Vec::new();
        let mut increments = Vec::new();
        let mut left = MAX_GAUSSIANS;
        for (refinement, &parents) in (0..count).zip(reference) {
            let removed = if u.arbitrary()? { 0 } else { u.int_in_range(0..=parents)? };
            let kept = parents.saturating_sub(removed);
            let added = u.int_in_range(0..=left.saturating_sub(kept).min(40))?;
            increments.push(self.increment(u, (top, refinement), parents, (removed, added))?);
            let home = kept.saturating_add(added);
            left = left.saturating_sub(home);
            homes.push(home);
        }
        // Without the last refinement a frame may announce more than is there.
        let found: u32 = homes.iter().copied().fold(0, u32::saturating_add);
        let more = if count == all { 0 } else { u.int_in_range(0..=40)? };
        Ok((increments, homes, found.saturating_add(more)))
    }

    fn increment(
        &self,
        u: &mut Unstructured<'_>,
        (spatial_layer, refinement): (u8, u8),
        parents: u32,
        (removed, added): (u32, u32),
    ) -> Result<ArbitraryIncrement> {
        let mut header = self.header(u)?;
        (header.parent_count, header.remove_count, header.new_count) = (parents, removed, added);
        if self.has_cells && refinement == 0 {
            header.cell_count = u.int_in_range(0..=MAX_CELLS)?;
        }
        let mut values = Values::of_group(u.arbitrary()?, self.tools.has_network);
        let modes = values.modes(parents, removed, self.intra);
        let count = |bit: i32| modes.iter().filter(|&&mode| mode != 4 && mode & bit != 0).count();
        header.move_count = u32::try_from(count(1)).unwrap_or(u32::MAX);
        header.update_count = u32::try_from(count(2)).unwrap_or(u32::MAX);
        let is_coded = u.ratio(19_u8, 20_u8)?;
        let present = Section::ALL.into_iter().filter(|&section| header.count(section) > 0);
        let sections = present
            .map(|section| {
                if is_coded {
                    let sh = ShCoding::of(&header.sh(), self.tools.sh_rank().unwrap_or(0));
                    let layout = Layout::of_section(section, self.tools.dc.1, sh);
                    let low_bits =
                        if section == Section::Cells { header.cell_log2 } else { header.position_shift };
                    let axis_bits = self.sequence.position_bits.saturating_sub(low_bits).max(1);
                    let count = (header.count(section), axis_bits);
                    Ok(coded(&layout, count, &modes, self.sequence.block_log2, &mut values))
                } else {
                    self.bytes(u, header.count(section))
                }
            })
            .collect::<Result<_>>()?;
        Ok(ArbitraryIncrement { spatial_layer, refinement, header, sections })
    }

    /// A section of arbitrary bytes.
    fn bytes(&self, u: &mut Unstructured<'_>, count: u32) -> Result<SectionBytes> {
        let block_count = count.div_ceil(1_u32.wrapping_shl(self.sequence.block_log2.into()));
        let model = section(u)?;
        let blocks = (0..block_count).map(|_| section(u)).collect::<Result<_>>()?;
        Ok(SectionBytes { lanes_log2: u.int_in_range(0..=5)?, model, blocks })
    }

    /// Everything but counts.
    fn header(&self, u: &mut Unstructured<'_>) -> Result<IncrementHeader> {
        let modes = match (self.tools.sh, self.stages.is_empty()) {
            (None, _) => ShMode::None,
            (Some(_), true) => ShMode::Coefficients,
            (Some(_), false) => ShMode::VectorQuantised,
        };
        let sh_mode = u.int_in_range(0..=modes.code())?;
        let vq_stage_count =
            if sh_mode == ShMode::VectorQuantised.code() { u.int_in_range(1..=4)? } else { 0 };
        let mut codebook_ids = [NO_CODEBOOK; 4];
        for id in codebook_ids.iter_mut().take(vq_stage_count.into()) {
            *id = *u.choose(&self.stages)?;
        }
        let mut attribute_shift = [0; 5];
        for shift in &mut attribute_shift {
            *shift = u.int_in_range(0..=7)?;
        }
        // Large ones put everything outside the lattice.
        let bits = self.sequence.position_bits;
        let most_shift = if u.ratio(1_u8, 4_u8)? { bits.saturating_sub(1) } else { 0 };
        let position_shift = u.int_in_range(0..=most_shift)?;
        let predictor_block_log2 = if u.arbitrary()? { u.int_in_range(0..=16)? } else { NO_PREDICTOR };
        Ok(IncrementHeader {
            refinement_digest: u.arbitrary()?,
            carried_digest: u.arbitrary()?,
            parent_count: 0,
            cell_count: 0,
            move_count: 0,
            update_count: 0,
            remove_count: 0,
            new_count: 0,
            position_shift,
            attribute_shift,
            cell_log2: u.int_in_range(0..=bits)?,
            predictor_block_log2,
            neighbour_count: u.int_in_range(1..=MAX_NEIGHBOURS)?,
            bilateral_spatial: u.arbitrary()?,
            bilateral_feature: u.arbitrary()?,
            sh_mode,
            vq_stage_count,
            codebook_ids,
            compensation_log_scale: u.arbitrary()?,
            compensation_opacity: u.arbitrary()?,
        })
    }
}
