//! Predicted frames: Gaussians of the reference that go on, and new ones.
#![expect(clippy::arithmetic_side_effects, reason = "counts of lists and Gaussians; layers are 1 or more")]
#![expect(
    clippy::indexing_slicing,
    reason = "there are as many lists as refinements, and rows are those of the matching"
)]

use super::cells::{CellPlan, code_cells};
use super::grain::Grain;
use super::moves::{self, MovePlan};
use super::new_list::{NewList, unpredicted};
use super::predictors::{Chooser, used};
use super::residuals::Wanted;
use super::survivors::{Aim, BitPrice, Fate, Parents, REMOVED, Survivors};
use super::target::Target;
use super::unit::{Draft, UnitCoder};
use super::update_decision::Judge;
use super::{CodedFrame, CodedUnit, Reference};
use crate::entropy_cost::entropy_of;
use crate::error::Error;
use crate::matching::Matching;
use splatstream_decoder::digest::{ListDigest, lists_digest};
use splatstream_decoder::displacement::CellField;
use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::increment::residual::ATTRIBUTE_RANGE;
use splatstream_decoder::increment::{Situation, Temporal};
use splatstream_decoder::layout::Section;
use splatstream_decoder::list::GaussianList;
use splatstream_decoder::moves::{MoveSpace, SpanRatio};
use splatstream_format::entropy::in_force::ModelsOfFrame;
use splatstream_format::payload::CellsBytes;
use splatstream_gaussians::importance;
use std::ops::Range;

/// The row of a Gaussian that no file has any more.
const NO_ROW: u32 = u32::MAX;

/// What a predicted frame is made from.
pub(crate) struct PredictedTarget<'a> {
    pub(crate) coder: UnitCoder<'a>,
    /// How new Gaussians are predicted.
    pub(crate) chooser: Chooser<'a>,
    pub(crate) reference: &'a Reference,
    /// log2 of how many frames it is later than the reference.
    pub(crate) span_log2: u8,
    /// The lists of the I frame of the GOP, if new Gaussians may be predicted from all of them: in whole anchors.
    pub(crate) anchor: &'a [GaussianList],
    pub(crate) target: &'a Target,
    pub(crate) survivors: Survivors<'a>,
    /// What fills the holes of each prefix: log-scale and opacity, as in the I frame.
    pub(crate) compensation: &'a [(i8, i8)],
}

/// A predicted frame being coded.
pub(crate) struct Predicted<'a> {
    pub(crate) from: PredictedTarget<'a>,
    matching: Matching,
    /// The lists of the reference, displaced by the cells of the frame.
    pub(crate) displaced: Vec<GaussianList>,
    field: CellField,
    cells: Option<CellsBytes>,
    models: ModelsOfFrame,
}

/// The units that have been coded, and what they leave.
#[derive(Default)]
struct Done {
    models: ModelsOfFrame,
    units: Vec<CodedUnit>,
    digests: Vec<ListDigest>,
    lists: Vec<GaussianList>,
    /// The new Gaussians of each list.
    added: Vec<QuantizedFrame>,
}

/// What becomes of the parents of a unit.
struct Changed {
    /// A unit that adds nothing.
    draft: Draft,
    /// The bits of its modes, moves and updates, nearly.
    bits: f64,
}

/// New Gaussians of a frame.
struct Fresh {
    /// Their indices in the target.
    indices: Vec<u32>,
    wanted: Wanted,
    /// For each list those it gets, as indices among the new ones.
    of_list: Vec<Vec<u32>>,
}

impl<'a> Predicted<'a> {
    /// Finds out what moves. `cells`: how cells are found; none, and nothing moves.
    ///
    /// # Errors
    /// What the decoder's own checks refuse.
    pub(crate) fn new(
        from: PredictedTarget<'a>,
        cells: Option<&CellPlan<'_>>,
        mut matching: Matching,
    ) -> Result<Self, Error> {
        let mut models = ModelsOfFrame::starting_with(from.reference.models.clone());
        let (field, cells) = match cells {
            Some(plan) => {
                code_cells(&from.coder, (from.reference, from.target), &matching, plan, &mut models.first)?
            }
            None => (CellField::default(), None),
        };
        let mut displaced: Vec<GaussianList> =
            from.reference.lists.iter().map(GaussianList::unchanged).collect();
        displaced.iter_mut().for_each(|list| {
            list.displace(&field);
        });
        // Pairs are parted whose Gaussian cannot be brought to its partner.
        let rows = displaced.iter().flat_map(|list| (0..list.len()).map(move |row| (list, row)));
        for ((list, row), partner) in rows.zip(&mut matching.target_of) {
            if partner.is_some_and(|index| from.survivors.is_out_of_reach(list, row, index)) {
                *partner = None;
            }
        }
        Ok(Self { from, matching, displaced, field, cells, models })
    }

    /// Has small differences weighed by what pictures of the source show of them. `price`: what bits are worth then.
    pub(crate) fn set_weigher(&mut self, weigher: Judge, price: BitPrice) {
        self.from.survivors.weigher = Some(weigher);
        self.from.survivors.price = price;
    }

    /// Codes the units of the frame.
    ///
    /// # Errors
    /// What the decoder's own checks refuse.
    pub(crate) fn code(mut self) -> Result<CodedFrame, Error> {
        let Fresh { indices, wanted, of_list } = self.fresh();
        let mut done = Done { models: core::mem::take(&mut self.models), ..Done::default() };
        let added = (0..).zip(of_list).map(|(list, added)| (added, self.grain(list))).collect();
        let new = NewList::all(&self.from.coder, &wanted, added, done.models.before(0));
        let mut space = self.space();
        let (mut rows, mut parents) = (Vec::new(), Vec::new());
        for (list, new) in new.into_iter().enumerate() {
            let new_rows = new.added.iter().map(|&index| self.row(indices[index as usize]));
            let continued = self.continued(list).map(|(_, partner)| partner.map_or(NO_ROW, |i| self.row(i)));
            rows.push(continued.chain(new_rows).collect());
            parents.extend(self.continued(list).map(|(from, _)| Some(from as u32)));
            parents.extend(new.added.iter().map(|_| None));
            self.unit(list, &wanted, new, &mut space, &mut done)?;
        }
        let carry = |list: &GaussianList| list.clone().carried(&self.field, true);
        let carried: Vec<GaussianList> = self.from.reference.carried.iter().map(carry).collect();
        let digest = || lists_digest(&carried.iter().map(GaussianList::digest).collect::<Vec<_>>());
        let carried_digest = (!carried.is_empty()).then(digest);
        let Done { models, units, lists, .. } = done;
        let row_count = self.from.target.row_count;
        let span_log2 = self.from.span_log2;
        let deviation = self.from.reference.deviation.as_ref();
        let deviation = deviation.filter(|deviation| deviation.is_fitted);
        let deviation = deviation.map(|deviation| deviation.followed(&parents));
        let models = models.first;
        let reference = Reference { lists, span_log2, carried, models, rows, row_count, deviation };
        Ok(CodedFrame { cells: self.cells, carried_digest, units, reference, savings: Vec::new() })
    }

    /// Codes the unit of a list. `new`: its new Gaussians, which shall become what `wanted` says.
    fn unit(
        &self,
        list: usize,
        wanted: &Wanted,
        mut new: NewList,
        space: &mut MoveSpace,
        done: &mut Done,
    ) -> Result<(), Error> {
        let PredictedTarget { coder, chooser, compensation, .. } = &self.from;
        let refinement = list as u8;
        let parents = &self.displaced[list];
        space.push(&self.from.reference.lists[list], parents);
        let mut draft = self.drafted(list, space, true);
        draft.add(core::mem::take(&mut new.values));
        let lower: Vec<&QuantizedFrame> = self.displaced[..list].iter().map(|list| &list.planes).collect();
        let anchor = self.from.anchor.iter().skip(list + 1).map(|list| &list.planes);
        let after: Vec<&QuantizedFrame> = anchor.chain(&done.added).collect();
        let temporal = self.temporal(list, space);
        let situation = Situation { around: [&lower, &after], temporal: Some(temporal) };
        let mut models = done.models.before(refinement).clone();
        let prediction_saves =
            chooser.choose(coder, &mut draft, parents, &situation, (wanted, &new), &models)?;
        let applied = coder.apply(&draft, parents.clone(), &situation)?;
        space.settle(&applied.list, &applied.keep);
        done.digests.push(applied.list.digest());
        draft.header.refinement_digest = lists_digest(&done.digests);
        if let Some(&(log_scale, opacity)) = compensation.get(list) {
            (draft.header.compensation_log_scale, draft.header.compensation_opacity) = (log_scale, opacity);
        }
        let payload = coder.code(&draft, &new.coded, &mut models)?;
        done.models.follow(refinement, models);
        done.units.push(CodedUnit {
            spatial_layer: coder.sequence.spatial_layer_count - 1,
            refinement,
            header: draft.header,
            payload,
            predicted: used(&draft),
            prediction_saves,
            reuse_saves: 0,
        });
        done.lists.push(applied.list);
        done.added.push(applied.added);
        Ok(())
    }

    /// Parents of no unit yet.
    fn space(&self) -> MoveSpace {
        MoveSpace::new(self.ratio(), self.from.coder.sequence.position_bits)
    }

    /// How much longer the step to this frame is than that to its reference frame.
    fn ratio(&self) -> SpanRatio {
        SpanRatio::new(self.from.span_log2, self.from.reference.span_log2)
    }

    /// What the parents of a unit come from.
    fn temporal<'s>(&'s self, list: usize, space: &'s MoveSpace) -> Temporal<'s> {
        Temporal { reference: &self.from.reference.lists[list], ratio: self.ratio(), moves: Some(space) }
    }

    /// The frame as far as lists show it, without prediction, which changes nothing that shows.
    ///
    /// # Errors
    /// What the decoder's own checks refuse.
    pub(crate) fn lists(&self) -> Result<Vec<GaussianList>, Error> {
        let Fresh { wanted, of_list, .. } = self.fresh();
        let list = |(list, added): (usize, Vec<u32>)| {
            let coder = &self.from.coder;
            let mut space = self.space();
            space.push(&self.from.reference.lists[list], &self.displaced[list]);
            let mut draft = self.drafted(list, &space, false);
            draft.add(unpredicted(coder, &wanted, added, self.grain(list)).1);
            let situation = Situation { around: [&[], &[]], temporal: Some(self.temporal(list, &space)) };
            Ok(coder.apply(&draft, self.displaced[list].clone(), &situation)?.list)
        };
        of_list.into_iter().enumerate().map(list).collect()
    }

    /// The Gaussians that continue none, on the grids, and the lists they go to.
    fn fresh(&self) -> Fresh {
        let PredictedTarget { coder, target, survivors, .. } = &self.from;
        let mut indices = self.matching.wanted(target.frame.len());
        if let Some(judge) = &survivors.judge {
            indices.retain(|&index| judge.is_missed(index));
        }
        let frame = target.frame.select(&indices);
        let continued: Vec<usize> =
            (0..self.displaced.len()).map(|list| self.continued(list).count()).collect();
        let order = importance::order(&importance::opacity_volume(&frame));
        let total = (continued.iter().sum::<usize>() + frame.len()) as u32;
        let refinements = coder.sequence.refinement_count;
        let mut of_list: Vec<Vec<u32>> = Vec::new();
        let mut rest = order.as_slice();
        for refinement in 0..refinements {
            let length = coder.sequence.refinement_length(refinement, total) as usize;
            let room = length.saturating_sub(continued[usize::from(refinement)]);
            let last = refinement + 1 == refinements;
            let (now, later) = rest.split_at(if last { rest.len() } else { room.min(rest.len()) });
            of_list.push(now.to_vec());
            rest = later;
        }
        let wanted = Wanted::new(&frame, None, coder);
        Fresh { indices, wanted, of_list }
    }

    /// How finely a list is coded: as in I frames where pictures decide what is sent, for they find enough as it is.
    fn grain(&self, list: usize) -> Grain {
        let grain = self.from.coder.grains.of(list as u8);
        if self.from.survivors.judge.is_some() { grain } else { grain.of_changes() }
    }

    /// A unit that decides about the parents in a list, which were added to `space` last. Without `predicts` nothing is
    /// made of earlier changes.
    fn drafted(&self, list: usize, space: &MoveSpace, predicts: bool) -> Draft {
        let plain = self.changed(list, space, predicts, &[]);
        let fading = if predicts { self.fading(list) } else { Vec::new() };
        if fading.is_empty() {
            return plain.draft;
        }
        let mut extrapolated = self.changed(list, space, predicts, &fading);
        extrapolated.draft.header.extrapolates_opacity = true;
        if extrapolated.bits < plain.bits { extrapolated.draft } else { plain.draft }
    }

    /// The opacities of the parents in a list if they go on changing; nothing if none does.
    fn fading(&self, list: usize) -> Vec<i32> {
        let fade = &self.from.reference.lists[list].change.fade;
        if fade.iter().all(|&fade| fade == 0) {
            return Vec::new();
        }
        let ratio = self.ratio();
        let opacity = self.displaced[list].planes.opacity.iter().zip(fade);
        let gone_on = |(&opacity, &fade): (&i32, &i32)| {
            (opacity + ratio.scaled(fade)).clamp(*ATTRIBUTE_RANGE.start(), *ATTRIBUTE_RANGE.end())
        };
        opacity.map(gone_on).collect()
    }

    /// A unit that changes parents. `opacity`: what updates of theirs start from, if not from what they are.
    fn changed(&self, list: usize, space: &MoveSpace, predicts: bool, opacity: &[i32]) -> Changed {
        let PredictedTarget { coder, survivors, .. } = &self.from;
        let displaced = &self.displaced[list];
        let range = self.range(list);
        let grain = self.grain(list);
        let position_shift = grain.position_shift;
        let rule = coder.steps(grain.attribute_step);
        let shift_of_intra = coder.grains.of(list as u8).position_shift;
        let parents = Parents { list: displaced, opacity, rule, position_shift, shift_of_intra };
        let fates = survivors.fates(parents, range.start, &self.matching.target_of[range]);
        let aims: Vec<Option<Aim>> = fates.iter().map(|fate| fate.aim).collect();
        let bits = coder.sequence.position_bits;
        let price = survivors.price.moves;
        let moves = moves::plan(space, displaced, &aims, (position_shift, bits), price, predicts);
        let mut draft = coder.blank(grain);
        set_changes(coder, &mut draft, &fates, moves);
        let bits = bits_of(&draft);
        Changed { draft, bits }
    }

    /// The indices of a list's Gaussians among those of all lists.
    fn range(&self, list: usize) -> Range<usize> {
        let start = self.displaced[..list].iter().map(GaussianList::len).sum();
        start..start + self.displaced[list].len()
    }

    /// Gaussians of a list that continue, and their partners.
    fn continued(&self, list: usize) -> impl Iterator<Item = (usize, Option<u32>)> {
        let range = self.range(list);
        let partners = range.clone().zip(self.matching.target_of[range].iter().copied());
        partners.filter(|&(from, partner)| self.from.survivors.goes_on(from, partner))
    }

    /// The row of a Gaussian of the target in its file.
    fn row(&self, index: u32) -> u32 {
        self.from.target.rows[index as usize]
    }
}

/// Puts what becomes of parents in a draft.
fn set_changes(coder: &UnitCoder<'_>, draft: &mut Draft, fates: &[Fate], moves: MovePlan) {
    let mode = |(fate, &moved): (&Fate, &bool)| match fate.aim {
        None => REMOVED,
        Some(_) => i32::from(moved) + 2 * i32::from(!fate.updated.is_empty()),
    };
    let modes: Vec<i32> = fates.iter().zip(&moves.moved).map(mode).collect();
    let count = |holds: &dyn Fn(i32) -> bool| modes.iter().filter(|&&mode| holds(mode)).count() as u32;
    let header = &mut draft.header;
    header.parent_count = fates.len() as u32;
    header.move_count = count(&|mode| mode & 1 != 0);
    header.update_count = count(&|mode| mode & 2 != 0);
    header.remove_count = count(&|mode| mode == REMOVED);
    header.move_block_log2 = moves.block_log2;
    draft.values.set(Section::Modes, coder.section(vec![modes]));
    draft.values.set(Section::MovePredictors, coder.section(vec![moves.predictors]));
    draft.values.set(Section::Moves, coder.section(moves.planes.to_vec()));
    let updated: Vec<&Vec<i32>> =
        fates.iter().filter(|fate| fate.aim.is_some()).map(|fate| &fate.updated).collect();
    let width = updated.iter().map(|values| values.len()).max().unwrap_or(0);
    let plane = |plane: usize| updated.iter().filter_map(|values| values.get(plane).copied()).collect();
    draft.values.set(Section::Updates, coder.section((0..width).map(plane).collect()));
}

/// Zero-order bits of what a draft says of parents.
fn bits_of(draft: &Draft) -> f64 {
    let planes = [Section::Modes, Section::Moves, Section::Updates]
        .into_iter()
        .flat_map(|section| &draft.values.section(section).planes);
    planes.map(|plane| entropy_of(plane)).sum()
}
