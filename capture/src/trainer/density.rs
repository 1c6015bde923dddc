//! Where Gaussians are added and which are removed.
//!
//! A Gaussian whose centre has steep slopes in pictures stands for too much, or for something beside it. A small one gets a
//! copy that begins somewhere within it; a large one is cut in two along its longest axis. The steepest come first.
//! Removed are those that are nearly transparent, and those so large that they hang before a camera like a fog.
#![expect(clippy::arithmetic_side_effects, reason = "vectors of floats; counts of Gaussians in memory")]
#![expect(clippy::indexing_slicing, reason = "rows are those of the frame, axes constants")]

use super::schedule::Scene;
use glam::{Quat, Vec3};
use splatstream_gaussians::GaussianFrame;
use splatstream_gaussians::activation::{logit, sigmoid};
use splatstream_gaussians::random::SplitMix64;
use splatstream_render::Camera;
use splatstream_render::gradient::Footprint;

/// Mean slope of the loss by the centre in half widths of a picture from which a Gaussian gets a companion.
const STEEP: f64 = 0.000_2;
/// Semi-axes above this share of the scene's extent are large.
const LARGE: f32 = 0.01;
/// Opacity of a Gaussian that is of no use: 0.5 %, as a logit.
const FAINT: f32 = -5.293_3;
/// A longest semi-axis above this share of the distance to the nearest camera is fog.
const FOG: f32 = 0.5;
/// Of half of a Gaussian that is cut in two: its middle, in semi-axes of the whole, and its own semi-axis.
const HALF: (f32, f32) = (0.6, 0.6);

/// What pictures have said of each Gaussian since the density last changed.
pub(super) struct Density {
    slopes: Vec<f64>,
    seen: Vec<u32>,
}

/// A frame to be made of another.
pub(super) struct Change {
    /// The row of the old frame that each new one comes from.
    pub(super) parents: Vec<u32>,
    /// How many of them stay what they are, or nearly; others follow.
    pub(super) kept: usize,
    /// Rows of the new frame that get other values.
    moved: Vec<(usize, Moved)>,
}

/// New values of a Gaussian.
struct Moved {
    position: Vec3,
    log_scale: [f32; 3],
    opacity_logit: f32,
}

impl Density {
    pub(super) fn new(rows: usize) -> Self {
        Self { slopes: vec![0.0; rows], seen: vec![0; rows] }
    }

    /// Takes what a picture says.
    pub(super) fn see(&mut self, footprints: &[Footprint], camera: &Camera) {
        let half = 0.5 * f64::from(camera.width.max(camera.height));
        for footprint in footprints {
            let [x, y] = footprint.slope;
            let slope = (x * x + y * y).sqrt();
            if slope > 0.0 {
                let row = footprint.gaussian as usize;
                self.slopes[row] += half * slope;
                self.seen[row] = self.seen[row].saturating_add(1);
            }
        }
    }

    /// What to change of the frame that all of this was seen of, so that it has `most` Gaussians at most.
    pub(super) fn change(
        &self,
        frame: &GaussianFrame,
        scene: &Scene,
        most: usize,
        random: &mut SplitMix64,
    ) -> Change {
        let kept: Vec<u32> =
            (0..frame.len()).filter(|&row| is_useful(frame, scene, row)).map(|row| row as u32).collect();
        // A scene is never left without any.
        let kept = if kept.is_empty() { (0..frame.len() as u32).collect() } else { kept };
        let mean = |row: u32| self.slopes[row as usize] / f64::from(self.seen[row as usize].max(1));
        let mut steep: Vec<usize> = (0..kept.len()).filter(|&place| mean(kept[place]) > STEEP).collect();
        steep.sort_by(|&a, &b| mean(kept[b]).total_cmp(&mean(kept[a])).then(a.cmp(&b)));
        steep.truncate(most.saturating_sub(kept.len()));
        let mut change = Change { kept: kept.len(), parents: kept, moved: Vec::new() };
        for place in steep {
            let gaussian = Gaussian::of(frame, change.parents[place] as usize);
            let large = gaussian.longest().1 > LARGE * scene.extent;
            let [own, other] = if large { gaussian.halves() } else { gaussian.copies(random) };
            change.moved.push((place, own));
            change.moved.push((change.parents.len(), other));
            change.parents.push(change.parents[place]);
        }
        change
    }
}

impl Change {
    /// The new frame, of the parents in their order.
    pub(super) fn applied(self, parents: GaussianFrame) -> GaussianFrame {
        let mut frame = parents;
        let planes = frame.planes_mut();
        for (row, Moved { position, log_scale, opacity_logit }) in self.moved {
            for axis in 0..3 {
                planes.position[axis][row] = position[axis];
                planes.log_scale[axis][row] = log_scale[axis];
            }
            planes.opacity_logit[row] = opacity_logit;
        }
        frame
    }
}

/// The shape of a Gaussian.
struct Gaussian {
    position: Vec3,
    log_scale: [f32; 3],
    turn: Quat,
    opacity_logit: f32,
}

impl Gaussian {
    fn of(frame: &GaussianFrame, row: usize) -> Self {
        let at = |plane: &Vec<f32>| plane[row];
        let [w, x, y, z] = frame.rotation().each_ref().map(at);
        let turn = Quat::from_xyzw(x, y, z, w);
        Self {
            position: Vec3::from(frame.position().each_ref().map(at)),
            log_scale: frame.log_scale().each_ref().map(at),
            turn: if turn.length_squared() > 0.0 { turn.normalize() } else { Quat::IDENTITY },
            opacity_logit: frame.opacity_logit()[row],
        }
    }

    /// The longest axis, and its length.
    fn longest(&self) -> (usize, f32) {
        let longer = |a: usize, b: usize| if self.log_scale[b] > self.log_scale[a] { b } else { a };
        let axis = longer(longer(0, 1), 2);
        (axis, libm::expf(self.log_scale[axis]))
    }

    /// Two that together are about as long.
    fn halves(&self) -> [Moved; 2] {
        let (axis, length) = self.longest();
        let (off, share) = HALF;
        let aside = self.turn * (Vec3::AXES[axis] * (off * length));
        let mut log_scale = self.log_scale;
        log_scale[axis] += libm::logf(share);
        [aside, -aside].map(|aside| Moved {
            position: self.position + aside,
            log_scale,
            opacity_logit: self.opacity_logit,
        })
    }

    /// Itself and another within it, both with the opacity of which two have its own.
    fn copies(&self, random: &mut SplitMix64) -> [Moved; 2] {
        let passing = 1.0 - sigmoid(f64::from(self.opacity_logit));
        let opacity_logit = logit(1.0 - passing.sqrt()) as f32;
        let off = Vec3::from(self.log_scale.map(|scale| libm::expf(scale) * random.signed()));
        [Vec3::ZERO, self.turn * off].map(|aside| Moved {
            position: self.position + aside,
            log_scale: self.log_scale,
            opacity_logit,
        })
    }
}

/// Whether a Gaussian is worth keeping in training.
fn is_useful(frame: &GaussianFrame, scene: &Scene, row: usize) -> bool {
    let gaussian = Gaussian::of(frame, row);
    let nearest = scene.cameras.iter().map(|camera| camera.distance_squared(gaussian.position));
    let nearest = nearest.fold(f32::INFINITY, f32::min).sqrt();
    // Nor for NaN.
    gaussian.opacity_logit > FAINT && gaussian.longest().1 < FOG * nearest
}

/// The rows of a trained frame that may show: all of whose values are finite, with an alpha of 1/255 somewhere.
pub(super) fn visible(frame: &GaussianFrame) -> Vec<u32> {
    let is_finite = |row: usize| frame.planes().iter().all(|plane| plane[row].is_finite());
    let shows =
        |row: &usize| sigmoid(f64::from(frame.opacity_logit()[*row])) >= 1.0 / 255.0 && is_finite(*row);
    (0..frame.len()).filter(shows).map(|row| row as u32).collect()
}
