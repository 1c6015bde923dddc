//! Spherical-harmonic degree, and how its coefficients are counted.

/// The largest SH degree that a frame can carry.
pub const MAX_SH_DEGREE: u8 = 3;

/// The constant basis function, 1 / (2 √π), whose coefficient is DC.
pub const SH_C0: f64 = 0.282_094_791_773_878_14;

/// Coefficients per colour channel without DC: 0, 3, 8, 15 for degrees 0 to 3; `(degree + 1)² − 1`.
#[expect(
    clippy::arithmetic_side_effects,
    reason = "a degree has eight bits, the square of one more has seventeen"
)]
pub fn sh_coefficients(degree: u8) -> usize {
    let side = usize::from(degree) + 1;
    side * side - 1
}

/// Planes of bands 1 and up, one a coefficient and channel: 0, 9, 24, 45 for degrees 0 to 3.
#[expect(clippy::arithmetic_side_effects, reason = "three times a number of seventeen bits")]
pub fn sh_planes(degree: u8) -> usize {
    sh_coefficients(degree) * 3
}

/// The number in PLY's name for an SH plane, `f_rest_*`: planes interleave channels, PLY holds one channel after
/// another.
#[expect(
    clippy::arithmetic_side_effects,
    reason = "a channel is at most 2, and `plane` / 3 is added to a number of eighteen bits"
)]
pub fn rest_index(plane: usize, degree: u8) -> usize {
    let (coefficient, channel) = (plane / 3, plane % 3);
    channel * sh_coefficients(degree) + coefficient
}

/// The SH basis of bands 1 to 3 in a unit direction, with the signs that Gaussian splatting uses. Degree 1
/// needs the first 3 values, degree 2 the first 8.
/// Source: Kerbl et al., "3D Gaussian splatting for real-time radiance field rendering", 2023.
#[expect(clippy::unreadable_literal, reason = "constants as published")]
pub fn sh_basis(direction: [f64; 3]) -> [f64; 15] {
    let [x, y, z] = direction;
    let (xx, yy, zz) = (x * x, y * y, z * z);
    [
        -0.4886025119029199 * y,
        0.4886025119029199 * z,
        -0.4886025119029199 * x,
        1.0925484305920792 * x * y,
        -1.0925484305920792 * y * z,
        0.31539156525252005 * (2.0 * zz - xx - yy),
        -1.0925484305920792 * x * z,
        0.5462742152960396 * (xx - yy),
        -0.5900435899266435 * y * (3.0 * xx - yy),
        2.890611442640554 * x * y * z,
        -0.4570457994644658 * y * (4.0 * zz - xx - yy),
        0.3731763325901154 * z * (2.0 * zz - 3.0 * xx - 3.0 * yy),
        -0.4570457994644658 * x * (4.0 * zz - xx - yy),
        1.445305721320277 * z * (xx - yy),
        -0.5900435899266435 * x * (xx - 3.0 * yy),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_degrees_have_0_3_8_and_15_coefficients() {
        assert_eq!([0, 1, 2, 3].map(sh_coefficients), [0, 3, 8, 15]);
    }

    #[test]
    fn the_green_part_of_the_second_coefficient_is_f_rest_16_at_degree_3() {
        assert_eq!(rest_index(4, 3), 16);
    }
}
