//! What moves: a rigid ring, an articulated arm, a deforming cloth.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::{DMat3, DQuat, DVec3};

use super::random::Random;
use super::surface::{Material, Pattern, Sample, circle, spacing, turn_about};

const RING_CENTRE: DVec3 = DVec3::new(1.3, -1.1, 0.2);
const RING_RADIUS: f64 = 0.42;
const RING_THICKNESS: f64 = 0.16;

/// A point of the ring, which tumbles about two axes and bobs.
pub(super) fn ring(random: &mut Random, count: u32, seconds: f64) -> Sample {
    let (around, across) = (random.between(0.0, TAU), random.between(0.0, TAU));
    let ((cos_around, sin_around), (cos_across, sin_across)) = (circle(around), circle(across));
    let outwards = DVec3::new(cos_around, 0.0, sin_around);
    let normal = cos_across * outwards + sin_across * DVec3::Y;
    let rest = RING_RADIUS * outwards + RING_THICKNESS * normal;
    let turn = turn_about(DVec3::new(0.6, 0.0, 0.8), 1.3 * seconds) * turn_about(DVec3::Y, 0.7 * seconds);
    let bob = DVec3::Y * 0.12 * libm::sin(1.9 * seconds);
    Sample {
        position: RING_CENTRE + bob + turn * rest,
        normal,
        tangent: DVec3::new(-sin_around, 0.0, cos_around),
        turn,
        texture: DVec3::new(around / TAU * 12.0, across / TAU * 3.0, 0.0) + rest,
        spacing: spacing(TAU * TAU * RING_RADIUS * RING_THICKNESS, f64::from(count)),
        material: Material {
            colours: [DVec3::new(0.75, 0.18, 0.15), DVec3::new(0.92, 0.82, 0.3)],
            pattern: Pattern::Stripes(0.5),
            gloss: 1.0,
            opacity_shift: 0.3,
        },
    }
}

const ARM_BASE: DVec3 = DVec3::new(-1.3, 0.0, 0.3);

/// A part of the arm, from its joint at the near end.
struct Segment {
    length: f64,
    radius: f64,
    /// Angle of the joint in radians: mean, swing, and speed in radians a second.
    joint: (f64, f64, f64),
}

const SEGMENTS: [Segment; 3] = [
    Segment { length: 0.75, radius: 0.11, joint: (0.1, 0.35, 1.1) },
    Segment { length: 0.55, radius: 0.085, joint: (0.7, 0.5, 1.7) },
    Segment { length: 0.4, radius: 0.06, joint: (0.5, 0.6, 2.6) },
];

/// A point of the arm: each segment turns with all those before it.
pub(super) fn arm(random: &mut Random, count: u32, seconds: f64) -> Sample {
    let area = |segment: &Segment| TAU * segment.radius * segment.length;
    let whole: f64 = SEGMENTS.iter().map(area).sum();
    let choice = random.unit() * whole;
    let [first, second, _] = SEGMENTS.each_ref().map(area);
    let place = usize::from(choice >= first) + usize::from(choice >= first + second);
    // The base turns about the vertical.
    let mut turn = turn_about(DVec3::Y, 0.5 * libm::sin(0.8 * seconds));
    let mut joint = ARM_BASE;
    for (at, segment) in SEGMENTS[..=place].iter().enumerate() {
        let (mean, swing, speed) = segment.joint;
        turn *= turn_about(DVec3::Z, mean + swing * libm::sin(speed * seconds));
        if at < place {
            joint += turn * (DVec3::NEG_Y * segment.length);
        }
    }
    on_segment(random, place, joint, turn, spacing(whole, f64::from(count)))
}

fn on_segment(random: &mut Random, place: usize, joint: DVec3, turn: DQuat, spacing: f64) -> Sample {
    let segment = &SEGMENTS[place];
    let (cosine, sine) = circle(random.between(0.0, TAU));
    let normal = DVec3::new(cosine, 0.0, sine);
    let rest = segment.radius * normal + DVec3::NEG_Y * random.between(0.0, segment.length);
    Sample {
        position: joint + turn * rest,
        normal,
        tangent: DVec3::NEG_Y,
        turn,
        // Apart from each other, or the segments would look alike.
        texture: rest * 4.0 + DVec3::splat(10.0 * place as f64),
        spacing,
        material: Material {
            colours: [DVec3::new(0.24, 0.4, 0.62), DVec3::new(0.8, 0.8, 0.82)],
            pattern: Pattern::Clouds,
            gloss: 0.7,
            opacity_shift: 0.3,
        },
    }
}

/// Middle of the bar that the cloth hangs from.
const CLOTH_BAR: DVec3 = DVec3::new(0.0, -2.1, 1.3);
const CLOTH_WIDTH: f64 = 1.6;
const CLOTH_HEIGHT: f64 = 1.2;

/// A point of the cloth. Waves run along it and grow towards its free end.
pub(super) fn cloth(random: &mut Random, count: u32, seconds: f64) -> Sample {
    let across = random.between(-CLOTH_WIDTH / 2.0, CLOTH_WIDTH / 2.0);
    let down = random.between(0.0, CLOTH_HEIGHT);
    let (long, short) = (4.0 * across - 2.2 * seconds, 7.0 * across + 3.0 * down - 3.1 * seconds);
    let ((cos_long, sin_long), (cos_short, sin_short)) = (circle(long), circle(short));
    let wave = 0.16 * sin_long + 0.05 * sin_short;
    // The derivatives of down × wave.
    let slope_across = down * (0.16 * 4.0 * cos_long + 0.05 * 7.0 * cos_short);
    let slope_down = wave + down * 0.05 * 3.0 * cos_short;
    let tangent = DVec3::new(1.0, 0.0, slope_across).normalize();
    let back = DVec3::new(-slope_across, -slope_down, 1.0).normalize();
    // At rest these three are the axes, and never more than a quarter turn from them.
    let turn = DQuat::from_mat3(&DMat3::from_cols(tangent, back.cross(tangent), back));
    Sample {
        position: CLOTH_BAR + DVec3::new(across, down, down * wave),
        normal: DVec3::NEG_Z,
        tangent: DVec3::X,
        turn,
        texture: DVec3::new(across, down, FRAC_PI_2) * 3.0,
        spacing: spacing(CLOTH_WIDTH * CLOTH_HEIGHT, f64::from(count)),
        material: Material {
            colours: [DVec3::new(0.82, 0.8, 0.74), DVec3::new(0.35, 0.14, 0.4)],
            pattern: Pattern::Stripes(1.2),
            gloss: 0.2,
            opacity_shift: 0.0,
        },
    }
}
