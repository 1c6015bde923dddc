//! A frame of Gaussians to a picture.

use crate::camera::Camera;
use crate::image::Image;
use splatstream_scene::GaussianFrame;

/// How to draw.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Options {
    /// Opacities were fitted for a renderer that compensates the low-pass filter.
    pub antialiased: bool,
    /// Colour behind everything.
    pub background: [f32; 3],
}

/// A picture and how much of each pixel the Gaussians cover.
#[derive(Clone, Debug, PartialEq)]
pub struct Rendering {
    /// Colour over the background.
    pub colour: Image,
    /// 1 less the transmittance of each pixel, 0 to 1; row by row as the picture.
    pub alpha: Vec<f32>,
}

/// Draws a frame.
pub fn render(_frame: &GaussianFrame, _camera: &Camera, _options: &Options) -> Rendering {
    unimplemented!()
}
