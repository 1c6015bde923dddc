//! Gaussians to ellipses in a small picture, sixteen at a time.
#![expect(clippy::indexing_slicing, reason = "lanes and axes are constants")]

use super::SmallView;
use super::rows::VALUES;
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
    /// The first and the last line of the picture that it is blended into; neither is below 0.
    pub(super) lines: [f32; 2],
}

/// Sixteen Gaussians as a camera sees them.
pub(super) struct Projected {
    centre: [Lanes; 2],
    xx: Lanes,
    skew: Lanes,
    yy: Lanes,
    peak: Lanes,
    /// The first and the last line.
    lines: [Lanes; 2],
    /// Whether each shows.
    is_seen: [bool; TILE],
    /// Red, green and blue without what depends on where they are seen from, at least 0.
    colour: [Lanes; 3],
}

impl Projected {
    /// What is not finite does not show.
    #[inline(always)]
    pub(super) fn new(values: &[Lanes; VALUES], is_compensated: bool, view: &SmallView) -> Self {
        let SmallView { camera, fine, near } = view;
        let zero = [0.0; TILE];
        let mut all = Self {
            centre: [zero; 2],
            xx: zero,
            skew: zero,
            yy: zero,
            peak: zero,
            lines: [zero; 2],
            is_seen: [false; TILE],
            colour: [zero; 3],
        };
        let [px, py, pz, ax, ay, az, bx, by, bz, cx, cy, cz, opacity, red, green, blue] = values;
        all.colour = [*red, *green, *blue];
        let (position, axes) = ([px, py, pz], [[ax, ay, az], [bx, by, bz], [cx, cy, cz]]);
        let ([right, down, ahead], from) = (camera.rotation, camera.position);
        let [(least_x, most_x), (least_y, most_y)] = seen_slopes(camera);
        let (focal, principal) = (camera.focal, camera.principal);
        let fine_pass = LOW_PASS * fine * fine;
        let [width, height] = [camera.width as f32, camera.height as f32];
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
            let [x, y] = [0, 1].map(|axis: usize| focal[axis] * slope[axis] + principal[axis]);
            let (flat, peak) = (1.0 / tall, opacity[lane] * (covered / determinant).sqrt());
            all.centre[0][lane] = x;
            all.centre[1][lane] = y;
            all.xx[lane] = tall / determinant;
            all.skew[lane] = -xy / tall;
            all.yy[lane] = flat;
            all.peak[lane] = peak;
            // How far it is blended.
            let [across, along] = [(REACH * wide).sqrt(), (REACH * tall).sqrt()];
            let reach = (REACH / flat).sqrt();
            let (top, bottom) = ((y - reach - 0.5).ceil(), (y + reach - 0.5).floor());
            let top = if top > 0.0 { top } else { 0.0 };
            let bottom = if bottom < height - 1.0 { bottom } else { height - 1.0 };
            all.lines[0][lane] = top;
            all.lines[1][lane] = bottom;
            all.is_seen[lane] = (depth >= *near)
                & (depth < f32::INFINITY)
                & (peak >= LEAST_ALPHA)
                & (x + across >= 0.0)
                & (x - across <= width)
                & (across < f32::INFINITY)
                & (y + along >= 0.0)
                & (y - along <= height)
                & (along < f32::INFINITY)
                & (top <= bottom);
        }
        all
    }

    /// Whether a lane shows in the picture.
    #[inline(always)]
    pub(super) fn is_seen(&self, lane: usize) -> bool {
        self.is_seen[lane]
    }

    /// The colour of a lane.
    #[inline(always)]
    pub(super) fn colour(&self, lane: usize) -> [f32; 3] {
        self.colour.each_ref().map(|lanes| lanes[lane])
    }

    /// The ellipse of a lane.
    #[inline(always)]
    pub(super) fn ellipse(&self, lane: usize) -> Ellipse {
        Ellipse {
            centre: self.centre.each_ref().map(|lanes| lanes[lane]),
            xx: self.xx[lane],
            skew: self.skew[lane],
            yy: self.yy[lane],
            peak: self.peak[lane],
            lines: self.lines.each_ref().map(|lanes| lanes[lane]),
        }
    }
}

#[inline(always)]
pub(super) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
