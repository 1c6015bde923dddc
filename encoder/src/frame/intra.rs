//! I frames: the lowest spatial layer has all Gaussians, and the layers above refine them ([`super::ladder`]).
//!
//! A static frame is the simplest case: one layer, so that no unit has parents, and nothing that is predicted.
#![expect(clippy::indexing_slicing, reason = "lists are counted by refinement_count, rows by the frame")]

use super::compensation::Compensator;
use super::grain::Grain;
use super::ladder::Ladder;
use super::new_list::NewList;
use super::predictors::{Chooser, used};
use super::residuals::Wanted;
use super::unit::{Draft, UnitCoder};
use super::{CodedFrame, CodedUnit, Reference, worth};
use crate::error::Error;
use crate::savings::Saving;
use splatstream_decoder::digest::{ListDigest, lists_digest};
use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::increment::Situation;
use splatstream_decoder::increment::residual::Attributes;
use splatstream_decoder::layout::{Section, ShCoding};
use splatstream_decoder::list::GaussianList;
use splatstream_format::entropy::in_force::ModelsOfFrame;

/// Bits of the mode of a parent.
const MOVED: i32 = 1;
const UPDATED: i32 = 2;

/// A frame on the finest grids, in the order of its source.
pub(crate) struct IntraTarget<'a> {
    /// How new Gaussians are predicted.
    pub(crate) chooser: Chooser<'a>,
    /// Judges what is shown of prefixes; none: they are shown as they are.
    pub(crate) compensator: Option<&'a Compensator>,
    /// Whether prefixes of the highest layer are shown too.
    pub(crate) shows_top_prefixes: bool,
    /// Goes when it is not needed any more.
    pub(crate) wanted: Wanted,
    /// What the lowest layer has of them, if that is to be something else.
    pub(crate) lowest: Option<Wanted>,
    /// Most important first.
    pub(crate) order: &'a [u32],
    /// Row of each Gaussian in its file, and rows of the file.
    pub(crate) rows: &'a [u32],
    pub(crate) row_count: u32,
    /// Whether the lowest spatial layer holds everything, and those above add nothing.
    pub(crate) in_one_layer: bool,
    /// Whether it is told what choices save.
    pub(crate) tells_savings: bool,
}

/// An I frame being coded.
struct Intra<'a> {
    coder: &'a UnitCoder<'a>,
    ladder: Ladder,
    target: IntraTarget<'a>,
    lists: Vec<GaussianList>,
    /// Gaussians of each list, by index in the target.
    members: Vec<Vec<u32>>,
    models: ModelsOfFrame,
    units: Vec<CodedUnit>,
    savings: Vec<Saving>,
}

/// Codes an I frame.
///
/// # Errors
/// What the decoder's own checks refuse.
pub(crate) fn code_intra(coder: &UnitCoder<'_>, target: IntraTarget<'_>) -> Result<CodedFrame, Error> {
    let sequence = coder.sequence;
    let refinements = usize::from(sequence.refinement_count);
    let sh_planes = usize::from(sequence.sh_dimension());
    let percents = &sequence.refinement_percent[..refinements];
    let mut intra = Intra {
        coder,
        ladder: Ladder::new(if target.in_one_layer { 1 } else { sequence.spatial_layer_count }, percents),
        target,
        lists: vec![GaussianList::empty(sh_planes); refinements],
        members: vec![Vec::new(); refinements],
        models: ModelsOfFrame::default(),
        units: Vec::new(),
        savings: Vec::new(),
    };
    for layer in 0..sequence.spatial_layer_count {
        intra.layer(layer)?;
    }
    let Intra { target, lists, members, models, units, savings, .. } = intra;
    let rows = members.iter().map(|list| list.iter().map(|&index| target.rows[index as usize]).collect());
    let reference = Reference {
        rows: rows.collect(),
        row_count: target.row_count,
        // What is carried matters in whole anchors only.
        carried: if sequence.whole_anchor() { lists.clone() } else { Vec::new() },
        lists,
        span_log2: 0,
        models: models.first,
        deviation: None,
    };
    Ok(CodedFrame { cells: None, carried_digest: None, units, reference, savings })
}

impl Intra<'_> {
    /// Codes the units of a layer. The lowest one adds all Gaussians.
    fn layer(&mut self, layer: u8) -> Result<(), Error> {
        let sequence = self.coder.sequence;
        let order = self.target.order;
        let total = order.len() as u32;
        let mut before = 0_usize;
        let mut added = Vec::new();
        for refinement in 0..sequence.refinement_count {
            let after = if layer == 0 { sequence.prefix_length(refinement, total) as usize } else { 0 };
            let rows = order.get(before..after).ok_or(Error::Fault("a list ends beyond its frame"))?;
            added.push((rows.to_vec(), self.grain(layer, refinement)));
            before = after;
        }
        // Layers above add nothing: they refine.
        let lowest = self.target.lowest.as_ref().unwrap_or(&self.target.wanted);
        let shifts: Vec<u8> = added.iter().map(|(_, grain)| grain.position_shift).collect();
        let new = NewList::all(self.coder, lowest, added, self.models.before(0));
        if self.target.tells_savings && layer == 0 {
            self.savings = worth::of_lists(self.coder, (lowest, order), &new, &shifts);
        }
        if !self.target.chooser.predicts() && !self.ladder.refines_from(layer) {
            self.target.wanted = self.target.wanted.select(&[]);
        }
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
        draft.header.parent_count = self.members[list].len() as u32;
        if self.ladder.refines(layer, list) {
            self.refine(&mut draft, &parents, list)?;
        }
        draft.add(core::mem::take(&mut new.values));
        let lower: Vec<&QuantizedFrame> = self.lists[..list].iter().map(|list| &list.planes).collect();
        let situation = Situation { around: [&lower, &[]], temporal: None };
        let mut models = self.models.before(refinement).clone();
        let chooser = self.target.chooser;
        let prediction_saves = chooser.choose(
            self.coder,
            &mut draft,
            &parents,
            &situation,
            (&self.target.wanted, &new),
            &models,
        )?;
        let applied = self.coder.apply(&draft, parents, &situation)?;
        digests.push(applied.list.digest());
        draft.header.refinement_digest = lists_digest(digests);
        self.lists[list] = applied.list;
        self.compensate(&mut draft, layer, refinement)?;
        let payload = self.coder.code(&draft, &new.coded, &mut models)?;
        let reuse_saves = match self.target.tells_savings {
            true => {
                let before = self.models.before(refinement);
                worth::of_reuse(self.coder, (&draft, &new), before, payload.len())?
            }
            false => 0,
        };
        self.models.follow(refinement, models);
        self.units.push(CodedUnit {
            spatial_layer: layer,
            refinement,
            payload,
            header: draft.header,
            predicted: used(&draft),
            prediction_saves,
            reuse_saves,
        });
        self.members[list].extend(new.added);
        Ok(())
    }

    /// Fills the holes of a prefix that can be shown.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "refinement_count and layers are 1 or more and at most 10; positions have at most 20 bits"
    )]
    fn compensate(&self, draft: &mut Draft, layer: u8, refinement: u8) -> Result<(), Error> {
        let sequence = self.coder.sequence;
        let is_top = layer + 1 == sequence.spatial_layer_count;
        let is_shown = !is_top || self.target.shows_top_prefixes;
        let is_prefix = refinement + 1 < sequence.refinement_count && is_shown;
        let Some(compensator) = self.target.compensator.filter(|_| is_prefix) else { return Ok(()) };
        let lists = self.lists[..=usize::from(refinement)].iter().map(|list| &list.planes);
        let lists: Vec<&QuantizedFrame> = lists.collect();
        let (log_scale, opacity) = compensator.offsets(&lists, sequence)?;
        (draft.header.compensation_log_scale, draft.header.compensation_opacity) = (log_scale, opacity);
        Ok(())
    }

    /// How finely a unit is coded.
    fn grain(&self, layer: u8, refinement: u8) -> Grain {
        let last = self.coder.grains.of(refinement);
        let has_books = matches!(self.coder.colour.mode, ShCoding::VectorQuantised { .. });
        self.ladder.grain(layer, refinement.into(), last, has_books, self.coder.sequence.position_bits)
    }

    /// Brings what the lowest layer has coded to its final steps.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "refinement_count and layers are 1 or more and at most 10; positions have at most 20 bits"
    )]
    fn refine(&self, draft: &mut Draft, parents: &GaussianList, list: usize) -> Result<(), Error> {
        let members = &self.members[list];
        if members.is_empty() {
            return Ok(());
        }
        let count = members.len() as u32;
        let wanted = self.target.wanted.select(members);
        let last = (1 << self.coder.sequence.position_bits) - 1;
        let moves = wanted.moves(parents, draft.header.position_shift, last);
        let moves_any = moves.iter().flatten().any(|&value| value != 0);
        let mode = UPDATED + if moves_any { MOVED } else { 0 };
        draft.values.set(Section::Modes, self.coder.section(vec![vec![mode; members.len()]]));
        draft.header.update_count = count;
        if moves_any {
            draft.header.move_count = count;
            draft.values.set(Section::Moves, self.coder.section(moves));
        }
        let rows: Vec<u32> = (0..count).collect();
        let now = Attributes::of_list(parents, &rows);
        let planes = wanted.updates(now, draft.header.attribute_step, self.coder)?;
        draft.values.set(Section::Updates, self.coder.section(planes));
        Ok(())
    }
}
