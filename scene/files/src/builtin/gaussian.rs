//! One Gaussian lying on a surface.

use splatstream_gaussians::activation::dc_of_colour;
use std::f64::consts::TAU;

use glam::{DMat3, DQuat, DVec3};

use super::light;
use super::random::Random;
use super::surface::circle;
use super::{Planes, Sample};

/// Share of Gaussians much longer than wide, as trained scenes have along edges.
const NEEDLES: f64 = 0.08;
/// Share of Gaussians far larger than the rest.
const LARGE: f64 = 0.05;

/// The attributes of one Gaussian, in the domains of [`Planes`].
#[derive(Clone)]
pub(super) struct Gaussian {
    pub(super) position: DVec3,
    pub(super) log_scale: [f64; 3],
    pub(super) rotation: DQuat,
    pub(super) opacity_logit: f64,
    pub(super) dc: [f64; 3],
    /// In the order of the planes: coefficient × 3 + channel.
    pub(super) sh: [f64; 45],
}

impl Gaussian {
    /// A Gaussian at `sample`, flat on the surface.
    pub(super) fn on(sample: &Sample, random: &mut Random) -> Self {
        let lift = 0.03 * sample.spacing * random.normal();
        let normal = sample.turn * sample.normal;
        let (log_scale, rest) = shape(sample, random);
        let opacity_logit = opacity(random) + sample.material.opacity_shift;
        let colour = light::colour(&sample.material, sample.texture, normal);
        let dc = colour.to_array().map(|part| f64::from(dc_of_colour(part)) + 0.08 * random.normal());
        let highlight = light::highlight(&sample.material, sample.texture, normal);
        // White light, tinted a little by the surface.
        let tint = colour.to_array().map(|part| 0.7 + 0.3 * part);
        let sh =
            std::array::from_fn(|plane| highlight[plane / 3] * tint[plane % 3] + 0.012 * random.normal());
        let position = sample.position + lift * normal;
        Self { position, log_scale, rotation: sample.turn * rest, opacity_logit, dc, sh }
    }

    /// Appends this to `planes`, which may be of a lower SH degree.
    pub(super) fn push(&self, planes: &mut Planes) {
        let fill = |planes: &mut [Vec<f32>], values: &[f64]| {
            planes.iter_mut().zip(values).for_each(|(plane, &value)| plane.push(value as f32));
        };
        let [x, y, z, w] = self.rotation.normalize().to_array();
        fill(&mut planes.position, &self.position.to_array());
        fill(&mut planes.log_scale, &self.log_scale);
        fill(&mut planes.rotation, &[w, x, y, z]);
        planes.opacity_logit.push(self.opacity_logit as f32);
        fill(&mut planes.dc, &self.dc);
        fill(&mut planes.sh, &self.sh);
    }
}

/// Log scales, and the rotation at rest of the axes that they measure.
fn shape(sample: &Sample, random: &mut Random) -> ([f64; 3], DQuat) {
    let tail = if random.chance(LARGE) { (-0.6 * libm::log(random.unit() + 1e-4)).min(1.3) } else { 0.0 };
    let length = libm::log(0.8 * sample.spacing) + 0.45 * random.normal() + tail;
    let needle = random.chance(NEEDLES);
    let width = length - if needle { random.between(1.8, 2.8) } else { 0.6 * random.normal().abs() };
    let thickness = width - random.between(1.2, 2.6);
    // Needles follow the surface's own direction; the others lie any way round.
    let (cosine, sine) = circle(if needle { 0.15 * random.normal() } else { random.between(0.0, TAU) });
    let other = sample.normal.cross(sample.tangent);
    let tilt = 0.06 * (random.normal() * sample.tangent + random.normal() * other);
    let normal = (sample.normal + tilt).normalize();
    let along = cosine * sample.tangent + sine * other;
    let along = (along - along.dot(normal) * normal).normalize();
    let (axes, scales) = ([along, normal.cross(along), normal], [length, width, thickness]);
    // Training leaves no order among the axes. Cyclic orders keep them right-handed.
    let first = random.below(3) as usize;
    let place = |axis: usize| (axis + first) % 3;
    let matrix = DMat3::from_cols(axes[place(0)], axes[place(1)], axes[place(2)]);
    ([0, 1, 2].map(|axis| scales[place(axis)]), DQuat::from_mat3(&matrix))
}

/// An opacity logit: most are nearly opaque, some half, and a tail is faint.
fn opacity(random: &mut Random) -> f64 {
    let choice = random.unit();
    if choice < 0.58 {
        random.between(3.5, 7.0)
    } else if choice < 0.82 {
        random.between(0.0, 3.5)
    } else {
        random.between(-4.0, 0.0)
    }
}
