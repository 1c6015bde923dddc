//! How much a picture flickers where nothing moves.

use super::{Mask, assert_same_size, shown};
use crate::rasterise::Rendering;

/// Pixels on a side of a block that is still or not as a whole.
const BLOCK: usize = 8;

/// The most that the mean of a channel over a still block changes from one frame to the next, and the most that a
/// channel of it changes on average. Noise changes pixels more than means, movement both.
const STILL_MEAN: f32 = 4.0 / 255.0;
const STILL: f32 = 24.0 / 255.0;

/// What is summed over a block.
#[derive(Default, Clone, Copy)]
struct Block {
    pixels: f32,
    /// Sum of the changes of each channel, and of their magnitudes over all.
    change: [f32; 3],
    size: f32,
}

impl Block {
    fn is_still(&self) -> bool {
        self.change.iter().all(|change| change.abs() <= STILL_MEAN * self.pixels)
            && self.size <= STILL * 3.0 * self.pixels
    }
}

/// The pixels where nothing moves between two frames of a scene that may be noisy: those in blocks whose mean hardly
/// changes, as far as the scene covers them in either frame.
///
/// # Panics
/// If the sizes differ.
#[must_use]
#[expect(clippy::indexing_slicing, reason = "blocks cover the picture")]
#[expect(clippy::arithmetic_side_effects, reason = "pixels and blocks of a picture in memory")]
pub fn still(before: &Rendering, after: &Rendering) -> Mask {
    let (a, b) = (&before.colour, &after.colour);
    assert_same_size(a, b);
    let width = a.width();
    let across = width.div_ceil(BLOCK);
    let place = |pixel: usize| pixel / width / BLOCK * across + pixel % width / BLOCK;
    let mut blocks = vec![Block::default(); across * a.height().div_ceil(BLOCK)];
    for (pixel, (&a, &b)) in a.pixels().iter().zip(b.pixels()).enumerate() {
        let (a, b) = (a.map(shown), b.map(shown));
        let block = &mut blocks[place(pixel)];
        block.pixels += 1.0;
        for (sum, (a, b)) in block.change.iter_mut().zip(a.iter().zip(b)) {
            *sum += b - a;
            block.size += (b - a).abs();
        }
    }
    let is_still =
        |(pixel, (&a, &b)): (usize, (&f32, &f32))| blocks[place(pixel)].is_still() && a.max(b) > 0.0;
    Mask::of(before.alpha.iter().zip(&after.alpha).enumerate().map(is_still).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Image;

    #[test]
    fn what_moves_and_what_is_empty_is_not_still() {
        let rendering = |level: fn(usize) -> f32, alpha: f32| Rendering {
            colour: Image::new(32, (0..32 * 16).map(|pixel| [level(pixel); 3]).collect()),
            alpha: vec![alpha; 32 * 16],
        };
        let before = rendering(|_| 0.5, 1.0);
        // The left half of the columns changes a lot, the right half by 1 of 255.
        let after = rendering(|pixel| if pixel % 32 < 16 { 0.6 } else { 0.5 + 1.0 / 255.0 }, 1.0);
        let mask = still(&before, &after);
        assert_eq!(mask.count(), 16 * 16);
        assert!(mask.included().iter().enumerate().all(|(pixel, &still)| still == (pixel % 32 >= 16)));
        let empty = rendering(|_| 0.0, 0.0);
        assert_eq!(still(&empty, &empty).count(), 0);
    }
}
