//! One Gaussian in 64 bits, by the formulas of the paper.

use crate::gaussian::Gaussian;
use splatstream_render::Camera;

pub(crate) const LEAST: f64 = 1.0 / 255.0;

/// Alpha that a Gaussian has at the centre of a pixel of a camera in the origin, before the least and the most.
pub(crate) fn alpha(gaussian: &Gaussian, camera: &Camera, antialiased: bool, pixel: [u32; 2]) -> f64 {
    let position = gaussian.position.map(f64::from);
    let focal = f64::from(camera.focal[0]);
    let [a, b, c] = covariance(gaussian, camera);
    let (wide, tall) = (a + 0.3, c + 0.3);
    let determinant = wide * tall - b * b;
    let offset = [0, 1].map(|axis| {
        let centre = focal * position[axis] / position[2] + f64::from(camera.principal[axis]);
        f64::from(pixel[axis]) + 0.5 - centre
    });
    let [x, y] = offset;
    let distance = (tall * x * x - 2.0 * b * x * y + wide * y * y) / determinant;
    let kept = if antialiased { ((a * c - b * b).max(0.0) / determinant).sqrt() } else { 1.0 };
    kept * opacity(gaussian) * (-0.5 * distance).exp()
}

pub(crate) fn opacity(gaussian: &Gaussian) -> f64 {
    1.0 / (1.0 + (-f64::from(gaussian.opacity_logit)).exp())
}

/// J R S Sᵀ Rᵀ Jᵀ.
fn covariance(gaussian: &Gaussian, camera: &Camera) -> [f64; 3] {
    let [x, y, z] = gaussian.position.map(f64::from);
    let focal = f64::from(camera.focal[0]);
    let slope = |at: f64, size: u32| {
        let half = 0.5 * f64::from(size) / focal;
        (at / z).clamp(-1.3 * half, 1.3 * half)
    };
    let jacobian = [
        [focal / z, 0.0, -focal / z * slope(x, camera.width)],
        [0.0, focal / z, -focal / z * slope(y, camera.height)],
    ];
    let rotation = matrix(gaussian.rotation.map(f64::from));
    let scale = gaussian.log_scale.map(|log| f64::from(log).exp());
    let factor = jacobian.map(|row| {
        [0, 1, 2]
            .map(|k| scale[k] * (row[0] * rotation[0][k] + row[1] * rotation[1][k] + row[2] * rotation[2][k]))
    });
    let dot = |p: [f64; 3], q: [f64; 3]| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
    [dot(factor[0], factor[0]), dot(factor[0], factor[1]), dot(factor[1], factor[1])]
}

/// The rotation of a quaternion of any length.
fn matrix([w, x, y, z]: [f64; 4]) -> [[f64; 3]; 3] {
    let s = 2.0 / (w * w + x * x + y * y + z * z);
    [
        [1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)],
        [s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x)],
        [s * (x * z - w * y), s * (y * z + w * x), 1.0 - s * (x * x + y * y)],
    ]
}
