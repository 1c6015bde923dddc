//! Which Gaussians may touch what is drawn, sixteen at a time.
#![expect(clippy::arithmetic_side_effects, reason = "vectors of floats; counts of Gaussians in memory")]
#![expect(clippy::indexing_slicing, reason = "rows are those of the frame; lanes and axes are constants")]

use super::Sight;
use super::block::Block;
use super::lanes::{Lanes, TILE};
use super::project::{LOW_PASS, seen_slopes};
use super::tile::exp2;
use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use splatstream_gaussians::GaussianFrame;
use std::f32::consts::LOG2_E;
use std::ops::Range;

/// Gaussians that a thread looks at at once.
const CHUNK: usize = 1 << 14;

/// Where alpha falls below 1/255 of the most, in widths, with room for rounding.
const WIDTHS: f32 = 3.4;

/// Logarithms of axes to the base of 2 beyond which axes count as these: the vector exponential knows no more.
const MOST_LOG2: f32 = 120.0;

/// The Gaussians that may touch what is drawn, by rising row: all that touch it, and few that do not. Each is in a box
/// around its projection, which is compared with the picture and with its strips.
pub(super) fn reachable(frame: &GaussianFrame, sight: &Sight<'_>) -> Vec<u32> {
    let boxes = Boxes::new(sight);
    let count = frame.len();
    let starts: Vec<usize> = (0..count).step_by(CHUNK).collect();
    let chunk = |&start: &usize| {
        let rows = start..count.min(start + CHUNK);
        pulp::Arch::new().dispatch(FindChunk { frame, boxes: &boxes, rows })
    };
    let chunks: Vec<Vec<u32>> = starts.par_iter().map(chunk).collect();
    chunks.concat()
}

/// A view, as boxes need it.
struct Boxes {
    rotation: [[f32; 3]; 3],
    position: [f32; 3],
    focal: [f32; 2],
    principal: [f32; 2],
    size: [f32; 2],
    slopes: [(f32, f32); 2],
    first: f32,
    every: f32,
}

/// Sixteen Gaussians.
struct Some16 {
    /// From the camera.
    offset: [Lanes; 3],
    /// Quaternions of any length but 0.
    rotation: [Lanes; 4],
    /// Semi-axes, slightly enlarged.
    axes: [Lanes; 3],
}

impl Boxes {
    fn new(sight: &Sight<'_>) -> Self {
        let camera = sight.camera;
        Self {
            rotation: camera.rotation,
            position: camera.position,
            focal: camera.focal,
            principal: camera.principal,
            size: [camera.width as f32, camera.height as f32],
            slopes: seen_slopes(camera),
            first: sight.strips.first as f32,
            every: sight.strips.every.max(1) as f32,
        }
    }

    /// Whether each of sixteen Gaussians may touch what is drawn, 1, or not, 0. What is not finite may.
    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "what is read of each lane stands in many arrays")]
    fn touch(&self, some: &Some16) -> [u32; TILE] {
        let [right, down, ahead] = self.rotation;
        let ([focal_x, focal_y], [middle_x, middle_y]) = (self.focal, self.principal);
        let ([width, height], [slopes_x, slopes_y]) = (self.size, self.slopes);
        let mut touch = [0; TILE];
        for lane in 0..TILE {
            let offset = [some.offset[0][lane], some.offset[1][lane], some.offset[2][lane]];
            let depth = dot(ahead, offset);
            let near = 1.0 / depth;
            let (slope_x, slope_y) = (dot(right, offset) * near, dot(down, offset) * near);
            let axes = some.world_axes(lane);
            let reach_x = reach(right, ahead, slope_x.max(slopes_x.0).min(slopes_x.1), focal_x * near, axes);
            let reach_y = reach(down, ahead, slope_y.max(slopes_y.0).min(slopes_y.1), focal_y * near, axes);
            let (x, y) = (focal_x * slope_x + middle_x, focal_y * slope_y + middle_y);
            // The first strip that ends below the top begins above the bottom.
            let top = (y - reach_y) / TILE as f32 - self.first;
            let bottom = (y + reach_y) / TILE as f32 - self.first;
            let strip = ((top - 1.0) / self.every).ceil() * self.every;
            let is_out = (depth <= 0.0)
                | (x + reach_x < 0.0)
                | (x - reach_x > width)
                | (y + reach_y < 0.0)
                | (y - reach_y > height)
                | (strip > bottom);
            touch[lane] = u32::from(!is_out);
        }
        touch
    }
}

/// How far a Gaussian reaches along an axis of the picture, pixels: `seen` is its slope as far as the Jacobian follows it.
#[inline(always)]
fn reach(across: [f32; 3], ahead: [f32; 3], seen: f32, scale: f32, axes: [[f32; 3]; 3]) -> f32 {
    let row = [
        (across[0] - ahead[0] * seen) * scale,
        (across[1] - ahead[1] * seen) * scale,
        (across[2] - ahead[2] * seen) * scale,
    ];
    let widths = [dot(row, axes[0]), dot(row, axes[1]), dot(row, axes[2])];
    WIDTHS * (dot(widths, widths) + LOW_PASS).sqrt() + 1.0
}

impl Some16 {
    /// Of at most sixteen rows of a frame, seen from a position.
    #[inline(always)]
    fn new(frame: &GaussianFrame, block: &Block, position: [f32; 3]) -> Self {
        let mut offset = frame.position().each_ref().map(|plane| block.of(plane));
        for (lanes, position) in offset.iter_mut().zip(position) {
            lanes.iter_mut().for_each(|lane| *lane -= position);
        }
        let mut axes = frame.log_scale().each_ref().map(|plane| block.of(plane));
        for axis in &mut axes {
            for lane in axis {
                *lane = 1.001 * exp2((LOG2_E * *lane).clamp(-MOST_LOG2, MOST_LOG2));
            }
        }
        Self { offset, rotation: frame.rotation().each_ref().map(|plane| block.of(plane)), axes }
    }

    /// The semi-axes of one as vectors in the world.
    #[inline(always)]
    fn world_axes(&self, lane: usize) -> [[f32; 3]; 3] {
        let [w, x, y, z] = &self.rotation;
        let (w, x, y, z) = (w[lane], x[lane], y[lane], z[lane]);
        let two = 2.0 / (w * w + x * x + y * y + z * z);
        let (a, b, c) = (self.axes[0][lane], self.axes[1][lane], self.axes[2][lane]);
        [
            [(1.0 - two * (y * y + z * z)) * a, two * (x * y + w * z) * a, two * (x * z - w * y) * a],
            [two * (x * y - w * z) * b, (1.0 - two * (x * x + z * z)) * b, two * (y * z + w * x) * b],
            [two * (x * z + w * y) * c, two * (y * z - w * x) * c, (1.0 - two * (x * x + y * y)) * c],
        ]
    }
}

#[inline(always)]
fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Finds those of some rows.
struct FindChunk<'a> {
    frame: &'a GaussianFrame,
    boxes: &'a Boxes,
    rows: Range<usize>,
}

impl WithSimd for FindChunk<'_> {
    type Output = Vec<u32>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let Self { frame, boxes, rows } = self;
        let mut found = Vec::with_capacity(rows.len());
        for start in rows.clone().step_by(TILE) {
            let block = Block::new(start..rows.end.min(start + TILE));
            let touch = boxes.touch(&Some16::new(frame, &block, boxes.position));
            let rows = block.rows().filter(|&(lane, _)| touch[lane] != 0);
            found.extend(rows.map(|(_, row)| row as u32));
        }
        found.shrink_to_fit();
        found
    }
}
