//! The new Gaussians of a list as they are without prediction.
//!
//! They need nothing of other units: those of all units of a frame are put in order, coded and given models at once.

use super::grain::Grain;
use super::residuals::Wanted;
use super::unit::UnitCoder;
use crate::section::{SectionDraft, biases};
use rayon::prelude::*;
use splatstream_decoder::increment::values::SectionValues;
use splatstream_decoder::layout::Section;
use splatstream_format::entropy::in_force::ModelsInForce;

/// The new Gaussians of a list.
pub(crate) struct NewList {
    /// Their indices among all that are new, in coded order.
    pub(crate) added: Vec<u32>,
    /// Their positions and residuals, until a draft takes them.
    pub(crate) values: SectionValues,
    /// Models of its own.
    pub(crate) coded: SectionDraft,
}

impl NewList {
    /// The new Gaussians of each list of a frame or layer: for each list their indices in `all`, and how finely they are
    /// coded. `models`: those in force before the first list.
    pub(crate) fn all(
        coder: &UnitCoder<'_>,
        all: &Wanted,
        added: Vec<(Vec<u32>, Grain)>,
        models: &ModelsInForce,
    ) -> Vec<Self> {
        let place = |(added, grain): (Vec<u32>, Grain)| {
            let (added, values) = unpredicted(coder, all, added, grain);
            (added, values, grain)
        };
        let placed: Vec<(Vec<u32>, SectionValues, Grain)> = added.into_par_iter().map(place).collect();
        let layout = coder.layout(Section::New);
        // Lists with equal steps have one bias, so that a unit may use the models of the one before.
        let mut biases_of_lists: Vec<Vec<i32>> = Vec::new();
        for (at, (_, _, grain)) in placed.iter().enumerate() {
            let is_alike = |(_, _, other): &(Vec<u32>, SectionValues, Grain)| {
                other.attribute_step == grain.attribute_step
            };
            let before = placed.iter().take(at).position(is_alike);
            let known = before.and_then(|before| biases_of_lists.get(before)).cloned();
            biases_of_lists.push(known.unwrap_or_else(|| {
                let alike = placed.iter().filter(|list| is_alike(list));
                let alike: Vec<&SectionValues> = alike.map(|(_, values, _)| values).collect();
                biases(Section::New, &layout, &alike, models, &coder.plan)
            }));
        }
        let draft = |((_, values, grain), biases): (&(Vec<u32>, SectionValues, Grain), Vec<i32>)| {
            let steps = coder.steps(grain.attribute_step);
            SectionDraft::new(layout.clone(), values, biases, steps, &coder.plan)
        };
        let drafts: Vec<SectionDraft> = placed.par_iter().zip(biases_of_lists).map(draft).collect();
        let lists = placed.into_iter().zip(drafts);
        lists.map(|((added, values, _), coded)| Self { added, values, coded }).collect()
    }

    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.added.len()
    }
}

/// Puts `added`, indices in `all`, in Morton order on the grid of positions of the unit, and gives their values without
/// prediction.
pub(crate) fn unpredicted(
    coder: &UnitCoder<'_>,
    all: &Wanted,
    added: Vec<u32>,
    grain: Grain,
) -> (Vec<u32>, SectionValues) {
    let shift = grain.position_shift;
    let mut codes: Vec<(u64, u32)> = added.par_iter().map(|&index| (all.code(index, shift), index)).collect();
    codes.par_sort_unstable();
    let (codes, added): (Vec<u64>, Vec<u32>) = codes.into_iter().unzip();
    let block = coder.block();
    let deltas = deltas(&codes, block);
    drop(codes);
    let planes = all.direct(&added, &coder.steps(grain.attribute_step), coder);
    (added, SectionValues { deltas, planes, block })
}

/// Differences of rising codes; they start again in each block.
#[expect(clippy::indexing_slicing, reason = "every entry that starts no block has one before it")]
#[expect(clippy::arithmetic_side_effects, reason = "codes rise")]
pub(crate) fn deltas(codes: &[u64], block: usize) -> Vec<u64> {
    let before = |index: usize| if index.is_multiple_of(block) { 0 } else { codes[index - 1] };
    codes.iter().enumerate().map(|(index, &code)| code - before(index)).collect()
}
