//! The canonical form: one of the many ways to write a Gaussian that render alike.
//!
//! Axes sorted from the largest, the quaternion with w largest and positive, a sphere without rotation,
//! no Gaussian that can never reach an alpha of 1/255.

use rayon::prelude::*;
use splatstream_gaussians::GaussianFrame;

/// The logit below which opacity stays under 1/255: ln(1/254).
pub const INVISIBLE_LOGIT: f32 = -5.537_334;

/// The Gaussians that can be seen, in their order; with `keep_invisible` also those that cannot, if they have any
/// opacity at all.
pub fn visible(frame: &GaussianFrame, keep_invisible: bool) -> Vec<u32> {
    let least = if keep_invisible { f32::MIN } else { INVISIBLE_LOGIT };
    (0..).zip(frame.opacity_logit()).filter(|&(_, &logit)| logit >= least).map(|(index, _)| index).collect()
}

/// The quaternion that turns the axes 0, 1, 2 into `order`, up to the signs of axes.
pub(crate) fn permutation(order: [usize; 3]) -> [f32; 4] {
    const HALF: f32 = 0.5;
    const ROOT_HALF: f32 = core::f32::consts::FRAC_1_SQRT_2;
    match order {
        [0, 1, 2] => [1.0, 0.0, 0.0, 0.0],
        [1, 2, 0] => [HALF, HALF, HALF, HALF],
        [2, 0, 1] => [HALF, -HALF, -HALF, -HALF],
        [0, 2, 1] => [ROOT_HALF, ROOT_HALF, 0.0, 0.0],
        [1, 0, 2] => [ROOT_HALF, 0.0, 0.0, ROOT_HALF],
        _ => [ROOT_HALF, 0.0, ROOT_HALF, 0.0],
    }
}

/// Hamilton product, w first.
pub(crate) fn product(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]
}

/// Of the four rotations that differ by half turns about the axes, the one with the largest w, positive.
fn smallest_turn(q: [f32; 4]) -> [f32; 4] {
    let [w, x, y, z] = q;
    let turned = match largest(q.map(f32::abs)) {
        0 => [w, x, y, z],
        1 => [-x, w, z, -y],
        2 => [-y, -z, w, x],
        _ => [-z, y, -x, w],
    };
    if turned[0] < 0.0 { turned.map(|component| -component) } else { turned }
}

fn largest(values: [f32; 4]) -> usize {
    let [first, ..] = values;
    let mut best = (0, first);
    for (index, value) in values.into_iter().enumerate() {
        if value > best.1 {
            best = (index, value);
        }
    }
    best.0
}

/// One Gaussian's axes and rotation in canonical form. `sort` is the sequence's canonical_axes.
#[expect(
    clippy::indexing_slicing,
    reason = "axes and parts are constants or a permutation of them; rows are those of the planes"
)]
pub fn canonical(log_scale: [f32; 3], rotation: [f32; 4], sort: bool) -> ([f32; 3], [f32; 4]) {
    let mut order = [0, 1, 2];
    if sort {
        // Neighbours change places only where the second is larger: equal ones stay in their order.
        for [first, second] in [[0, 1], [1, 2], [0, 1]] {
            if log_scale[order[first]].total_cmp(&log_scale[order[second]]).is_lt() {
                order.swap(first, second);
            }
        }
    }
    let sorted = order.map(|axis| log_scale[axis]);
    let squares: f32 = rotation.iter().map(|component| component * component).sum();
    let unit = rotation.map(|component| component / squares.sqrt());
    (sorted, smallest_turn(product(unit, permutation(order))))
}

/// Gaussians that are put into canonical form at a time.
const PART: usize = 1 << 12;

/// The Gaussians of a frame in canonical form.
#[must_use]
pub fn canonicalise(mut frame: GaussianFrame, sort: bool) -> GaussianFrame {
    let (log_scale, rotation) = frame.axes_mut();
    let [a, b, c] = log_scale.map(|plane| plane.par_chunks_mut(PART));
    let [w, x, y, z] = rotation.map(|plane| plane.par_chunks_mut(PART));
    let parts = (a, b, c, w, x, y, z).into_par_iter();
    parts.for_each(|(a, b, c, w, x, y, z)| {
        let scales = a.iter_mut().zip(b).zip(c);
        let turns = w.iter_mut().zip(x).zip(y).zip(z);
        for (((a, b), c), (((w, x), y), z)) in scales.zip(turns) {
            ([*a, *b, *c], [*w, *x, *y, *z]) = canonical([*a, *b, *c], [*w, *x, *y, *z], sort);
        }
    });
    frame
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// R diag(exp 2s) R^T, what a renderer sees of scale and rotation.
    fn covariance(log_scale: [f32; 3], q: [f32; 4]) -> [[f64; 3]; 3] {
        let [w, x, y, z] = q.map(f64::from);
        let r = [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ];
        let squares = log_scale.map(|scale| libm::exp(2.0 * f64::from(scale)));
        let entry = |i: usize, j: usize| (0..3).map(|k| r[i][k] * squares[k] * r[j][k]).sum();
        [0, 1, 2].map(|i| [0, 1, 2].map(|j| entry(i, j)))
    }

    #[test]
    fn axes_of_equal_length_stay_in_their_order() {
        // With a turn about each axis of another angle the order shows in the rotation alone.
        let turn = [0.9, 0.1, 0.2, 0.3];
        let lengths = [-1.0_f32, 0.0, 1.0];
        for scales in
            lengths.iter().flat_map(|a| lengths.iter().flat_map(move |b| lengths.map(|c| [*a, *b, c])))
        {
            let mut order = [0, 1, 2];
            order.sort_by(|&a, &b| scales[b].total_cmp(&scales[a]));
            let (sorted, rotation) = canonical(scales, turn, true);
            assert_eq!(sorted, order.map(|axis| scales[axis]));
            let squares: f32 = turn.iter().map(|part| part * part).sum();
            let unit = turn.map(|part| part / squares.sqrt());
            assert_eq!(rotation, smallest_turn(product(unit, permutation(order))), "{scales:?}");
        }
    }

    proptest! {
        #[test]
        fn the_canonical_form_has_the_same_covariance(
            scales in prop::array::uniform3(-3.0_f32..1.0),
            turn in prop::array::uniform4(-1.0_f32..1.0).prop_filter("zero", |q| q.iter().map(|c| c * c).sum::<f32>() > 0.01),
            sort in any::<bool>(),
        ) {
            let norm = turn.iter().map(|c| c * c).sum::<f32>().sqrt();
            let unit = turn.map(|c| c / norm);
            let (sorted, canonical_turn) = canonical(scales, turn, sort);
            let before = covariance(scales, unit);
            let after = covariance(sorted, canonical_turn);
            for (a, b) in before.iter().flatten().zip(after.iter().flatten()) {
                prop_assert!((a - b).abs() < 1e-4, "{before:?} {after:?}");
            }
            prop_assert!(canonical_turn[0] >= 0.499);
            prop_assert!(!sort || (sorted[0] >= sorted[1] && sorted[1] >= sorted[2]));
        }
    }
}
