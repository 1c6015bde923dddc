//! Predicted frames: Gaussians of the reference that go on, and new ones.

use super::cells::{CellPlan, code_cells};
use super::new_list::{NewList, unpredicted};
use super::predictors::{Chooser, used};
use super::price::Goal;
use super::survivors::{Fate, Survivors};
use super::unit::{Draft, UnitCoder};
use super::wanted::Wanted;
use super::{CodedFrame, CodedUnit, Reference, Target};
use crate::error::Error;
use crate::grid::Spacing;
use crate::matching::Matching;
use splatstream_decoder::digest::{ListDigest, lists_digest};
use splatstream_decoder::displacement::CellField;
use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::increment::Situation;
use splatstream_decoder::layout::Section;
use splatstream_decoder::list::GaussianList;
use splatstream_format::entropy::in_force::ModelsOfFrame;
use splatstream_format::payload::CellsBytes;
use splatstream_scene::importance;
use std::ops::Range;

/// The row of a Gaussian that no file has any more.
const NO_ROW: u32 = u32::MAX;

/// What a predicted frame is made from.
pub(crate) struct PredictedTarget<'a> {
    pub(crate) coder: UnitCoder<'a>,
    /// How new Gaussians are predicted.
    pub(crate) chooser: Chooser<'a>,
    pub(crate) reference: &'a Reference,
    /// The lists of the I frame of the GOP, if new Gaussians may be predicted from all of them: in whole anchors.
    pub(crate) anchor: &'a [GaussianList],
    pub(crate) target: &'a Target,
    pub(crate) survivors: Survivors<'a>,
    /// Whether the steps of the last list are doubled, as in I frames.
    pub(crate) coarse_tail: bool,
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
            Some(plan) => code_cells(&from, &matching, plan, &mut models.first)?,
            None => (CellField::default(), None),
        };
        let mut displaced = from.reference.lists.clone();
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

    /// Codes the units of the frame.
    ///
    /// # Errors
    /// What the decoder's own checks refuse.
    pub(crate) fn code(mut self, goal: Option<&mut Goal>) -> Result<CodedFrame, Error> {
        if let Some(goal) = goal {
            self.set_judge(goal)?;
        }
        let Fresh { indices, wanted, of_list } = self.fresh()?;
        let mut done = Done { models: core::mem::take(&mut self.models), ..Done::default() };
        let new = NewList::all(&self.from.coder, &wanted, of_list, 0, done.models.before(0))?;
        let mut rows = Vec::new();
        for (list, new) in new.into_iter().enumerate() {
            let new_rows = new.added.iter().map(|&index| self.row(indices[index as usize]));
            let continued = self.continued(list).map(|(_, partner)| partner.map_or(NO_ROW, |i| self.row(i)));
            rows.push(continued.chain(new_rows).collect());
            self.unit(list, &wanted, new, &mut done)?;
        }
        let carry = |list: &GaussianList| list.clone().carried(&self.field, true);
        let carried: Vec<GaussianList> = self.from.reference.carried.iter().map(carry).collect();
        let digest = || lists_digest(&carried.iter().map(GaussianList::digest).collect::<Vec<_>>());
        let carried_digest = (!carried.is_empty()).then(digest);
        let Done { models, units, lists, .. } = done;
        let row_count = self.from.target.row_count;
        let reference = Reference { lists, carried, models: models.first, rows, row_count };
        Ok(CodedFrame { cells: self.cells, carried_digest, units, reference })
    }

    /// Codes the unit of a list. `new`: its new Gaussians, which shall become what `wanted` says.
    fn unit(&self, list: usize, wanted: &Wanted, mut new: NewList, done: &mut Done) -> Result<(), Error> {
        let PredictedTarget { coder, chooser, compensation, .. } = &self.from;
        let refinement = list as u8;
        let mut draft = self.drafted(list);
        draft.add(core::mem::take(&mut new.values));
        let parents = &self.displaced[list];
        let lower: Vec<&QuantizedFrame> = self.displaced[..list].iter().map(|list| &list.planes).collect();
        let anchor = self.from.anchor.iter().skip(list + 1).map(|list| &list.planes);
        let after: Vec<&QuantizedFrame> = anchor.chain(&done.added).collect();
        let situation = Situation { around: [&lower, &after], parents_follow: false };
        let mut models = done.models.before(refinement).clone();
        chooser.choose(coder, &mut draft, parents, &situation, (wanted, &new), &models)?;
        let applied = coder.apply(&draft, parents.clone(), &situation)?;
        done.digests.push(applied.list.digest());
        draft.header.refinement_digest = lists_digest(&done.digests);
        if let Some(&(log_scale, opacity)) = compensation.get(list) {
            (draft.header.compensation_log_scale, draft.header.compensation_opacity) = (log_scale, opacity);
        }
        let payload = coder.code(&draft, &new, &mut models)?;
        done.models.follow(refinement, models);
        done.units.push(CodedUnit {
            spatial_layer: coder.sequence.spatial_layer_count - 1,
            refinement,
            header: draft.header,
            payload,
            predicted: used(&draft),
        });
        done.lists.push(applied.list);
        done.added.push(applied.added);
        Ok(())
    }

    /// The frame as far as lists show it, without prediction, which changes nothing that shows.
    ///
    /// # Errors
    /// What the decoder's own checks refuse.
    pub(crate) fn lists(&self) -> Result<Vec<GaussianList>, Error> {
        let Fresh { wanted, of_list, .. } = self.fresh()?;
        let list = |(list, added): (usize, Vec<u32>)| {
            let coder = &self.from.coder;
            let mut draft = self.drafted(list);
            draft.add(unpredicted(coder, &wanted, added, 0)?.1);
            let situation = Situation { around: [&[], &[]], parents_follow: false };
            Ok(coder.apply(&draft, self.displaced[list].clone(), &situation)?.list)
        };
        of_list.into_iter().enumerate().map(list).collect()
    }

    /// The Gaussians that continue none, on the grids, and the lists they go to.
    fn fresh(&self) -> Result<Fresh, Error> {
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
        let wanted = Wanted::new(&frame, &Spacing::default(), None, coder)?;
        Ok(Fresh { indices, wanted, of_list })
    }

    /// A unit that decides about the parents in a list.
    fn drafted(&self, list: usize) -> Draft {
        let PredictedTarget { coder, survivors, .. } = &self.from;
        let range = self.range(list);
        let last = list + 1 == self.displaced.len();
        let coarse = last && list > 0 && self.from.coarse_tail;
        let partners = &self.matching.target_of[range.clone()];
        let fates = survivors.fates(&self.displaced[list], range.start, partners, coarse);
        let mut draft = coder.blank(0, [0; 5]);
        set_fates(coder, &mut draft, &fates);
        draft
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
fn set_fates(coder: &UnitCoder<'_>, draft: &mut Draft, fates: &[Fate]) {
    let count = |holds: &dyn Fn(i32) -> bool| fates.iter().filter(|fate| holds(fate.mode)).count() as u32;
    let header = &mut draft.header;
    header.parent_count = fates.len() as u32;
    header.move_count = count(&|mode| mode & 1 != 0);
    header.update_count = count(&|mode| mode & 2 != 0);
    header.remove_count = count(&|mode| mode == 4);
    let modes = fates.iter().map(|fate| fate.mode).collect();
    draft.values.set(Section::Modes, coder.section(vec![modes]));
    let moved =
        |axis: usize| fates.iter().filter(|fate| fate.mode & 1 != 0).map(|fate| fate.moved[axis]).collect();
    draft.values.set(Section::Moves, coder.section([0, 1, 2].map(moved).to_vec()));
    let width = fates.iter().map(|fate| fate.updated.len()).max().unwrap_or(0);
    let updated = |plane: usize| {
        fates.iter().filter(|fate| fate.mode & 2 != 0).map(|fate| fate.updated[plane]).collect()
    };
    draft.values.set(Section::Updates, coder.section((0..width).map(updated).collect()));
}
