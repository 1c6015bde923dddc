//! Cameras for a scene that comes without.
#![expect(
    clippy::arithmetic_side_effects,
    reason = "vectors of floats; counts of cameras and of Gaussians in memory"
)]

use super::Camera;
use glam::{Quat, Vec3};
use rayon::prelude::*;
use splatstream_gaussians::GaussianFrame;
use splatstream_gaussians::random::SplitMix64;
use std::f32::consts::{PI, TAU};

/// Vertical angle of view, radians: 40 degrees.
const FIELD: f32 = 40.0 / 180.0 * PI;

/// Gaussians fainter than this say nothing of where the scene is: a logit, so that no sigmoid is needed.
const VISIBLE_LOGIT: f32 = -2.0;

/// The direction that points up in the pictures, along an axis of the frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Up {
    /// Against y: what trainers of splats write.
    #[default]
    MinusY,
    /// Along y.
    PlusY,
    /// Against z.
    MinusZ,
    /// Along z.
    PlusZ,
    /// Against x.
    MinusX,
    /// Along x.
    PlusX,
}

impl Up {
    /// Right, up and front: where the first camera of a ring stands.
    fn axes(self) -> [Vec3; 3] {
        match self {
            Self::MinusY => [Vec3::X, Vec3::NEG_Y, Vec3::NEG_Z],
            Self::PlusY => [Vec3::X, Vec3::Y, Vec3::Z],
            Self::MinusZ => [Vec3::X, Vec3::NEG_Z, Vec3::Y],
            Self::PlusZ => [Vec3::X, Vec3::Z, Vec3::NEG_Y],
            Self::MinusX => [Vec3::Y, Vec3::NEG_X, Vec3::Z],
            Self::PlusX => [Vec3::Y, Vec3::X, Vec3::NEG_Z],
        }
    }
}

/// `count` cameras around the middle of the scene, turning about the vertical, on two heights in turn: 5 and
/// 30 degrees above.
pub fn ring(frame: &GaussianFrame, up: Up, count: u32, height: u32) -> Vec<Camera> {
    let subject = Subject::of(frame, up);
    let view = |number: u32| {
        let elevation = if number.is_multiple_of(2) { 5.0 } else { 30.0 } / 180.0 * PI;
        let turn = TAU * number as f32 / count as f32;
        subject.seen_from(format!("ring_{number:02}"), turn, elevation, height)
    };
    (0..count).map(view).collect()
}

/// `count` cameras in front of the scene, within 15 degrees to each side and 8 up and down.
pub fn forward(frame: &GaussianFrame, up: Up, count: u32, height: u32) -> Vec<Camera> {
    let subject = Subject::of(frame, up);
    let view = |number: u32| {
        let around = TAU * number as f32 / count as f32;
        let turn = libm::cosf(around) * 15.0 / 180.0 * PI;
        let elevation = libm::sinf(around) * 8.0 / 180.0 * PI;
        subject.seen_from(format!("forward_{number:02}"), turn, elevation, height)
    };
    (0..count).map(view).collect()
}

/// `count` cameras spread evenly over the part of the sphere between 40 degrees below and 60 above: what a
/// viewer who walks freely may see. None coincides with a camera of a ring.
pub fn spiral(frame: &GaussianFrame, up: Up, count: u32, height: u32) -> Vec<Camera> {
    let subject = Subject::of(frame, up);
    let (low, high) = (-0.643, 0.866);
    // The golden angle never comes back to where it was.
    let golden = PI * (3.0 - 5.0_f32.sqrt());
    let view = |number: u32| {
        let share = (number as f32 + 0.5) / count as f32;
        let elevation = libm::asinf(low + (high - low) * share);
        subject.seen_from(format!("spiral_{number:02}"), 0.4 + golden * number as f32, elevation, height)
    };
    (0..count).map(view).collect()
}

/// The angle by which [`held_out`] turns given cameras about the scene, and up to which those of [`Scattered`] turn, radians: 5
/// degrees.
const TURN: f32 = 5.0 / 180.0 * PI;

/// `count` cameras that coincide with none of a ring or a spiral, between 10 degrees below and 40 above: to judge what
/// was chosen by other views. Where the scene comes with cameras they stand near some of these, turned about the middle
/// of what they see by 5 degrees to one side or the other.
pub fn held_out(frame: &GaussianFrame, up: Up, given: &[Camera], count: u32, height: u32) -> Vec<Camera> {
    held_out_views(&Subject::of(frame, up), given, (count, height), ("held_out", 0))
}

/// What [`held_out`] gives, and as many other cameras, as high, from other sides: to judge what was chosen by the first.
pub fn held_out_twice(
    frame: &GaussianFrame,
    up: Up,
    given: &[Camera],
    count: u32,
    height: u32,
) -> [Vec<Camera>; 2] {
    let subject = Subject::of(frame, up);
    [("held_out", 0), ("between_held_out", 1)]
        .map(|set| held_out_views(&subject, given, (count, height), set))
}

/// Cameras that rise while they go around the scene. Those of set 1 stand half the way from those of set 0 to the next, and near
/// others of the given cameras.
fn held_out_views(
    subject: &Subject,
    given: &[Camera],
    (count, height): (u32, u32),
    (name, set): (&str, u32),
) -> Vec<Camera> {
    let golden = PI * (3.0 - 5.0_f32.sqrt());
    let made = |number: u32| {
        let share = (number as f32 + 0.5) / count as f32;
        let elevation = libm::asinf(-0.174 + (0.643 + 0.174) * share);
        let azimuth = 1.9 + golden * (number as f32 + 0.5 * set as f32);
        subject.seen_from(format!("{name}_{number:02}"), azimuth, elevation, height)
    };
    let turned = |number: u32| {
        let at = (2 * number + 1 - set) as usize * given.len() / (2 * count as usize);
        // To the other side, where the same camera serves both sets.
        given.get(at).map(|camera| subject.turned(camera, (name, number + set), height))
    };
    (0..count).map(|number| turned(number).unwrap_or_else(|| made(number))).collect()
}

/// How far the elevation of a scattered camera reaches below and above, sine.
const SCATTERED: [f32; 2] = [-0.5, 0.9];

/// Cameras that look random, without end, and the same for the same seed on every machine: to fit something to pictures that
/// shall be good from anywhere.
///
/// Around a scene without cameras they stand from 30 degrees below to 64 above, between half and one and a half times as far
/// away as those of a [`ring`], with an angle of view of 30 to 60 degrees, and look past its middle by up to a third of its
/// radius. Where the scene comes with cameras each stands near one of these: moved by up to a tenth of its distance and turned
/// by up to 5 degrees, with 0.8 to 1.25 times its focal length.
///
/// ```
/// use splatstream_files::builtin::BuiltinScene;
/// use splatstream_render::camera::{Scattered, Up};
///
/// let frame = BuiltinScene { gaussians: 100, ..BuiltinScene::default() }.frame(0);
/// let cameras = || Scattered::new(&frame, Up::default(), &[], 7, 540).take(3);
/// assert!(cameras().eq(cameras()));
/// ```
#[derive(Debug, Clone)]
pub struct Scattered {
    subject: Subject,
    given: Vec<Camera>,
    random: SplitMix64,
    height: u32,
    number: u32,
}

impl Scattered {
    /// Of pictures of `height` lines of a frame, near the cameras that are given, if any are.
    pub fn new(frame: &GaussianFrame, up: Up, given: &[Camera], seed: u64, height: u32) -> Self {
        let (subject, random) = (Subject::of(frame, up), SplitMix64::new(seed));
        Self { subject, given: given.to_vec(), random, height, number: 0 }
    }

    fn within(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.random.unit() as f32
    }

    /// A vector within a ball of radius 1, nearly: of three coordinates the middle is most likely.
    fn aside(&mut self) -> Vec3 {
        Vec3::from([(); 3].map(|()| 0.5 * (self.random.signed() + self.random.signed())))
    }

    fn made(&mut self, name: String) -> Camera {
        let turn = self.within(0.0, TAU);
        let [low, high] = SCATTERED;
        let elevation = libm::asinf(self.within(low, high));
        let field = self.within(30.0, 60.0) / 180.0 * PI;
        let away = libm::exp2f(self.within(-1.0, 0.6));
        let aside = self.aside() * (self.subject.radius / 3.0);
        let seen = self.subject.seen_from(name, turn, elevation, self.height);
        let middle = self.subject.middle;
        let position = middle + (Vec3::from(seen.position) - middle) * away;
        let down = -self.subject.axes[1];
        Camera::look_at(seen.name, position, middle + aside, down, field, [seen.width, seen.height])
    }

    fn near(&mut self, name: String, camera: &Camera) -> Camera {
        let [position, ahead] = [camera.position, camera.rotation[2]].map(Vec3::from);
        let depth = ahead.dot(self.subject.middle - position).max(0.1 * self.subject.radius);
        let moved = position + self.aside() * (0.1 * depth);
        let axis = self.aside().normalize_or(Vec3::Y);
        let half = self.within(-0.5 * TURN, 0.5 * TURN);
        let turn = Quat::from_vec4((axis * libm::sinf(half)).extend(libm::cosf(half)));
        let zoom = libm::exp2f(self.within(-0.32, 0.32));
        let camera = camera.scaled_to_height(self.height);
        Camera {
            name,
            rotation: camera.rotation.map(|axis| (turn * Vec3::from(axis)).to_array()),
            position: moved.to_array(),
            focal: camera.focal.map(|focal| focal * zoom),
            ..camera
        }
    }
}

impl Iterator for Scattered {
    type Item = Camera;

    fn next(&mut self) -> Option<Camera> {
        let name = format!("scattered_{:04}", self.number);
        self.number = self.number.wrapping_add(1);
        let place = self.random.below(self.given.len());
        Some(match self.given.get(place).cloned() {
            Some(camera) => self.near(name, &camera),
            None => self.made(name),
        })
    }
}

/// Percentiles between which the box of a scene is measured, from the outermost to the innermost.
const BOXES: [[usize; 2]; 3] = [[3, 97], [20, 80], [35, 65]];

/// A box that is more than this many times as large as the one inside it holds surroundings: those of a ball or a block
/// are less than 2.5 times as large.
const SURROUNDINGS: f32 = 4.0;

/// What stands at some places, which rise, when values are sorted: the values between two places are looked at together.
#[expect(clippy::indexing_slicing, reason = "places are below the number of values")]
fn ranked(values: &mut [f32], places: &[usize]) -> Vec<f32> {
    let middle = places.len() / 2;
    let Some(&place) = places.get(middle) else { return Vec::new() };
    let (below, &mut value, above) = values.select_nth_unstable_by(place, f32::total_cmp);
    let mut found = ranked(below, &places[..middle]);
    found.push(value);
    let farther: Vec<usize> = places[middle + 1..].iter().map(|&other| other - place - 1).collect();
    found.extend(ranked(above, &farther));
    found
}

/// What a camera looks at.
#[derive(Debug, Clone)]
struct Subject {
    middle: Vec3,
    /// Radius of the sphere that a picture holds.
    radius: f32,
    /// Right, up and front.
    axes: [Vec3; 3],
}

impl Subject {
    /// The box of what is visible, less 3 % at either end of each axis: stray Gaussians do not push the cameras
    /// away. Where that box is more than four times as large as that of the inner 60 %, the scene has
    /// surroundings, and the inner box is the subject; and so on to the inner 30 %.
    #[expect(clippy::indexing_slicing, reason = "rows are those of the frame; boxes are constants")]
    fn of(frame: &GaussianFrame, up: Up) -> Self {
        let shown = |row: &usize| frame.opacity_logit()[*row] > VISIBLE_LOGIT;
        let mut rows: Vec<usize> = (0..frame.len()).filter(shown).collect();
        if rows.is_empty() {
            rows = (0..frame.len()).collect();
        }
        let mut axes =
            frame.position().each_ref().map(|plane| rows.iter().map(|&row| plane[row]).collect::<Vec<f32>>());
        let of_axis = |values: &mut Vec<f32>| {
            let count = values.len();
            let place = |percent: usize| count * percent / 100;
            let mut places: Vec<usize> = BOXES.as_flattened().iter().map(|&percent| place(percent)).collect();
            places.sort_unstable();
            places.dedup();
            let found = if values.is_empty() { Vec::new() } else { ranked(values, &places) };
            let value = |percent: usize| places.iter().zip(&found).find(|known| *known.0 == place(percent));
            BOXES.map(|percents| percents.map(|percent| value(percent).map_or(0.0, |known| *known.1)))
        };
        let mut of_axes = [[[0.0; 2]; BOXES.len()]; 3];
        of_axes.par_iter_mut().zip(&mut axes).for_each(|(boxes, values)| *boxes = of_axis(values));
        let corner =
            |number: usize, end: usize| Vec3::from(of_axes.each_ref().map(|boxes| boxes[number][end]));
        let boxes: [[Vec3; 2]; BOXES.len()] =
            std::array::from_fn(|number| [0, 1].map(|end| corner(number, end)));
        let side = |[low, high]: [Vec3; 2]| (high - low).length();
        let mut subject = boxes[0];
        for inner in &boxes[1..] {
            if side(subject) <= SURROUNDINGS * side(*inner) {
                break;
            }
            subject = *inner;
        }
        let [low, high] = subject;
        let radius = 0.5 * side(subject);
        Self { middle: 0.5 * (low + high), radius: if radius > 0.0 { radius } else { 1.0 }, axes: up.axes() }
    }

    /// A camera that has gone a little way around the part of the scene that it sees, to one side or the other.
    fn turned(&self, camera: &Camera, (name, number): (&str, u32), height: u32) -> Camera {
        let [down, ahead] = [camera.rotation[1], camera.rotation[2]].map(Vec3::from);
        let position = Vec3::from(camera.position);
        // A camera that looks past the scene turns about a point near it.
        let depth = ahead.dot(self.middle - position).max(0.1 * self.radius);
        let half = if number.is_multiple_of(2) { 0.5 * TURN } else { -0.5 * TURN };
        let turn = Quat::from_vec4((down * libm::sinf(half)).extend(libm::cosf(half)));
        let middle = position + ahead * depth;
        Camera {
            name: format!("{name}_{number:02}"),
            rotation: camera.rotation.map(|axis| (turn * Vec3::from(axis)).to_array()),
            position: (middle + turn * (position - middle)).to_array(),
            ..camera.scaled_to_height(height)
        }
    }

    /// A camera `turn` about the vertical from the front and `elevation` above it, radians.
    fn seen_from(&self, name: String, turn: f32, elevation: f32, height: u32) -> Camera {
        let [right, up, front] = self.axes;
        let level = right * libm::sinf(turn) + front * libm::cosf(turn);
        let towards = level * libm::cosf(elevation) + up * libm::sinf(elevation);
        let position = self.middle + towards * (self.radius / libm::sinf(0.5 * FIELD));
        let width = (u64::from(height) * 16 / 9) as u32;
        Camera::look_at(name, position, self.middle, -up, FIELD, [width.max(1), height])
    }
}
