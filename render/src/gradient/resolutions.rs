//! The loss of the paper over pictures of several resolutions.

use super::{GradientError, Gradients, Loss};
use crate::camera::Camera;
use crate::image::Image;
use crate::rasterise::PreparedFrame;

/// A resolution and its weight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resolution {
    /// Lines of the picture, 1 or more.
    pub lines: u32,
    /// λ: 0 or more.
    pub weight: f32,
}

/// The multi-resolution loss of the paper: Σ λᵣ·[(1 − β)·L1 + β·(1 − SSIM)], over pictures of r lines.
///
/// The frame is drawn at every resolution on its own; the reference is one picture, of which each pixel of the lower
/// resolutions is the mean of the area that it covers.
#[derive(Clone, Debug, PartialEq)]
pub struct MultiResolution {
    /// The resolutions r, with λᵣ.
    pub resolutions: Vec<Resolution>,
    /// The loss of one picture, with β.
    pub loss: Loss,
}

impl Default for MultiResolution {
    /// 540, 720 and 1080 lines as in the paper, which gives no weights: λ is 1/3 each, as the loss of a picture is a mean
    /// already, and β the 0.2 of 3D Gaussian splatting.
    fn default() -> Self {
        let resolution = |lines| Resolution { lines, weight: 1.0 / 3.0 };
        Self { resolutions: [540, 720, 1080].map(resolution).to_vec(), loss: Loss::default() }
    }
}

/// A view at one resolution.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// Where it was taken from.
    pub camera: Camera,
    /// What a frame should look like from there.
    pub picture: Image,
    /// λ.
    pub weight: f32,
}

impl MultiResolution {
    /// The views of one reference picture. A resolution of more lines than the camera's picture has is left out, for the
    /// reference does not show it.
    ///
    /// # Errors
    /// A picture of another size than the camera's, or no resolution that fits into it.
    pub fn targets(&self, camera: &Camera, picture: &Image) -> Result<Vec<Target>, GradientError> {
        let size = [camera.width as usize, camera.height as usize];
        if [picture.width(), picture.height()] != size {
            return Err(GradientError::Size([picture.width(), picture.height()], size));
        }
        let fits = |resolution: &&Resolution| (1..=camera.height).contains(&resolution.lines);
        let target = |&Resolution { lines, weight }: &Resolution| {
            let camera = camera.scaled_to_height(lines);
            let picture = picture.averaged(camera.width as usize, camera.height as usize);
            Target { camera, picture, weight }
        };
        let targets: Vec<Target> = self.resolutions.iter().filter(fits).map(target).collect();
        if targets.is_empty() { Err(GradientError::Resolutions(camera.height)) } else { Ok(targets) }
    }

    /// The loss of a frame over one colour; its slopes are added to `gradients`.
    ///
    /// # Errors
    /// A target whose picture is of another size than its camera's, or gradients of another frame. Targets before it have
    /// been added.
    ///
    /// ```
    /// use splatstream_files::builtin::BuiltinScene;
    /// use splatstream_render::camera::{Up, ring};
    /// use splatstream_render::gradient::{Gradients, MultiResolution, Resolution};
    /// use splatstream_render::{PreparedFrame, render};
    ///
    /// let frame = BuiltinScene { gaussians: 100, ..BuiltinScene::default() }.frame(0);
    /// let camera = &ring(&frame, Up::default(), 1, 64)[0];
    /// let picture = render(&frame, camera, [0.0; 3]).colour;
    /// let small = |lines| Resolution { lines, weight: 0.5 };
    /// let loss = MultiResolution { resolutions: vec![small(32), small(64)], ..MultiResolution::default() };
    /// let targets = loss.targets(camera, &picture)?;
    /// let mut gradients = Gradients::zero(&frame);
    /// let value = loss.add(&PreparedFrame::new(&frame), [0.0; 3], &targets, &mut gradients)?;
    /// // Of 64 lines it is the picture itself; 32 lines drawn are not quite the means of 64.
    /// assert!(value > 0.0 && value < 0.05);
    /// # Ok::<(), splatstream_render::gradient::GradientError>(())
    /// ```
    pub fn add(
        &self,
        frame: &PreparedFrame<'_>,
        background: [f32; 3],
        targets: &[Target],
        gradients: &mut Gradients,
    ) -> Result<f64, GradientError> {
        let mut value = 0.0;
        for target in targets {
            let drawing = frame.draw(&target.camera, background);
            let judged = self.loss.between(&target.picture, &drawing.rendering().colour)?;
            drawing.backward(&weighted(judged.slopes, target.weight), gradients)?;
            value += f64::from(target.weight) * judged.value;
        }
        Ok(value)
    }
}

/// Slopes of a loss of this weight.
fn weighted(slopes: Image, weight: f32) -> Image {
    let width = slopes.width();
    Image::new(width, slopes.pixels().iter().map(|pixel| pixel.map(|slope| weight * slope)).collect())
}
