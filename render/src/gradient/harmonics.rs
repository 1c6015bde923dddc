//! Colour backwards: from slopes by red, green and blue to slopes by coefficients, and by the direction of the view.

use glam::DVec3;
use splatstream_gaussians::{GaussianFrame, sh_basis, sh_coefficients};

/// Adds slopes by the coefficients of bands 1 and up, whose planes are those of the frame and whose row here is `row` of
/// `planes` and `gaussian` of the frame; returns the slope by the Gaussian's centre, which lies at `offset` from the camera.
#[expect(clippy::arithmetic_side_effects, reason = "vectors of floats")]
#[expect(
    clippy::indexing_slicing,
    reason = "planes of a frame are as long as it, and gradients as those of the frame"
)]
pub(super) fn backward(
    frame: &GaussianFrame,
    gaussian: usize,
    offset: DVec3,
    colour: [f64; 3],
    (planes, row): (&mut [&mut [f32]], usize),
) -> DVec3 {
    let coefficients = sh_coefficients(frame.sh_degree());
    let distance = offset.length();
    if coefficients == 0 || distance == 0.0 {
        return DVec3::ZERO;
    }
    let direction = offset / distance;
    let basis = sh_basis(direction.to_array());
    let slopes = sh_basis_slopes(direction);
    let mut turned = DVec3::ZERO;
    for (coefficient, (basis, slopes)) in basis.iter().zip(slopes).take(coefficients).enumerate() {
        let mut weight = 0.0;
        for (channel, colour) in colour.iter().enumerate() {
            let plane = 3 * coefficient + channel;
            planes[plane][row] += (colour * basis) as f32;
            weight += colour * f64::from(frame.sh()[plane][gaussian]);
        }
        turned += slopes * weight;
    }
    // Only what turns the direction counts: it has length 1.
    (turned - direction * direction.dot(turned)) / distance
}

/// Slopes of [`sh_basis`] by x, y and z.
#[expect(clippy::unreadable_literal, reason = "constants as published")]
fn sh_basis_slopes(direction: DVec3) -> [DVec3; 15] {
    let DVec3 { x, y, z } = direction;
    let (xx, yy, zz) = (x * x, y * y, z * z);
    let (a, b, c, d) = (0.4886025119029199, 1.0925484305920792, 0.31539156525252005, 0.5462742152960396);
    let (e, f, g, h, i) =
        (0.5900435899266435, 2.890611442640554, 0.4570457994644658, 0.3731763325901154, 1.445305721320277);
    let slopes = [
        [0.0, -a, 0.0],
        [0.0, 0.0, a],
        [-a, 0.0, 0.0],
        [b * y, b * x, 0.0],
        [0.0, -b * z, -b * y],
        [-2.0 * c * x, -2.0 * c * y, 4.0 * c * z],
        [-b * z, 0.0, -b * x],
        [2.0 * d * x, -2.0 * d * y, 0.0],
        [-6.0 * e * x * y, -3.0 * e * (xx - yy), 0.0],
        [f * y * z, f * x * z, f * x * y],
        [2.0 * g * x * y, -g * (4.0 * zz - xx - 3.0 * yy), -8.0 * g * y * z],
        [-6.0 * h * x * z, -6.0 * h * y * z, 3.0 * h * (2.0 * zz - xx - yy)],
        [-g * (4.0 * zz - 3.0 * xx - yy), 2.0 * g * x * y, -8.0 * g * x * z],
        [2.0 * i * x * z, -2.0 * i * y * z, i * (xx - yy)],
        [-3.0 * e * (xx - yy), 6.0 * e * x * y, 0.0],
    ];
    slopes.map(DVec3::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_of_the_basis_are_its_differences() {
        let direction = DVec3::new(0.3, -0.7, 0.5);
        let slopes = sh_basis_slopes(direction);
        for axis in 0..3 {
            let at = |step: f64| {
                let mut moved = direction;
                moved[axis] += step;
                sh_basis(moved.to_array())
            };
            let (more, less) = (at(1e-5), at(-1e-5));
            for ((slope, more), less) in slopes.iter().zip(more).zip(less) {
                assert!((slope[axis] - (more - less) / 2e-5).abs() < 1e-9, "{axis}");
            }
        }
    }
}
