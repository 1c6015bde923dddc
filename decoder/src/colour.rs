//! Clause 7.6.5: colour components to colour, by an integer transform.
//!
//! No sum overflows (annex F.4). Indices into codebooks are checked against their entries before these are summed, and a plane
//! has a value for each Gaussian of the run.

use crate::attribute::in_range;
pub use crate::components::COMPONENT_RANGE;
use crate::components::{Components, Pair, TILE};
use crate::cores;
use crate::interrupt::Interrupt;
use crate::layout::ShCoding;
use crate::steps::Exponents;
use crate::vector::{Task, vectorized};
use core::ops::RangeInclusive;
use splatstream_format::entropy::machine::{Machine, WIDE};
use splatstream_format::entropy::reader::{signed, vector};
use splatstream_format::payload::{Codebook, Transform};
use splatstream_format::{Error, ErrorKind, Result};

/// The values of colour in output steps.
pub(crate) const COLOUR_RANGE: RangeInclusive<i32> = -(1 << 30)..=1 << 30;

/// Gaussians whose colours one task transforms.
const RUN: usize = 4096;

/// Everything a unit needs to compute colour from components.
#[derive(Debug, Clone, Copy)]
pub struct Colour<'a> {
    /// The dc transform.
    pub dc: &'a Transform,
    /// The sh transform; none if the unit codes no SH.
    pub sh: Option<&'a Transform>,
    /// How SH is coded.
    pub mode: ShCoding,
    /// The codebooks of the stages.
    pub codebooks: [Option<&'a Codebook>; 4],
}

impl Colour<'_> {
    /// Writes red, green, blue and the SH planes of a block to `out`.
    ///
    /// # Errors
    /// Invalid if a component or a colour is out of range or an index names no entry.
    pub(crate) fn reconstruct(
        &self,
        dc: &Components,
        sh: &ShValues<'_>,
        out: &mut [&mut [i32]],
        at: u64,
    ) -> Result<()> {
        let (dc_out, sh_out) = out.split_at_mut_checked(3).unwrap_or_default();
        inverse(self.dc, dc, dc_out, at)?;
        let transform = self.sh.filter(|_| self.mode != ShCoding::None);
        match (sh, transform) {
            (ShValues::Components(components), Some(transform)) => inverse(transform, components, sh_out, at),
            (ShValues::Indices { planes, exponents }, Some(transform)) => {
                let entries = self.entries(planes, usize::from(transform.header.rank), at)?;
                let count = entries.first().map_or(0, Vec::len);
                let mut components = Components::new(count, entries.len(), exponents, Vec::new());
                entries.iter().for_each(|plane| components.add(plane, 0, at));
                inverse(transform, &components, sh_out, at)
            }
            (_, None) => {
                sh_out.iter_mut().for_each(|plane| plane.fill(0));
                Ok(())
            }
        }
    }

    /// Clause 7.6.5. Adds up the codebook entries of the stages; the sum is clamped.
    pub(crate) fn entries(&self, indices: &[Vec<i32>], rank: usize, at: u64) -> Result<Vec<Vec<i32>>> {
        let count = indices.first().map_or(0, Vec::len);
        let mut components = vec![vec![0_i32; count]; rank];
        for (stage, codebook) in indices.iter().zip(self.codebooks.iter().flatten()) {
            let largest = codebook.entries.len().checked_div(rank).unwrap_or(0).saturating_sub(1);
            in_entries(stage, largest, at)?;
            for (component, plane) in components.iter_mut().enumerate() {
                for (sum, &index) in plane.iter_mut().zip(stage) {
                    let index = (index as usize).wrapping_mul(rank).wrapping_add(component);
                    let value = codebook.entries.get(index).copied().unwrap_or(0);
                    *sum = sum.wrapping_add(i32::from(value));
                }
            }
        }
        for value in components.iter_mut().flatten() {
            *value = (*value).clamp(*COMPONENT_RANGE.start(), *COMPONENT_RANGE.end());
        }
        Ok(components)
    }
}

fn in_entries(stage: &[i32], largest: usize, at: u64) -> Result<()> {
    let max = i64::try_from(largest).unwrap_or(i64::MAX);
    match stage.iter().find(|&&index| i64::from(index) > max) {
        None => Ok(()),
        Some(&index) => Err(Error::new(
            at,
            "7.6.5",
            ErrorKind::OutOfRange { element: "vq_index", value: i64::from(index), min: 0, max },
        )),
    }
}

/// SH of some Gaussians without predictors, as they are coded.
pub(crate) enum ShValues<'c> {
    /// Components, or none.
    Components(&'c Components),
    /// Indices into the codebooks, stage by stage, and the exponents of the steps of sums of entries.
    Indices { planes: &'c [Vec<i32>], exponents: &'c Exponents },
}

/// `out_j = mean_j + Round(sum over k of basis[k][j] * component_k, 6)`.
///
/// # Errors
/// Invalid if a component leaves -8191..=8191 or a colour its range. With |basis| at most 4096 and at most 45 components
/// the sum stays below 2^31.
fn inverse(transform: &Transform, components: &Components, out: &mut [&mut [i32]], at: u64) -> Result<()> {
    transformed(transform, components, out, |_, mean, change| mean.wrapping_add(change))?;
    // A sum is below 2^25 after rounding, so that only extreme means can leave the range.
    let near_limit = transform.mean.iter().any(|mean| mean.unsigned_abs() > (1 << 30) - (1 << 25));
    let mut planes = out.iter().filter(|_| near_limit);
    planes.try_for_each(|plane| in_range(plane, &COLOUR_RANGE, "colour", "7.6", at))
}

/// `out_j += Round(sum over k of basis[k][j] * component_k, 6)`: a residual on top of what `out` holds. Components are
/// `coded` times the steps of their Gaussians. Runs of Gaussians are transformed on all cores.
///
/// # Errors
/// Invalid if a component leaves -8191..=8191: the first of the first run that has one. Where an interrupt is requested,
/// that.
pub fn add_inverse(
    transform: &Transform,
    coded: &[Vec<i32>],
    exponents: &Exponents,
    out: &mut [Vec<i32>],
    interrupt: &Interrupt,
    at: u64,
) -> Result<()> {
    let count = coded.first().map_or(0, Vec::len);
    let mut runs: Vec<Vec<&mut [i32]>> =
        (0..count.div_ceil(RUN)).map(|_| Vec::with_capacity(out.len())).collect();
    for plane in out {
        runs.iter_mut().zip(plane.chunks_mut(RUN)).for_each(|(run, chunk)| run.push(chunk));
    }
    let values = count.saturating_mul(transform.header.dimension.into());
    let transform_run = |(index, mut out): (usize, Vec<&mut [i32]>)| {
        interrupt.check()?;
        let start = index.wrapping_mul(RUN);
        let range = start..start.saturating_add(RUN).min(count);
        let mut components =
            Components::new(range.len(), coded.len(), &exponents.part(range.clone()), Vec::new());
        for plane in coded {
            components.add(plane.get(range.clone()).unwrap_or_default(), 0, at);
        }
        transformed(transform, &components, &mut out, |predicted, _, change| predicted.wrapping_add(change))
    };
    cores::map(values, runs.into_iter().enumerate().collect(), transform_run).into_iter().collect()
}

/// Writes what `join` makes of the value in `out`, the mean and the transformed components.
fn transformed(
    transform: &Transform,
    components: &Components,
    out: &mut [&mut [i32]],
    join: impl Fn(i32, i32, i32) -> i32,
) -> Result<()> {
    components.check()?;
    let weights = weights(transform, usize::from(transform.header.dimension));
    vectorized(Tiles { weights: &weights, means: &transform.mean, components, out, join });
    Ok(())
}

/// A pair of weights, or of components, in the halves of an `i32`: machines multiply both pairs and add the products in
/// one instruction.
fn packed(low: i16, high: i16) -> i32 {
    i32::from(low) & 0xFFFF | i32::from(high).wrapping_shl(16)
}

/// For each plane of the output the weights of the components, in pairs.
fn weights(transform: &Transform, dimension: usize) -> Vec<Vec<i32>> {
    let rows: Vec<&[i16]> = transform.basis.chunks_exact(dimension.max(1)).collect();
    let weight = |row: &&[i16], axis: usize| row.get(axis).copied().unwrap_or(0);
    let of_axis = |axis: usize| {
        let pair = |rows: &[&[i16]]| match rows {
            [first, second] => packed(weight(first, axis), weight(second, axis)),
            rows => packed(rows.first().map_or(0, |row| weight(row, axis)), 0),
        };
        rows.chunks(2).map(pair).collect()
    };
    (0..dimension).map(of_axis).collect()
}

/// Colours, tile by tile.
struct Tiles<'t, 'o, F> {
    weights: &'t [Vec<i32>],
    means: &'t [i32],
    components: &'t Components,
    out: &'t mut [&'o mut [i32]],
    join: F,
}

impl<F: Fn(i32, i32, i32) -> i32> Task for Tiles<'_, '_, F> {
    #[inline(always)]
    fn run(self, machine: impl Machine) {
        let Self { weights, means, components, out, join } = self;
        let mut start = 0_usize;
        for tile in components.tiles() {
            for ((plane, &mean), weights) in out.iter_mut().zip(means).zip(weights) {
                let sums = tile_sums(machine, weights, tile);
                let slots = plane.get_mut(start..).unwrap_or_default();
                match slots.first_chunk_mut::<TILE>() {
                    Some(slots) => {
                        let (slots, _) = slots.as_chunks_mut::<WIDE>();
                        for (slots, sums) in slots.iter_mut().zip(sums) {
                            for (slot, sum) in slots.iter_mut().zip(signed(machine, sums)) {
                                *slot = join(*slot, mean, sum.wrapping_add(32) >> 6);
                            }
                        }
                    }
                    None => {
                        let sums = sums.map(|sums| signed(machine, sums));
                        for (slot, &sum) in slots.iter_mut().zip(sums.as_flattened()) {
                            *slot = join(*slot, mean, sum.wrapping_add(32) >> 6);
                        }
                    }
                }
            }
            start = start.wrapping_add(TILE);
        }
    }
}

/// The sums of the products of weights and components. With |weights| at most 4096 and at most 45 components they stay
/// below 2^31.
#[inline(always)]
fn tile_sums<M: Machine>(machine: M, weights: &[i32], tile: &[Pair]) -> [M::V; TILE / WIDE] {
    let mut sums = [machine.splat(0); TILE / WIDE];
    for (&weights, components) in weights.iter().zip(tile) {
        let weights = machine.splat(weights.cast_unsigned());
        let (components, _) = components.as_chunks();
        for (sum, components) in sums.iter_mut().zip(components) {
            *sum = machine.add(*sum, machine.dot(vector(machine, components), weights));
        }
    }
    sums
}
