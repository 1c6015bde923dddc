//! What stands still: a ground disc, a back wall, columns and foliage.

use std::f64::consts::{PI, TAU};

use glam::{DQuat, DVec3};

use super::random::Random;
use super::surface::{Material, Pattern, Sample, circle, spacing};

const GROUND_RADIUS: f64 = 4.5;
const WALL_WIDTH: f64 = 9.0;
const WALL_HEIGHT: f64 = 3.0;
const WALL_DISTANCE: f64 = 3.5;
const COLUMN_RADIUS: f64 = 0.22;
const COLUMN_HEIGHT: f64 = 2.6;
/// x and z of the columns' axes.
const COLUMNS: [(f64, f64); 3] = [(-3.0, 2.6), (0.2, 2.9), (3.1, 2.4)];
/// Centres and radii of the bushes.
const BUSHES: [(DVec3, f64); 5] = [
    (DVec3::new(-2.4, -0.45, 1.4), 0.5),
    (DVec3::new(2.6, -0.55, 0.9), 0.6),
    (DVec3::new(1.5, -0.3, 2.2), 0.35),
    (DVec3::new(-0.9, -0.35, 2.3), 0.4),
    (DVec3::new(3.3, -0.4, -0.8), 0.45),
];
/// Leaves overlap: a bush has the surface of this many balls of its size.
const LEAF_LAYERS: f64 = 3.0;

/// Shares of the Gaussians: ground, wall, columns; the rest is foliage.
const SHARES: [f64; 3] = [0.34, 0.26, 0.12];

/// A point of the surroundings, which have `count` Gaussians in all.
pub(super) fn sample(random: &mut Random, count: u32) -> Sample {
    let count = f64::from(count);
    let choice = random.unit();
    let [ground_share, wall_share, column_share] = SHARES;
    if choice < ground_share {
        ground(random, count * ground_share)
    } else if choice < ground_share + wall_share {
        wall(random, count * wall_share)
    } else if choice < ground_share + wall_share + column_share {
        column(random, count * column_share)
    } else {
        leaf(random, count * (1.0 - ground_share - wall_share - column_share))
    }
}

fn still(position: DVec3, normal: DVec3, tangent: DVec3, spacing: f64, material: Material) -> Sample {
    Sample { position, normal, tangent, turn: DQuat::IDENTITY, texture: position, spacing, material }
}

fn ground(random: &mut Random, count: f64) -> Sample {
    let (x, z) = circle(random.between(0.0, TAU));
    let radius = GROUND_RADIUS * random.unit().sqrt();
    let spacing = spacing(PI * GROUND_RADIUS * GROUND_RADIUS, count);
    let material = Material {
        colours: [DVec3::new(0.46, 0.42, 0.36), DVec3::new(0.28, 0.27, 0.25)],
        pattern: Pattern::Checks,
        gloss: 0.25,
        opacity_shift: 0.0,
    };
    still(DVec3::new(x * radius, 0.0, z * radius), DVec3::NEG_Y, DVec3::X, spacing, material)
}

fn wall(random: &mut Random, count: f64) -> Sample {
    let x = random.between(-WALL_WIDTH / 2.0, WALL_WIDTH / 2.0);
    let position = DVec3::new(x, random.between(-WALL_HEIGHT, 0.0), WALL_DISTANCE);
    let material = Material {
        colours: [DVec3::new(0.62, 0.33, 0.24), DVec3::new(0.72, 0.69, 0.63)],
        pattern: Pattern::Bricks,
        gloss: 0.1,
        opacity_shift: 0.0,
    };
    still(position, DVec3::NEG_Z, DVec3::X, spacing(WALL_WIDTH * WALL_HEIGHT, count), material)
}

fn column(random: &mut Random, count: f64) -> Sample {
    let (x, z) = COLUMNS[random.below(COLUMNS.len() as u64) as usize];
    let (cosine, sine) = circle(random.between(0.0, TAU));
    let normal = DVec3::new(cosine, 0.0, sine);
    let position = DVec3::new(x, random.between(-COLUMN_HEIGHT, 0.0), z) + COLUMN_RADIUS * normal;
    let area = TAU * COLUMN_RADIUS * COLUMN_HEIGHT * COLUMNS.len() as f64;
    let material = Material {
        colours: [DVec3::new(0.78, 0.76, 0.72), DVec3::new(0.55, 0.53, 0.52)],
        pattern: Pattern::Clouds,
        gloss: 0.6,
        opacity_shift: 0.0,
    };
    still(position, normal, DVec3::NEG_Y, spacing(area, count), material)
}

/// A leaf in a bush: denser towards the outside, turned outwards more or less.
fn leaf(random: &mut Random, count: f64) -> Sample {
    let (centre, radius) = BUSHES[random.below(BUSHES.len() as u64) as usize];
    let outwards = direction(random);
    let position = centre + radius * random.unit().sqrt() * outwards;
    let normal = (outwards + 0.8 * direction(random)).try_normalize().unwrap_or(DVec3::NEG_Y);
    let area: f64 = BUSHES.iter().map(|(_, radius)| LEAF_LAYERS * 4.0 * PI * radius * radius).sum();
    let material = Material {
        colours: [DVec3::new(0.16, 0.36, 0.12), DVec3::new(0.42, 0.52, 0.18)],
        pattern: Pattern::Clouds,
        gloss: 0.35,
        opacity_shift: -1.2,
    };
    still(position, normal, normal.any_orthonormal_vector(), spacing(area, count), material)
}

/// Uniform over the sphere.
fn direction(random: &mut Random) -> DVec3 {
    let y = random.between(-1.0, 1.0);
    let (x, z) = circle(random.between(0.0, TAU));
    let radius = (1.0 - y * y).sqrt();
    DVec3::new(x * radius, y, z * radius)
}
