//! Clause 7.5 with the vectors of WebAssembly.
//!
//! Integers of 64 bits have no product in one instruction there, and f64 have. With sides of cells up to 2^17 grid steps an
//! offset is at most 2^22 + 32, and an element of the matrix at most 2^28, so that sums of products are integers below
//! 2^52; those of rotations are below 2^38. An f64 holds them exactly, and half of their last bit more, which makes halves
//! round up: the results are those of the integers.

use super::{Bounds, Motion, Planes};
use crate::cell::UNIT_MAX;
use crate::vector::halves;
use core::arch::wasm32::{
    f64x2_add, f64x2_lt, f64x2_mul, f64x2_pmax, f64x2_splat, f64x2_sqrt, f64x2_sub, i32x4_add, i32x4_max,
    i32x4_min, i32x4_shuffle, i32x4_splat, i32x4_sub, v128, v128_and, v128_xor,
};
use pulp::cast;

/// Sides of cells, as log2 of grid steps, up to which positions are exact in f64.
pub(super) const MAX_CELL_LOG2: u8 = 17;
/// Gaussians of a vector of i32.
const FOUR: usize = 4;
/// 2^52 + 2^51: what an f64 of a magnitude below 2^51 becomes by adding this is rounded to an integer, whose low 32 bits
/// are those of the sum.
const TO_INTEGER: f64 = 6_755_399_441_055_744.0;
/// Half of the last bit of the sums of positions and of rotations, once they are divided by 2^27 and 2^14.
const HALF_OF_27: f64 = 1.0 / 268_435_456.0;
const HALF_OF_14: f64 = 1.0 / 32_768.0;

/// Moves Gaussians that lie in a cell that rotates.
pub(super) fn displace(motion: &Motion, (position, rotation): Planes<'_>, bounds: Bounds) {
    each_four(position, Positions::new(motion, bounds));
    each_four(rotation, Rotations::new(motion, bounds));
}

/// What changes three vectors of i32.
trait Change {
    fn of(&self, values: [v128; 3]) -> [v128; 3];
}

/// Changes three planes.
#[inline(always)]
fn each_four([xs, ys, zs]: [&mut [i32]; 3], change: impl Change) {
    for ((x, y), z) in xs.chunks_mut(FOUR).zip(ys.chunks_mut(FOUR)).zip(zs.chunks_mut(FOUR)) {
        let mut own = [x, y, z];
        let changed = change.of(own.each_ref().map(|part| loaded(part)));
        for (part, values) in own.iter_mut().zip(changed) {
            let values: [i32; FOUR] = cast(values);
            match part.first_chunk_mut() {
                Some(slots) => *slots = values,
                None => part.iter_mut().zip(values).for_each(|(slot, value)| *slot = value),
            }
        }
    }
}

/// Four values, or as many as there are and zeros.
#[inline(always)]
fn loaded(values: &[i32]) -> v128 {
    let few = || {
        let mut all = [0; FOUR];
        all.iter_mut().zip(values).for_each(|(slot, &value)| *slot = value);
        all
    };
    cast(values.first_chunk::<FOUR>().copied().unwrap_or_else(few))
}

/// Four integers that were rounded by adding [`TO_INTEGER`].
#[inline(always)]
fn integers([first, last]: [v128; 2]) -> v128 {
    i32x4_shuffle::<0, 2, 4, 6>(first, last)
}

/// The sum of the products of two vectors.
#[inline(always)]
fn dot([a, b, c]: [v128; 3], [x, y, z]: [v128; 3]) -> v128 {
    f64x2_add(f64x2_add(f64x2_mul(a, x), f64x2_mul(b, y)), f64x2_mul(c, z))
}

/// [`Motion::position`].
struct Positions {
    centre: [v128; 3],
    translation: [v128; 3],
    /// Without the factor 2^27.
    turn: [[v128; 3]; 3],
    last: v128,
}

#[expect(clippy::float_arithmetic, reason = "powers of two")]
impl Positions {
    fn new(motion: &Motion, bounds: Bounds) -> Self {
        Self {
            centre: motion.centre.map(|part| i32x4_splat(part)),
            translation: motion.translation.map(|part| i32x4_splat(part)),
            turn: motion.turn.map(|row| row.map(|part| f64x2_splat(f64::from(part) / 134_217_728.0))),
            last: i32x4_splat(bounds.position),
        }
    }
}

impl Change for Positions {
    #[inline(always)]
    fn of(&self, fine: [v128; 3]) -> [v128; 3] {
        let ([x, y, z], [a, b, c]) = (fine, self.centre);
        let [x, y, z] = [(x, a), (y, b), (z, c)].map(|(fine, centre)| halves(i32x4_sub(fine, centre)));
        let offsets = [[x[0], y[0], z[0]], [x[1], y[1], z[1]]];
        let mut moved = fine;
        for ((fine, row), &translation) in moved.iter_mut().zip(&self.turn).zip(&self.translation) {
            // The half and the integer part are added one after the other: their sum is none of an f64.
            let turned = offsets.map(|offset| {
                let sum = f64x2_add(dot(*row, offset), f64x2_splat(HALF_OF_27));
                f64x2_add(sum, f64x2_splat(TO_INTEGER))
            });
            let to = i32x4_add(*fine, i32x4_add(integers(turned), translation));
            *fine = i32x4_max(i32x4_min(to, self.last), i32x4_splat(0));
        }
        moved
    }
}

/// [`Motion::rotation`].
struct Rotations {
    /// The quaternion of the cell: vector and real part.
    vector: [v128; 3],
    real: v128,
    /// The square of 1 in fine rotations.
    square: v128,
}

#[expect(clippy::float_arithmetic, reason = "an exact integer")]
impl Rotations {
    fn new(motion: &Motion, bounds: Bounds) -> Self {
        let one = f64::from(bounds.one);
        Self {
            vector: motion.vector.map(|part| f64x2_splat(part.into())),
            real: f64x2_splat(motion.real.into()),
            square: f64x2_splat(one * one),
        }
    }

    /// The products for two Gaussians, rounded by adding [`TO_INTEGER`].
    #[inline(always)]
    fn product(&self, fine: [v128; 3]) -> [v128; 3] {
        let ([a, b, c], [x, y, z], own) = (self.vector, fine, self.real);
        let rest = f64x2_pmax(f64x2_splat(0.0), f64x2_sub(self.square, dot(fine, fine)));
        // A root is an integer, or differs from every integer by 2^-22 or more: with a little less than a half taken away it
        // is rounded to its integer part.
        let root = f64x2_sub(f64x2_sqrt(rest), f64x2_splat(0.5 - 1.0 / 16_777_216.0));
        let real = f64x2_sub(f64x2_add(root, f64x2_splat(TO_INTEGER)), f64x2_splat(TO_INTEGER));
        let is_negative = f64x2_lt(f64x2_mul(own, real), dot(self.vector, fine));
        let sign = v128_and(is_negative, f64x2_splat(-0.0));
        let part = |fine, vector, (p, q), (r, s)| {
            let sum = f64x2_add(f64x2_mul(own, fine), f64x2_mul(vector, real));
            let sum = f64x2_add(sum, f64x2_sub(f64x2_mul(p, q), f64x2_mul(r, s)));
            // Halves are rounded up before the sign is chosen.
            let sum = f64x2_add(f64x2_mul(sum, f64x2_splat(1.0 / 16_384.0)), f64x2_splat(HALF_OF_14));
            let rounded = f64x2_sub(f64x2_add(sum, f64x2_splat(TO_INTEGER)), f64x2_splat(TO_INTEGER));
            f64x2_add(v128_xor(rounded, sign), f64x2_splat(TO_INTEGER))
        };
        [part(x, a, (b, z), (c, y)), part(y, b, (c, x), (a, z)), part(z, c, (a, y), (b, x))]
    }
}

impl Change for Rotations {
    #[inline(always)]
    fn of(&self, fine: [v128; 3]) -> [v128; 3] {
        const LIMIT: i32 = UNIT_MAX as i32 * 64;
        let [x, y, z] = fine.map(halves);
        let first = self.product([x[0], y[0], z[0]]);
        let last = self.product([x[1], y[1], z[1]]);
        let ([a, b, c], [d, e, f]) = (first, last);
        [[a, d], [b, e], [c, f]]
            .map(|rounded| i32x4_max(i32x4_min(integers(rounded), i32x4_splat(LIMIT)), i32x4_splat(-LIMIT)))
    }
}
