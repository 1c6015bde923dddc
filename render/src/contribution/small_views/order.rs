//! The order in which Gaussians are blended.
#![expect(clippy::arithmetic_side_effects, reason = "floats; counts of Gaussians in memory")]
#![expect(
    clippy::indexing_slicing,
    reason = "digits are below the number of buckets, slots those of the Gaussians"
)]

use super::ellipses::{LEAST_ALPHA, dot};
use super::rows::Rows;
use crate::camera::Camera;
use core::ops::Range;

/// Bits of depth that are sorted by in a round.
const DIGIT: u32 = 11;
const BUCKETS: usize = 1 << DIGIT;

/// Gaussians that may show, nearest first; of those at one depth, nearly, the first in the frame.
#[derive(Default)]
pub(super) struct Order {
    /// A key that rises with the depth, and the place among the Gaussians that are left.
    all: Vec<(u32, u32)>,
    /// The same while it is sorted.
    sorted: Vec<(u32, u32)>,
}

impl Order {
    /// Of the Gaussians that are left, without those before the least depth that is drawn and those that are too faint.
    #[inline(always)]
    pub(super) fn find(&mut self, left: &Rows, camera: &Camera, near: f32) {
        let ([.., ahead], from) = (camera.rotation, camera.position);
        self.all.clear();
        // Many views look at as many as there are.
        self.all.reserve_exact(left.len());
        for ((position, opacity), place) in left.positions().zip(0..) {
            let depth = dot(ahead, [0, 1, 2].map(|axis: usize| position[axis] - from[axis]));
            if depth >= near && depth < f32::INFINITY && opacity >= LEAST_ALPHA {
                // Depths are positive: their bits order as they do.
                self.all.push((depth.to_bits(), place));
            }
        }
        self.sort();
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.all.len()
    }

    /// Some of them, the nearest first: keys and places.
    #[inline(always)]
    pub(super) fn nearest(&self, some: Range<usize>) -> &[(u32, u32)] {
        &self.all[some]
    }

    /// Two rounds of sorting by counting, by the 22 highest bits in which depths differ.
    #[inline(always)]
    fn sort(&mut self) {
        let Self { all, sorted } = self;
        let depths = || all.iter().map(|&(depth, _)| depth);
        let (least, most) = (depths().min().unwrap_or_default(), depths().max().unwrap_or_default());
        let shift = (u32::BITS - (most - least).leading_zeros()).saturating_sub(2 * DIGIT);
        all.iter_mut().for_each(|(depth, _)| *depth = (*depth - least) >> shift);
        sorted.clear();
        sorted.reserve_exact(all.len());
        sorted.resize(all.len(), (0, 0));
        for digit in 0..2 {
            let bucket = |key: u32| (key >> (digit * DIGIT)) as usize % BUCKETS;
            let mut starts = [0; BUCKETS + 1];
            all.iter().for_each(|&(key, _)| starts[bucket(key) + 1] += 1);
            (0..BUCKETS).for_each(|bucket| starts[bucket + 1] += starts[bucket]);
            for &(key, place) in all.iter() {
                let slot = &mut starts[bucket(key)];
                sorted[*slot] = (key, place);
                *slot += 1;
            }
            core::mem::swap(all, sorted);
        }
    }
}
