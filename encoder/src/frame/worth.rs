//! What contexts, refinements and tables of the refinement before are worth to an I frame.
#![expect(clippy::arithmetic_side_effects, reason = "counts of bits and of what is in memory")]

use super::new_list::{NewList, deltas};
use super::residuals::Wanted;
use super::unit::{Draft, UnitCoder};
use crate::entropy_cost::Histogram;
use crate::error::Error;
use crate::savings::{Saving, Tool};
use crate::section::{MANY, SectionPlan};
use crate::settings::Tools;
use rayon::prelude::*;
use splatstream_format::entropy::in_force::ModelsInForce;
use splatstream_format::entropy::token::split;

/// What contexts and refinements save the Gaussians that the lowest layer adds, estimated: those of `order` in `wanted`. `shifts`: low bits of positions that
/// each list leaves out.
pub(super) fn of_lists(
    coder: &UnitCoder<'_>,
    (wanted, order): (&Wanted, &[u32]),
    new: &[NewList],
    shifts: &[u8],
) -> Vec<Saving> {
    let worths: Vec<_> =
        new.par_iter().map(|list| list.coded.worth_of_contexts(&list.values, &coder.plan)).collect();
    let count = order.len().max(1) as f64;
    let contexts: f64 = worths.iter().map(|worth| worth.plain - worth.own).sum();
    let mut savings = vec![Saving::estimated(Tool::Contexts, contexts / count)];
    if new.len() > 1 {
        let models = |worth: &crate::models::ContextWorth| worth.models;
        let tables = worths.iter().map(models).sum::<f64>() - worths.iter().map(models).fold(0.0, f64::max);
        let positions = positions_in_lists(new, shifts) - positions_in_one(coder, wanted, order);
        savings.push(Saving::estimated(Tool::Refinements, -(tables + positions) / count));
    }
    savings
}

/// Bits of positions in their lists, with the low bits that these leave out.
fn positions_in_lists(new: &[NewList], shifts: &[u8]) -> f64 {
    let of_list = |(list, &shift): (&NewList, &u8)| {
        position_bits(&list.values.deltas) + 3.0 * f64::from(shift) * list.len() as f64
    };
    new.iter().zip(shifts).map(of_list).sum()
}

/// Bits of positions if all Gaussians stood in one list.
fn positions_in_one(coder: &UnitCoder<'_>, wanted: &Wanted, order: &[u32]) -> f64 {
    let mut codes: Vec<u64> = order.par_iter().map(|&row| wanted.code(row, 0)).collect();
    codes.par_sort_unstable();
    position_bits(&deltas(&codes, coder.block()))
}

/// Zero-order bits of differences of codes.
fn position_bits(deltas: &[u64]) -> f64 {
    const DIRECT_LOG2: u8 = 4;
    let mut histogram = Histogram::default();
    let mut raw = 0_u64;
    for &delta in deltas {
        let token = split(delta, DIRECT_LOG2);
        histogram.add(token.token);
        raw += u64::from(token.raw_bits);
    }
    histogram.entropy_bits() + raw as f64
}

/// Bytes that a unit, of `bytes`, takes less because it may use tables of the one before. `models`: those in force before it.
///
/// # Errors
/// As [`UnitCoder::code`].
pub(super) fn of_reuse(
    coder: &UnitCoder<'_>,
    (draft, new): (&Draft, &NewList),
    models: &ModelsInForce,
    bytes: usize,
) -> Result<usize, Error> {
    // Such a unit has tables of its own in any case.
    if new.len() > MANY && draft.header.parent_count == 0 {
        return Ok(0);
    }
    let plan = SectionPlan { tools: Tools { table_reuse: false, ..coder.plan.tools }, ..coder.plan };
    let alone = UnitCoder { plan, ..*coder }.code(draft, &new.coded, &mut models.clone())?;
    Ok(alone.len().saturating_sub(bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_differences_take_their_raw_bits_only() {
        assert_eq!(position_bits(&[3; 100]), 0.0);
        let raw = f64::from(split(1 << 20, 4).raw_bits);
        assert_eq!(position_bits(&[1 << 20; 10]), 10.0 * raw);
    }
}
