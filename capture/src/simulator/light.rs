//! Light: a sun, a sky, and what surfaces make of them. Radiance is linear red, green and blue.

use super::material::step;
use super::objects::{Hit, Objects};
use glam::DVec3;
use splatstream_files::builtin::noise::rough;
use splatstream_files::srgb;

/// Towards the sun, not of length 1: above, left and in front.
const SUN: DVec3 = DVec3::new(-0.55, -0.75, -0.36);
/// Radius of the sun's disc, of the distance: six times that of the real one, for soft shadows.
const SUN_RADIUS: f64 = 0.03;
/// What a white surface that faces the sun gives back of it.
const SUN_LIGHT: DVec3 = DVec3::new(0.95, 0.87, 0.72);
/// What a white surface gives back of the sky, facing up, and of the ground, facing down.
const SKY_LIGHT: DVec3 = DVec3::new(0.3, 0.37, 0.48);
const GROUND_LIGHT: DVec3 = DVec3::new(0.13, 0.13, 0.1);
/// Exponent of highlights: a lobe of some 15 degrees.
const SHARPNESS: f64 = 60.0;
/// Reach of the dimming in corners, metres.
const CORNER: f64 = 0.4;
/// Radius of the hills and the sky, metres.
pub(super) const DOME: f64 = 60.0;

/// What comes towards the origin of a ray. `disc` is a point of the unit disc, which chooses where on the sun shadows are
/// looked for; what a mirror shows has no mirrors.
pub(super) fn radiance(
    objects: &Objects,
    origin: DVec3,
    ahead: DVec3,
    disc: [f64; 2],
    mirrors: bool,
) -> DVec3 {
    let Some(hit) = objects.hit(origin, ahead) else { return far(dome_point(origin, ahead)) };
    let at = origin + ahead * hit.along + hit.normal * 1e-5;
    let direct = surface(objects, &hit, at, ahead, disc);
    let material = &hit.object.material;
    if !mirrors || material.mirror == 0.0 {
        return direct;
    }
    let facing = -hit.normal.dot(ahead);
    let away = (1.0 - facing).clamp(0.0, 1.0);
    // Schlick's approximation.
    let share = material.mirror + (1.0 - material.mirror) * away * away * away * away * away;
    let mirrored = ahead + hit.normal * (2.0 * facing);
    direct * (1.0 - share) + radiance(objects, at, mirrored.normalize_or(hit.normal), disc, false) * share
}

/// Sun and sky on a surface.
fn surface(objects: &Objects, hit: &Hit<'_>, at: DVec3, ahead: DVec3, disc: [f64; 2]) -> DVec3 {
    let middle = SUN.normalize();
    let (right, down) = middle.any_orthonormal_pair();
    let sun = (middle + (right * disc[0] + down * disc[1]) * SUN_RADIUS).normalize();
    let facing = hit.normal.dot(sun).max(0.0);
    let is_lit = facing > 0.0 && !objects.is_dark(at, sun);
    let lit = if is_lit { facing } else { 0.0 };
    let sky = GROUND_LIGHT.lerp(SKY_LIGHT, 0.5 - 0.5 * hit.normal.y) * openness(objects, at, hit.normal);
    let material = &hit.object.material;
    let half = (sun - ahead).normalize_or(hit.normal);
    let highlight = if is_lit && material.gloss > 0.0 {
        material.gloss * libm::pow(hit.normal.dot(half).max(0.0), SHARPNESS)
    } else {
        0.0
    };
    material.colour(hit.inside) * (SUN_LIGHT * lit + sky) + SUN_LIGHT * highlight
}

/// How much of the sky a surface sees, by how far away other surfaces are along its normal; 0 to 1.
fn openness(objects: &Objects, at: DVec3, normal: DVec3) -> f64 {
    let missing = |share: f64| {
        let reach = CORNER * share;
        (reach - objects.free(at + normal * reach, reach)).max(0.0) / CORNER
    };
    (1.0 - 1.1 * (missing(0.15) + missing(0.45) + missing(1.0))).clamp(0.15, 1.0)
}

/// Where a ray leaves the world.
pub(super) fn dome_point(origin: DVec3, ahead: DVec3) -> DVec3 {
    let middle = origin.dot(ahead);
    let square = middle * middle - origin.length_squared() + DOME * DOME;
    origin + ahead * (-middle + square.max(0.0).sqrt())
}

/// Hills and sky at a point of the dome.
fn far(at: DVec3) -> DVec3 {
    let towards = at / DOME;
    let level = DVec3::new(towards.x, 0.0, towards.z).normalize_or(DVec3::X);
    let height = -towards.y;
    let ridge = 0.02 + 0.16 * rough(level * 3.0, 21);
    let near_ridge = 0.01 + 0.09 * rough(level * 5.0, 22);
    let clouds = step(rough(DVec3::new(towards.x, 2.5 * towards.y, towards.z) * 4.0, 23), 0.45, 0.75);
    let blue = DVec3::new(0.45, 0.6, 0.8).lerp(DVec3::new(0.12, 0.28, 0.62), step(height, 0.0, 0.7));
    let sky = blue.lerp(DVec3::splat(0.85), 0.8 * clouds);
    let trees = rough(towards * 40.0, 24);
    let hill = DVec3::new(0.16, 0.22, 0.22).lerp(DVec3::new(0.28, 0.34, 0.32), trees);
    let near_hill = DVec3::new(0.05, 0.1, 0.04).lerp(DVec3::new(0.17, 0.2, 0.09), trees);
    // Soft edges, as of air between.
    let with_hill = hill.lerp(sky, step(height, ridge - 0.002, ridge + 0.002));
    near_hill.lerp(with_hill, step(height, near_ridge - 0.002, near_ridge + 0.002))
}

/// Linear radiance as a file of 8 bits has it: clamped, with the transfer function of sRGB, rounded to the nearest level.
pub(super) fn to_picture(radiance: DVec3) -> [f32; 3] {
    levels(radiance).map(|level| f32::from(level) / 255.0)
}

/// The same as levels.
pub(super) fn levels(radiance: DVec3) -> [u8; 3] {
    radiance.to_array().map(|linear| (255.0 * srgb::encode(linear.clamp(0.0, 1.0)) + 0.5) as u8)
}
