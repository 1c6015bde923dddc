//! Points on surfaces, and what the surfaces are made of.

use glam::{DQuat, DVec3};

/// A point on a surface as it stands in a frame. Metres; x right, y down, z forward.
pub(super) struct Sample {
    /// Where it is.
    pub(super) position: DVec3,
    /// Outward normal at rest, unit.
    pub(super) normal: DVec3,
    /// A direction along the surface at rest, unit.
    pub(super) tangent: DVec3,
    /// From rest to now. Continuous in time, so that quaternions do not change sign between frames.
    pub(super) turn: DQuat,
    /// Where textures are looked up: moves with the surface.
    pub(super) texture: DVec3,
    /// Mean distance to the next Gaussian of the same surface.
    pub(super) spacing: f64,
    pub(super) material: Material,
}

/// Looks of a surface.
#[derive(Clone, Copy)]
pub(super) struct Material {
    /// Red, green, blue, 0 to 1, of the two colours that the pattern mixes.
    pub(super) colours: [DVec3; 2],
    pub(super) pattern: Pattern,
    /// Strength of highlights, 0 to 1.
    pub(super) gloss: f64,
    /// Added to every opacity logit: negative for what is hard to see through and hard to see.
    pub(super) opacity_shift: f64,
}

/// How the two colours of a material alternate, over and above noise.
#[derive(Clone, Copy)]
pub(super) enum Pattern {
    Clouds,
    Bricks,
    /// Soft stripes along x of the texture, so many a unit.
    Stripes(f64),
    /// Squares of x and z of the texture.
    Checks,
}

/// The mean distance between `count` points spread over `area`.
pub(super) fn spacing(area: f64, count: f64) -> f64 {
    (area / count.max(1.0)).sqrt()
}

/// A rotation about a unit axis by an angle in radians. Not glam's: that takes its sine from the platform.
pub(super) fn turn_about(axis: DVec3, angle: f64) -> DQuat {
    let (sine, cosine) = libm::sincos(angle / 2.0);
    DQuat::from_xyzw(axis.x * sine, axis.y * sine, axis.z * sine, cosine)
}

/// Cosine and sine.
pub(super) fn circle(angle: f64) -> (f64, f64) {
    let (sine, cosine) = libm::sincos(angle);
    (cosine, sine)
}
