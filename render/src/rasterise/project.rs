//! Gaussians to ellipses in the picture, nearest first.
#![expect(clippy::arithmetic_side_effects, reason = "vectors of floats; counts of Gaussians in memory")]
#![expect(clippy::indexing_slicing, reason = "rows are those of the frame; axes are constants")]

use super::block::Block;
use super::lanes::TILE;
use super::{Sight, Strips};
use crate::camera::Camera;
use glam::{Mat3, Vec3};
use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use splatstream_gaussians::GaussianFrame;
use std::f32::consts::LOG2_E;
use std::ops::Range;

/// Gaussians nearer to the camera's plane than this share of the mean depth are not drawn: see [`near`].
const NEAR: f32 = 1.0 / 256.0;

/// Variance that the low-pass filter adds on each axis, square pixels.
pub const LOW_PASS: f32 = 0.3;

/// -log2 of the least alpha drawn, 1/255.
pub(crate) const LOG2_255: f32 = 7.994_353_4;

/// Gaussians that a thread projects at once.
const CHUNK: usize = 4096;

/// An ellipse in the picture. log2 of alpha at an offset from the centre is
/// `peak + xx·(dx + skew·dy)² + yy·dy²`.
///
/// No term is above 0, so that rounding never makes alpha larger than the opacity, and long thin ellipses keep
/// their shape far from their centre: `xx·dx² + xy·dx·dy + yy·dy²` would be a small difference of large terms.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Splat {
    /// Centre, pixels.
    pub(crate) centre: [f32; 2],
    /// Quadratic form.
    pub(crate) xx: f32,
    pub(crate) skew: f32,
    pub(crate) yy: f32,
    /// log2 of the opacity.
    pub(crate) peak: f32,
    /// How far alpha is 1/255 or more, along x and y, pixels.
    pub(crate) extent: [f32; 2],
    /// Red, green and blue as the camera sees them, at least 0.
    pub(crate) colour: [f32; 3],
    /// Which Gaussian of the frame.
    pub(crate) gaussian: u32,
}

/// What is the same in all views of a frame.
pub(crate) struct Shapes {
    /// The semi-axes of each Gaussian as vectors in the world.
    axes: Vec<[Vec3; 3]>,
    /// The longest semi-axis of each Gaussian.
    longest: Vec<f32>,
    /// Opacity of each Gaussian.
    opacity: Vec<f32>,
}

impl Shapes {
    pub(crate) fn of(frame: &GaussianFrame) -> Self {
        let rows = (0..frame.len()).into_par_iter().with_min_len(CHUNK);
        let axes: Vec<[Vec3; 3]> = rows.map(|row| semi_axes(frame, row)).collect();
        let squared = |axes: &[Vec3; 3]| axes.map(Vec3::length_squared).into_iter().fold(0.0, f32::max);
        let longest = axes.par_iter().with_min_len(CHUNK).map(|axes| squared(axes).sqrt()).collect();
        let rows = (0..frame.len()).into_par_iter().with_min_len(CHUNK);
        Self { axes, longest, opacity: rows.map(|row| opacity(frame, row)).collect() }
    }

    /// The semi-axes of a Gaussian.
    pub(crate) fn axes(&self, row: usize) -> [Vec3; 3] {
        self.axes[row]
    }

    /// The shape of a Gaussian.
    #[inline(always)]
    fn one(&self, row: usize) -> Shape {
        Shape { axes: self.axes[row], longest: self.longest[row], opacity: self.opacity[row] }
    }
}

/// What is the same of a Gaussian in all views.
struct Shape {
    axes: [Vec3; 3],
    longest: f32,
    opacity: f32,
}

/// The ellipses of the Gaussians that touch the picture, nearest first; `near` is the least depth that is drawn.
pub(crate) fn project(frame: &GaussianFrame, shapes: &Shapes, sight: &Sight<'_>, near: f32) -> Vec<Splat> {
    let view = View::new(frame, sight, near);
    let count = frame.len();
    let starts: Vec<usize> = (0..count).step_by(CHUNK).collect();
    let chunk = |&start: &usize| {
        let rows = start..count.min(start + CHUNK);
        pulp::Arch::new().dispatch(ProjectChunk { view: &view, shapes, rows })
    };
    let chunks: Vec<Vec<(f32, Splat)>> = starts.par_iter().map(chunk).collect();
    // Positive floats order as their bits; equal depths keep the order of the frame.
    let key = |((depth, _), place): (&(f32, Splat), usize)| u64::from(depth.to_bits()) << 32 | place as u64;
    let places = starts.iter().zip(&chunks).flat_map(|(&start, chunk)| chunk.iter().zip(start..));
    let mut keys: Vec<u64> = places.map(key).collect();
    keys.par_sort_unstable();
    let splat = |key: &u64| {
        let place = *key as u32 as usize;
        chunks[place / CHUNK][place % CHUNK].1
    };
    keys.par_iter().map(splat).collect()
}

/// Projects some Gaussians.
struct ProjectChunk<'a> {
    view: &'a View<'a>,
    shapes: &'a Shapes,
    rows: Range<usize>,
}

impl WithSimd for ProjectChunk<'_> {
    type Output = Vec<(f32, Splat)>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let Self { view, shapes, rows } = self;
        let mut splats = Vec::with_capacity(rows.len());
        for start in rows.clone().step_by(TILE) {
            let block = Block::new(start..rows.end.min(start + TILE));
            let first = splats.len();
            for (lane, row) in block.rows() {
                if let Some((depth, splat)) = view.ellipse(row, &shapes.one(row)) {
                    // Until the colours of the block are there, the lane that it is at.
                    splats.push((depth, Splat { colour: [lane as f32; 3], ..splat }));
                }
            }
            if splats.len() > first {
                let colours = block.colours(view.frame, view.position.to_array());
                for (_, splat) in &mut splats[first..] {
                    let lane = splat.colour[0] as usize;
                    splat.colour = [colours[0][lane], colours[1][lane], colours[2][lane]];
                }
            }
        }
        splats.shrink_to_fit();
        splats
    }
}

/// A frame and a camera, as projection needs them.
struct View<'a> {
    frame: &'a GaussianFrame,
    to_camera: Mat3,
    rows: [Vec3; 3],
    position: Vec3,
    /// The least depth that is drawn, scene units.
    near: f32,
    focal: [f32; 2],
    principal: [f32; 2],
    size: [f32; 2],
    strips: Strips,
    slopes: [(f32, f32); 2],
}

impl<'a> View<'a> {
    fn new(frame: &'a GaussianFrame, sight: &Sight<'_>, near: f32) -> Self {
        let camera = sight.camera;
        let to_camera = Mat3::from_cols_array_2d(&camera.rotation).transpose();
        let size = [camera.width as f32, camera.height as f32];
        Self {
            frame,
            to_camera,
            rows: camera.rotation.map(Vec3::from),
            position: camera.position.into(),
            near,
            focal: camera.focal,
            principal: camera.principal,
            size,
            strips: sight.strips,
            slopes: seen_slopes(camera),
        }
    }

    /// The depth of a Gaussian, and its ellipse without colour; none if it cannot be seen.
    #[inline(always)]
    fn ellipse(&self, row: usize, shape: &Shape) -> Option<(f32, Splat)> {
        // Arrays are spelled out, here and below: closures of `map` are not compiled for the machine unless they are inlined.
        let [x, y, z] = self.frame.position();
        let offset = Vec3::new(x[row], y[row], z[row]) - self.position;
        let at = self.to_camera * offset;
        if at.z.is_nan() || at.z < self.near || self.is_outside(at, shape.longest) {
            return None;
        }
        let Covariance { xx, xy, yy, determinant: sharp } = self.covariance(shape, at);
        let (wide, tall) = (xx + LOW_PASS, yy + LOW_PASS);
        let determinant = sharp + LOW_PASS * (xx + tall);
        let kept = if self.frame.antialiased() { (sharp / determinant).sqrt() } else { 1.0 };
        let opacity = shape.opacity * kept;
        let peak = libm::log2f(opacity);
        // Squared Mahalanobis distance at which alpha is 1/255.
        let reach = 2.0 / LOG2_E * (peak + LOG2_255);
        if !(reach > 0.0 && determinant.is_finite()) {
            return None;
        }
        let centre = [
            self.focal[0] * (at.x / at.z) + self.principal[0],
            self.focal[1] * (at.y / at.z) + self.principal[1],
        ];
        let extent = [(reach * wide).sqrt(), (reach * tall).sqrt()];
        let touches = |axis: usize| {
            centre[axis] + extent[axis] >= 0.0 && centre[axis] - extent[axis] <= self.size[axis]
        };
        if !(touches(0) && touches(1) && extent[0].is_finite() && extent[1].is_finite()) {
            return None;
        }
        if !self.is_in_strips(centre[1] - extent[1], centre[1] + extent[1]) {
            return None;
        }
        let splat = Splat {
            centre,
            xx: -0.5 * LOG2_E * (tall / determinant),
            skew: -xy / tall,
            yy: -0.5 * LOG2_E / tall,
            peak,
            extent,
            colour: [0.0; 3],
            gaussian: row as u32,
        };
        Some((at.z, splat))
    }

    /// Whether a Gaussian surely touches nothing that is drawn: by a circle around it in which it is, with room for
    /// rounding.
    #[inline(always)]
    fn is_outside(&self, at: Vec3, longest: f32) -> bool {
        let near = 1.0 / at.z;
        let mut bounds = [(0.0, 0.0); 2];
        for axis in 0..2 {
            let slope = at[axis] * near;
            let (least, most) = self.slopes[axis];
            let seen = slope.clamp(least, most);
            let scale = self.focal[axis] * near * longest;
            let reach = 3.4 * (scale * scale * (1.0 + seen * seen) + LOW_PASS).sqrt() + 1.0;
            let centre = self.focal[axis] * slope + self.principal[axis];
            bounds[axis] = (centre - reach, centre + reach);
        }
        let is_beside = (0..2).any(|axis: usize| bounds[axis].1 < 0.0 || bounds[axis].0 > self.size[axis]);
        is_beside || !self.is_in_strips(bounds[1].0, bounds[1].1)
    }

    /// Whether lines between these belong to a strip that is drawn. What is not finite does.
    #[inline(always)]
    fn is_in_strips(&self, top: f32, bottom: f32) -> bool {
        let every = self.strips.every as f32;
        if self.strips.every <= 1 {
            return true;
        }
        let first = self.strips.first as f32;
        let (top, bottom) = (top / TILE as f32 - first, bottom / TILE as f32 - first);
        // The first strip that ends below the top begins above the bottom.
        let strip = ((top - 1.0) / every).ceil() * every;
        strip <= bottom || strip.is_nan()
    }

    /// Covariance of the projection, without low-pass.
    #[inline(always)]
    fn covariance(&self, shape: &Shape, at: Vec3) -> Covariance {
        let near = 1.0 / at.z;
        let [(least_x, most_x), (least_y, most_y)] = self.slopes;
        let (x, y) = ((at.x * near).clamp(least_x, most_x), (at.y * near).clamp(least_y, most_y));
        let across = (self.rows[0] - self.rows[2] * x) * (self.focal[0] * near);
        let down = (self.rows[1] - self.rows[2] * y) * (self.focal[1] * near);
        let [a, b, c] = shape.axes;
        let u = Vec3::new(across.dot(a), across.dot(b), across.dot(c));
        let v = Vec3::new(down.dot(a), down.dot(b), down.dot(c));
        // Lagrange's identity: never negative, where |u|²·|v|² - (u·v)² may lose every digit.
        let determinant = u.cross(v).length_squared();
        Covariance { xx: u.length_squared(), xy: u.dot(v), yy: v.length_squared(), determinant }
    }
}

/// Slopes beyond which the Jacobian is not followed: the picture and 15 % on either side.
pub(crate) fn seen_slopes(camera: &Camera) -> [(f32, f32); 2] {
    let size = [camera.width as f32, camera.height as f32];
    [0, 1].map(|axis| {
        let (focal, principal) = (camera.focal[axis], camera.principal[axis]);
        let margin = 0.15 * size[axis] / focal;
        (-(principal / focal + margin), (size[axis] - principal) / focal + margin)
    })
}

/// The near plane of a view, scene units: a share of the geometric mean of the depths in front of the camera, so that
/// a scene looks the same in any unit of length, and far Gaussians hardly move it.
///
/// The bits of a positive float, read as an integer, are close to a logarithm of it: their mean is exact and does not
/// depend on the order.
pub(crate) fn near(frame: &GaussianFrame, camera: &Camera) -> f32 {
    let [x, y, z] = frame.position();
    let [ahead, position] = [camera.rotation[2], camera.position].map(Vec3::from);
    let depth = |row: usize| ahead.dot(Vec3::new(x[row], y[row], z[row]) - position);
    let rows = (0..frame.len()).into_par_iter().with_min_len(CHUNK);
    let in_front = rows.map(depth).filter(|depth| *depth > 0.0 && depth.is_finite());
    let (sum, count) = in_front
        .map(|depth| (u64::from(depth.to_bits()), 1))
        .reduce(|| (0, 0), |one, other| (one.0 + other.0, one.1 + other.1));
    let mean = sum.checked_div(count).unwrap_or_default();
    (NEAR * f32::from_bits(mean as u32)).max(f32::MIN_POSITIVE)
}

/// Covariance in the picture, square pixels.
struct Covariance {
    xx: f32,
    xy: f32,
    yy: f32,
    determinant: f32,
}

/// Opacity of a Gaussian.
pub(crate) fn opacity(frame: &GaussianFrame, row: usize) -> f32 {
    1.0 / (1.0 + libm::expf(-frame.opacity_logit()[row]))
}

/// The semi-axes of a Gaussian as vectors in the world.
pub(crate) fn semi_axes(frame: &GaussianFrame, row: usize) -> [Vec3; 3] {
    let [w, x, y, z] = frame.rotation().each_ref().map(|plane| plane[row]);
    let scale = 1.0 / (w * w + x * x + y * y + z * z).sqrt();
    let [w, x, y, z] = [w, x, y, z].map(|part| part * scale);
    let [a, b, c] = frame.log_scale().each_ref().map(|plane| libm::expf(plane[row]));
    [
        Vec3::new(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)) * a,
        Vec3::new(2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)) * b,
        Vec3::new(2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)) * c,
    ]
}
