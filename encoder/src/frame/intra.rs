//! I frames: each spatial layer adds Gaussians and halves the steps of those below it.
//!
//! A static frame is the simplest case: one layer, so that no unit has parents, and nothing that is predicted.

use super::compensation::Compensator;
use super::new_list::NewList;
use super::predictors::{Chooser, used};
use super::unit::{Draft, Grain, UnitCoder};
use super::wanted::Wanted;
use super::{CodedFrame, CodedUnit, Reference};
use crate::error::Error;
use splatstream_decoder::digest::{ListDigest, lists_digest};
use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::increment::Situation;
use splatstream_decoder::increment::residual::Attributes;
use splatstream_decoder::layout::{Section, ShCoding};
use splatstream_decoder::list::GaussianList;
use splatstream_format::entropy::in_force::ModelsOfFrame;
use splatstream_format::syntax::{MAX_ATTRIBUTE_STEP, prefix_length};

/// Share of the Gaussians, most important first, up to each spatial layer, percent.
const fn shares(layers: u8) -> &'static [u8] {
    match layers {
        0 | 1 => &[100],
        2 => &[60, 100],
        3 => &[50, 75, 100],
        _ => &[40, 60, 80, 100],
    }
}

/// A frame on the finest grids, in the order of its source.
pub(crate) struct IntraTarget<'a> {
    /// How new Gaussians are predicted.
    pub(crate) chooser: Chooser<'a>,
    /// Judges what is shown of prefixes; none: they are shown as they are.
    pub(crate) compensator: Option<&'a Compensator>,
    /// Whether prefixes of the highest layer are shown too.
    pub(crate) shows_top_prefixes: bool,
    pub(crate) wanted: &'a Wanted,
    /// Most important first.
    pub(crate) order: &'a [u32],
    /// Row of each Gaussian in its file, and rows of the file.
    pub(crate) rows: &'a [u32],
    pub(crate) row_count: u32,
    /// Whether the lowest spatial layer holds everything, and those above add nothing.
    pub(crate) in_one_layer: bool,
}

/// An I frame being coded.
struct Intra<'a> {
    coder: &'a UnitCoder<'a>,
    target: &'a IntraTarget<'a>,
    lists: Vec<GaussianList>,
    /// Gaussians of each list, by index in the target.
    members: Vec<Vec<u32>>,
    models: ModelsOfFrame,
    units: Vec<CodedUnit>,
}

/// Codes an I frame.
///
/// # Errors
/// What the decoder's own checks refuse.
pub(crate) fn code_intra(coder: &UnitCoder<'_>, target: &IntraTarget<'_>) -> Result<CodedFrame, Error> {
    let sequence = coder.sequence;
    let refinements = usize::from(sequence.refinement_count);
    let sh_planes = usize::from(sequence.sh_dimension());
    let mut intra = Intra {
        coder,
        target,
        lists: vec![GaussianList::empty(sh_planes); refinements],
        members: vec![Vec::new(); refinements],
        models: ModelsOfFrame::default(),
        units: Vec::new(),
    };
    for layer in 0..sequence.spatial_layer_count {
        intra.layer(layer)?;
    }
    let Intra { lists, members, models, units, .. } = intra;
    let rows = members.iter().map(|list| list.iter().map(|&index| target.rows[index as usize]).collect());
    let reference = Reference {
        rows: rows.collect(),
        row_count: target.row_count,
        // What is carried matters in whole anchors only.
        carried: if sequence.whole_anchor() { lists.clone() } else { Vec::new() },
        lists,
        span_log2: 0,
        models: models.first,
    };
    Ok(CodedFrame { cells: None, carried_digest: None, units, reference })
}

impl Intra<'_> {
    /// Codes the units of a layer.
    fn layer(&mut self, layer: u8) -> Result<(), Error> {
        let sequence = self.coder.sequence;
        let layers = sequence.spatial_layer_count;
        let total = self.target.order.len() as u32;
        let shares = if self.target.in_one_layer { &[100; 4] } else { shares(layers) };
        let end = prefix_length(shares[usize::from(layer)], total) as usize;
        let start = match layer {
            0 => 0,
            _ => prefix_length(shares[usize::from(layer) - 1], total) as usize,
        };
        let mut before = 0_usize;
        let mut added = Vec::new();
        for refinement in 0..sequence.refinement_count {
            let after = sequence.prefix_length(refinement, total) as usize;
            let rows = self.target.order.get(start.max(before)..end.min(after)).unwrap_or_default();
            added.push((rows.to_vec(), self.grain(layer, refinement)));
            before = after;
        }
        let new = NewList::all(self.coder, self.target.wanted, added, self.models.before(0));
        let mut digests = Vec::new();
        for (refinement, new) in (0..).zip(new) {
            self.unit(layer, refinement, new, &mut digests)?;
        }
        Ok(())
    }

    fn unit(
        &mut self,
        layer: u8,
        refinement: u8,
        mut new: NewList,
        digests: &mut Vec<ListDigest>,
    ) -> Result<(), Error> {
        let list = usize::from(refinement);
        let parents = core::mem::take(&mut self.lists[list]);
        let mut draft = self.coder.blank(self.grain(layer, refinement));
        self.refine(&mut draft, &parents, list)?;
        draft.add(core::mem::take(&mut new.values));
        let lower: Vec<&QuantizedFrame> = self.lists[..list].iter().map(|list| &list.planes).collect();
        let situation = Situation { around: [&lower, &[]], temporal: None };
        let mut models = self.models.before(refinement).clone();
        let chooser = self.target.chooser;
        chooser.choose(self.coder, &mut draft, &parents, &situation, (self.target.wanted, &new), &models)?;
        let applied = self.coder.apply(&draft, parents, &situation)?;
        digests.push(applied.list.digest());
        draft.header.refinement_digest = lists_digest(digests);
        self.lists[list] = applied.list;
        self.compensate(&mut draft, layer, refinement);
        let payload = self.coder.code(&draft, &new, &mut models)?;
        self.models.follow(refinement, models);
        self.units.push(CodedUnit {
            spatial_layer: layer,
            refinement,
            payload,
            header: draft.header,
            predicted: used(&draft),
        });
        self.members[list].extend(new.added);
        Ok(())
    }

    /// Fills the holes of a prefix that can be shown.
    fn compensate(&self, draft: &mut Draft, layer: u8, refinement: u8) {
        let sequence = self.coder.sequence;
        let is_top = layer + 1 == sequence.spatial_layer_count;
        let is_shown = !is_top || self.target.shows_top_prefixes;
        let is_prefix = refinement + 1 < sequence.refinement_count && is_shown;
        let Some(compensator) = self.target.compensator.filter(|_| is_prefix) else { return };
        let lists = &self.lists[..=usize::from(refinement)];
        let (log_scale, opacity) = compensator.offsets(lists, sequence);
        (draft.header.compensation_log_scale, draft.header.compensation_opacity) = (log_scale, opacity);
    }

    /// How finely a unit is coded: every layer halves the steps of the one below. Entries of codebooks keep their step: no
    /// layer refines them.
    fn grain(&self, layer: u8, refinement: u8) -> Grain {
        let sequence = self.coder.sequence;
        let above = if self.target.in_one_layer { 0 } else { sequence.spatial_layer_count - 1 - layer };
        let Grain { position_shift, attribute_step } = self.coder.grains.of(refinement);
        let book = matches!(self.coder.colour.mode, ShCoding::VectorQuantised { .. });
        let [scale, opacity, rotation, dc, sh] =
            attribute_step.map(|step| (step + 2 * above).min(MAX_ATTRIBUTE_STEP));
        let sh = if book { attribute_step[4] } else { sh };
        Grain {
            position_shift: (position_shift + above).min(sequence.position_bits - 1),
            attribute_step: [scale, opacity, rotation, dc, sh],
        }
    }

    /// Refines what lower layers have coded.
    fn refine(&self, draft: &mut Draft, parents: &GaussianList, list: usize) -> Result<(), Error> {
        let members = &self.members[list];
        if members.is_empty() {
            return Ok(());
        }
        let count = members.len() as u32;
        if self.target.in_one_layer {
            draft.header.parent_count = count;
            return Ok(());
        }
        (draft.header.parent_count, draft.header.move_count, draft.header.update_count) =
            (count, count, count);
        draft.values.set(Section::Modes, self.coder.section(vec![vec![3; members.len()]]));
        let wanted = self.target.wanted.select(members);
        let last = (1 << self.coder.sequence.position_bits) - 1;
        let moves = wanted.moves(parents, draft.header.position_shift, last);
        draft.values.set(Section::Moves, self.coder.section(moves));
        let rows: Vec<u32> = (0..count).collect();
        let now = Attributes::of_list(parents, &rows);
        let planes = wanted.updates(now, draft.header.attribute_step, self.coder)?;
        draft.values.set(Section::Updates, self.coder.section(planes));
        Ok(())
    }
}
