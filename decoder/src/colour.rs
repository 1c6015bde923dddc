//! Clause 7.6.5: colour components to colour, by an integer transform.

use crate::attribute::in_range;
use crate::layout::ShCoding;
use crate::steps::Exponents;
use crate::vector::{Task, vectorized};
use core::ops::RangeInclusive;
use splatstream_format::entropy::machine::Machine;
use splatstream_format::payload::{Codebook, Transform};
use splatstream_format::{Error, ErrorKind, Result};

/// The values of a component.
pub const COMPONENT_RANGE: RangeInclusive<i32> = -8191..=8191;

/// The values of colour in output steps.
pub(crate) const COLOUR_RANGE: RangeInclusive<i32> = -(1 << 30)..=1 << 30;

/// Gaussians transformed at a time: their sums stay in registers.
const TILE: usize = 32;

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
    /// Writes red, green, blue and the SH planes of a block to `out`. With a codebook, `sh` are indices, and its steps
    /// are those of sums of entries.
    ///
    /// # Errors
    /// Invalid if a component or a colour is out of range or an index names no entry.
    pub fn reconstruct(
        &self,
        dc: Components<'_>,
        sh: Components<'_>,
        out: &mut [&mut [i32]],
        at: u64,
    ) -> Result<()> {
        let (dc_out, sh_out) = out.split_at_mut_checked(3).unwrap_or_default();
        inverse(self.dc, dc, dc_out, at)?;
        match (self.mode, self.sh) {
            (ShCoding::Coefficients { .. }, Some(transform)) => inverse(transform, sh, sh_out, at),
            (ShCoding::VectorQuantised { .. }, Some(transform)) => {
                let entries = self.entries(sh.coded, usize::from(transform.header.rank), at)?;
                inverse(transform, Components { coded: &entries, biases: &[], ..sh }, sh_out, at)
            }
            _ => {
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

/// The components of some Gaussians, as they are coded.
#[derive(Debug, Clone, Copy)]
pub struct Components<'c> {
    /// The coded values, plane by plane.
    pub coded: &'c [Vec<i32>],
    /// What is added to the values of each plane; planes without a bias have 0.
    pub biases: &'c [i32],
    /// The exponents of their steps, by which the sums are multiplied.
    pub exponents: &'c Exponents,
}

impl<'c> Components<'c> {
    /// Components that are known as they are.
    pub const fn known(planes: &'c [Vec<i32>]) -> Self {
        Self { coded: planes, biases: &[], exponents: &Exponents::Same(0) }
    }

    /// The planes with their biases.
    #[inline(always)]
    fn planes(&self) -> impl Iterator<Item = (&'c [i32], i32)> {
        let biases = self.biases.iter().copied().chain(core::iter::repeat(0));
        self.coded.iter().map(Vec::as_slice).zip(biases)
    }

    /// The error of the first component that is out of range, if there is one.
    fn check(&self, at: u64) -> Result<()> {
        self.planes().try_for_each(|(plane, bias)| {
            let mut plane = plane.to_vec();
            self.exponents.scale(&mut plane, bias);
            in_range(&plane, &COMPONENT_RANGE, "component", "7.6.5", at)
        })
    }
}

/// `out_j = mean_j + Round(sum over k of basis[k][j] * component_k, 6)`.
///
/// # Errors
/// Invalid if a component leaves -8191..=8191 or a colour its range. With |basis| at most 4096 and at most 45 components
/// the sum stays below 2^31.
pub fn inverse(
    transform: &Transform,
    components: Components<'_>,
    out: &mut [&mut [i32]],
    at: u64,
) -> Result<()> {
    transformed(transform, components, out, at, |_, mean, change| mean.wrapping_add(change))?;
    // A sum is below 2^25 after rounding, so that only extreme means can leave the range.
    let near_limit = transform.mean.iter().any(|mean| mean.unsigned_abs() > (1 << 30) - (1 << 25));
    let mut planes = out.iter().filter(|_| near_limit);
    planes.try_for_each(|plane| in_range(plane, &COLOUR_RANGE, "colour", "7.6", at))
}

/// `out_j += Round(sum over k of basis[k][j] * component_k, 6)`: a residual on top of what `out` holds.
///
/// # Errors
/// As [`inverse`].
pub fn add_inverse(
    transform: &Transform,
    components: &[Vec<i32>],
    out: &mut [&mut [i32]],
    at: u64,
) -> Result<()> {
    let components = Components::known(components);
    transformed(transform, components, out, at, |predicted, _, change| predicted.wrapping_add(change))
}

/// Writes what `join` makes of the value in `out`, the mean and the transformed components.
fn transformed(
    transform: &Transform,
    components: Components<'_>,
    out: &mut [&mut [i32]],
    at: u64,
    join: impl Fn(i32, i32, i32) -> i32,
) -> Result<()> {
    let weights = weights(transform, usize::from(transform.header.dimension));
    let mut in_range = true;
    let means = &transform.mean;
    vectorized(Tiles { weights: &weights, means, components, out, join, in_range: &mut in_range });
    if in_range { Ok(()) } else { components.check(at) }
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

/// Colours, tile by tile: the components of a tile are brought to their steps and checked while they are packed, and the
/// sums of products stay in registers.
struct Tiles<'t, 'o, F> {
    weights: &'t [Vec<i32>],
    means: &'t [i32],
    components: Components<'t>,
    out: &'t mut [&'o mut [i32]],
    join: F,
    /// Becomes false if a component is out of range.
    in_range: &'t mut bool,
}

impl<F: Fn(i32, i32, i32) -> i32> Task for Tiles<'_, '_, F> {
    #[inline(always)]
    fn run(self, _: impl Machine) {
        let Self { weights, means, components, out, join, in_range } = self;
        let count = out.first().map_or(0, |plane| plane.len());
        let mut tile = vec![[0_i32; TILE]; components.coded.len().div_ceil(2)];
        let mut greatest = [0; TILE];
        for start in (0..count).step_by(TILE) {
            let steps = components.exponents.steps(start);
            for (number, (plane, bias)) in components.planes().enumerate() {
                let values = scaled(plane, start, bias, &steps);
                for (greatest, value) in greatest.iter_mut().zip(values) {
                    *greatest = value.unsigned_abs().max(*greatest);
                }
                let Some(slots) = tile.get_mut(number / 2) else { continue };
                // Components in range have 15 bits.
                match number % 2 {
                    0 => slots.iter_mut().zip(values).for_each(|(slot, low)| *slot = low & 0xFFFF),
                    _ => slots.iter_mut().zip(values).for_each(|(slot, high)| *slot |= high.wrapping_shl(16)),
                }
            }
            for ((plane, &mean), weights) in out.iter_mut().zip(means).zip(weights) {
                let sums = tile_sums(weights, &tile);
                for (slot, sum) in plane.get_mut(start..).unwrap_or_default().iter_mut().zip(sums) {
                    *slot = join(*slot, mean, sum.wrapping_add(32) >> 6);
                }
            }
        }
        *in_range = greatest.iter().all(|&greatest| greatest <= COMPONENT_RANGE.end().unsigned_abs());
    }
}

/// The values of a tile with their bias, times the steps; 0 where there are none.
#[inline(always)]
fn scaled(plane: &[i32], start: usize, bias: i32, steps: &[i32; TILE]) -> [i32; TILE] {
    let rest = plane.get(start..).unwrap_or_default();
    let mut values = [0; TILE];
    match rest.first_chunk::<TILE>() {
        Some(rest) => {
            for ((slot, &value), &step) in values.iter_mut().zip(rest).zip(steps) {
                *slot = value.wrapping_add(bias).wrapping_mul(step);
            }
        }
        None => {
            for ((slot, &value), &step) in values.iter_mut().zip(rest).zip(steps) {
                *slot = value.wrapping_add(bias).wrapping_mul(step);
            }
        }
    }
    values
}

/// The sums of the products of weights and components. With |weights| at most 4096 and at most 45 components they stay
/// below 2^31.
#[inline(always)]
fn tile_sums(weights: &[i32], tile: &[[i32; TILE]]) -> [i32; TILE] {
    let mut sums = [0_i32; TILE];
    for (&weights, components) in weights.iter().zip(tile) {
        for (sum, &pair) in sums.iter_mut().zip(components) {
            let low = low(pair).wrapping_mul(low(weights));
            *sum = sum.wrapping_add(low.wrapping_add((pair >> 16).wrapping_mul(weights >> 16)));
        }
    }
    sums
}

/// The low half of a pair.
#[inline(always)]
fn low(pair: i32) -> i32 {
    pair.wrapping_shl(16) >> 16
}
