//! What a step more of each coded value takes in bits, under the models that the values would be coded with.
//!
//! Contexts are held: a value is not rewarded for what it makes cheaper after it. Positions take the same bits wherever a
//! Gaussian moves, nearly, and have no slope.
#![expect(
    clippy::arithmetic_side_effects,
    reason = "coded values are below 2^17; counts of what is in memory"
)]
#![expect(
    clippy::indexing_slicing,
    reason = "rows and planes are those of the lists that the models are of; places are clamped"
)]

use super::latent::{Decoded, Latent, List};
use crate::error::Error;
use crate::frame::new_list::NewList;
use crate::frame::residuals::Wanted;
use crate::models::{PlaneCosts, ValueBits};
use core::ops::Range;
use rayon::prelude::*;
use splatstream_decoder::layout::{Section, ShCoding};
use splatstream_format::entropy::in_force::ModelsInForce;
use splatstream_gaussians::Planes;

/// Values on either side of the bias whose slopes are kept; beyond them the last one holds.
const REACH: i32 = 512;

/// Bits of a step, at most: a value that no table has yet may be reached all the same.
const STEEPEST: f32 = 3.0;

/// Planes of values of log-scales, opacity, rotation and dc, and the first of sh.
const LOG_SCALES: usize = 3;
const ROTATION: usize = 4;
const DC: usize = 7;
const SH: usize = 10;

/// Slopes of the bits of a frame.
pub(super) struct Rate {
    lists: Vec<ListRate>,
    /// Bits of all values but positions, as they were when the models were chosen.
    pub(super) bits: f64,
}

/// Of one list: plane by plane.
struct ListRate {
    rows: Range<usize>,
    planes: Vec<PlaneRate>,
    /// Of what moves parents; none of new Gaussians.
    moves: Vec<PlaneRate>,
}

/// Of one plane of a list.
struct PlaneRate {
    bias: i32,
    /// Slope of each value, by table.
    tables: Vec<Vec<f32>>,
    table_of_row: Vec<u8>,
}

impl Rate {
    /// Chooses models for the values that a frame would be coded with.
    ///
    /// # Errors
    /// None of planes that are those of a frame.
    pub(super) fn new(latent: &Latent<'_>) -> Result<Self, Error> {
        let coder = latent.coder;
        if latent.lists.iter().any(|list| list.parents.is_some()) {
            return Self::of_refinements(latent);
        }
        let wanted = Wanted::new(&latent.frame()?, None, coder);
        let rows = |list: &List| list.rows.clone().map(|row| row as u32).collect();
        let added = latent.lists.iter().map(|list| (rows(list), list.grain)).collect();
        let new = NewList::all(coder, &wanted, added, &ModelsInForce::default());
        let mut rate = Self { lists: Vec::new(), bits: 0.0 };
        for (list, new) in latent.lists.iter().zip(&new) {
            let costs = new.coded.costs(&new.values, &coder.plan);
            rate.bits += costs.iter().map(|plane| plane.bits).sum::<f64>();
            let planes = costs.into_par_iter().map(|costs| PlaneRate::new(costs, &list.rows, &new.added));
            rate.lists.push(ListRate {
                rows: list.rows.clone(),
                planes: planes.collect(),
                moves: Vec::new(),
            });
        }
        Ok(rate)
    }

    /// The same of values that refine those of parents.
    fn of_refinements(latent: &Latent<'_>) -> Result<Self, Error> {
        let (coder, decoded) = (latent.coder, latent.decoded()?);
        let mut rate = Self { lists: Vec::new(), bits: 0.0 };
        for list in &latent.lists {
            let steps = coder.steps(list.grain.attribute_step);
            let added: Vec<u32> = list.rows.clone().map(|row| row as u32).collect();
            let [planes, moves] = [(Section::Updates, &decoded.values), (Section::Moves, &decoded.moves)]
                .map(|(section, planes)| {
                    let own = planes.iter().map(|plane| plane[list.rows.clone()].to_vec()).collect();
                    let values = coder.section(own);
                    let draft = coder.section_draft(section, &values, steps, &ModelsInForce::default());
                    let costs = draft.costs(&values, &coder.plan);
                    rate.bits += costs.iter().map(|plane| plane.bits).sum::<f64>();
                    costs.into_iter().map(|costs| PlaneRate::new(costs, &list.rows, &added)).collect()
                });
            rate.lists.push(ListRate { rows: list.rows.clone(), planes, moves });
        }
        Ok(rate)
    }

    /// Adds to slopes what a step of each latent value takes, bits times `weight`. Values that nobody sees are not to become cheap.
    pub(super) fn add(&self, latent: &Latent<'_>, decoded: &Decoded, weight: f32, slopes: &mut Planes) {
        let sh_planes = match latent.coder.colour.mode {
            ShCoding::Coefficients { rank } => usize::from(rank),
            // Entries of codebooks are not values that a step leads from one to the next of.
            ShCoding::None | ShCoding::VectorQuantised { .. } => 0,
        };
        let steps = &latent.steps().log_scale;
        let fitted = self.lists.iter().zip(&latent.lists).filter(|(_, list)| list.is_fitted);
        for (list, _) in fitted {
            let slope = |plane: usize, row: usize| {
                let at = list.rows.start + row;
                weight * list.planes[plane].slope(row, decoded.values[plane][at])
            };
            let of_moves = |axis: usize, row: usize| {
                weight * list.moves[axis].slope(row, decoded.moves[axis][list.rows.start + row])
            };
            if !list.moves.is_empty() {
                for row in 0..list.rows.len() {
                    let at = list.rows.start + row;
                    (0..3).for_each(|axis| slopes.log_scale[axis][at] += slope(axis, row));
                    (0..3).for_each(|axis| slopes.position[axis][at] += of_moves(axis, row));
                }
            }
            let new = if list.moves.is_empty() { 0..list.rows.len() } else { 0..0 };
            // The largest, and two differences, of which the first changes with both: the steps of the largest are others.
            for row in new {
                let at = list.rows.start + row;
                let [largest, first, second] = [0, 1, 2].map(|plane: usize| slope(plane, row));
                slopes.log_scale[0][at] += largest + first * steps[0][at] / steps[1][at];
                slopes.log_scale[1][at] += second - first;
                slopes.log_scale[2][at] -= second;
            }
            let add = |plane: usize, slopes: &mut Vec<f32>| {
                let slopes = slopes[list.rows.clone()].iter_mut().enumerate();
                slopes.for_each(|(row, sum)| *sum += slope(plane, row));
            };
            let Planes { opacity_logit, rotation, dc, sh, .. } = slopes;
            add(LOG_SCALES, opacity_logit);
            (ROTATION..DC).zip(rotation.iter_mut().skip(1)).for_each(|(plane, slopes)| add(plane, slopes));
            (DC..SH).zip(dc).for_each(|(plane, slopes)| add(plane, slopes));
            (SH..).zip(sh.iter_mut().take(sh_planes)).for_each(|(plane, slopes)| add(plane, slopes));
        }
    }
}

impl PlaneRate {
    /// `added`: the rows of the values, which are in coded order.
    fn new(costs: PlaneCosts, rows: &Range<usize>, added: &[u32]) -> Self {
        let mut table_of_row = vec![0; rows.len()];
        for (&row, &table) in added.iter().zip(&costs.table_of_value) {
            table_of_row[row as usize - rows.start] = table;
        }
        Self { bias: costs.bias, tables: costs.tables.iter().map(slopes).collect(), table_of_row }
    }

    /// Bits of one step more of a value.
    fn slope(&self, row: usize, value: i32) -> f32 {
        let place = (value - self.bias).clamp(-REACH, REACH) + REACH;
        self.tables[usize::from(self.table_of_row[row])][place as usize]
    }
}

/// Slopes of the bits of values, between the neighbours of each; where values share a token, between values farther off.
fn slopes(table: &ValueBits) -> Vec<f32> {
    let slope = |value: i32| {
        let apart = (value.abs() / 4).max(1);
        let slope = (table.of(value + apart) - table.of(value - apart)) / (2 * apart) as f32;
        slope.clamp(-STEEPEST, STEEPEST)
    };
    (-REACH..=REACH).map(slope).collect()
}
