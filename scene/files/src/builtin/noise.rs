//! Smooth noise in space, for textures: the same on every machine. Coordinates must be below 10^15.

use glam::DVec3;

use splatstream_gaussians::random::mix;

/// Value noise: random numbers on the integer lattice, smoothly interpolated; 0 to 1, one feature a unit.
/// `layer` chooses among unrelated noises.
pub fn smooth(at: DVec3, layer: u64) -> f64 {
    let cell = at.floor();
    let inside = at - cell;
    let weight = inside * inside * (DVec3::splat(3.0) - 2.0 * inside);
    let corner = |x: f64, y: f64, z: f64| lattice(cell + DVec3::new(x, y, z), layer);
    let along_x = |y: f64, z: f64| blend(corner(0.0, y, z), corner(1.0, y, z), weight.x);
    let along_y = |z: f64| blend(along_x(0.0, z), along_x(1.0, z), weight.y);
    blend(along_y(0.0), along_y(1.0), weight.z)
}

/// Three octaves of [`smooth`], each of half the size and strength; 0 to 1.
pub fn rough(at: DVec3, layer: u64) -> f64 {
    let octave = |scale: f64, strength: f64| strength * smooth(at * scale, layer);
    (octave(1.0, 1.0) + octave(2.0, 0.5) + octave(4.0, 0.25)) / 1.75
}

/// Three components of [`smooth`], each −1 to 1.
pub fn drift(at: DVec3, layer: u64) -> DVec3 {
    2.0 * DVec3::new(smooth(at, layer), smooth(at, layer + 1), smooth(at, layer + 2)) - DVec3::ONE
}

fn blend(a: f64, b: f64, weight: f64) -> f64 {
    a + (b - a) * weight
}

fn lattice(point: DVec3, layer: u64) -> f64 {
    // Coordinates are small whole numbers, which `i64` holds; the multipliers are large odd numbers.
    let [x, y, z] = point.to_array().map(|part| part as i64 as u64);
    let key = x.wrapping_mul(0x8da6_b343_65d3_a1c5)
        ^ y.wrapping_mul(0xd816_3841_fdc0_b2e7)
        ^ z.wrapping_mul(0xcb1a_b31f_4f2e_3d29);
    (mix(key.wrapping_add(mix(layer + 1))) >> 11) as f64 / (1_u64 << 53) as f64
}
