//! Weighted sums of planes: how colours change their basis, there and back.
//!
//! Some Gaussians come after the others, so few that all their values stay in the first-level cache, and a sum stays in registers
//! until every input is in it. It takes its inputs in their order, so that it is the same on every machine.
#![expect(clippy::arithmetic_side_effects, reason = "lengths of what is in memory, and sums of floats")]

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

/// Gaussians of a tile.
pub(crate) const TILE: usize = 1 << 8;
/// Sums that are taken at the same time.
const LANES: usize = 1 << 5;
/// Gaussians that a thread takes at once: whole tiles.
const PART: usize = 1 << 12;

/// The values that some Gaussians have in a plane; those of a last tile may be fewer, and what stands behind them is no matter.
pub(crate) type Tile = [f32; TILE];

/// What outputs are made of inputs.
pub(crate) struct Combination {
    /// Taken off each input.
    pub(crate) before: Vec<f32>,
    /// The weights of all inputs, for each output.
    pub(crate) weights: Vec<Vec<f32>>,
    /// What the sum of each output starts with.
    pub(crate) start: Vec<f32>,
}

impl Combination {
    /// Planes of the outputs, from planes of the inputs.
    pub(crate) fn of(&self, planes: &[&[f32]]) -> Vec<Vec<f32>> {
        let count = planes.first().map_or(0, |plane| plane.len());
        let arch = Arch::new();
        assembled(count, self.weights.len(), |first, outputs| self.tile(arch, planes, first, outputs))
    }

    /// The outputs of the tile that starts with a Gaussian.
    pub(crate) fn tile(&self, arch: Arch, planes: &[&[f32]], first: usize, outputs: &mut [Tile]) {
        let mut inputs = vec![[0.0; TILE]; planes.len()];
        for ((input, plane), &before) in inputs.iter_mut().zip(planes).zip(&self.before) {
            let values = plane.get(first..).unwrap_or_default();
            input.iter_mut().zip(values).for_each(|(input, &value)| *input = value - before);
        }
        self.sums(arch, &inputs, outputs);
    }

    /// The same of inputs of which what is to be taken off has been.
    pub(crate) fn sums(&self, arch: Arch, inputs: &[Tile], outputs: &mut [Tile]) {
        arch.dispatch(Sums { combination: self, inputs, outputs });
    }
}

struct Sums<'a> {
    combination: &'a Combination,
    inputs: &'a [Tile],
    outputs: &'a mut [Tile],
}

impl WithSimd for Sums<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { combination: Combination { weights, start, .. }, inputs, outputs } = self;
        for ((output, weights), &start) in outputs.iter_mut().zip(weights).zip(start) {
            for (lanes, sums) in output.as_chunks_mut::<LANES>().0.iter_mut().enumerate() {
                let mut totals = [start; LANES];
                for (input, &weight) in inputs.iter().zip(weights) {
                    let Some(values) = input.as_chunks::<LANES>().0.get(lanes) else { continue };
                    totals.iter_mut().zip(values).for_each(|(total, value)| *total += weight * value);
                }
                *sums = totals;
            }
        }
    }
}

/// Planes of so many Gaussians, tile by tile: `tile` is given the first Gaussian of each, and the tiles of all planes.
pub(crate) fn assembled(
    count: usize,
    planes: usize,
    tile: impl Fn(usize, &mut [Tile]) + Sync,
) -> Vec<Vec<f32>> {
    let mut whole: Vec<Vec<f32>> = (0..planes).map(|_| vec![0.0; count]).collect();
    // Each part of the Gaussians has a part of every plane.
    let mut chunks: Vec<_> = whole.iter_mut().map(|plane| plane.chunks_mut(PART)).collect();
    let part = |_| -> Vec<&mut [f32]> { chunks.iter_mut().filter_map(Iterator::next).collect() };
    let parts: Vec<Vec<&mut [f32]>> = (0..count.div_ceil(PART)).map(part).collect();
    parts.into_par_iter().enumerate().for_each(|(number, part)| {
        let mut tiles = vec![[0.0; TILE]; planes];
        let mut places: Vec<_> = part.into_iter().map(|plane| plane.chunks_mut(TILE)).collect();
        for first in (number * PART..count.min((number + 1) * PART)).step_by(TILE) {
            tile(first, &mut tiles);
            for (places, tile) in places.iter_mut().zip(&tiles) {
                let values = places.next().into_iter().flatten();
                values.zip(tile).for_each(|(value, &of_tile)| *value = of_tile);
            }
        }
    });
    whole
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_those_of_the_inputs_in_their_order() {
        let planes: Vec<Vec<f32>> = (0..5)
            .map(|plane| (0..700).map(|row| (row * (plane + 3) % 101) as f32 / 7.0).collect())
            .collect();
        let planes: Vec<&[f32]> = planes.iter().map(Vec::as_slice).collect();
        let weights: Vec<Vec<f32>> =
            (0..3).map(|output| (0..5).map(|input| (output * 5 + input) as f32 / 11.0).collect()).collect();
        let combination =
            Combination { before: vec![0.5, -1.0, 2.0, 0.0, 3.25], weights, start: vec![0.0, 1.5, -4.0] };
        let outputs = combination.of(&planes);
        for (output, (weights, &start)) in
            outputs.iter().zip(combination.weights.iter().zip(&combination.start))
        {
            for row in 0..700 {
                let terms = weights.iter().zip(&planes).zip(&combination.before);
                let sum =
                    terms.fold(start, |sum, ((weight, plane), before)| sum + weight * (plane[row] - before));
                assert_eq!(output[row].to_bits(), sum.to_bits());
            }
        }
        assert_eq!(outputs.iter().map(Vec::len).collect::<Vec<_>>(), [700; 3]);
    }
}
