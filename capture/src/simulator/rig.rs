//! Cameras around and in front of the stage.

use glam::Vec3;
use splatstream_render::Camera;
use std::f32::consts::{PI, TAU};

/// Vertical angle of view, radians: 50 degrees.
const FIELD: f32 = 50.0 / 180.0 * PI;
/// What cameras look at.
const MIDDLE: Vec3 = Vec3::new(0.0, -0.55, 0.2);

/// How cameras stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rig {
    /// All around, 4.2 metres from the middle, on three heights in turn: 6, 22 and 40 degrees above.
    Orbit,
    /// In front, 4.4 metres away, in rows that cover 30 degrees from side to side and 18 from low to high.
    Forward,
}

impl Rig {
    /// `count` cameras whose pictures have `[width, height]` pixels, in an order in which every eighth sees what its
    /// neighbours see.
    #[must_use]
    pub fn cameras(self, count: u32, size: [u32; 2]) -> Vec<Camera> {
        (0..count).map(|number| self.camera(number, count, size)).collect()
    }

    fn camera(self, number: u32, count: u32, size: [u32; 2]) -> Camera {
        let share = (number as f32 + 0.5) / count as f32;
        let degrees = |degrees: f32| degrees / 180.0 * PI;
        let (turn, elevation, distance) = match self {
            Self::Orbit => {
                let elevation =
                    [6.0, 22.0, 40.0].into_iter().cycle().nth(number as usize % 3).unwrap_or_default();
                (TAU * share, degrees(elevation), 4.2)
            }
            Self::Forward => {
                // Three rows, each from side to side.
                let row = [4.0, 13.0, 22.0].into_iter().cycle().nth(number as usize % 3).unwrap_or_default();
                (degrees(30.0) * (share - 0.5), degrees(row), 4.4)
            }
        };
        let level = Vec3::new(libm::sinf(turn), 0.0, -libm::cosf(turn));
        let up = Vec3::NEG_Y * libm::sinf(elevation);
        let position = MIDDLE + (level * libm::cosf(elevation) + up) * distance;
        Camera::look_at(format!("view_{number:03}"), position, MIDDLE, Vec3::Y, FIELD, size)
    }
}
