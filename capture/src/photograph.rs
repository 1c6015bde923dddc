//! Pictures with the cameras that took them.

use splatstream_render::metrics::psnr;
use splatstream_render::{Camera, Image, PreparedFrame};

/// A picture and its camera, eight bits a channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Photograph {
    camera: Camera,
    pixels: Vec<[u8; 3]>,
}

/// A picture of another size than its camera's.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{name}: the picture has {found:?} pixels, the camera says {expected:?}; give the pictures that the cameras are of"
)]
pub struct SizeError {
    /// What the view is called.
    pub name: String,
    /// Width and height of the picture.
    pub found: [usize; 2],
    /// Width and height that the camera says.
    pub expected: [usize; 2],
}

impl Photograph {
    /// A picture in `height` rows, or in its own if those are fewer: each pixel the mean of what it covers.
    ///
    /// A picture that a camera's is an exact or nearly exact multiple of, or the other way round, is the same view of another
    /// size, as programs write them for training on smaller pictures: the camera is scaled to it.
    ///
    /// # Errors
    /// A picture of another shape than the camera's.
    pub fn new(camera: &Camera, picture: &Image, height: Option<u32>) -> Result<Self, SizeError> {
        Ok(Self::whole(camera, picture)?.at_most(height))
    }

    /// A picture in its own rows.
    ///
    /// # Errors
    /// As [`Photograph::new`].
    pub(crate) fn whole(camera: &Camera, picture: &Image) -> Result<Self, SizeError> {
        let camera = camera_of(camera, [picture.width(), picture.height()])?;
        Ok(Self { pixels: bytes(picture), camera })
    }

    /// The same view in `height` rows, or in its own if those are fewer.
    pub(crate) fn at_most(self, height: Option<u32>) -> Self {
        match height.filter(|&height| height < self.camera.height) {
            Some(height) => self.smaller(height),
            None => self,
        }
    }

    /// From where it was taken, in pixels of this picture.
    #[must_use]
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The picture, 0 to 1.
    #[must_use]
    pub fn picture(&self) -> Image {
        let pixels = self.pixels.iter().map(|pixel| pixel.map(|level| f32::from(level) / 255.0)).collect();
        Image::new(self.camera.width as usize, pixels)
    }

    /// The same view in so many rows.
    #[must_use]
    pub(crate) fn smaller(&self, height: u32) -> Self {
        let camera = self.camera.scaled_to_height(height.max(1));
        let picture = self.picture().averaged(camera.width as usize, camera.height as usize);
        Self { pixels: bytes(&picture), camera }
    }

    /// How close a frame comes to the picture, dB of all pixels and channels.
    #[must_use]
    pub fn psnr(&self, frame: &PreparedFrame<'_>, background: [f32; 3]) -> f64 {
        psnr(&self.picture(), &frame.draw(&self.camera, background).rendering().colour)
    }
}

/// The camera of a picture of so many pixels, of which nothing else needs to be known.
///
/// # Errors
/// As [`Photograph::new`].
pub(crate) fn camera_of(camera: &Camera, found: [usize; 2]) -> Result<Camera, SizeError> {
    let camera = camera.scaled_to_height(found[1] as u32);
    let expected = [camera.width as usize, camera.height as usize];
    // A size that was halved may have been rounded either way.
    if found[0].abs_diff(expected[0]) > 1 {
        return Err(SizeError { name: camera.name, found, expected });
    }
    Ok(Camera { width: found[0] as u32, ..camera })
}

/// The nearest levels.
fn bytes(picture: &Image) -> Vec<[u8; 3]> {
    let level = |value: f32| (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
    picture.pixels().iter().map(|pixel| pixel.map(level)).collect()
}
