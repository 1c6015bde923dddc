//! The frames of a GOP: increments with counts that fit the parents, and their sections.

use super::coded::{Values, coded};
use super::{ArbitraryFrame, ArbitraryIncrement, LayeredCodebook, codebook, section};
use crate::entropy::layout::{Layout, Section, ShCoding};
use crate::payload::{CellsBytes, SectionBytes, Transform};
use crate::syntax::{
    FrameHeader, FrameRole, GopHeader, IncrementHeader, MAX_ATTRIBUTE_STEP, MAX_NEIGHBOURS, Profile,
    SequenceParameters, ShHeader, ShMode, TransformKind,
};
use arbitrary::{Result, Unstructured};

/// Most Gaussians of a frame: enough for two blocks.
const MAX_GAUSSIANS: u32 = 150;
/// Most cells of a frame.
const MAX_CELLS: u32 = 70;

/// Gaussians of each list to which other frames may refer.
type Lists = Vec<u32>;

/// What the frames of a GOP share.
pub(super) struct Tools {
    /// Identifier and rank.
    dc: (u8, u8),
    sh: Option<(u8, u8)>,
    /// Codebooks and the temporal layers that define them.
    codebooks: Vec<(u8, u8)>,
    profile: Profile,
    has_network: bool,
}

impl Tools {
    pub(super) fn new(transforms: &[Transform], profile: Profile, has_network: bool) -> Self {
        let find = |kind| {
            let found = transforms.iter().find(|transform| transform.header.kind() == Some(kind));
            found.map(|transform| (transform.header.transform_id, transform.header.rank))
        };
        let dc = find(TransformKind::Dc).unwrap_or_default();
        Self { dc, sh: find(TransformKind::Sh), codebooks: Vec::new(), profile, has_network }
    }

    fn layer_of(&self, id: u8) -> Option<u8> {
        self.codebooks.iter().find(|(known, _)| *known == id).map(|(_, layer)| *layer)
    }

    /// Codebooks before a frame: new ones, or new definitions of those that are known.
    fn define(
        &mut self,
        u: &mut Unstructured<'_>,
        role: &FrameRole,
        sequence: &SequenceParameters,
    ) -> Result<Vec<LayeredCodebook>> {
        let Some((_, rank)) = self.sh else { return Ok(Vec::new()) };
        let most = sequence.temporal_layer_count.saturating_sub(1).min(role.temporal_layer);
        let mut defined = Vec::new();
        for _ in 0..u.int_in_range(0..=2)? {
            let id = u.int_in_range(0..=3)?;
            let known = self.layer_of(id);
            let temporal_layer = known.map_or_else(|| u.int_in_range(0..=most), Ok)?;
            if known.is_none() {
                self.codebooks.push((id, temporal_layer));
            }
            defined.push(LayeredCodebook { temporal_layer, codebook: codebook(u, id, rank)? });
        }
        Ok(defined)
    }

    /// The codebooks that a unit of a temporal layer may use.
    fn stages(&self, temporal_layer: u8) -> Vec<u8> {
        let usable = self.codebooks.iter().filter(|(_, layer)| *layer <= temporal_layer);
        usable.map(|(id, _)| *id).collect()
    }
}

/// The frames of a GOP.
pub(super) fn frames(
    u: &mut Unstructured<'_>,
    header: &GopHeader,
    sequence: &SequenceParameters,
    mut tools: Tools,
) -> Result<Vec<ArbitraryFrame>> {
    let mut known: Vec<(u32, Lists)> = Vec::new();
    let mut frames = Vec::new();
    for index in 0..header.gop_frame_count {
        let role = header.role(index);
        // Frames that no other refers to may be absent.
        let is_leaf = role.temporal_layer > 0 && role.temporal_layer == header.temporal_depth;
        if is_leaf && u.ratio(1_u8, 5_u8)? {
            continue;
        }
        let codebooks = tools.define(u, &role, sequence)?;
        let reference = role.reference.and_then(|wanted| known.iter().find(|(index, _)| *index == wanted));
        let stages = tools.stages(role.temporal_layer);
        let maker = Maker { sequence, tools: &tools, stages, intra: role.reference.is_none() };
        let (increments, lists, gaussians) = match reference {
            Some((_, lists)) => maker.predicted(u, lists)?,
            None => maker.layers(u)?,
        };
        let header = FrameHeader::new(role.frame_type, tools.dc.0, tools.sh.map(|(id, _)| id), gaussians);
        let cells = if maker.intra || u.arbitrary()? { None } else { Some(maker.cells(u)?) };
        let has_digest = !maker.intra && u.ratio(1_u8, 4_u8)?;
        let carried_digest = if has_digest { Some(u.arbitrary()?) } else { None };
        known.push((index, lists));
        frames.push(ArbitraryFrame { index, codebooks, header, carried_digest, cells, increments });
    }
    Ok(frames)
}

/// Makes the increments of one frame.
struct Maker<'f> {
    sequence: &'f SequenceParameters,
    tools: &'f Tools,
    stages: Vec<u8>,
    intra: bool,
}

type Made = (Vec<ArbitraryIncrement>, Lists, u32);

impl Maker<'_> {
    /// The increments of an I frame, layer by layer.
    fn layers(&self, u: &mut Unstructured<'_>) -> Result<Made> {
        let gaussians = u.int_in_range(0..=MAX_GAUSSIANS)?;
        let top = self.sequence.spatial_layer_count.saturating_sub(1);
        let all = self.sequence.refinement_count;
        let mut lists: Lists = vec![0; all.into()];
        let mut increments = Vec::new();
        let cut = u.ratio(1_u8, 3_u8)?;
        let last_layer = if cut { u.int_in_range(0..=top)? } else { top };
        let mut width = all;
        for layer in 0..=last_layer {
            width = if cut { u.int_in_range(1..=width)? } else { width };
            for (refinement, list) in (0..width).zip(&mut lists) {
                let most = self.sequence.refinement_length(refinement, gaussians);
                let least = (*list).min(most);
                let size = if layer == top { most } else { u.int_in_range(least..=most)? };
                let added = size.saturating_sub(*list);
                increments.push(self.increment(u, (layer, refinement), *list, (0, added))?);
                *list = size;
            }
        }
        // Frames refer to the lists of the highest layer, or to all of them if all units are there.
        let refers = last_layer == top && (width == all || !self.sequence.whole_anchor());
        let units = usize::from(all).saturating_mul(self.sequence.spatial_layer_count.into());
        let whole = !self.sequence.whole_anchor() || increments.len() == units;
        lists.truncate(if refers && whole { width.into() } else { 0 });
        Ok((increments, lists, gaussians))
    }

    /// The increments of a frame that refers to another.
    fn predicted(&self, u: &mut Unstructured<'_>, reference: &Lists) -> Result<Made> {
        let top = self.sequence.spatial_layer_count.saturating_sub(1);
        let all = self.sequence.refinement_count;
        let most = u8::try_from(reference.len()).unwrap_or(all).min(all);
        let count = if u.ratio(3_u8, 4_u8)? { most } else { u.int_in_range(0..=most)? };
        let mut lists: Lists = Vec::new();
        let mut increments = Vec::new();
        let mut left = MAX_GAUSSIANS;
        for (refinement, &parents) in (0..count).zip(reference) {
            let removed = if u.arbitrary()? { 0 } else { u.int_in_range(0..=parents)? };
            let kept = parents.saturating_sub(removed);
            let added = u.int_in_range(0..=left.saturating_sub(kept).min(40))?;
            increments.push(self.increment(u, (top, refinement), parents, (removed, added))?);
            let size = kept.saturating_add(added);
            left = left.saturating_sub(size);
            lists.push(size);
        }
        // Without the last refinement a frame may announce more than is there.
        let found: u32 = lists.iter().copied().fold(0, u32::saturating_add);
        let more = if count == all { 0 } else { u.int_in_range(0..=40)? };
        Ok((increments, lists, found.saturating_add(more)))
    }

    /// The motion of a frame that refers to another.
    fn cells(&self, u: &mut Unstructured<'_>) -> Result<CellsBytes> {
        let cell_count = u.int_in_range(1..=MAX_CELLS)?;
        let cell_log2 = u.int_in_range(0..=self.sequence.position_bits)?;
        let mut values = Values::new(u.arbitrary()?);
        let section = self.section(u, Section::Cells, &NO_SH, (cell_count, cell_log2), &[], &mut values)?;
        Ok(CellsBytes { cell_count, cell_log2, section })
    }

    fn increment(
        &self,
        u: &mut Unstructured<'_>,
        (spatial_layer, refinement): (u8, u8),
        parents: u32,
        (removed, added): (u32, u32),
    ) -> Result<ArbitraryIncrement> {
        let mut header = self.header(u, added > 0)?;
        (header.parent_count, header.remove_count, header.new_count) = (parents, removed, added);
        let mut values = Values::of_gop(u.arbitrary()?, self.tools.has_network);
        let modes = values.modes(parents, removed, self.intra);
        let count = |bit: i32| modes.iter().filter(|&&mode| mode != 4 && mode & bit != 0).count();
        header.move_count = u32::try_from(count(1)).unwrap_or(u32::MAX);
        header.update_count = u32::try_from(count(2)).unwrap_or(u32::MAX);
        if !self.intra && header.move_count > 0 && u.arbitrary()? {
            header.move_block_log2 = u.int_in_range(0..=16)?;
        }
        header.extrapolates_opacity = !self.intra && parents > 0 && u.arbitrary()?;
        let more =
            if u.arbitrary()? { IncrementHeader::POSITION_SHIFT | IncrementHeader::COMPENSATION } else { 0 };
        header = header.with_flags();
        // An element that is present may have the value that it has when it is absent.
        header.increment_flags |= more;
        let sh = header.sh();
        let mut sections = Vec::new();
        for section in Section::OF_INCREMENT.into_iter().filter(|&section| header.count(section) > 0) {
            let counts = (header.count(section), header.position_shift);
            sections.push(self.section(u, section, &sh, counts, &modes, &mut values)?);
        }
        Ok(ArbitraryIncrement { spatial_layer, refinement, header, sections })
    }

    /// A section that decodes, or one of arbitrary bytes. Positions lack so many low bits.
    fn section(
        &self,
        u: &mut Unstructured<'_>,
        section: Section,
        sh: &ShHeader,
        (count, low_bits): (u32, u8),
        modes: &[i32],
        values: &mut Values,
    ) -> Result<SectionBytes> {
        if u.ratio(19_u8, 20_u8)? {
            let sh = ShCoding::of(sh, self.tools.sh.map_or(0, |(_, rank)| rank));
            let layout = Layout::of_section(section, self.tools.dc.1, sh);
            let axis_bits = self.sequence.position_bits.saturating_sub(low_bits).max(1);
            return Ok(coded(&layout, (count, axis_bits), modes, self.sequence.block_log2, values));
        }
        let block_count = count.div_ceil(1_u32.wrapping_shl(self.sequence.block_log2.into()));
        let model = self::section(u)?;
        let blocks = (0..block_count).map(|_| self::section(u)).collect::<Result<_>>()?;
        Ok(SectionBytes { lanes_log2: u.int_in_range(0..=5)?, model, blocks })
    }

    /// Everything but counts.
    fn header(&self, u: &mut Unstructured<'_>, has_new: bool) -> Result<IncrementHeader> {
        let mut header = IncrementHeader { refinement_digest: u.arbitrary()?, ..IncrementHeader::PLAIN };
        ShHeader {
            sh_mode: header.sh_mode,
            vq_stage_count: header.vq_stage_count,
            codebook_ids: header.codebook_ids,
        } = self.sh(u)?;
        for step in &mut header.attribute_step {
            *step = if u.arbitrary()? { u.int_in_range(0..=MAX_ATTRIBUTE_STEP)? } else { 0 };
        }
        // Large ones put everything outside the grid.
        let last_bit = self.sequence.position_bits.saturating_sub(1);
        header.position_shift = if u.ratio(1_u8, 4_u8)? { u.int_in_range(0..=last_bit)? } else { 0 };
        if has_new && self.tools.profile == Profile::Dynamic && u.arbitrary()? {
            header.predictor_block_log2 = u.int_in_range(0..=16)?;
            header.neighbour_count = u.int_in_range(1..=MAX_NEIGHBOURS)?;
            header.bilateral_spatial = u.arbitrary()?;
            header.bilateral_feature = u.arbitrary()?;
        }
        header.compensation_log_scale = u.arbitrary()?;
        header.compensation_opacity = u.arbitrary()?;
        Ok(header)
    }

    fn sh(&self, u: &mut Unstructured<'_>) -> Result<ShHeader> {
        let modes = match (self.tools.sh, self.stages.is_empty()) {
            (None, _) => ShMode::None,
            (Some(_), true) => ShMode::Coefficients,
            (Some(_), false) => ShMode::VectorQuantised,
        };
        let mut sh = ShHeader { sh_mode: u.int_in_range(0..=modes.code())?, ..NO_SH };
        if sh.mode() == Some(ShMode::VectorQuantised) {
            sh.vq_stage_count = u.int_in_range(1..=4)?;
        }
        for id in sh.codebook_ids.iter_mut().take(sh.vq_stage_count.into()) {
            *id = *u.choose(&self.stages)?;
        }
        Ok(sh)
    }
}

const NO_SH: ShHeader = IncrementHeader::PLAIN.sh();
