//! A frame as cameras see it, to compare other frames with.

use crate::metrics::psnr;
use crate::{Camera, Image, render};
use splatstream_gaussians::GaussianFrame;

/// Behind the Gaussians, of the frame and of those that are compared with it.
const BACKGROUND: [f32; 3] = [0.0; 3];

/// Pictures of a frame over black, and the cameras that they were taken with.
#[derive(Debug, Clone)]
pub struct ReferencePictures {
    views: Vec<(Camera, Image)>,
}

impl ReferencePictures {
    /// What the cameras see of a frame.
    #[must_use]
    pub fn new(frame: &GaussianFrame, cameras: Vec<Camera>) -> Self {
        let view = |camera: Camera| {
            let colour = render(frame, &camera, BACKGROUND).colour;
            (camera, colour)
        };
        Self { views: cameras.into_iter().map(view).collect() }
    }

    /// PSNR of each of another frame's pictures against these, dB; infinite where they are equal.
    pub fn psnr(&self, frame: &GaussianFrame) -> impl Iterator<Item = f64> {
        self.views.iter().map(|(camera, own)| psnr(own, &render(frame, camera, BACKGROUND).colour))
    }

    /// The cameras.
    pub fn cameras(&self) -> impl Iterator<Item = &Camera> {
        self.views.iter().map(|(camera, _)| camera)
    }

    /// The number of pictures.
    #[must_use]
    pub fn len(&self) -> usize {
        self.views.len()
    }

    /// Whether there is no picture.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.views.is_empty()
    }
}
