//! Pinhole cameras: pose and intrinsics, in the axes of a frame.

mod files;
mod generated;

pub use files::{
    CameraError, Capture, CapturedPoint, CapturedView, read_cameras, read_capture, read_views, write_cameras,
};
pub use generated::{Scattered, Up, forward, held_out, held_out_twice, ring, spiral};

use glam::{Mat3, Quat, Vec3};

/// A pinhole camera without distortion. Camera axes are x right, y down, z forward, as a frame's.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// What the view is called; the picture's file is named after it.
    pub name: String,
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Focal lengths along x and y, pixels.
    pub focal: [f32; 2],
    /// Principal point, pixels from the top left corner of the top left pixel.
    pub principal: [f32; 2],
    /// From world to camera: the rows are the camera's right, down and forward axes in the world.
    pub rotation: [[f32; 3]; 3],
    /// Centre of projection in the world.
    pub position: [f32; 3],
}

impl Camera {
    /// A camera at `position` that sees `target` in the middle of a picture of `[width, height]` pixels. `down`
    /// is the direction that shall point down in the picture; `field` is the vertical angle of view, radians.
    #[must_use]
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "products and sums of vectors of floats, which do not overflow"
    )]
    pub fn look_at(
        name: String,
        position: Vec3,
        target: Vec3,
        down: Vec3,
        field: f32,
        [width, height]: [u32; 2],
    ) -> Self {
        let ahead = (target - position).normalize_or(Vec3::Z);
        // Looking along `down`, any right will do.
        let right = down.cross(ahead).normalize_or(ahead.any_orthonormal_vector());
        let focal = 0.5 * height as f32 / libm::tanf(0.5 * field);
        Self {
            name,
            width,
            height,
            focal: [focal; 2],
            principal: [0.5 * width as f32, 0.5 * height as f32],
            rotation: [right, ahead.cross(right), ahead].map(|axis| axis.to_array()),
            position: position.to_array(),
        }
    }

    /// A camera with a pose as scene descriptions have it: `rotation` is a quaternion w, x, y, z from the camera to the
    /// scene, of any length; `field` is the vertical angle of view, radians.
    #[must_use]
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "products and sums of vectors of floats, which do not overflow"
    )]
    pub fn of_pose(name: String, position: [f32; 3], rotation: [f32; 4], field: f32, size: [u32; 2]) -> Self {
        let [w, x, y, z] = rotation;
        let length = Quat::from_xyzw(x, y, z, w).length();
        let rotation = if length > 0.0 { Quat::from_xyzw(x, y, z, w) / length } else { Quat::IDENTITY };
        let axes = Mat3::from_quat(rotation);
        let camera = Self::look_at(name, Vec3::ZERO, Vec3::Z, Vec3::Y, field, size);
        Self { rotation: axes.to_cols_array_2d(), position, ..camera }
    }

    /// The rotation of such a pose, a unit quaternion w, x, y, z.
    #[must_use]
    pub fn quaternion(&self) -> [f32; 4] {
        let [x, y, z, w] = Quat::from_mat3(&Mat3::from_cols_array_2d(&self.rotation)).normalize().to_array();
        [w, x, y, z]
    }

    /// The vertical angle of view, radians.
    #[must_use]
    pub fn vertical_field(&self) -> f32 {
        2.0 * libm::atanf(0.5 * self.height as f32 / self.focal[1])
    }

    /// The same view in a picture of `height` rows; the width follows, rounded to the nearest pixel.
    #[must_use]
    #[expect(clippy::indexing_slicing, reason = "axes are 0 and 1")]
    pub fn scaled_to_height(&self, height: u32) -> Self {
        let width = (f64::from(self.width) * f64::from(height) / f64::from(self.height)).round().max(1.0);
        let scale = [width as f32 / self.width as f32, height as f32 / self.height as f32];
        Self {
            width: width as u32,
            height,
            focal: [0, 1].map(|axis| self.focal[axis] * scale[axis]),
            principal: [0, 1].map(|axis| self.principal[axis] * scale[axis]),
            ..self.clone()
        }
    }
}
