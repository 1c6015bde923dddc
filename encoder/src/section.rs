//! Codes a section: values to models and blocks.

use crate::blocks::{Blocks, first_value_plane};
use crate::error::Error;
use crate::models::{self, ContextWorth, PlaneCosts};
use crate::settings::{Preset, Tools};
use rayon::prelude::*;
use splatstream_decoder::increment::values::SectionValues;
use splatstream_decoder::layout::{Layout, PlaneInfo, Section};
use splatstream_decoder::steps::StepRule;
use splatstream_format::entropy::in_force::{ModelsInForce, SectionModels};
use splatstream_format::entropy::model::{PlaneModel, write_models};
use splatstream_format::entropy::token::Alphabet;
use splatstream_format::payload::SectionBytes;

/// Values of a plane above which tables of its own always pay.
pub(crate) const MANY: usize = 1 << 15;

/// How sections are coded.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SectionPlan {
    /// log2 of the values of a plane in a block.
    pub(crate) block_log2: u8,
    /// How much to search.
    pub(crate) preset: Preset,
    /// What may be used.
    pub(crate) tools: Tools,
}

/// Models for a section of its own. These need nothing of other units, so that those of all units of a frame are chosen at
/// once. Its values are given to each function again, as they are kept elsewhere.
pub(crate) struct SectionDraft {
    layout: Layout,
    biases: Vec<i32>,
    steps: StepRule,
    own: Vec<PlaneModel>,
}

impl SectionDraft {
    /// Chooses models for values. `steps` are those of the unit.
    pub(crate) fn new(
        layout: Layout,
        values: &SectionValues,
        biases: Vec<i32>,
        steps: StepRule,
        plan: &SectionPlan,
    ) -> Self {
        let mut draft = Self { layout, biases, steps, own: Vec::new() };
        draft.own = models::choose_all(&draft.blocks(values, plan), plan.preset, plan.tools);
        draft
    }

    fn blocks<'v>(&'v self, values: &'v SectionValues, plan: &SectionPlan) -> Blocks<'v> {
        Blocks::new(&self.layout, values, &self.biases, plan.block_log2, self.steps)
    }

    /// Codes the section, each plane with its own model or with the one in force, and puts its models in force.
    ///
    /// # Errors
    /// A value that no token codes.
    pub(crate) fn code(
        &self,
        section: Section,
        values: &SectionValues,
        plan: &SectionPlan,
        in_force: &mut ModelsInForce,
    ) -> Result<SectionBytes, Error> {
        let before = known(section, &self.layout, in_force, plan);
        let blocks = self.blocks(values, plan);
        let chosen = match before.filter(|_| blocks.values() <= MANY) {
            Some(before) => models::cheapest(&self.own, before, &blocks),
            None => self.own.clone(),
        };
        let model = write_models(&chosen, &self.layout.alphabets(), before);
        self.code_with(section, &blocks, chosen, model, in_force)
    }

    /// What values cost under the models of the section: one entry for each plane after the position.
    pub(crate) fn costs(&self, values: &SectionValues, plan: &SectionPlan) -> Vec<PlaneCosts> {
        let blocks = self.blocks(values, plan);
        // A section without values has no models.
        models::costs(&self.own, &blocks).into_iter().skip(first_value_plane(&self.layout)).collect()
    }

    /// What contexts are worth to the values, on some of them.
    pub(crate) fn worth_of_contexts(&self, values: &SectionValues, plan: &SectionPlan) -> ContextWorth {
        models::worth_of_contexts(&self.own, &self.blocks(values, plan))
    }

    /// The same with more bits than are needed: A.2 allows no more than so many new Gaussians in a byte.
    ///
    /// # Errors
    /// A value that no token codes.
    pub(crate) fn code_at_length(
        &self,
        section: Section,
        values: &SectionValues,
        plan: &SectionPlan,
        in_force: &mut ModelsInForce,
    ) -> Result<SectionBytes, Error> {
        let mut longer = self.own.clone();
        let first = first_value_plane(&self.layout);
        longer.iter_mut().skip(first).take(1).for_each(models::dilute);
        let model = write_models(&longer, &self.layout.alphabets(), None);
        self.code_with(section, &self.blocks(values, plan), longer, model, in_force)
    }

    fn code_with(
        &self,
        section: Section,
        blocks: &Blocks<'_>,
        models: Vec<PlaneModel>,
        model: Vec<u8>,
        in_force: &mut ModelsInForce,
    ) -> Result<SectionBytes, Error> {
        let coded = blocks.code(&models)?;
        in_force.replace(section, SectionModels { layout: self.layout.clone(), models });
        Ok(SectionBytes { lanes_log2: blocks.lanes_log2(), model, blocks: coded })
    }
}

/// The models in force that a section may use again.
fn known<'m>(
    section: Section,
    layout: &Layout,
    in_force: &'m ModelsInForce,
    plan: &SectionPlan,
) -> Option<&'m [PlaneModel]> {
    let known = in_force.get(section).filter(|known| plan.tools.table_reuse && known.layout == *layout);
    known.map(|known| known.models.as_slice())
}

/// What is taken off each plane of a section of which `parts` are coded one after the other: the biases of the models
/// in force, so that these can be used again; else the mean of whole Gaussians, and nothing of residuals.
#[expect(clippy::arithmetic_side_effects, reason = "counts and sums of values of 32 bits")]
pub(crate) fn biases(
    section: Section,
    layout: &Layout,
    parts: &[&SectionValues],
    in_force: &ModelsInForce,
    plan: &SectionPlan,
) -> Vec<i32> {
    if let Some(known) = known(section, layout, in_force, plan) {
        return known.iter().map(|model| model.bias).collect();
    }
    let first = first_value_plane(layout);
    let mean = |(plane, info): (usize, &PlaneInfo)| {
        let Some(plane) = plane.checked_sub(first) else { return 0 };
        if section != Section::New || info.alphabet != Alphabet::Attribute {
            return 0;
        }
        let planes = || parts.iter().filter_map(|part| part.planes.get(plane));
        let count = planes().map(Vec::len).sum::<usize>().max(1) as i64;
        let sum: i64 = planes().map(|plane| plane.iter().map(|&value| i64::from(value)).sum::<i64>()).sum();
        (2 * sum + count).div_euclid(2 * count) as i32
    };
    layout.planes().par_iter().enumerate().map(mean).collect()
}
