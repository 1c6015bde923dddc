//! Gaussians to ellipses in a small picture, sixteen at a time.
#![expect(clippy::indexing_slicing, reason = "lanes and axes are constants")]

use super::rows::VALUES;
use crate::camera::Camera;
use crate::rasterise::{LOW_PASS, Lanes, TILE, seen_slopes};

/// The square of the distance from its centre, in its own widths, to which a Gaussian is blended: beyond are 5 % of it.
pub(super) const REACH: f32 = 6.0;

/// The least alpha in its middle with which a Gaussian is blended.
pub(super) const LEAST_ALPHA: f32 = 1.0 / 255.0;

/// An ellipse in the picture. Its alpha at an offset from the centre is
/// `peak·exp(-(xx·(dx + skew·dy)² + yy·dy²) / 2)`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ellipse {
    /// Pixels.
    pub(super) centre: [f32; 2],
    pub(super) xx: f32,
    pub(super) skew: f32,
    pub(super) yy: f32,
    /// Alpha in the middle.
    pub(super) peak: f32,
    /// Which of the Gaussians that are left.
    pub(super) place: u32,
    /// Red, green and blue without what depends on where it is seen from, at least 0.
    pub(super) colour: [f32; 3],
}

/// Sixteen Gaussians as a camera sees them.
pub(super) struct Projected {
    depth: Lanes,
    centre: [Lanes; 2],
    xx: Lanes,
    skew: Lanes,
    yy: Lanes,
    peak: Lanes,
    /// How far they are blended along x and y, pixels.
    extent: [Lanes; 2],
    /// Red, green and blue.
    colour: [Lanes; 3],
}

impl Projected {
    /// `fine`: the side of a pixel of the picture that this one stands for, pixels of this one.
    #[inline(always)]
    pub(super) fn new(values: &[Lanes; VALUES], is_compensated: bool, camera: &Camera, fine: f32) -> Self {
        let zero = [0.0; TILE];
        let mut all = Self {
            depth: zero,
            centre: [zero; 2],
            xx: zero,
            skew: zero,
            yy: zero,
            peak: zero,
            extent: [zero; 2],
            colour: [zero; 3],
        };
        let [px, py, pz, ax, ay, az, bx, by, bz, cx, cy, cz, opacity, red, green, blue] = values;
        all.colour = [*red, *green, *blue];
        let (position, axes) = ([px, py, pz], [[ax, ay, az], [bx, by, bz], [cx, cy, cz]]);
        let ([right, down, ahead], from) = (camera.rotation, camera.position);
        let [(least_x, most_x), (least_y, most_y)] = seen_slopes(camera);
        let (focal, principal) = (camera.focal, camera.principal);
        let fine_pass = LOW_PASS * fine * fine;
        // Written out number by number: the compiler makes vectors of sixteen lanes of straight lines.
        for lane in 0..TILE {
            let offset = [0, 1, 2].map(|axis: usize| position[axis][lane] - from[axis]);
            let depth = dot(ahead, offset);
            let inverse = 1.0 / depth;
            let slope = [dot(right, offset) * inverse, dot(down, offset) * inverse];
            let (x, y) = (slope[0].max(least_x).min(most_x), slope[1].max(least_y).min(most_y));
            let scale = focal.map(|focal| focal * inverse);
            let across = [0, 1, 2].map(|axis: usize| (right[axis] - ahead[axis] * x) * scale[0]);
            let along = [0, 1, 2].map(|axis: usize| (down[axis] - ahead[axis] * y) * scale[1]);
            let axis = |number: usize| [0, 1, 2].map(|part: usize| axes[number][part][lane]);
            let [a, b, c] = [axis(0), axis(1), axis(2)];
            let u = [dot(across, a), dot(across, b), dot(across, c)];
            let v = [dot(along, a), dot(along, b), dot(along, c)];
            let (xx, xy, yy) = (dot(u, u), dot(u, v), dot(v, v));
            let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
            // Lagrange's identity: never negative.
            let sharp = dot(normal, normal);
            let (wide, tall) = (xx + LOW_PASS, yy + LOW_PASS);
            let determinant = sharp + LOW_PASS * (xx + tall);
            // What it covers in the picture that this one stands for.
            let filtered = sharp + fine_pass * (xx + (yy + fine_pass));
            let covered = if is_compensated { sharp } else { filtered };
            all.depth[lane] = depth;
            all.centre[0][lane] = focal[0] * slope[0] + principal[0];
            all.centre[1][lane] = focal[1] * slope[1] + principal[1];
            all.xx[lane] = tall / determinant;
            all.skew[lane] = -xy / tall;
            all.yy[lane] = 1.0 / tall;
            all.peak[lane] = opacity[lane] * (covered / determinant).sqrt();
            all.extent[0][lane] = (REACH * wide).sqrt();
            all.extent[1][lane] = (REACH * tall).sqrt();
        }
        all
    }

    /// Whether a lane shows in the picture. What is not finite does not.
    #[inline(always)]
    pub(super) fn is_seen(&self, lane: usize, camera: &Camera, near: f32) -> bool {
        let size = [camera.width, camera.height];
        let touches = |axis: usize| {
            let (centre, extent) = (self.centre[axis][lane], self.extent[axis][lane]);
            centre + extent >= 0.0 && centre - extent <= size[axis] as f32 && extent < f32::INFINITY
        };
        let depth = self.depth[lane];
        depth >= near && depth < f32::INFINITY && self.peak[lane] >= LEAST_ALPHA && touches(0) && touches(1)
    }

    /// The ellipse of a lane.
    #[inline(always)]
    pub(super) fn ellipse(&self, lane: usize, place: u32) -> Ellipse {
        Ellipse {
            centre: self.centre.each_ref().map(|lanes| lanes[lane]),
            xx: self.xx[lane],
            skew: self.skew[lane],
            yy: self.yy[lane],
            peak: self.peak[lane],
            place,
            colour: self.colour.each_ref().map(|lanes| lanes[lane]),
        }
    }
}

#[inline(always)]
pub(super) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
