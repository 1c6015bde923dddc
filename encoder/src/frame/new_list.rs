//! The new Gaussians of a list as they are without prediction.
//!
//! They need nothing of other units: those of all units of a frame are put in order, coded and given models at once.

use super::unit::UnitCoder;
use super::wanted::Wanted;
use crate::error::Error;
use crate::section::{SectionDraft, biases};
use rayon::prelude::*;
use splatstream_decoder::increment::residual::{AttributeValues, Attributes, Stage};
use splatstream_decoder::increment::values::SectionValues;
use splatstream_decoder::layout::Section;
use splatstream_format::entropy::in_force::ModelsInForce;

/// The new Gaussians of a list.
pub(crate) struct NewList {
    /// Their indices among all that are new, in coded order.
    pub(crate) added: Vec<u32>,
    /// Their positions and residuals, until a draft takes them.
    pub(crate) values: SectionValues,
    /// The section with models of its own.
    pub(crate) coded: SectionDraft,
}

impl NewList {
    /// The new Gaussians of each list of a frame or layer, with steps of 2^shift. `added`: for each list their indices
    /// in `all`. `models`: those in force before the first list.
    ///
    /// # Errors
    /// What the decoder's own checks refuse.
    pub(crate) fn all(
        coder: &UnitCoder<'_>,
        all: &Wanted,
        added: Vec<Vec<u32>>,
        shift: u8,
        models: &ModelsInForce,
    ) -> Result<Vec<Self>, Error> {
        let placed: Vec<(Vec<u32>, SectionValues)> = added
            .into_par_iter()
            .map(|added| unpredicted(coder, all, added, shift))
            .collect::<Result<_, Error>>()?;
        let layout = coder.layout(Section::New);
        let values: Vec<&SectionValues> = placed.iter().map(|(_, values)| values).collect();
        // One bias for all lists: so that a unit may use the models of the one before.
        let biases = biases(Section::New, &layout, &values, models, &coder.plan);
        let list = |(added, values): (Vec<u32>, SectionValues)| {
            let coded = SectionDraft::new(layout.clone(), &values, &biases, &coder.plan);
            Self { added, values, coded }
        };
        Ok(placed.into_par_iter().map(list).collect())
    }

    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.added.len()
    }
}

/// Puts `added`, indices in `all`, in Morton order on the grid of every 2^shift-th point, and gives their values without
/// prediction.
///
/// # Errors
/// What the decoder's own checks refuse.
pub(crate) fn unpredicted(
    coder: &UnitCoder<'_>,
    all: &Wanted,
    added: Vec<u32>,
    shift: u8,
) -> Result<(Vec<u32>, SectionValues), Error> {
    let mut codes: Vec<(u64, u32)> = added.par_iter().map(|&index| (all.code(index, shift), index)).collect();
    codes.par_sort_unstable();
    let (codes, added): (Vec<u64>, Vec<u32>) = codes.into_iter().unzip();
    let planes = match shift {
        0 => all.direct(&added),
        _ => shifted(coder, &all.select(&added), shift)?,
    };
    let block = coder.block();
    Ok((added, SectionValues { deltas: deltas(&codes, block), planes, block }))
}

/// Residuals on top of nothing, with coarser steps.
fn shifted(coder: &UnitCoder<'_>, wanted: &Wanted, shift: u8) -> Result<Vec<Vec<i32>>, Error> {
    let sh_planes = usize::from(coder.sequence.sh_dimension());
    let mut now = Attributes::unpredicted(wanted.len(), &coder.colour, sh_planes);
    let mut planes = Vec::new();
    for stage in Stage::ALL {
        planes.extend(wanted.residuals(stage, &now, shift, &coder.colour, true));
        now.add_stage(stage, AttributeValues(&planes), &coder.coding([shift; 5]), 0)?;
    }
    Ok(planes)
}

/// Differences of rising codes; they start again in each block.
pub(crate) fn deltas(codes: &[u64], block: usize) -> Vec<u64> {
    let before = |index: usize| if index.is_multiple_of(block) { 0 } else { codes[index - 1] };
    codes.iter().enumerate().map(|(index, &code)| code - before(index)).collect()
}
