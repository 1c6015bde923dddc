//! Fixed light: what colour a surface shows, and how that changes with the direction of view.

use glam::DVec3;
use splatstream_gaussians::sh_basis;

use super::noise;
use super::surface::{Material, Pattern};

/// Towards the light: above, left and in front.
const SUN: DVec3 = DVec3::new(-0.48, -0.8, -0.36);
/// Share of the light that comes from everywhere.
const AMBIENT: f64 = 0.6;
/// Strength of a highlight in bands 1, 2 and 3: it falls as in trained scenes.
const BANDS: [f64; 3] = [0.34, 0.2, 0.1];

/// Diffuse colour, red, green, blue, about 0 to 1.
pub(super) fn colour(material: &Material, texture: DVec3, normal: DVec3) -> DVec3 {
    let cloud = noise::rough(texture * 2.0, 0);
    let mix = match material.pattern {
        Pattern::Clouds => cloud,
        Pattern::Bricks => bricks(texture),
        Pattern::Stripes(density) => 0.5 + 0.5 * libm::sin(texture.x * density * std::f64::consts::TAU),
        Pattern::Checks => checks(texture),
    };
    let [first, second] = material.colours;
    let pigment = first + (second - first) * mix;
    let grain = 0.75 + 0.5 * noise::rough(texture * 5.0, 1);
    pigment * grain * (AMBIENT + (1.0 - AMBIENT) * normal.dot(SUN).max(0.0))
}

/// 1 in the joints of a brick wall, 0 on its bricks: 0.5 by 0.2, each course shifted by half.
fn bricks(texture: DVec3) -> f64 {
    let course = (texture.y / 0.2).floor();
    let along = texture.x / 0.5 + 0.5 * course;
    let inside = |position: f64| position - position.floor();
    if inside(texture.y / 0.2) < 0.12 || inside(along) < 0.05 { 1.0 } else { 0.0 }
}

fn checks(texture: DVec3) -> f64 {
    let parity = (texture.x.floor() + texture.z.floor()) / 2.0;
    if parity == parity.floor() { 1.0 } else { 0.0 }
}

/// SH coefficients of bands 1 to 3 that all channels share: the highlight of the sun on a surface that is a
/// little uneven, as a lobe about the direction from which it is seen.
pub(super) fn highlight(material: &Material, texture: DVec3, normal: DVec3) -> [f64; 15] {
    let mirrored = 2.0 * normal.dot(SUN) * normal - SUN;
    // The direction of view in splatting goes from the eye to the Gaussian.
    let seen = (0.4 * noise::drift(texture * 1.5, 2) - mirrored).try_normalize().unwrap_or(DVec3::Z);
    let mut values = sh_basis(seen.to_array());
    for (at, value) in values.iter_mut().enumerate() {
        let band = if at < 3 { 0 } else { usize::from(at >= 8) + 1 };
        *value *= material.gloss * BANDS[band];
    }
    values
}
