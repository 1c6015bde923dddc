//! Pictures in 64 bits by the formulas of the renderer, every Gaussian at every pixel, without tiles; and their slopes by
//! central differences.
//!
//! What the renderer chooses (which Gaussians a pixel has, in what order, where alpha or the slope of a projection is
//! clamped, where a pixel is done) is decided once, and then holds for all differences. Where such a choice hangs by less
//! than rounding, the model says so, and nothing is compared there.

use splatstream_gaussians::{GaussianFrame, sh_basis};
use splatstream_render::Camera;

/// Planes of a frame in 64 bits, in the order of [`splatstream_gaussians::Planes::iter`].
pub(crate) type Values = Vec<Vec<f64>>;

pub(crate) fn values(frame: &GaussianFrame) -> Values {
    frame.planes().iter().map(|plane| plane.iter().map(|&value| f64::from(value)).collect()).collect()
}

/// A view of a frame.
pub(crate) struct Model<'a> {
    pub(crate) camera: &'a Camera,
    pub(crate) background: [f64; 3],
    pub(crate) antialiased: bool,
    pub(crate) sh_degree: u8,
}

/// What a view has chosen.
pub(crate) struct Choices {
    /// Of each Gaussian, slopes of the projection that are clamped.
    pub(crate) clamped: Vec<[Option<f64>; 2]>,
    /// Of each pixel, its Gaussians, nearest first, and whether their alpha is clamped.
    pub(crate) pixels: Vec<Vec<(usize, bool)>>,
    /// How many pixels are done before their last Gaussian.
    pub(crate) done: usize,
    /// Pixels where a choice hangs by rounding.
    pub(crate) doubtful: Vec<bool>,
}

/// A Gaussian as the camera sees it.
struct Seen {
    centre: [f64; 2],
    /// Covariance with the low-pass filter, and its determinant.
    covariance: [f64; 3],
    determinant: f64,
    opacity: f64,
    colour: [f64; 3],
}

const LOW_PASS: f64 = 0.3;
const MAX_ALPHA: f64 = 0.99;
/// How near log2 of alpha, or of what passes, may be to a limit.
const DOUBT: f64 = 5e-3;

fn dot(p: [f64; 3], q: [f64; 3]) -> f64 {
    p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
}

impl Model<'_> {
    fn offset(&self, values: &Values, row: usize) -> [f64; 3] {
        [0, 1, 2].map(|axis| values[axis][row] - f64::from(self.camera.position[axis]))
    }

    fn in_camera(&self, values: &Values, row: usize) -> [f64; 3] {
        let offset = self.offset(values, row);
        self.camera.rotation.map(|axis| dot(axis.map(f64::from), offset))
    }

    /// The slope along an axis, clamped to the picture and 15 % on either side.
    fn clamp(&self, ratio: f64, axis: usize) -> Option<f64> {
        let size = f64::from([self.camera.width, self.camera.height][axis]);
        let (focal, principal) = (f64::from(self.camera.focal[axis]), f64::from(self.camera.principal[axis]));
        let (least, most) = (-(principal + 0.15 * size) / focal, (1.15 * size - principal) / focal);
        let held = ratio.clamp(least, most);
        (held != ratio).then_some(held)
    }

    fn seen(&self, values: &Values, row: usize, clamped: [Option<f64>; 2]) -> Seen {
        let at = self.in_camera(values, row);
        let focal = self.camera.focal.map(f64::from);
        let ratios = [at[0] / at[2], at[1] / at[2]];
        let jacobian = [0, 1].map(|axis| {
            let slope = clamped[axis].unwrap_or(ratios[axis]);
            let mut line = [0.0, 0.0, -focal[axis] / at[2] * slope];
            line[axis] = focal[axis] / at[2];
            // Into the world.
            [0, 1, 2].map(|k| (0..3).map(|r| line[r] * f64::from(self.camera.rotation[r][k])).sum::<f64>())
        });
        let axes = semi_axes(values, row);
        let [u, v] = jacobian.map(|line| axes.map(|axis| dot(line, axis)));
        let (a, b, c) = (dot(u, u), dot(u, v), dot(v, v));
        let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        let determinant = dot(cross, cross) + LOW_PASS * (a + c + LOW_PASS);
        let kept = if self.antialiased { (dot(cross, cross) / determinant).sqrt() } else { 1.0 };
        Seen {
            centre: [0, 1].map(|axis| focal[axis] * ratios[axis] + f64::from(self.camera.principal[axis])),
            covariance: [a + LOW_PASS, b, c + LOW_PASS],
            determinant,
            opacity: kept / (1.0 + (-values[10][row]).exp()),
            colour: self.colour(values, row),
        }
    }

    fn colour(&self, values: &Values, row: usize) -> [f64; 3] {
        let offset = self.offset(values, row);
        let length = dot(offset, offset).sqrt();
        let basis = sh_basis(offset.map(|part| part / length));
        let coefficients = usize::from(self.sh_degree + 1).pow(2) - 1;
        [0, 1, 2].map(|channel| {
            let rest = (0..coefficients).map(|k| basis[k] * values[14 + 3 * k + channel][row]).sum::<f64>();
            (0.5 + 0.282_094_791_773_878_14 * values[11 + channel][row] + rest).max(0.0)
        })
    }

    /// What a pixel gets of a Gaussian, before the least and the most.
    fn alpha(seen: &Seen, [x, y]: [usize; 2]) -> f64 {
        let (dx, dy) = (x as f64 + 0.5 - seen.centre[0], y as f64 + 0.5 - seen.centre[1]);
        let [_, b, c] = seen.covariance;
        // (c dx² - 2 b dx dy + a dy²) / determinant, as a sum of squares.
        let along = dx - b / c * dy;
        let distance = c / seen.determinant * along * along + dy * dy / c;
        seen.opacity * (-0.5 * distance).exp()
    }

    /// As the renderer has it: a share of the mean of the bits of the depths.
    fn near(&self, frame: &GaussianFrame) -> f64 {
        let depths = (0..frame.len()).map(|row| {
            let [x, y, z] = [0, 1, 2].map(|axis| frame.position()[axis][row] - self.camera.position[axis]);
            let [a, b, c] = self.camera.rotation[2];
            a * x + b * y + c * z
        });
        let bits: Vec<u64> =
            depths.filter(|&depth| depth > 0.0).map(|depth| u64::from(depth.to_bits())).collect();
        let mean = bits.iter().sum::<u64>() / bits.len().max(1) as u64;
        f64::from(f32::from_bits(mean as u32)) / 256.0
    }

    pub(crate) fn choose(&self, frame: &GaussianFrame) -> Choices {
        let values = values(frame);
        let near = self.near(frame);
        let clamped: Vec<[Option<f64>; 2]> = (0..frame.len())
            .map(|row| {
                let at = self.in_camera(&values, row);
                [0, 1].map(|axis| self.clamp(at[axis] / at[2], axis))
            })
            .collect();
        let mut order: Vec<(f64, usize)> =
            (0..frame.len()).map(|row| (self.in_camera(&values, row)[2], row)).collect();
        order.retain(|&(depth, _)| depth >= near);
        order.sort_by(|one, other| one.0.total_cmp(&other.0));
        let seen: Vec<Seen> = order.iter().map(|&(_, row)| self.seen(&values, row, clamped[row])).collect();
        let (width, height) = (self.camera.width as usize, self.camera.height as usize);
        let mut choices = Choices { clamped, pixels: Vec::new(), done: 0, doubtful: Vec::new() };
        for pixel in 0..width * height {
            let (mut drawn, mut doubtful, mut passing) = (Vec::new(), false, 1.0);
            for (&(_, row), seen) in order.iter().zip(&seen) {
                let alpha = Self::alpha(seen, [pixel % width, pixel / width]);
                doubtful |= near_to(alpha, 1.0 / 255.0) || near_to(alpha, MAX_ALPHA);
                if alpha < 1.0 / 255.0 {
                    continue;
                }
                let after = passing * (1.0 - alpha.min(MAX_ALPHA));
                doubtful |= near_to(after, 1e-4);
                if after < 1e-4 {
                    choices.done += 1;
                    break;
                }
                passing = after;
                drawn.push((row, alpha > MAX_ALPHA));
            }
            choices.pixels.push(drawn);
            choices.doubtful.push(doubtful);
        }
        choices
    }

    /// The picture, by choices made before.
    pub(crate) fn picture(&self, values: &Values, choices: &Choices) -> Vec<[f64; 3]> {
        let rows = 0..values[0].len();
        let seen: Vec<Seen> = rows.map(|row| self.seen(values, row, choices.clamped[row])).collect();
        let width = self.camera.width as usize;
        let blend = |(pixel, drawn): (usize, &Vec<(usize, bool)>)| {
            let (mut light, mut passing) = ([0.0; 3], 1.0);
            for &(row, is_clamped) in drawn {
                let alpha = Self::alpha(&seen[row], [pixel % width, pixel / width]);
                let alpha = if is_clamped { MAX_ALPHA } else { alpha };
                for (light, colour) in light.iter_mut().zip(seen[row].colour) {
                    *light += passing * alpha * colour;
                }
                passing *= 1.0 - alpha;
            }
            [0, 1, 2].map(|channel| light[channel] + passing * self.background[channel])
        };
        choices.pixels.iter().enumerate().map(blend).collect()
    }

    /// Slopes of Σ weight · picture by every value.
    pub(crate) fn differences(&self, values: &Values, choices: &Choices, weights: &[[f64; 3]]) -> Values {
        let loss = |values: &Values| {
            let picture = self.picture(values, choices);
            picture.iter().flatten().zip(weights.iter().flatten()).map(|(c, g)| c * g).sum::<f64>()
        };
        let mut values = values.clone();
        let mut slopes = values.clone();
        for plane in 0..values.len() {
            for row in 0..values[plane].len() {
                let value = values[plane][row];
                let step = 1e-5 * value.abs().max(0.1);
                values[plane][row] = value + step;
                let more = loss(&values);
                values[plane][row] = value - step;
                slopes[plane][row] = (more - loss(&values)) / (2.0 * step);
                values[plane][row] = value;
            }
        }
        slopes
    }
}

fn near_to(value: f64, limit: f64) -> bool {
    (value / limit).log2().abs() < DOUBT
}

/// Columns of the rotation, as long as the semi-axes.
fn semi_axes(values: &Values, row: usize) -> [[f64; 3]; 3] {
    let [w, x, y, z] = [6, 7, 8, 9].map(|plane| values[plane][row]);
    let s = 2.0 / (w * w + x * x + y * y + z * z);
    let matrix = [
        [1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)],
        [s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x)],
        [s * (x * z - w * y), s * (y * z + w * x), 1.0 - s * (x * x + y * y)],
    ];
    [0, 1, 2].map(|k| [0, 1, 2].map(|r| matrix[r][k] * values[3 + k][row].exp()))
}
