//! Rigid motions, and those that bring points to their places best.

use crate::quantile::ranked;

/// Grid steps.
pub(super) type Vector = [f64; 3];

/// A point of the reference and where it went.
#[derive(Debug, Clone, Copy)]
pub(super) struct Point {
    /// Before.
    pub(super) from: Vector,
    /// After.
    pub(super) to: Vector,
}

/// The most points of one cell that a fit looks at; more change a motion by less than its coded precision.
const FITTED: usize = 512;

/// The most points that a median is taken of.
const MEDIAN: usize = 127;

/// How many points without motion of their own the motion before counts as.
const PRIOR: f64 = 1.0;

pub(super) fn plus(a: Vector, b: Vector) -> Vector {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

pub(super) fn minus(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn scaled(a: Vector, factor: f64) -> Vector {
    a.map(|value| value * factor)
}

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `d` rotated by the unit quaternion with this vector part and a positive real part.
pub(super) fn rotated(rotation: Vector, d: Vector) -> Vector {
    let w = (1.0 - dot(rotation, rotation)).max(0.0).sqrt();
    let t = cross(rotation, d);
    plus(d, scaled(plus(scaled(t, w), cross(rotation, t)), 2.0))
}

/// The vector part of one rotation after another, with a positive real part.
fn after(second: Vector, first: Vector) -> Vector {
    let real = |rotation: Vector| (1.0 - dot(rotation, rotation)).max(0.0).sqrt();
    let (a, b) = (real(second), real(first));
    let vector = plus(plus(scaled(second, b), scaled(first, a)), cross(second, first));
    if a * b - dot(second, first) < 0.0 { scaled(vector, -1.0) } else { vector }
}

/// A rotation about a centre, then a shift.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rigid {
    /// What stays while rotating.
    pub(super) centre: Vector,
    /// Vector part of the unit quaternion.
    pub(super) rotation: Vector,
    /// Shift of the centre.
    pub(super) shift: Vector,
}

impl Rigid {
    /// Nothing moves.
    pub(super) const STILL: Self = Self { centre: [0.0; 3], rotation: [0.0; 3], shift: [0.0; 3] };

    /// Where a point goes.
    pub(super) fn apply(&self, point: Vector) -> Vector {
        plus(plus(self.centre, self.shift), rotated(self.rotation, minus(point, self.centre)))
    }

    /// The same motion about another centre.
    pub(super) fn about(&self, centre: Vector) -> Self {
        Self { centre, rotation: self.rotation, shift: minus(self.apply(centre), centre) }
    }

    /// This motion, corrected by what is left between points of a cell of this size and where they went.
    ///
    /// The correction is a weighted least-squares fit of a small rotation and a shift. Points far from the median count
    /// little: pairs may be mistaken, and a cell may hold two bodies. With few points, or points in a row, it stays
    /// near the motion before.
    pub(super) fn refined(self, points: &[Point], size: f64) -> Self {
        let step = points.len().div_ceil(FITTED).max(1);
        let left: Vec<(Vector, Vector)> = points
            .iter()
            .step_by(step)
            .map(|point| self.apply(point.from))
            .zip(points.iter().step_by(step))
            .map(|(carried, point)| (carried, minus(point.to, carried)))
            .collect();
        if left.is_empty() {
            return self;
        }
        let weighted = weighted(&left);
        let total: f64 = weighted.iter().map(|(weight, ..)| weight).sum();
        let mean = |part: fn(&(f64, Vector, Vector)) -> Vector| {
            let sum = weighted.iter().fold([0.0; 3], |sum, item| plus(sum, scaled(part(item), item.0)));
            scaled(sum, 1.0 / total)
        };
        let (pivot, shift) = (mean(|item| item.1), mean(|item| item.2));
        let rotation = small_turn(&weighted, pivot, shift, PRIOR * size * size / 16.0);
        let shift = scaled(shift, total / (total + PRIOR));
        let correction = Self { centre: pivot, rotation, shift };
        let moved = correction.apply(self.apply(self.centre));
        Self {
            centre: self.centre,
            rotation: after(rotation, self.rotation),
            shift: minus(moved, self.centre),
        }
    }
}

/// Weights by the distance from the median: 1, down to 1/25 at four times the median distance.
#[expect(clippy::indexing_slicing, reason = "rows, columns and axes are 0, 1 and 2")]
fn weighted(left: &[(Vector, Vector)]) -> Vec<(f64, Vector, Vector)> {
    let step = left.len().div_ceil(MEDIAN);
    let middle = [0, 1, 2].map(|axis: usize| median(left.iter().step_by(step).map(|(_, rest)| rest[axis])));
    let apart = |rest: Vector| {
        let d = minus(rest, middle);
        dot(d, d)
    };
    let spread = 4.0 * median(left.iter().step_by(step).map(|&(_, rest)| apart(rest))) + 0.0625;
    let weight = |rest: Vector| {
        let far = 1.0 + apart(rest) / spread;
        1.0 / (far * far)
    };
    left.iter().map(|&(carried, rest)| (weight(rest), carried, rest)).collect()
}

/// 0 of nothing.
pub(super) fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    ranked(&mut values, 50, f64::total_cmp).unwrap_or_default()
}

/// The rotation about `pivot` that leaves least, half its angle as the vector part of a quaternion.
#[expect(clippy::indexing_slicing, reason = "rows, columns and axes are 0, 1 and 2")]
fn small_turn(weighted: &[(f64, Vector, Vector)], pivot: Vector, shift: Vector, prior: f64) -> Vector {
    let mut inertia = [[prior, 0.0, 0.0], [0.0, prior, 0.0], [0.0, 0.0, prior]];
    let mut moment = [0.0; 3];
    for &(weight, carried, rest) in weighted {
        let arm = minus(carried, pivot);
        moment = plus(moment, scaled(cross(arm, minus(rest, shift)), weight));
        let square = dot(arm, arm);
        for row in 0..3 {
            inertia[row][row] += weight * square;
            for column in 0..3 {
                inertia[row][column] -= weight * arm[row] * arm[column];
            }
        }
    }
    let [a, b, c] = inertia;
    let (bc, ca, ab) = (cross(b, c), cross(c, a), cross(a, b));
    let determinant = dot(a, bc);
    // With a positive prior the matrix is positive definite; only overflow could say otherwise.
    if determinant.is_nan() || determinant <= 0.0 {
        return [0.0; 3];
    }
    // The matrix is symmetric: rows of the adjugate are its columns.
    let angle = scaled([dot(bc, moment), dot(ca, moment), dot(ab, moment)], 1.0 / determinant);
    let size = dot(angle, angle).sqrt();
    if size < 1e-12 {
        return [0.0; 3];
    }
    // A linear fit finds the tangent; beyond half a rotation it finds nothing.
    scaled(angle, libm::sin(0.5 * libm::atan(size)) / size)
}
