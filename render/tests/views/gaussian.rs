//! Frames and cameras for the tests.

use proptest::prelude::*;
use splatstream_gaussians::{GaussianFrame, Planes};
use splatstream_render::Camera;

/// One Gaussian without view dependence.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gaussian {
    pub(crate) position: [f32; 3],
    pub(crate) log_scale: [f32; 3],
    /// w, x, y, z; the frame normalises it.
    pub(crate) rotation: [f32; 4],
    pub(crate) opacity_logit: f32,
    pub(crate) dc: [f32; 3],
}

/// White, a tenth of a unit wide, nearly opaque, three units ahead.
pub(crate) const BALL: Gaussian = Gaussian {
    position: [0.0, 0.0, 3.0],
    log_scale: [-2.3; 3],
    rotation: [1.0, 0.0, 0.0, 0.0],
    opacity_logit: 3.0,
    dc: [1.772_453_9; 3],
};

pub(crate) fn frame(gaussians: &[Gaussian]) -> GaussianFrame {
    let mut planes = Planes::default();
    for gaussian in gaussians {
        let length = gaussian.rotation.iter().map(|part| part * part).sum::<f32>().sqrt();
        let rotation = gaussian.rotation.map(|part| part / length);
        for (plane, value) in planes.position.iter_mut().zip(gaussian.position) {
            plane.push(value);
        }
        for (plane, value) in planes.log_scale.iter_mut().zip(gaussian.log_scale) {
            plane.push(value);
        }
        for (plane, value) in planes.rotation.iter_mut().zip(rotation) {
            plane.push(value);
        }
        for (plane, value) in planes.dc.iter_mut().zip(gaussian.dc) {
            plane.push(value);
        }
        planes.opacity_logit.push(gaussian.opacity_logit);
    }
    GaussianFrame::from_planes(0, planes).expect("planes of one length")
}

/// A camera in the origin that looks along z.
pub(crate) fn camera(width: u32, height: u32, focal: f32) -> Camera {
    Camera {
        name: "test".to_owned(),
        width,
        height,
        focal: [focal; 2],
        principal: [0.5 * width as f32, 0.5 * height as f32],
        rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        position: [0.0; 3],
    }
}

/// Gaussians in front of such a camera: of any direction, also long and thin ones, some half outside of the
/// picture.
pub(crate) fn any_gaussian() -> impl Strategy<Value = Gaussian> {
    let rotation = [-1.0_f32..1.0, -1.0_f32..1.0, -1.0_f32..1.0, 0.1_f32..1.0];
    let slopes = [-0.6_f32..0.6, -0.6_f32..0.6];
    let scales = [-6.0_f32..-0.5, -6.0_f32..-0.5, -9.0_f32..-0.5];
    (slopes, 1.0_f32..8.0, scales, rotation, -4.0_f32..6.0, [-2.0_f32..2.0, -2.0_f32..2.0, -2.0_f32..2.0])
        .prop_map(|(slopes, depth, log_scale, [x, y, z, w], opacity_logit, dc)| Gaussian {
            position: [slopes[0] * depth, slopes[1] * depth, depth],
            log_scale,
            rotation: [w, x, y, z],
            opacity_logit,
            dc,
        })
}

/// Up to 40 of them.
pub(crate) fn any_gaussians() -> impl Strategy<Value = Vec<Gaussian>> {
    proptest::collection::vec(any_gaussian(), 1..40)
}
