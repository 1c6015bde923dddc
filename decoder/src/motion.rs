//! Clause 7.5: the motion of one cell, applied to a fine position and a fine rotation.
//!
//! A position lies below 2^26, the centre of a cell below 2^27, so that an offset is below 2^28. With v the vector and w the
//! real part of the rotation, |v| and w at most 2^14, the clause asks for `w (v x d) + v x (v x d)`: this is a matrix
//! times d, and its elements `w [v] + v v^T - |v|^2` are at most 2^29. So products have factors of 32 bits, their sums
//! stay below 2^60, and what is left after rounding is below 2^31. A fine rotation is below 2^21, so that sums of products
//! with it stay below 2^38. Values out of range, which a stream cannot have, wrap.

use crate::cell::{Cell, UNIT_MAX, isqrt};
use crate::vector::{Task, vectorized};
use splatstream_format::entropy::machine::Machine;

#[cfg(all(target_arch = "wasm32", target_feature = "simd128", not(feature = "portable")))]
mod simd128;

/// Gaussians moved at a time by the instructions of the machine.
const LANES: usize = 16;
/// Gaussians for which it is not worth it.
const FEW: usize = 4;

/// A cell made ready to move Gaussians.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Motion {
    /// Middle of the cell, in 64ths of a grid step.
    centre: [i32; 3],
    /// In 64ths of a grid step.
    translation: [i32; 3],
    /// What the rotation adds to an offset from the centre, times 2^27: a matrix, row by row.
    turn: [[i32; 3]; 3],
    /// log2 of the side of the cell.
    #[cfg(all(target_arch = "wasm32", target_feature = "simd128", not(feature = "portable")))]
    cell_log2: u8,
    /// The quaternion, times 2^14: vector and real part.
    vector: [i32; 3],
    real: i32,
}

/// The grids that Gaussians are moved on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bounds {
    /// The largest fine position.
    pub(crate) position: i32,
    /// 1 in fine rotations, at most 2^21.
    pub(crate) one: i32,
}

/// The fine positions and fine rotations of some Gaussians: six planes of one length.
pub(crate) type Planes<'p> = ([&'p mut [i32]; 3], [&'p mut [i32]; 3]);

impl Motion {
    pub(crate) fn of(cell: &Cell, cell_log2: u8) -> Self {
        let size = u32::from(cell_log2).wrapping_add(6);
        let half = 1_i64.wrapping_shl(size) >> 1;
        let vector = cell.rotation.map(i64::from);
        let square = dot(vector, vector);
        let real = isqrt((1_u64 << 28).saturating_sub(square.unsigned_abs())) as i64;
        let [x, y, z] = vector;
        let across = [[0, z.wrapping_neg(), y], [z, 0, x.wrapping_neg()], [y.wrapping_neg(), x, 0]];
        let mut turn = [[0; 3]; 3];
        for (i, ((row, across), &v)) in turn.iter_mut().zip(across).zip(&vector).enumerate() {
            for (j, ((slot, across), &w)) in row.iter_mut().zip(across).zip(&vector).enumerate() {
                let diagonal = if i == j { square } else { 0 };
                let twice = v.wrapping_mul(w).wrapping_sub(diagonal);
                *slot = real.wrapping_mul(across).wrapping_add(twice) as i32;
            }
        }
        Self {
            centre: cell.coordinates.map(|at| i64::from(at).wrapping_shl(size).wrapping_add(half) as i32),
            translation: cell.translation.map(|shift| shift.wrapping_mul(8)),
            turn,
            #[cfg(all(target_arch = "wasm32", target_feature = "simd128", not(feature = "portable")))]
            cell_log2,
            vector: cell.rotation,
            real: real as i32,
        }
    }

    /// Rotates about the centre of the cell, then shifts; a point that would leave the grid stays at its edge.
    #[inline(always)]
    pub(crate) fn position(&self, fine: [i32; 3], bounds: Bounds) -> [i32; 3] {
        let offset = join(fine, self.centre, i32::wrapping_sub);
        let offset = offset.map(i64::from);
        let rotated = self.turn.map(|row| round(dot(row.map(i64::from), offset), 27));
        let shift = join(rotated, self.translation, i32::wrapping_add);
        join(fine, shift, i32::wrapping_add).map(|moved| moved.min(bounds.position).max(0))
    }

    /// The quaternion product of the rotation of the cell and that of a Gaussian, of the sign that makes its real part positive.
    #[inline(always)]
    pub(crate) fn rotation(&self, fine: [i32; 3], bounds: Bounds) -> [i32; 3] {
        let real = i64::from(real_part(fine, bounds.one));
        let own = i64::from(self.real);
        let (fine, vector) = (fine.map(i64::from), self.vector.map(i64::from));
        let parts =
            join(fine, vector, |fine, vector| own.wrapping_mul(fine).wrapping_add(vector.wrapping_mul(real)));
        let rotated = join(parts, cross(vector, fine), i64::wrapping_add).map(|sum| round(sum, 14));
        let negative = own.wrapping_mul(real) < dot(vector, fine);
        rotated.map(|part| limited(if negative { part.wrapping_neg() } else { part }))
    }

    /// Whether it rotates.
    fn rotates(&self) -> bool {
        self.vector != [0; 3]
    }

    /// Moves Gaussians that lie in the cell.
    pub(crate) fn displace(&self, (position, rotation): Planes<'_>, bounds: Bounds) {
        let ([xs, ys, zs], [r0, r1, r2]) = (position, rotation);
        if xs.len() < FEW {
            let positions = xs.iter_mut().zip(ys).zip(zs);
            for (((x, y), z), ((a, b), c)) in positions.zip(r0.iter_mut().zip(r1).zip(r2)) {
                [*x, *y, *z] = self.position([*x, *y, *z], bounds);
                [*a, *b, *c] = self.rotation([*a, *b, *c], bounds);
            }
            return;
        }
        #[cfg(all(target_arch = "wasm32", target_feature = "simd128", not(feature = "portable")))]
        if self.rotates() && self.cell_log2 <= simd128::MAX_CELL_LOG2 {
            return simd128::displace(self, ([xs, ys, zs], [r0, r1, r2]), bounds);
        }
        vectorized(Displace { motion: self, planes: ([xs, ys, zs], [r0, r1, r2]), bounds });
    }
}

/// The same for many Gaussians.
struct Displace<'m, 'p> {
    motion: &'m Motion,
    planes: Planes<'p>,
    bounds: Bounds,
}

impl Task for Displace<'_, '_> {
    #[inline(always)]
    fn run(self, _: impl Machine) {
        let Self { motion, planes: (position, rotation), bounds } = self;
        each_run(position, Positions { motion, bounds });
        // Without a rotation of the cell the quaternion product is what it was.
        match motion.rotates() {
            true => each_run(rotation, Rotations { motion, bounds }),
            false => rotation.into_iter().flatten().for_each(|part| *part = limited(*part)),
        }
    }
}

/// What changes three values.
trait Change {
    fn of(&self, values: [i32; 3]) -> [i32; 3];
}

struct Positions<'m> {
    motion: &'m Motion,
    bounds: Bounds,
}

impl Change for Positions<'_> {
    #[inline(always)]
    fn of(&self, fine: [i32; 3]) -> [i32; 3] {
        self.motion.position(fine, self.bounds)
    }
}

struct Rotations<'m> {
    motion: &'m Motion,
    bounds: Bounds,
}

impl Change for Rotations<'_> {
    #[inline(always)]
    fn of(&self, fine: [i32; 3]) -> [i32; 3] {
        self.motion.rotation(fine, self.bounds)
    }
}

/// Changes three planes, [`LANES`] values of each at a time, in arrays that nothing else can see.
#[inline(always)]
fn each_run(planes: [&mut [i32]; 3], change: impl Change) {
    let [xs, ys, zs] = planes;
    for ((x, y), z) in xs.chunks_mut(LANES).zip(ys.chunks_mut(LANES)).zip(zs.chunks_mut(LANES)) {
        let mut planes = [[0; LANES]; 3];
        let mut own = [x, y, z];
        for (values, plane) in planes.iter_mut().zip(&own) {
            values.iter_mut().zip(plane.iter()).for_each(|(value, &from)| *value = from);
        }
        let [to_x, to_y, to_z] = &mut planes;
        for ((x, y), z) in to_x.iter_mut().zip(to_y).zip(to_z) {
            [*x, *y, *z] = change.of([*x, *y, *z]);
        }
        for (values, plane) in planes.iter().zip(&mut own) {
            plane.iter_mut().zip(values).for_each(|(slot, &value)| *slot = value);
        }
    }
}

/// The real part of a rotation: `isqrt(max(0, one^2 - |fine|^2))`.
///
/// All sums are integers below 2^44, which an f64 holds exactly, and the argument of the root is at most 2^42. The root of
/// an integer below `k^2`, `k` at most 2^21, is less than `k` by 2^-22 or more, and an f64 next to it is 2^-32 apart: so
/// its integer part is exact, on every machine.
#[inline(always)]
#[expect(clippy::float_arithmetic, reason = "every result is an exact integer")]
fn real_part(fine: [i32; 3], one: i32) -> i32 {
    let [x, y, z] = fine.map(f64::from);
    let one = f64::from(one);
    let square = one * one - (x * x + y * y + z * z);
    // A choice: WebAssembly has the greater of two by a call. The root is at most 2^21, not negative.
    let square = if square > 0.0 { square } else { 0.0 };
    square.sqrt() as i32
}

/// A fine rotation in its range.
#[inline(always)]
fn limited(part: i32) -> i32 {
    const LIMIT: i32 = UNIT_MAX as i32 * 64;
    part.clamp(-LIMIT, LIMIT)
}

/// The low 32 bits of Round(value, bits) of clause 4.
#[inline(always)]
fn round(value: i64, bits: u32) -> i32 {
    value.wrapping_add(1_i64.wrapping_shl(bits) >> 1).wrapping_shr(bits) as i32
}

#[inline(always)]
fn join<T: Copy, U>([a, b, c]: [T; 3], [d, e, f]: [T; 3], each: impl Fn(T, T) -> U) -> [U; 3] {
    [each(a, d), each(b, e), each(c, f)]
}

#[inline(always)]
fn dot(left: [i64; 3], right: [i64; 3]) -> i64 {
    join(left, right, i64::wrapping_mul).into_iter().fold(0, i64::wrapping_add)
}

#[inline(always)]
fn cross([a, b, c]: [i64; 3], [d, e, f]: [i64; 3]) -> [i64; 3] {
    let minor = |p: i64, q: i64, r: i64, s: i64| p.wrapping_mul(q).wrapping_sub(r.wrapping_mul(s));
    [minor(b, f, c, e), minor(c, d, a, f), minor(a, e, b, d)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[expect(clippy::arithmetic_side_effects, reason = "an overflow is a failed test")]
    fn by_integers(fine: [i32; 3], one: i32) -> u64 {
        let fine = fine.map(i64::from);
        let one = i64::from(one);
        isqrt((one * one - dot(fine, fine)).max(0).unsigned_abs())
    }

    /// Clause 7.5 word for word: products of the vector, one after the other.
    #[expect(clippy::arithmetic_side_effects, reason = "an overflow is a failed test")]
    fn by_products(cell: &Cell, cell_log2: u8, fine: [i32; 3]) -> [i64; 3] {
        let half = (1_i64 << (cell_log2 + 6)) >> 1;
        let v = cell.rotation.map(i64::from);
        let w = isqrt((1 << 28) - dot(v, v).unsigned_abs()) as i64;
        let centre = cell.coordinates.map(|at| (i64::from(at) << (cell_log2 + 6)) + half);
        let across = cross(v, join(fine.map(i64::from), centre, |fine, centre| fine - centre));
        let again = cross(v, across);
        let rotated = join(across, again, |across, again| (w * across + again + (1 << 26)) >> 27);
        let shift = join(rotated, cell.translation.map(i64::from), |rotated, shift| rotated + 8 * shift);
        join(fine.map(i64::from), shift, |fine, shift| (fine + shift).clamp(0, LAST.into()))
    }

    /// A position of the second cell along each axis: offsets reach from one side, rounded, to the other.
    #[expect(clippy::arithmetic_side_effects, reason = "an overflow is a failed test")]
    fn inside(cell_log2: u8, fine: [i32; 3]) -> [i32; 3] {
        let side = 1 << (cell_log2 + 6);
        fine.map(|part| part % side + side - 32)
    }

    /// The largest fine position of 20 bits.
    const LAST: i32 = ((1 << 20) - 1) << 6;

    #[test]
    fn roots_next_to_squares_are_those_of_integers() {
        for root in (1..1 << 21).step_by(977).chain([2, 3, (1 << 21) - 1, 1 << 21]) {
            // one^2 - x^2 - y^2 is root^2 for x = y = 0, and a little less for small x and y.
            for fine in [[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 1]] {
                assert_eq!(real_part(fine, root) as u64, by_integers(fine, root), "{root} {fine:?}");
            }
        }
    }

    proptest! {
        #[test]
        fn a_matrix_moves_as_products_do(
            coordinates in [0_u32..32, 0_u32..32, 0_u32..32],
            translation in [-1_048_576..=1_048_576, -1_048_576..=1_048_576, -1_048_576..=1_048_576],
            rotation in [-8192..=8192, -8192..=8192, -8192..=8192],
            fine in [0..=LAST, 0..=LAST, 0..=LAST],
        ) {
            let cell = Cell { coordinates, translation, rotation, stale: false };
            let moved = Motion::of(&cell, 15).position(fine, Bounds { position: LAST, one: 1 << 20 });
            prop_assert_eq!(moved.map(i64::from), by_products(&cell, 15, fine));
        }

        #[test]
        fn planes_move_as_each_gaussian_does(
            cell_log2 in 3_u8..=20,
            translation in [-1_048_576..=1_048_576, -1_048_576..=1_048_576, -1_048_576..=1_048_576],
            rotation in [-8192..=8192, -8192..=8192, -8192..=8192],
            gaussians in proptest::collection::vec(
                ([0..1 << 26, 0..1 << 26, 0..1 << 26], [-2_097_088..=2_097_088, -2_097_088..=2_097_088, -2_097_088..=2_097_088]),
                1..40,
            ),
            (shift, one) in (0..21, 0..=1 << 21),
        ) {
            let gaussians: Vec<([i32; 3], [i32; 3])> = gaussians
                .into_iter()
                .map(|(position, rotation)| (inside(cell_log2, position), rotation.map(|part| part >> shift)))
                .collect();
            let cell = Cell { coordinates: [1; 3], translation, rotation, stale: false };
            let (motion, bounds) = (Motion::of(&cell, cell_log2), Bounds { position: LAST, one });
            let plane = |axis: usize| -> Vec<i32> { gaussians.iter().map(|(position, _)| position[axis]).collect() };
            let turned = |axis: usize| -> Vec<i32> { gaussians.iter().map(|(_, rotation)| rotation[axis]).collect() };
            let (mut positions, mut rotations) = ([0, 1, 2].map(plane), [0, 1, 2].map(turned));
            let planes = (positions.each_mut().map(Vec::as_mut_slice), rotations.each_mut().map(Vec::as_mut_slice));
            motion.displace(planes, bounds);
            for (at, &(position, rotation)) in gaussians.iter().enumerate() {
                let moved = [0, 1, 2].map(|axis| positions[axis][at]);
                prop_assert_eq!(moved, motion.position(position, bounds));
                let turned = [0, 1, 2].map(|axis| rotations[axis][at]);
                prop_assert_eq!(turned, motion.rotation(rotation, bounds));
            }
        }

        #[test]
        fn the_real_part_is_the_root_of_integers(
            one in 0..=1 << 21,
            fine in [-2_097_088..=2_097_088, -2_097_088..=2_097_088, -2_097_088..=2_097_088],
        ) {
            prop_assert_eq!(real_part(fine, one) as u64, by_integers(fine, one));
            let small = fine.map(|part| part / 2);
            prop_assert_eq!(real_part(small, one) as u64, by_integers(small, one));
        }
    }
}
