//! What stands and moves on the stage.

use super::material::{Material, Pattern};
use super::shape::{NEAR, Shape};
use glam::{DQuat, DVec3};
use splatstream_gaussians::random::SplitMix64;
use std::f64::consts::{PI, TAU};

/// A surface in its place.
#[derive(Clone, Debug)]
pub(super) struct Object {
    shape: Shape,
    /// From the shape's axes to the world's.
    turn: DQuat,
    place: DVec3,
    pub(super) material: Material,
    bound: f64,
}

/// Where a ray meets an object.
pub(super) struct Hit<'a> {
    pub(super) object: &'a Object,
    /// Distance from the start of the ray.
    pub(super) along: f64,
    /// The point in the axes of the shape, where textures are looked up.
    pub(super) inside: DVec3,
    /// The direction out of the surface, in the world.
    pub(super) normal: DVec3,
}

impl Object {
    fn new(shape: Shape, place: DVec3, turn: DQuat, material: Material) -> Self {
        // A little more, for rounding.
        Self { shape, turn, place, material, bound: 1.000_001 * shape.bound() }
    }

    fn standing(shape: Shape, place: [f64; 3], material: Material) -> Self {
        Self::new(shape, DVec3::from(place), DQuat::IDENTITY, material)
    }

    /// How far along a ray of length 1 the object is met, if that is nearer than `most`.
    fn meets(&self, origin: DVec3, ahead: DVec3, most: f64) -> Option<f64> {
        let towards = self.place - origin;
        let middle = towards.dot(ahead);
        let off = towards.length_squared() - middle * middle;
        if off > self.bound * self.bound || middle + self.bound < 0.0 || middle - self.bound > most {
            return None;
        }
        let back = self.turn.conjugate();
        let along = self.shape.meets(back * -towards, back * ahead)?;
        (along < most).then_some(along)
    }

    /// From a point to the surface.
    fn distance(&self, at: DVec3) -> f64 {
        self.shape.distance(self.turn.conjugate() * (at - self.place))
    }
}

/// All of the stage at one time.
pub(super) struct Objects(Vec<Object>);

impl Objects {
    /// The stage of a seed at a time, seconds.
    pub(super) fn at(seed: u64, seconds: f64) -> Self {
        let mut random = SplitMix64::new(seed);
        let mut objects = still(&mut random);
        let phase = random.unit() * 10.0;
        objects.extend(moving(&mut random, seconds + phase));
        Self(objects)
    }

    /// What a ray meets first.
    pub(super) fn hit(&self, origin: DVec3, ahead: DVec3) -> Option<Hit<'_>> {
        let mut nearest = None;
        let mut most = f64::INFINITY;
        for object in &self.0 {
            if let Some(along) = object.meets(origin, ahead, most) {
                most = along;
                nearest = Some(object);
            }
        }
        let object = nearest?;
        let inside = object.turn.conjugate() * (origin + ahead * most - object.place);
        let out = object.turn * object.shape.normal(inside);
        let normal = if out.dot(ahead) > 0.0 { -out } else { out };
        Some(Hit { object, along: most, inside, normal })
    }

    /// Whether anything lies on the ray.
    pub(super) fn is_dark(&self, origin: DVec3, ahead: DVec3) -> bool {
        self.0
            .iter()
            .any(|object| object.meets(origin, ahead, f64::INFINITY).is_some_and(|along| along > NEAR))
    }

    /// From a point to the nearest surface, or `most` if that is less.
    pub(super) fn free(&self, at: DVec3, most: f64) -> f64 {
        let near = |object: &&Object| {
            let reach = object.bound + most;
            (object.place - at).length_squared() < reach * reach
        };
        self.0.iter().filter(near).map(|object| object.distance(at)).fold(most, f64::min)
    }
}

/// Linear red, green and blue.
const fn rgb(r: f64, g: f64, b: f64) -> DVec3 {
    DVec3::new(r, g, b)
}

fn any(random: &mut SplitMix64, low: f64, high: f64) -> f64 {
    low + (high - low) * random.unit()
}

fn around(angle: f64, radius: f64) -> DVec3 {
    let (sine, cosine) = libm::sincos(angle);
    DVec3::new(radius * cosine, 0.0, radius * sine)
}

/// About a unit axis by an angle in radians; sine and cosine are those of `libm`.
fn turn_about(axis: DVec3, angle: f64) -> DQuat {
    let (sine, cosine) = libm::sincos(0.5 * angle);
    DQuat::from_xyzw(axis.x * sine, axis.y * sine, axis.z * sine, cosine)
}

fn still(random: &mut SplitMix64) -> Vec<Object> {
    let floor = Material::dull(Pattern::Tiles(0.6), [rgb(0.42, 0.38, 0.32), rgb(0.16, 0.15, 0.14)], 1);
    let floor = Material { mirror: 0.03, ..floor };
    let grass = Material::dull(Pattern::Patches(0.8), [rgb(0.09, 0.16, 0.04), rgb(0.2, 0.19, 0.08)], 2);
    let block = Material::dull(Pattern::Bricks(0.14), [rgb(0.38, 0.12, 0.07), rgb(0.5, 0.47, 0.42)], 3);
    let wood = Material::dull(Pattern::Wood(0.05), [rgb(0.45, 0.25, 0.11), rgb(0.22, 0.1, 0.04)], 4);
    let post = Material::dull(Pattern::Stripes(7.0), [rgb(0.65, 0.62, 0.55), rgb(0.12, 0.2, 0.36)], 5);
    let steel = Material {
        gloss: 0.8,
        mirror: 0.45,
        ..Material::dull(Pattern::Plain, [rgb(0.35, 0.36, 0.38), rgb(0.35, 0.36, 0.38)], 6)
    };
    let stone = Material::dull(Pattern::Patches(0.3), [rgb(0.3, 0.28, 0.26), rgb(0.14, 0.13, 0.13)], 7);
    let mut objects = vec![
        Object::standing(Shape::Disc { radius: 14.0 }, [0.0, 0.02, 0.0], grass),
        Object::standing(Shape::Box { half: DVec3::new(2.6, 0.05, 2.6) }, [0.0, 0.05, 0.0], floor),
        Object::standing(Shape::Box { half: DVec3::new(1.1, 0.42, 0.12) }, [-0.4, -0.42, 1.7], block),
        Object::standing(Shape::Box { half: DVec3::new(0.5, 0.3, 0.35) }, [1.55, -0.3, 1.05], wood),
        Object::standing(Shape::Ball { radius: 0.36 }, [1.55, -0.96, 1.05], steel),
        Object::standing(
            Shape::Ring { radius: 0.3, thickness: 0.09 },
            [-1.5, -0.09, -0.9],
            Material { gloss: 0.5, ..post },
        ),
    ];
    objects.extend(fence(post, wood));
    for number in 0..14 {
        let place = around((f64::from(number) + any(random, 0.0, 0.7)) / 14.0 * TAU, any(random, 6.0, 11.0));
        let tall = any(random, 0.7, 1.6);
        objects.push(match number % 3 {
            0 => Object::new(
                Shape::Capsule { half: tall, radius: 0.2 },
                place - DVec3::Y * tall,
                DQuat::IDENTITY,
                post,
            ),
            1 => Object::new(
                Shape::Ball { radius: 0.6 * tall },
                place - DVec3::Y * 0.3 * tall,
                DQuat::IDENTITY,
                stone,
            ),
            _ => {
                let turn = turn_about(DVec3::Y, any(random, 0.0, PI));
                let half = DVec3::new(0.8, tall, 0.5);
                Object::new(Shape::Box { half }, place - DVec3::Y * tall, turn, block)
            }
        });
    }
    objects
}

/// A fence of thin bars on one side.
fn fence(bars: Material, rail: Material) -> Vec<Object> {
    let mut objects: Vec<Object> = (0..9)
        .map(|bar| {
            let place = [-2.3, -0.4, -1.4 + 0.35 * f64::from(bar)];
            Object::standing(Shape::Capsule { half: 0.4, radius: 0.025 }, place, bars)
        })
        .collect();
    let turn = turn_about(DVec3::X, 0.5 * PI);
    objects.push(Object::new(
        Shape::Capsule { half: 1.5, radius: 0.035 },
        DVec3::new(-2.3, -0.66, 0.0),
        turn,
        rail,
    ));
    objects
}

fn moving(random: &mut SplitMix64, seconds: f64) -> Vec<Object> {
    let tint = any(random, 0.0, 0.3);
    let ball = Material {
        gloss: 0.6,
        mirror: 0.06,
        ..Material::dull(Pattern::Stripes(6.0), [rgb(0.7, 0.08, 0.05 + tint), rgb(0.75, 0.68, 0.5)], 8)
    };
    let gold = Material {
        gloss: 0.9,
        mirror: 0.12,
        ..Material::dull(Pattern::Patches(0.12), [rgb(0.6, 0.38, 0.08), rgb(0.3, 0.12 + tint, 0.05)], 9)
    };
    let crate_ = Material::dull(Pattern::Wood(0.08), [rgb(0.12, 0.3, 0.34), rgb(0.5, 0.52, 0.48)], 10);
    // The ball rolls around the stage without slipping, as far as a turn about one axis can say it.
    let way = 0.5 * seconds;
    let rolls = turn_about(around(way, 1.0), way * 1.15 / 0.28);
    let mut objects = vec![
        Object::new(Shape::Ball { radius: 0.28 }, around(way, 1.15) - DVec3::Y * 0.28, rolls, ball),
        Object::new(
            Shape::Ring { radius: 0.34, thickness: 0.12 },
            DVec3::new(0.1, -1.25 + 0.1 * libm::sin(1.7 * seconds), 0.1),
            turn_about(DVec3::new(0.6, 0.0, 0.8), 0.9 * seconds) * turn_about(DVec3::Y, 0.6 * seconds),
            gold,
        ),
        Object::new(
            Shape::Box { half: DVec3::new(0.28, 0.28, 0.28) },
            DVec3::new(-0.2, -0.28, -0.1),
            turn_about(DVec3::Y, 0.7 * seconds),
            crate_,
        ),
    ];
    arm(seconds, &mut objects);
    objects
}

/// Half length and radius of a segment; its angle in radians: mean, swing, and speed in radians a second.
const SEGMENTS: [(f64, f64, [f64; 3]); 3] =
    [(0.38, 0.1, [0.1, 0.3, 1.1]), (0.28, 0.08, [0.7, 0.45, 1.6]), (0.2, 0.06, [0.5, 0.5, 2.3])];

/// Each segment turns with all those before it.
fn arm(seconds: f64, objects: &mut Vec<Object>) {
    let skin = Material {
        gloss: 0.3,
        ..Material::dull(Pattern::Stripes(5.0), [rgb(0.62, 0.3, 0.1), rgb(0.2, 0.22, 0.25)], 11)
    };
    let mut joint = DVec3::new(-1.2, 0.0, 0.5);
    let mut turn = turn_about(DVec3::Y, 0.5 * libm::sin(0.8 * seconds));
    for (half, radius, [mean, swing, speed]) in SEGMENTS {
        turn *= turn_about(DVec3::Z, mean + swing * libm::sin(speed * seconds));
        let up = turn * DVec3::NEG_Y;
        objects.push(Object::new(Shape::Capsule { half, radius }, joint + up * half, turn, skin));
        joint += up * (2.0 * half);
    }
}
