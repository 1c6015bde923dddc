//! Clauses 7.7 and 7.8: colour components to colour, by an integer transform.

use crate::attribute::in_range;
use crate::layout::ShCoding;
use core::ops::RangeInclusive;
use splatstream_format::payload::{Codebook, Transform};
use splatstream_format::{Error, ErrorKind, Result};

/// The values of a component.
pub const COMPONENT_RANGE: RangeInclusive<i32> = -8191..=8191;

/// Gaussians transformed at a time: their sums stay in registers.
const TILE: usize = 32;

/// Everything a unit needs to turn components into colour.
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
    /// SH planes of a frame of this sequence.
    pub sh_planes: usize,
}

/// Red, green and blue, and the SH planes.
pub type ColourPlanes = ([Vec<i32>; 3], Vec<Vec<i32>>);

impl Colour<'_> {
    /// The dc planes and the SH planes of `count` Gaussians.
    ///
    /// # Errors
    /// Invalid if a component is out of range or an index names no entry.
    pub fn reconstruct(
        &self,
        dc: &[Vec<i32>],
        sh: &[Vec<i32>],
        count: usize,
        at: u64,
    ) -> Result<ColourPlanes> {
        let mut colour = inverse(self.dc, dc, count, at)?.into_iter();
        let mut next = || colour.next().unwrap_or_default();
        let dc = [next(), next(), next()];
        let sh = match (self.mode, self.sh) {
            (ShCoding::Coefficients { .. }, Some(transform)) => inverse(transform, sh, count, at)?,
            (ShCoding::VectorQuantised { .. }, Some(transform)) => {
                inverse(transform, &self.entries(sh, usize::from(transform.header.rank), at)?, count, at)?
            }
            _ => vec![vec![0; count]; self.sh_planes],
        };
        Ok((dc, sh))
    }

    /// Clause 7.8. Adds up the codebook entries of the stages; the sum is clamped.
    fn entries(&self, indices: &[Vec<i32>], rank: usize, at: u64) -> Result<Vec<Vec<i32>>> {
        let count = indices.first().map_or(0, Vec::len);
        let mut components = vec![vec![0_i32; count]; rank];
        for (stage, codebook) in indices.iter().zip(self.codebooks.iter().flatten()) {
            let largest = codebook.entries.len().checked_div(rank).unwrap_or(0).saturating_sub(1);
            in_entries(stage, largest, at)?;
            for (component, plane) in components.iter_mut().enumerate() {
                for (sum, &index) in plane.iter_mut().zip(stage) {
                    let place = (index as usize).wrapping_mul(rank).wrapping_add(component);
                    let value = codebook.entries.get(place).copied().unwrap_or(0);
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
            "7.8",
            ErrorKind::OutOfRange { element: "vq_index", value: i64::from(index), min: 0, max },
        )),
    }
}

/// out_j = mean_j + Round(sum over k of basis[k][j] * component_k, 6).
///
/// # Errors
/// Invalid if a component leaves -8191..=8191. With |basis| at most 4096 and at most 45 components the sum
/// stays below 2^31.
pub fn inverse(
    transform: &Transform,
    components: &[Vec<i32>],
    count: usize,
    at: u64,
) -> Result<Vec<Vec<i32>>> {
    let dimension = usize::from(transform.header.dimension);
    for plane in components {
        in_range(plane, &COMPONENT_RANGE, "component", "7.7", at)?;
    }
    let mut planes: Vec<Vec<i32>> = (0..dimension).map(|_| Vec::with_capacity(count)).collect();
    let mut tile = vec![[0_i16; TILE]; components.len()];
    let mut start = 0_usize;
    while start < count {
        let width = TILE.min(count.wrapping_sub(start));
        for (tile, plane) in tile.iter_mut().zip(components) {
            for (value, &component) in tile.iter_mut().zip(plane.get(start..).unwrap_or_default()) {
                *value = component as i16;
            }
        }
        for (axis, (plane, &mean)) in planes.iter_mut().zip(&transform.mean).enumerate() {
            let sums = tile_sums(transform, axis, dimension, &tile);
            let rounded = sums.iter().take(width).map(|&sum| mean.wrapping_add(sum.wrapping_add(32) >> 6));
            plane.extend(rounded);
        }
        start = start.wrapping_add(TILE);
    }
    Ok(planes)
}

#[inline(always)]
fn tile_sums(transform: &Transform, axis: usize, dimension: usize, tile: &[[i16; TILE]]) -> [i32; TILE] {
    let mut sums = [0_i32; TILE];
    for (row, components) in transform.basis.chunks_exact(dimension.max(1)).zip(tile) {
        let weight = i32::from(row.get(axis).copied().unwrap_or(0));
        for (sum, &component) in sums.iter_mut().zip(components) {
            *sum = sum.wrapping_add(weight.wrapping_mul(i32::from(component)));
        }
    }
    sums
}
