//! Spherical harmonics that turn with what they belong to.

use crate::sphere::directions;
use glam::DQuat;
use splatstream_gaussians::{sh_basis, sh_coefficients};

/// What a rotation makes of the coefficients of each band. A function whose coefficients are multiplied by it has in a direction
/// the value that it had in the direction turned back.
pub(super) struct Spin {
    /// Of bands 1 to 3; row by row.
    bands: [Vec<f64>; 3],
    is_nothing: bool,
}

impl Spin {
    /// The matrices of a rotation. The basis functions are orthonormal, so an entry is the integral of one of them times
    /// another that was turned: a polynomial of degree 6 at most, which a sum over 32 directions gives exactly.
    pub(super) fn of(rotation: DQuat) -> Self {
        let back = rotation.conjugate();
        let mut bands = [1, 2, 3].map(|degree: usize| vec![0.0; (2 * degree + 1) * (2 * degree + 1)]);
        for (direction, weight) in directions() {
            let (here, there) = (sh_basis(direction.to_array()), sh_basis((back * direction).to_array()));
            for (degree, band) in (1_u8..).zip(&mut bands) {
                let of_band = |basis: &[f64; 15]| {
                    let first = sh_coefficients(degree - 1);
                    basis.get(first..sh_coefficients(degree)).map(<[f64]>::to_vec).unwrap_or_default()
                };
                let (here, there) = (of_band(&here), of_band(&there));
                let entries = here.iter().flat_map(|here| there.iter().map(move |there| here * there));
                band.iter_mut().zip(entries).for_each(|(entry, value)| *entry += weight * value);
            }
        }
        Self { bands, is_nothing: rotation == DQuat::IDENTITY }
    }

    /// Turns the coefficients in the planes of a frame, as many bands as there are.
    pub(super) fn turn(&self, mut planes: Vec<&mut [f32]>) {
        if self.is_nothing {
            return;
        }
        let mut rest = planes.as_mut_slice();
        for (degree, band) in (1_usize..).zip(&self.bands) {
            let Some((of_band, after)) = rest.split_at_mut_checked((2 * degree + 1) * 3) else { return };
            (0..3).for_each(|channel| turn_band(band, of_band, channel));
            rest = after;
        }
    }
}

/// Turns one channel of a band: its planes have the channels in turn.
fn turn_band(band: &[f64], planes: &mut [&mut [f32]], channel: usize) {
    let mut channels: Vec<&mut &mut [f32]> = planes.iter_mut().skip(channel).step_by(3).collect();
    let size = channels.len();
    let rows = channels.first().map_or(0, |plane| plane.len());
    let mut old = vec![0.0; size];
    for row in 0..rows {
        for (old, plane) in old.iter_mut().zip(&channels) {
            *old = plane.get(row).map_or(0.0, |&value| f64::from(value));
        }
        for (plane, factors) in channels.iter_mut().zip(band.chunks_exact(size)) {
            let sum: f64 = factors.iter().zip(&old).map(|(factor, old)| factor * old).sum();
            plane.get_mut(row).into_iter().for_each(|value| *value = sum as f32);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    /// The value of a function of 15 coefficients.
    fn value(coefficients: &[f64], direction: DVec3) -> f64 {
        sh_basis(direction.to_array()).iter().zip(coefficients).map(|(basis, value)| basis * value).sum()
    }

    #[test]
    fn a_turned_function_has_the_values_of_where_it_came_from() {
        let rotation = DQuat::from_xyzw(0.4, -0.3, 0.2, 0.7).normalize();
        let old: Vec<f64> = (0..15).map(|at| f64::from(at * 7 % 11) / 10.0 - 0.4).collect();
        let mut planes: Vec<Vec<f32>> =
            old.iter().flat_map(|&value| [value as f32; 3].map(|value| vec![value])).collect();
        Spin::of(rotation).turn(planes.iter_mut().map(Vec::as_mut_slice).collect());
        for channel in 0..3 {
            let new: Vec<f64> = planes.iter().skip(channel).step_by(3).map(|plane| plane[0].into()).collect();
            for direction in [DVec3::X, DVec3::new(0.6, -0.48, 0.64), DVec3::new(-0.8, 0.36, 0.48)] {
                let (here, there) = (value(&new, direction), value(&old, rotation.conjugate() * direction));
                assert!((here - there).abs() < 1e-6, "{here} {there}");
            }
        }
    }
}
