//! The transfer function of sRGB, and Gaussians whose colours are in linear light.
//!
//! Frames have the colours that trainers of Gaussian splatting optimise: encoded as sRGB, and blended so. A scene may also be
//! trained in linear light, where pictures are encoded after everything is blended. Its Gaussians can be given colours that
//! look the same each by itself; where translucent ones cover each other, pictures differ.

use crate::sphere::directions;
use splatstream_gaussians::activation::{colour_of_dc, dc_of_colour};
use splatstream_gaussians::{GaussianFrame, PlanesMut, SH_C0, sh_basis, sh_coefficients};

/// A value of linear light encoded as sRGB. Beyond 0 to 1 the curve goes on, below 0 as above.
/// Source: IEC 61966-2-1.
pub fn encode(linear: f64) -> f64 {
    let size = linear.abs();
    let encoded = if size <= 0.003_130_8 { 12.92 * size } else { 1.055 * libm::pow(size, 1.0 / 2.4) - 0.055 };
    encoded.copysign(linear)
}

/// The linear light of a value from 0 to 1 that is encoded as sRGB.
pub(crate) fn decode(encoded: f64) -> f64 {
    if encoded <= 0.04045 { encoded / 12.92 } else { libm::pow((encoded + 0.055) / 1.055, 2.4) }
}

/// The frame with colours encoded as sRGB that has them in linear light.
///
/// A colour without spherical harmonics is encoded, which is exact. One that depends on the direction is encoded in 32
/// directions, and gets the coefficients of the same degree that are nearest to these: the basis is orthonormal over the
/// 32, so each coefficient is a sum of products. Coefficients of 0 stay so.
pub fn from_linear(mut frame: GaussianFrame) -> GaussianFrame {
    let coefficients = sh_coefficients(frame.sh_degree());
    let seen: Vec<([f64; 15], f64)> =
        directions().map(|(direction, weight)| (sh_basis(direction.to_array()), weight)).collect();
    let PlanesMut { dc, mut sh, .. } = frame.planes_mut();
    for (channel, dc) in dc.into_iter().enumerate() {
        let mut sh: Vec<&mut &mut [f32]> = sh.iter_mut().skip(channel).step_by(3).collect();
        for (row, dc) in dc.iter_mut().enumerate() {
            let mut old = [0.0; 15];
            for (old, plane) in old.iter_mut().zip(&sh) {
                *old = plane.get(row).map_or(0.0, |&value| f64::from(value));
            }
            let (mean, new) = encoded(colour_of_dc(*dc), &old, &seen);
            *dc = mean;
            for (plane, new) in sh.iter_mut().zip(new).take(coefficients) {
                plane.get_mut(row).into_iter().for_each(|value| *value = new as f32);
            }
        }
    }
    frame
}

/// One channel of a Gaussian: DC and the other coefficients of its colour, `base` and `old` in linear light. `seen` has the
/// basis in some directions, and their weights.
fn encoded(base: f64, old: &[f64; 15], seen: &[([f64; 15], f64)]) -> (f32, [f64; 15]) {
    let middle = encode(base);
    let (mut mean, mut new) = (middle, [0.0; 15]);
    if old.iter().all(|&value| value == 0.0) {
        return (dc_of_colour(mean), new);
    }
    for (basis, weight) in seen {
        let linear = base + basis.iter().zip(old).map(|(basis, old)| basis * old).sum::<f64>();
        let beside = weight * (encode(linear) - middle);
        mean += SH_C0 * SH_C0 * beside;
        new.iter_mut().zip(basis).for_each(|(new, basis)| *new += basis * beside);
    }
    (dc_of_colour(mean), new)
}

#[cfg(test)]
mod tests {
    use super::*;
    use splatstream_gaussians::Planes;

    /// A grey Gaussian of degree 3.
    fn grey(colour: f64, sh: [f32; 15]) -> GaussianFrame {
        let mut planes = Planes::with_capacity(3, 1);
        planes.iter_mut().for_each(|plane| plane.push(0.0));
        planes.rotation[0][0] = 1.0;
        planes.dc.iter_mut().for_each(|plane| plane[0] = dc_of_colour(colour));
        planes.sh.iter_mut().enumerate().for_each(|(at, plane)| plane[0] = sh[at / 3]);
        GaussianFrame::from_planes(3, planes).unwrap()
    }

    /// Its green in a direction.
    fn seen(frame: &GaussianFrame, direction: [f64; 3]) -> f64 {
        let sh = frame.sh().iter().skip(1).step_by(3).map(|plane| f64::from(plane[0]));
        colour_of_dc(frame.dc()[1][0])
            + sh_basis(direction).iter().zip(sh).map(|(basis, value)| basis * value).sum::<f64>()
    }

    #[test]
    fn the_curve_is_that_of_srgb_and_comes_back() {
        assert!((encode(0.5) - 0.735_356_98).abs() < 1e-8);
        assert_eq!((encode(0.002), encode(0.0)), (12.92 * 0.002, 0.0));
        for value in [0.0, 0.002, 0.01, 0.2, 0.9, 1.0] {
            assert!((decode(encode(value)) - value).abs() < 1e-7, "{value}");
            assert_eq!(encode(-value), -encode(value));
        }
    }

    #[test]
    fn a_colour_without_harmonics_is_encoded_and_gets_none() {
        let frame = from_linear(grey(0.214, [0.0; 15]));
        assert!((seen(&frame, [0.0, 0.0, 1.0]) - encode(0.214)).abs() < 1e-6);
        assert!(frame.sh().iter().all(|plane| plane[0] == 0.0));
    }

    #[test]
    fn a_colour_that_depends_on_the_direction_is_encoded_in_every_one() {
        let mut sh =
            [0.01, -0.02, 0.03, 0.01, 0.0, -0.02, 0.01, 0.02, 0.0, 0.01, -0.01, 0.0, 0.01, 0.0, -0.01];
        let linear = grey(0.3, sh);
        let encoded = from_linear(linear.clone());
        for direction in [[0.0, 0.0, 1.0], [0.6, -0.48, 0.64], [-0.8, 0.36, 0.48], [0.0, -1.0, 0.0]] {
            let (found, expected) = (seen(&encoded, direction), encode(seen(&linear, direction)));
            assert!((found - expected).abs() < 2e-3, "{found} {expected}");
        }
        // A stronger one is not a polynomial any more, and is met on average.
        sh.iter_mut().for_each(|value| *value *= 6.0);
        let linear = grey(0.3, sh);
        let encoded = from_linear(linear.clone());
        let error: f64 = directions()
            .map(|(direction, weight)| {
                let direction = direction.to_array();
                let error = seen(&encoded, direction) - encode(seen(&linear, direction).max(0.0));
                weight / (4.0 * std::f64::consts::PI) * error * error
            })
            .sum();
        assert!(error.sqrt() < 0.03, "{}", error.sqrt());
    }

    #[test]
    fn what_is_not_finite_stays_so() {
        let mut sh = [0.0; 15];
        sh[3] = f32::NAN;
        let frame = from_linear(grey(0.3, sh));
        assert!(frame.dc()[1][0].is_nan());
        assert!(from_linear(grey(f64::INFINITY, [0.0; 15])).dc()[0][0].is_infinite());
    }
}
