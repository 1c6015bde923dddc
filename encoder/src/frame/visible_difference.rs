//! What pictures show of the difference between two Gaussians, estimated from what they show of one of them.
//!
//! A Gaussian that is taken away changes the pictures by its [loss](splatstream_render::contribution::Worth::loss). One that moves, grows or turns a
//! little changes them by a part of that: the part of its own square that the difference of two bells has. Its colour
//! changes them by the square of the change times its [energy](splatstream_render::contribution::Worth::energy).
#![expect(clippy::indexing_slicing, reason = "axes are 0, 1 and 2; rows are those of the frame")]

use super::axis_matching::Pose;
use crate::canonical::product;
use pulp::{Simd, WithSimd};
use splatstream_gaussians::GaussianFrame;
use splatstream_render::Camera;
use splatstream_render::rasterise::LOW_PASS;

/// The square of a bell's derivative by its place in units of its width, and by the log of its width on one axis, as a
/// part of its own square. Each axis is seen from two of three sides.
const MOVED: f32 = 0.5 * 2.0 / 3.0;
const GROWN: f32 = 0.75 * 2.0 / 3.0;
/// The same by a turn, which is seen from one of three sides.
const TURNED: f32 = 0.25 * 4.0 / 3.0;

/// Two bells that share nothing differ by both of their squares.
const MOST: f32 = 2.0;

/// The mean square of a spherical harmonic, dc among them.
const HARMONIC: f32 = core::f32::consts::FRAC_1_PI / 4.0;

/// What pictures show of a Gaussian, as shares of the errors allowed in them.
pub(crate) struct Seen {
    pub(crate) loss: f32,
    pub(crate) energy: f32,
    /// The side of a pixel at its place, scene units.
    pub(crate) pixel: f32,
}

/// What pictures show of changes of one Gaussian of the target.
pub(crate) struct Shown {
    loss: f32,
    energy: f32,
    /// Semi-axes behind the low-pass filter of the renderer, scene units, and the part of each square that is the
    /// Gaussian's own, 0 to 1.
    width: [f32; 3],
    share: [f32; 3],
    rotation: [f32; 4],
}

impl Shown {
    /// Of a Gaussian with this pose.
    pub(crate) fn new(seen: &Seen, pose: &Pose) -> Self {
        let squares = pose.log_scale.map(|value| libm::expf(2.0 * value));
        let filtered = squares.map(|square| square + LOW_PASS * seen.pixel * seen.pixel);
        let share = [0, 1, 2].map(|axis: usize| squares[axis] / filtered[axis]);
        Self {
            loss: seen.loss,
            energy: seen.energy,
            width: filtered.map(f32::sqrt),
            share,
            rotation: pose.rotation,
        }
    }

    /// The square of a distance, scene units, in widths of the Gaussian.
    pub(crate) fn widths(&self, apart: [f32; 3]) -> f32 {
        let [w, x, y, z] = self.rotation;
        let local = turned([w, -x, -y, -z], apart);
        local.iter().zip(self.width).map(|(d, width)| (d / width) * (d / width)).sum()
    }

    /// Of a move by a distance, given as the square of [widths](Self::widths).
    pub(crate) fn moved(&self, widths: f32) -> f32 {
        self.loss * (MOVED * widths).min(MOST)
    }

    /// Of a squared change of 1 of the log-scale of an axis.
    pub(crate) fn grown(&self, axis: usize) -> f32 {
        self.loss * GROWN * self.share[axis] * self.share[axis]
    }

    /// Of another rotation.
    #[expect(clippy::arithmetic_side_effects, reason = "axes are 0, 1 and 2")]
    pub(crate) fn turned(&self, rotation: [f32; 4]) -> f32 {
        let [w, x, y, z] = self.rotation;
        let [_, x, y, z] = product([w, -x, -y, -z], rotation);
        let angle = [x, y, z].map(|part| 2.0 * part);
        let part = |axis: usize| {
            let (a, b) = (self.width[(axis + 1) % 3], self.width[(axis + 2) % 3]);
            let unlike = a / b - b / a;
            (angle[axis] * unlike) * (angle[axis] * unlike)
        };
        self.loss * (TURNED * (part(0) + part(1) + part(2))).min(MOST)
    }

    /// Of a squared change of 1 of the opacity logit, between these two.
    pub(crate) fn faded(&self, from: f32, to: f32) -> f32 {
        let opacity = |logit: f32| 1.0 / (1.0 + libm::expf(-logit));
        let (a, b) = (opacity(from), opacity(to));
        let slope = if (to - from).abs() < 0.01 { b * (1.0 - b) } else { (b - a) / (to - from) };
        let relative = slope / b.max(f32::MIN_POSITIVE);
        self.loss * relative * relative
    }

    /// Of a squared change of 1 of a coefficient of colour.
    pub(crate) fn coloured(&self) -> f32 {
        self.energy * HARMONIC
    }
}

/// A vector turned by a unit quaternion, w first.
fn turned([w, x, y, z]: [f32; 4], d: [f32; 3]) -> [f32; 3] {
    let cross = |a: [f32; 3], b: [f32; 3]| {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    };
    let axis = [x, y, z];
    let first = cross(axis, d).map(|part| 2.0 * part);
    let second = cross(axis, first);
    [0, 1, 2].map(|k: usize| d[k] + w * first[k] + second[k])
}

/// The side of a pixel at the place of a Gaussian, scene units; the mean of the cameras.
pub(crate) fn pixel(frame: &GaussianFrame, row: usize, cameras: &[Camera]) -> f32 {
    let mut pixel = [0.0];
    fill_pixels(frame.position().each_ref().map(|plane| &plane[row..=row]), cameras, &mut pixel);
    pixel[0]
}

/// The same of Gaussians at these places: in whole vectors, on every machine the same.
pub(crate) struct Pixels<'a> {
    pub(crate) position: [&'a [f32]; 3],
    pub(crate) cameras: &'a [Camera],
    /// Become the sides.
    pub(crate) pixels: &'a mut [f32],
}

impl WithSimd for Pixels<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        fill_pixels(self.position, self.cameras, self.pixels);
    }
}

#[inline(always)]
fn fill_pixels([x, y, z]: [&[f32]; 3], cameras: &[Camera], pixels: &mut [f32]) {
    pixels.fill(0.0);
    for Camera { position: [from_x, from_y, from_z], focal: [focal, _], .. } in cameras {
        let focal = focal.max(f32::MIN_POSITIVE);
        for (((pixel, x), y), z) in pixels.iter_mut().zip(x).zip(y).zip(z) {
            let [x, y, z] = [x - from_x, y - from_y, z - from_z];
            *pixel += (x * x + y * y + z * z).sqrt() / focal;
        }
    }
    let count = cameras.len().max(1) as f32;
    pixels.iter_mut().for_each(|pixel| *pixel /= count);
}
