//! Captures of a scene that is known exactly: ray-traced pictures from calibrated cameras at any time.
//!
//! The scene is a stage of analytic surfaces: a rolling ball, a tumbling ring, a jointed arm and a turning box among still
//! things on a floor, posts and boulders some way off, and hills and sky 60 units away. Surfaces have textures with
//! fine detail; some are glossy or mirror their surroundings, so that they look different from everywhere.
//!
//! Light is one sun with soft shadows and a sky, dimmed in corners. Pictures are the means over pixels of linear light,
//! clamped to 0..1, with the transfer function of sRGB, in 8 bits. Numbers are single IEEE operations and `libm` in 64 bits,
//! and samples follow from their place: equal settings give equal bytes on every machine and for any number of threads.
//!
//! Axes are those of frames: x right, y down, z forward. The unit is a metre, more or less.

mod files;
mod light;
mod material;
mod objects;
mod rig;
mod shape;
mod trace;

pub use files::{CaptureFiles, NamedBytes};
pub use rig::Rig;

use objects::Objects;
use rayon::prelude::*;
use splatstream_gaussians::random::{SplitMix64, mix};
use splatstream_render::camera::CapturedPoint;
use splatstream_render::{Camera, Image};

/// A scene to be captured. Equal fields make equal pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Simulation {
    /// Chooses colours, textures and where movements start.
    pub seed: u64,
    /// Samples of each pixel on either axis, 1 to 16; clamped to that.
    pub samples: u32,
}

impl Default for Simulation {
    /// Sixteen samples of each pixel.
    fn default() -> Self {
        Self { seed: 1, samples: 4 }
    }
}

impl Simulation {
    /// What a camera sees at a time, seconds: values of the file's 256 levels, 0 to 1.
    ///
    /// ```
    /// use splatstream_capture::simulator::{Rig, Simulation};
    ///
    /// let simulation = Simulation { samples: 1, ..Simulation::default() };
    /// let camera = &Rig::Orbit.cameras(8, [64, 36])[0];
    /// let picture = simulation.picture(camera, 0.0);
    /// assert_eq!([picture.width(), picture.height()], [64, 36]);
    /// assert_ne!(picture, simulation.picture(camera, 0.5));
    /// ```
    #[must_use]
    pub fn picture(&self, camera: &Camera, seconds: f64) -> Image {
        let objects = Objects::at(self.seed, seconds);
        let sight = trace::Sight::new(camera);
        let side = self.samples.clamp(1, 16);
        let width = camera.width.max(1);
        let row = |y: u32| (0..width).map(move |x| [x, y]);
        let pixels = (0..camera.height.max(1)).into_par_iter().flat_map_iter(row);
        let pixel = |at: [u32; 2]| light::to_picture(sight.mean(&objects, at, side));
        Image::new(width as usize, pixels.map(pixel).collect())
    }

    /// `count` points of the scene as cameras see them at a time, as structure from motion would find them, but with points
    /// on surfaces without texture too: positions are off by about a thousandth of their distance.
    #[must_use]
    pub fn points(&self, cameras: &[Camera], seconds: f64, count: u32) -> Vec<CapturedPoint> {
        let objects = Objects::at(self.seed, seconds);
        let point = |number: u32| {
            let key = mix(self.seed ^ mix(u64::from(number)) ^ seconds.to_bits().rotate_left(17));
            let mut random = SplitMix64::new(key);
            let camera = cameras.get(random.below(cameras.len()))?;
            trace::Sight::new(camera).point(&objects, &mut random)
        };
        (0..count).into_par_iter().filter_map(point).collect()
    }
}
