//! What surfaces look like from near.

use glam::DVec3;
use splatstream_files::builtin::noise::{drift, rough, smooth};
use std::f64::consts::TAU;

/// Looks of a surface; colours are linear.
#[derive(Clone, Copy, Debug)]
pub(super) struct Material {
    pub(super) pattern: Pattern,
    pub(super) colours: [DVec3; 2],
    /// Chooses the noise.
    pub(super) layer: u64,
    /// Strength of the sun's highlight, 0 to 1.
    pub(super) gloss: f64,
    /// Share of light that is mirrored where the surface is seen face on, 0 to 1; more at grazing angles.
    pub(super) mirror: f64,
}

/// How two colours alternate; lengths are in metres on the surface.
#[derive(Clone, Copy, Debug)]
pub(super) enum Pattern {
    /// Soft patches of this size.
    Patches(f64),
    /// Squares of x and z of this side, with joints.
    Tiles(f64),
    /// Bricks of this height, by x and y.
    Bricks(f64),
    /// Stripes along y, so many around.
    Stripes(f64),
    /// Rings of wood around an axis along x.
    Wood(f64),
    /// One colour, with grain.
    Plain,
}

impl Material {
    /// A dull material.
    pub(super) const fn dull(pattern: Pattern, colours: [DVec3; 2], layer: u64) -> Self {
        Self { pattern, colours, layer, gloss: 0.0, mirror: 0.0 }
    }

    /// Share of light that a point of the surface gives back, of red, green and blue.
    pub(super) fn colour(&self, at: DVec3) -> DVec3 {
        let [first, second] = self.colours;
        let mixed = first.lerp(second, self.pattern.share(at, self.layer));
        // Grain in two sizes, the finer of them near what a picture resolves.
        let grain = 0.7 + 0.4 * rough(at * 9.0, self.layer) + 0.2 * smooth(at * 70.0, self.layer);
        (mixed * grain).clamp(DVec3::ZERO, DVec3::splat(0.95))
    }
}

impl Pattern {
    /// The share of the second colour, 0 to 1.
    fn share(self, at: DVec3, layer: u64) -> f64 {
        let inside = |position: f64| position - position.floor();
        let is_joint = |position: f64, width: f64| inside(position) < width || inside(position) > 1.0 - width;
        match self {
            Self::Patches(size) => {
                step(rough((at + 0.2 * drift(at / size, layer)) / size, layer), 0.45, 0.55)
            }
            Self::Tiles(side) => {
                let place = at / side;
                let parity = (place.x.floor() + place.z.floor()).rem_euclid(2.0);
                if is_joint(place.x, 0.02) || is_joint(place.z, 0.02) { 0.5 } else { 0.85 * parity }
            }
            Self::Bricks(height) => {
                // The edges of a box of whole courses lie within bricks, not on joints.
                let course = at.y / height + 0.4;
                let along = at.x / (2.4 * height) + 0.5 * course.floor();
                if is_joint(course, 0.06) || is_joint(along, 0.03) { 1.0 } else { 0.0 }
            }
            Self::Stripes(count) => {
                let around = libm::atan2(at.z, at.x) / TAU * count;
                step((inside(around) - 0.5).abs(), 0.22, 0.28)
            }
            Self::Wood(size) => {
                let bent = at + 0.06 * drift(at * 3.0, layer);
                let away = (bent.y * bent.y + bent.z * bent.z).sqrt() / size;
                inside(away) * inside(away)
            }
            Self::Plain => 0.0,
        }
    }
}

/// 0 below the first number, 1 above the second, smooth between them.
pub(super) fn step(value: f64, low: f64, high: f64) -> f64 {
    let share = ((value - low) / (high - low)).clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}
