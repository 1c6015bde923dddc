//! Codes a section: values to models and blocks.

use crate::blocks::{code_blocks, lanes_log2};
use crate::error::Error;
use crate::models;
use crate::settings::{Preset, Tools};
use rayon::prelude::*;
use splatstream_decoder::coded_block::CodedBlock;
use splatstream_decoder::increment::values::SectionValues;
use splatstream_decoder::layout::{Layout, PlaneInfo, Section};
use splatstream_decoder::steps::StepRule;
use splatstream_format::entropy::in_force::{ModelsInForce, SectionModels};
use splatstream_format::entropy::model::{PlaneModel, write_models};
use splatstream_format::entropy::token::Alphabet;
use splatstream_format::payload::SectionBytes;

/// Values of a plane above which tables of its own always pay.
const MANY: usize = 1 << 15;

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

/// A section with models of its own. These need nothing of other units, so that those of all units of a frame are
/// chosen at once.
pub(crate) struct SectionDraft {
    layout: Layout,
    lanes_log2: u8,
    blocks: Vec<CodedBlock>,
    own: Vec<PlaneModel>,
}

impl SectionDraft {
    /// Divides values into blocks and chooses models for them. `steps` are those of the unit.
    pub(crate) fn new(
        layout: Layout,
        values: &SectionValues,
        biases: &[i32],
        steps: StepRule,
        plan: &SectionPlan,
    ) -> Self {
        let size = 1 << plan.block_log2;
        let lanes_log2 = lanes_log2(count(&layout, values).min(size));
        let blocks =
            blocks(&layout, values, biases, size, |deltas| CodedBlock::new(deltas, lanes_log2, steps));
        let own = match blocks.is_empty() {
            true => Vec::new(),
            false => models::choose_all(layout.planes(), &blocks, biases, plan.preset, plan.tools),
        };
        Self { layout, lanes_log2, blocks, own }
    }

    /// Codes the section, each plane with its own model or with the one in force, and puts its models in force.
    ///
    /// # Errors
    /// A value that no token codes.
    pub(crate) fn code(
        &self,
        section: Section,
        plan: &SectionPlan,
        in_force: &mut ModelsInForce,
    ) -> Result<SectionBytes, Error> {
        let before = known(section, &self.layout, in_force, plan);
        let tried = before.filter(|_| self.blocks.iter().map(CodedBlock::len).sum::<usize>() <= MANY);
        let chosen = models::cheapest(&self.own, tried, self.layout.planes(), &self.blocks);
        let model = write_models(&chosen, &self.layout.alphabets(), before);
        self.code_with(section, chosen, model, in_force)
    }

    /// The same with more bits than are needed: A.2 allows no more than so many new Gaussians in a byte.
    ///
    /// # Errors
    /// A value that no token codes.
    pub(crate) fn code_at_length(
        &self,
        section: Section,
        in_force: &mut ModelsInForce,
    ) -> Result<SectionBytes, Error> {
        let mut longer = self.own.clone();
        let first = value_plane(&self.layout);
        longer.iter_mut().skip(first).take(1).for_each(models::dilute);
        let model = write_models(&longer, &self.layout.alphabets(), None);
        self.code_with(section, longer, model, in_force)
    }

    fn code_with(
        &self,
        section: Section,
        models: Vec<PlaneModel>,
        model: Vec<u8>,
        in_force: &mut ModelsInForce,
    ) -> Result<SectionBytes, Error> {
        let blocks = code_blocks(self.layout.planes(), &models, &self.blocks, self.lanes_log2)?;
        in_force.replace(section, SectionModels { layout: self.layout.clone(), models });
        Ok(SectionBytes { lanes_log2: self.lanes_log2, model, blocks })
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
    let first = value_plane(layout);
    let mean = |(plane, info): (usize, &PlaneInfo)| {
        let Some(plane) = plane.checked_sub(first) else { return 0 };
        if section != Section::New || info.alphabet != Alphabet::Attribute {
            return 0;
        }
        let values = || parts.iter().filter_map(|part| part.planes.get(plane)).flatten();
        let count = values().count().max(1) as i64;
        let sum: i64 = values().map(|&value| i64::from(value)).sum();
        (2 * sum + count).div_euclid(2 * count) as i32
    };
    layout.planes().par_iter().enumerate().map(mean).collect()
}

/// The first plane that is not of the position alphabet.
fn value_plane(layout: &Layout) -> usize {
    usize::from(layout.planes().first().is_some_and(PlaneInfo::is_position))
}

/// Values of a plane.
fn count(layout: &Layout, values: &SectionValues) -> usize {
    match value_plane(layout) {
        0 => values.planes.first().map_or(0, Vec::len),
        _ => values.deltas.len(),
    }
}

/// Blocks of `size` values a plane; `empty` makes one without planes from its deltas.
#[expect(clippy::indexing_slicing, reason = "blocks are cut from planes of equal lengths")]
#[expect(clippy::arithmetic_side_effects, reason = "counts and sums of values of 32 bits")]
fn blocks(
    layout: &Layout,
    values: &SectionValues,
    biases: &[i32],
    size: usize,
    empty: impl Fn(Vec<u64>) -> CodedBlock + Sync,
) -> Vec<CodedBlock> {
    let (first, count) = (value_plane(layout), count(layout, values));
    let starts: Vec<usize> = (0..count).step_by(size).collect();
    let of_start = |&start: &usize| {
        let end = count.min(start + size);
        let deltas = if first == 1 { values.deltas[start..end].to_vec() } else { vec![0; end - start] };
        let mut block = empty(deltas);
        for (plane, (&info, &bias)) in layout.planes().iter().zip(biases).enumerate() {
            let coded = match plane.checked_sub(first) {
                Some(plane) => values.planes[plane][start..end].iter().map(|value| value - bias).collect(),
                None => Vec::new(),
            };
            block.push(info, coded, bias);
        }
        block
    };
    starts.par_iter().map(of_start).collect()
}
