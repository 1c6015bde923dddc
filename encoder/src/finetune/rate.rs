//! What a step more of each coded value costs in bits, under the models that the values would be coded with.
//!
//! Contexts are held fixed: a value that becomes cheaper for those after it is not rewarded for that.
#![expect(clippy::arithmetic_side_effects, reason = "coded values are below 2^17; counts of what is in memory")]
#![expect(
    clippy::indexing_slicing,
    reason = "rows and planes are those of the lists that the models are of; axes are constants"
)]

use super::latent::{Decoded, LOG_SCALE, Latent, List, OPACITY};
use crate::error::Error;
use crate::frame::new_list::NewList;
use crate::frame::residuals::Wanted;
use crate::models::ValueBits;
use crate::models::PlaneCosts;
use rayon::prelude::*;
use splatstream_format::entropy::in_force::ModelsInForce;

/// Values on either side of the bias whose slopes are kept; beyond them the last one holds.
const REACH: i32 = 512;

/// Bits a step, at most: a value that no table has yet may be reached all the same.
const STEEPEST: f32 = 3.0;

/// Slopes by list, plane of values and table, and which table each value has.
pub(super) struct Rate {
    lists: Vec<ListRate>,
    /// Bits of all values without positions, as they were when the models were chosen.
    pub(super) bits: f64,
    /// Bits that halving all steps would add: one for each value that is seldom 0, less for others.
    pub(super) bits_an_octave: f64,
}

/// Of one list.
struct ListRate {
    planes: Vec<PlaneRate>,
}

/// Of one plane of a list.
struct PlaneRate {
    bias: i32,
    tables: Vec<Vec<f32>>,
    table_of_row: Vec<u8>,
}

impl PlaneRate {
    /// Bits that one step more takes.
    fn slope(&self, row: usize, value: i32) -> f32 {
        let place = (value - self.bias).clamp(-REACH, REACH) + REACH;
        self.tables[usize::from(self.table_of_row[row])][place as usize]
    }
}

impl Rate {
    /// Chooses models for the values that a frame would be coded with.
    pub(super) fn new(latent: &Latent<'_>) -> Result<Self, Error> {
        let coder = latent.coder;
        let wanted = Wanted::new(&latent.frame()?, None, coder);
        let added = latent.lists.iter().map(|list| (list.rows.clone().map(|row| row as u32).collect(), list.grain));
        let new = NewList::all(coder, &wanted, added.collect(), &ModelsInForce::default());
        let of_list = |(list, new): (&List, &NewList)| {
            let costs = new.coded.costs(&new.values, &coder.plan);
            let (mut bits, mut octave) = (0.0, 3.0 * list.rows.len() as f64);
            let of_plane = |costs: PlaneCosts| {
                let mut table_of_row = vec![0; list.rows.len()];
                for (&row, &table) in new.added.iter().zip(&costs.table_of_value) {
                    table_of_row[row as usize - list.rows.start] = table;
                }
                bits += costs.bits;
                let mean = costs.bits / list.rows.len().max(1) as f64;
                octave += list.rows.len() as f64 * (0.5 * mean).min(1.0);
                let tables = costs.tables.iter().map(|bits| slopes(bits)).collect();
                PlaneRate { bias: costs.bias, tables, table_of_row }
            };
            let planes = costs.into_iter().map(of_plane).collect();
            (ListRate { planes }, bits, octave)
        };
        let found: Vec<_> = latent.lists.par_iter().zip(&new).map(of_list).collect();
        let (bits, bits_an_octave) = found.iter().fold((0.0, 0.0), |sum, of| (sum.0 + of.1, sum.1 + of.2));
        Ok(Self { lists: found.into_iter().map(|(list, ..)| list).collect(), bits, bits_an_octave })
    }

    /// Adds what a step of each latent value costs, bits times `weight`, to slopes.
    pub(super) fn add(&self, latent: &Latent<'_>, decoded: &Decoded, weight: f32, slopes: &mut [Vec<f32>]) {
        let planes = slopes.len();
        let steps = &latent.steps();
        for (list, rate) in latent.lists.iter().zip(&self.lists) {
            let rows = list.rows.clone();
            let of = |plane: usize, row: usize| {
                weight * rate.planes[plane].slope(row, decoded.values[plane][rows.start + row])
            };
            // Of the largest log-scale and two differences, of which the first has another step.
            for row in 0..rows.len() {
                let [a, b, c] = [0, 1, 2].map(|plane: usize| of(plane, row));
                let at = rows.start + row;
                let share = steps[LOG_SCALE][at] / steps[LOG_SCALE + 1][at];
                slopes[LOG_SCALE][at] += a + b * share;
                slopes[LOG_SCALE + 1][at] += c - b;
                slopes[LOG_SCALE + 2][at] -= c;
            }
            slopes[OPACITY..planes].par_iter_mut().enumerate().for_each(|(plane, slopes)| {
                for (row, slope) in slopes[rows.clone()].iter_mut().enumerate() {
                    *slope += of(OPACITY - LOG_SCALE + plane, row);
                }
            });
        }
    }
}

/// Slopes of the bits of values, between the neighbours of each; where values share a token, between values farther off.
fn slopes(table: &ValueBits) -> Vec<f32> {
    let bits = |value: i32| table.of(value);
    let slope = |value: i32| {
        let apart = (value.abs() / 4).max(1);
        let slope = (bits(value + apart) - bits(value - apart)) / (2 * apart) as f32;
        slope.clamp(-STEEPEST, STEEPEST)
    };
    (-REACH..=REACH).map(slope).collect()
}
