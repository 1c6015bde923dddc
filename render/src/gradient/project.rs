//! Projection backwards: from slopes by ellipses to slopes by Gaussians, in 64 bits.
#![expect(clippy::arithmetic_side_effects, reason = "vectors of floats; counts of Gaussians in memory")]
#![expect(
    clippy::indexing_slicing,
    reason = "rows are those of the frame, planes as long as it, axes constants"
)]

use super::blend::Sums;
use super::harmonics;
use crate::camera::Camera;
use crate::rasterise::{LOW_PASS, PreparedFrame, Splat, seen_slopes};
use glam::DVec3;
use rayon::prelude::*;
use splatstream_gaussians::{GaussianFrame, Planes, PlanesMut, SH_C0};
use std::f64::consts::LOG2_E;

/// Gaussians that a thread goes back through at once.
const CHUNK: usize = 4096;

/// No ellipse.
const NONE: u32 = u32::MAX;

/// A frame and a camera.
pub(super) struct Projection<'a> {
    prepared: &'a PreparedFrame<'a>,
    frame: &'a GaussianFrame,
    /// Right, down and forward of the camera in the world.
    rows: [DVec3; 3],
    position: DVec3,
    focal: [f64; 2],
    /// Slopes beyond which the Jacobian is not followed.
    seen: [(f64, f64); 2],
}

/// What a loss gains with the values of a Gaussian that make its ellipse.
struct Shape {
    position: DVec3,
    log_scale: [f64; 3],
    rotation: [f64; 4],
    opacity_logit: f64,
}

/// What a loss gains with an ellipse: its centre, its covariance as two vectors (see [`Projection::ellipse`]), and log2 of
/// its opacity.
struct Ellipse {
    centre: [f64; 2],
    u: DVec3,
    v: DVec3,
    peak: f64,
}

impl<'a> Projection<'a> {
    pub(super) fn new(prepared: &'a PreparedFrame<'a>, camera: &Camera) -> Self {
        let wide = |row: [f32; 3]| DVec3::from(row.map(f64::from));
        Self {
            prepared,
            frame: prepared.frame,
            rows: camera.rotation.map(wide),
            position: wide(camera.position),
            focal: camera.focal.map(f64::from),
            seen: seen_slopes(camera).map(|(least, most)| (f64::from(least), f64::from(most))),
        }
    }

    /// Adds the slopes of all Gaussians that have an ellipse.
    pub(super) fn backward(&self, splats: &[Splat], sums: &[Sums<f64>], planes: &mut Planes) {
        let mut places = vec![NONE; self.frame.len()];
        for (place, splat) in (0..).zip(splats) {
            places[splat.gaussian as usize] = place;
        }
        places.par_chunks(CHUNK).zip(parts(planes)).for_each(|(places, mut planes)| {
            for (row, &place) in places.iter().enumerate().filter(|&(_, &place)| place != NONE) {
                let (splat, sums) = (&splats[place as usize], &sums[place as usize]);
                if sums.iter().any(|&sum| sum != 0.0) {
                    self.add(splat, sums, (&mut planes, row));
                }
            }
        });
    }

    /// Adds the slopes of a Gaussian to a row of planes.
    fn add(&self, splat: &Splat, sums: &Sums<f64>, (planes, row): (&mut PlanesMut<'_>, usize)) {
        let gaussian = splat.gaussian as usize;
        let at = |plane: &Vec<f32>| f64::from(plane[gaussian]);
        let offset = DVec3::from(self.frame.position().each_ref().map(at)) - self.position;
        // Where a channel is clamped to 0, nothing changes it.
        let colour =
            [0, 1, 2].map(|channel: usize| if splat.colour[channel] > 0.0 { sums[channel] } else { 0.0 });
        let shape = self.shape(splat, sums, offset);
        let turned = harmonics::backward(self.frame, gaussian, offset, colour, (&mut planes.sh, row));
        let position = shape.position + turned;
        let add = |plane: &mut &mut [f32], slope: f64| plane[row] += slope as f32;
        planes.position.iter_mut().zip(position.to_array()).for_each(|(plane, slope)| add(plane, slope));
        planes.log_scale.iter_mut().zip(shape.log_scale).for_each(|(plane, slope)| add(plane, slope));
        planes.rotation.iter_mut().zip(shape.rotation).for_each(|(plane, slope)| add(plane, slope));
        planes.dc.iter_mut().zip(colour).for_each(|(plane, slope)| add(plane, SH_C0 * slope));
        add(&mut planes.opacity_logit, shape.opacity_logit);
    }

    /// Slopes by centre, semi-axes, rotation and opacity of a Gaussian at `offset` from the camera.
    ///
    /// With the camera's axes r, depth z, slopes x and y (clamped) and focal lengths f, the rows of the Jacobian in the world
    /// are fx/z·(r₀ − x·r₂) and fy/z·(r₁ − y·r₂); u and v are their products with the semi-axes.
    fn shape(&self, splat: &Splat, sums: &Sums<f64>, offset: DVec3) -> Shape {
        let gaussian = splat.gaussian as usize;
        let axes = self.prepared.shapes.axes(gaussian).map(|axis| axis.as_dvec3());
        let [right, down, ahead] = self.rows;
        let depth = ahead.dot(offset);
        let near = 1.0 / depth;
        let ratios = [right.dot(offset) * near, down.dot(offset) * near];
        let clamped = [0, 1].map(|axis: usize| ratios[axis].clamp(self.seen[axis].0, self.seen[axis].1));
        let sides = [right - ahead * clamped[0], down - ahead * clamped[1]];
        let scales = self.focal.map(|focal| focal * near);
        let [across, along] = [sides[0] * scales[0], sides[1] * scales[1]];
        let [u, v] = [across, along].map(|row| DVec3::from(axes.map(|axis| row.dot(axis))));
        let ellipse = self.ellipse(splat, sums, u, v);

        let (du, dv) = (ellipse.u.to_array(), ellipse.v.to_array());
        let mut position = DVec3::ZERO;
        let mut d_depth = 0.0;
        for (axis, (slope, toward)) in [(du, right), (dv, down)].into_iter().enumerate() {
            // By the row of the Jacobian, then by its slope and by the depth.
            let d_row: DVec3 = axes.iter().zip(slope).map(|(&axis, slope)| axis * slope).sum();
            let is_free = ratios[axis] == clamped[axis];
            let through = if is_free { -scales[axis] * ahead.dot(d_row) } else { 0.0 };
            let d_ratio = through + ellipse.centre[axis] * self.focal[axis];
            position += toward * (d_ratio * near);
            d_depth -= near * (ratios[axis] * d_ratio + scales[axis] * sides[axis].dot(d_row));
        }
        let d_axes = [0, 1, 2].map(|k: usize| across * du[k] + along * dv[k]);
        Shape {
            position: position + ahead * d_depth,
            log_scale: [0, 1, 2].map(|k: usize| axes[k].dot(d_axes[k])),
            rotation: self.rotation(gaussian, d_axes),
            opacity_logit: ellipse.peak * LOG2_E
                / (1.0 + libm::exp(f64::from(self.frame.opacity_logit()[gaussian]))),
        }
    }

    /// Slopes by an ellipse, from the sums over its pixels.
    ///
    /// Its covariance is A = u·u, B = u·v, C = v·v, with the low-pass filter λ on A and C; its determinant is
    /// D = |u × v|² + λ (A + C + λ). The renderer has xx = −h (C + λ) / D, skew = −B / (C + λ), yy = −h / (C + λ) with
    /// h = log2(e) / 2; and where it compensates for the filter, log2 of |u × v| / √D in the exponent.
    fn ellipse(&self, splat: &Splat, sums: &Sums<f64>, u: DVec3, v: DVec3) -> Ellipse {
        let [.., level, _, square, _, steep, cross] = *sums;
        let xx = f64::from(splat.xx);
        let centre = by_centre(splat, sums);
        let low_pass = f64::from(LOW_PASS);
        let normal = u.cross(v);
        let sharp = normal.length_squared();
        let tall = v.length_squared() + low_pass;
        let determinant = sharp + low_pass * (u.length_squared() + tall);
        let half = 0.5 * LOG2_E;
        let (d_xx, d_skew, d_yy) = (square, 2.0 * xx * cross, steep);

        let mut d_determinant = d_xx * half * tall / (determinant * determinant);
        let mut d_sharp = 0.0;
        if self.frame.antialiased() {
            d_determinant -= level * half / determinant;
            d_sharp += level * half / sharp;
        }
        d_sharp += d_determinant;
        let d_tall = (d_skew * u.dot(v) + d_yy * half) / (tall * tall) - d_xx * half / determinant;
        let d_uu = low_pass * d_determinant;
        let d_vv = d_uu + d_tall;
        let d_uv = -d_skew / tall;
        let d_normal = normal * (2.0 * d_sharp);
        Ellipse {
            centre,
            u: u * (2.0 * d_uu) + v * d_uv + v.cross(d_normal),
            v: v * (2.0 * d_vv) + u * d_uv + d_normal.cross(u),
            peak: level,
        }
    }

    /// Slopes by the quaternion as it is stored, from those by the semi-axes.
    fn rotation(&self, gaussian: usize, d_axes: [DVec3; 3]) -> [f64; 4] {
        let stored = self.frame.rotation().each_ref().map(|plane| f64::from(plane[gaussian]));
        let length = stored.iter().map(|part| part * part).sum::<f64>().sqrt();
        let unit = stored.map(|part| part / length);
        let [w, x, y, z] = unit;
        let scales = self.frame.log_scale().each_ref().map(|plane| libm::exp(f64::from(plane[gaussian])));
        let [a, b, c] = [0, 1, 2].map(|k: usize| d_axes[k] * scales[k]);
        let slopes = [
            z * (a.y - b.x) + y * (c.x - a.z) + x * (b.z - c.y),
            y * (a.y + b.x) + z * (a.z + c.x) + w * (b.z - c.y) - 2.0 * x * (b.y + c.z),
            x * (a.y + b.x) + z * (b.z + c.y) + w * (c.x - a.z) - 2.0 * y * (a.x + c.z),
            x * (a.z + c.x) + y * (b.z + c.y) + w * (a.y - b.x) - 2.0 * z * (a.x + b.y),
        ]
        .map(|slope| 2.0 * slope);
        // The length of the quaternion changes nothing.
        let outward: f64 = slopes.iter().zip(unit).map(|(slope, unit)| slope * unit).sum();
        [0, 1, 2, 3].map(|part: usize| (slopes[part] - outward * unit[part]) / length)
    }
}

/// What a loss gains where the centre of an ellipse moves by a pixel to the right and down.
pub(super) fn by_centre(splat: &Splat, sums: &Sums<f64>) -> [f64; 2] {
    let [.., along, _, down, _, _] = *sums;
    let [xx, skew, yy] = [splat.xx, splat.skew, splat.yy].map(f64::from);
    [-2.0 * xx * along, -2.0 * (xx * skew * along + yy * down)]
}

/// Planes in parts of so many rows as a thread goes back through.
fn parts(planes: &mut Planes) -> Vec<PlanesMut<'_>> {
    let rows = planes.opacity_logit.len();
    let mut left: Vec<_> = planes.iter_mut().map(|plane| plane.chunks_mut(CHUNK)).collect();
    let part = |_| {
        let mut next = left.iter_mut().map(|chunks| chunks.next().unwrap_or_default());
        let mut plane = || next.next().unwrap_or_default();
        // In the order of the fields, as `Planes::iter_mut` gives them.
        PlanesMut {
            position: [(); 3].map(|()| plane()),
            log_scale: [(); 3].map(|()| plane()),
            rotation: [(); 4].map(|()| plane()),
            opacity_logit: plane(),
            dc: [(); 3].map(|()| plane()),
            sh: next.collect(),
        }
    };
    (0..rows.div_ceil(CHUNK)).map(part).collect()
}
