//! Clause 7.5: the motion of one cell, applied to a fine position and a fine rotation.
//!
//! Nothing here overflows: a position lies below 2^26, a centre within 2^27, so an offset is below 2^28; a
//! component of a cell rotation is at most 2^14; then |v x d| < 2^43 and |w t + v x t| < 2^59. A fine rotation is below
//! 2^21, so that sums of products with it stay below 2^38. Values out of range, which a stream cannot have,
//! wrap.

use crate::cell::{Cell, UNIT_MAX, isqrt};

/// A cell made ready to move Gaussians.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Motion {
    /// Middle of the cell, in 64ths of a grid step.
    centre: [i64; 3],
    /// In 64ths of a grid step.
    translation: [i64; 3],
    /// The quaternion, times 2^14: vector and real part.
    vector: [i64; 3],
    real: i64,
}

impl Motion {
    pub(crate) fn of(cell: &Cell, cell_log2: u8) -> Self {
        let size = u32::from(cell_log2).wrapping_add(6);
        let half = 1_i64.wrapping_shl(size) >> 1;
        let vector = cell.rotation.map(i64::from);
        let real = isqrt((1_u64 << 28).saturating_sub(dot(vector, vector).unsigned_abs()));
        Self {
            centre: cell.coordinates.map(|at| i64::from(at).wrapping_shl(size).wrapping_add(half)),
            translation: cell.translation.map(|shift| i64::from(shift).wrapping_mul(8)),
            vector,
            real: real as i64,
        }
    }

    /// Rotates about the centre of the cell, then shifts; a point that would leave the grid stays at its edge.
    pub(crate) fn position(&self, fine: [i32; 3], max: i64) -> [i32; 3] {
        let fine = fine.map(i64::from);
        let across = cross(self.vector, join(fine, self.centre, i64::wrapping_sub));
        let again = cross(self.vector, across);
        let rotated = join(across, again, |across, again| {
            round(self.real.wrapping_mul(across).wrapping_add(again), 27)
        });
        let shift = join(rotated, self.translation, i64::wrapping_add);
        join(fine, shift, i64::wrapping_add).map(|moved| moved.clamp(0, max.max(0)) as i32)
    }

    /// The quaternion product of the rotation of the cell and that of a Gaussian, of the sign that makes its real part positive.
    pub(crate) fn rotation(&self, fine: [i32; 3], unit: i64) -> [i32; 3] {
        let fine = fine.map(i64::from);
        let one = unit.wrapping_mul(64);
        let real = isqrt(one.wrapping_mul(one).wrapping_sub(dot(fine, fine)).max(0).unsigned_abs()) as i64;
        let parts = join(fine, self.vector, |fine, vector| {
            self.real.wrapping_mul(fine).wrapping_add(vector.wrapping_mul(real))
        });
        let rotated = join(parts, cross(self.vector, fine), i64::wrapping_add).map(|sum| round(sum, 14));
        let negative = self.real.wrapping_mul(real) < dot(self.vector, fine);
        let limit = UNIT_MAX.wrapping_mul(64);
        rotated.map(|part| {
            if negative { part.wrapping_neg() } else { part }.clamp(limit.wrapping_neg(), limit) as i32
        })
    }
}

/// Round(value, bits) of clause 4.
fn round(value: i64, bits: u32) -> i64 {
    value.wrapping_add(1_i64.wrapping_shl(bits) >> 1).wrapping_shr(bits)
}

fn join([a, b, c]: [i64; 3], [d, e, f]: [i64; 3], each: impl Fn(i64, i64) -> i64) -> [i64; 3] {
    [each(a, d), each(b, e), each(c, f)]
}

fn dot(left: [i64; 3], right: [i64; 3]) -> i64 {
    join(left, right, i64::wrapping_mul).into_iter().fold(0, i64::wrapping_add)
}

fn cross([a, b, c]: [i64; 3], [d, e, f]: [i64; 3]) -> [i64; 3] {
    let minor = |p: i64, q: i64, r: i64, s: i64| p.wrapping_mul(q).wrapping_sub(r.wrapping_mul(s));
    [minor(b, f, c, e), minor(c, d, a, f), minor(a, e, b, d)]
}
