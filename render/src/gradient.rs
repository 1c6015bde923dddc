//! How a loss on pictures changes with every value of the frame that they are drawn from.
//!
//! * [`PreparedFrame::draw`] draws a view that can be gone back through; [`Drawing::backward`] takes the slope of a loss by
//!   each pixel to slopes by centre, log-scale, rotation, opacity logit and colour of each Gaussian: [`Gradients`].
//! * [`Loss`] is the loss of 3D Gaussian splatting, L1 and SSIM, with its slope by each pixel.
//! * [`MultiResolution`] sums it over pictures of 540, 720 and 1080 lines.
//! * [`Adam`] goes down the slopes.
//!
//! Gradients are those of exactly the picture that [`render`](crate::render) draws, kernel with or without the
//! compensation of the low-pass filter, for the Gaussians, pixels and order that it chose. They do not follow what is
//! chosen: whether alpha reaches 1/255 or passes 0.99, where a pixel is done, which Gaussian is nearer, which are nearer
//! than the near plane. Where alpha, a channel of a colour or a slope of the projection is clamped, they are 0 through it.
//!
//! Gradients are equal for any number of threads and on every machine. A backward pass takes memory for nine numbers for
//! each Gaussian that shows and each row of tiles it shows in, of at most 16 rows or four for each thread at a time.
//!
//! ```
//! use splatstream_gaussians::{GaussianFrame, Planes};
//! use splatstream_render::camera::{Up, ring};
//! use splatstream_render::gradient::{Gradients, Loss};
//! use splatstream_render::{PreparedFrame, render};
//!
//! let one = |dc: f32| Planes {
//!     position: [vec![0.0], vec![0.0], vec![0.0]],
//!     log_scale: [vec![-1.0], vec![-2.0], vec![-2.0]],
//!     rotation: [vec![1.0], vec![0.0], vec![0.0], vec![0.0]],
//!     opacity_logit: vec![2.0],
//!     dc: [vec![dc], vec![0.0], vec![0.0]],
//!     sh: Vec::new(),
//! };
//! let (target, frame) = (GaussianFrame::from_planes(0, one(1.0))?, GaussianFrame::from_planes(0, one(0.5))?);
//! let camera = &ring(&target, Up::default(), 1, 64)[0];
//! let reference = render(&target, camera, [0.0; 3]).colour;
//!
//! let prepared = PreparedFrame::new(&frame);
//! let drawing = prepared.draw(camera, [0.0; 3]);
//! let judged = Loss::default().between(&reference, &drawing.rendering().colour)?;
//! let mut gradients = Gradients::zero(&frame);
//! drawing.backward(&judged.slopes, &mut gradients)?;
//! // More red would make the loss less.
//! assert!(judged.value > 0.0 && gradients.planes().dc[0][0] < 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//! Source of blending and projection backwards: Kerbl et al., "3D Gaussian splatting for real-time radiance field
//! rendering", 2023, appendix A; derived again for the kernel as [`rasterise`](crate::rasterise) writes it.

mod adam;
mod blend;
mod harmonics;
mod loss;
mod project;
mod resolutions;
mod similarity;

pub use adam::{Adam, Rates};
pub use loss::{Judged, Loss};
pub use resolutions::{MultiResolution, Resolution, Target};

use crate::camera::Camera;
use crate::image::Image;
use crate::rasterise::{PreparedFrame, Rendering, Sight, Splat, View, paint};
use splatstream_gaussians::{FrameError, GaussianFrame, Planes, sh_planes};

/// Pictures or frames that do not go together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GradientError {
    /// Two pictures of different sizes.
    #[error("a picture of {0:?} pixels where one of {1:?} is needed")]
    Size(
        /// Width and height of the picture given.
        [usize; 2],
        /// Width and height that it should have.
        [usize; 2],
    ),
    /// Gradients of another frame.
    #[error("gradients of {0} Gaussians and SH degree {1} where those of {2} and {3} are needed")]
    Frame(
        /// Gaussians of the gradients given.
        usize,
        /// Their SH degree.
        u8,
        /// Gaussians of the frame.
        usize,
        /// Its SH degree.
        u8,
    ),
    /// No picture of the resolutions asked for.
    #[error("none of the resolutions asked for fits into a picture of {0} lines")]
    Resolutions(
        /// Lines of the picture.
        u32,
    ),
}

/// The slope of a loss by each value of a frame: plane for plane as in the frame, row for row.
///
/// Slopes are in units of the loss for each unit of the value: scene units of a centre, 1 of a logarithm of a semi-axis, 1
/// of a component of the quaternion as it is stored, of any length, 1 of a logit, 1 of a coefficient. That of a quaternion
/// is at right angles to it. A Gaussian that no picture shows has 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Gradients {
    sh_degree: u8,
    planes: Planes,
}

impl Gradients {
    /// None yet, for a frame of this size and SH degree.
    #[must_use]
    pub fn zero(frame: &GaussianFrame) -> Self {
        let mut planes = Planes { sh: vec![Vec::new(); sh_planes(frame.sh_degree())], ..Planes::default() };
        planes.iter_mut().for_each(|plane| plane.resize(frame.len(), 0.0));
        Self { sh_degree: frame.sh_degree(), planes }
    }

    /// Slopes from elsewhere, such as those of a term of a loss that no picture shows.
    ///
    /// # Errors
    /// Planes that make no frame of that SH degree.
    pub fn from_planes(sh_degree: u8, planes: Planes) -> Result<Self, FrameError> {
        let planes = GaussianFrame::from_planes(sh_degree, planes)?.into_planes();
        Ok(Self { sh_degree, planes })
    }

    /// The slopes.
    #[must_use]
    pub fn planes(&self) -> &Planes {
        &self.planes
    }

    /// The slopes, to change: another term of a loss, or values of which those of the frame are made.
    #[must_use]
    pub fn planes_mut(&mut self) -> &mut Planes {
        &mut self.planes
    }

    /// The slopes, to keep.
    #[must_use]
    pub fn into_planes(self) -> Planes {
        self.planes
    }

    /// Sets all to 0, to be used again.
    pub fn clear(&mut self) {
        self.planes.iter_mut().for_each(|plane| plane.fill(0.0));
    }

    /// # Errors
    /// A frame of another size or SH degree.
    fn check(&self, frame: &GaussianFrame) -> Result<(), GradientError> {
        let (own, needed) =
            ((self.planes.opacity_logit.len(), self.sh_degree), (frame.len(), frame.sh_degree()));
        if own == needed { Ok(()) } else { Err(GradientError::Frame(own.0, own.1, needed.0, needed.1)) }
    }
}

/// What one picture says of a Gaussian.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    /// Its row in the frame.
    pub gaussian: u32,
    /// What the loss gains where its centre moves by one pixel to the right, and down, of the picture.
    pub slope: [f64; 2],
    /// From its centre to where its alpha falls below 1/255, pixels, to the side and down.
    pub extent: [f32; 2],
}

/// A picture that was drawn, and what is needed to go back through it.
pub struct Drawing<'a> {
    prepared: &'a PreparedFrame<'a>,
    camera: &'a Camera,
    view: View,
    rendering: Rendering,
}

impl PreparedFrame<'_> {
    /// Draws a whole picture over one colour, the same as [`render`](crate::render), and keeps how it came about.
    #[must_use]
    pub fn draw<'a>(&'a self, camera: &'a Camera, background: [f32; 3]) -> Drawing<'a> {
        let sight = Sight::of(camera);
        let view = View::new(self.frame, &self.shapes, &sight);
        let rendering = paint(&view, &sight, background, pulp::Arch::new());
        Drawing { prepared: self, camera, view, rendering }
    }
}

impl Drawing<'_> {
    /// The picture.
    #[must_use]
    pub fn rendering(&self) -> &Rendering {
        &self.rendering
    }

    /// How many Gaussians may show: those whose alpha is 1/255 or more somewhere in the picture's plane near it.
    #[must_use]
    pub fn gaussians(&self) -> usize {
        self.view.splats.len()
    }

    /// Adds to `gradients` what the loss gains with each value of the frame. `slopes` has what it gains with each channel of
    /// each pixel of [the picture](Drawing::rendering), which is not clamped to 0..1 for it.
    ///
    /// # Errors
    /// Slopes of another size than the picture, or gradients of another frame; then nothing is added.
    pub fn backward(&self, slopes: &Image, gradients: &mut Gradients) -> Result<(), GradientError> {
        self.shares(slopes, gradients).map(drop)
    }

    /// As [`Drawing::backward`]; gives what the picture says of each Gaussian that it may show, in no order that means
    /// anything. Trainers add Gaussians where these slopes are steep.
    ///
    /// # Errors
    /// As [`Drawing::backward`].
    pub fn backward_in_picture(
        &self,
        slopes: &Image,
        gradients: &mut Gradients,
    ) -> Result<Vec<Footprint>, GradientError> {
        let shares = self.shares(slopes, gradients)?;
        let footprint = |(splat, sums): (&Splat, &blend::Sums<f64>)| Footprint {
            gaussian: splat.gaussian,
            slope: project::by_centre(splat, sums),
            extent: splat.extent,
        };
        Ok(self.view.splats.iter().zip(&shares).map(footprint).collect())
    }

    /// Goes back through the picture, and gives the sums of each ellipse.
    fn shares(
        &self,
        slopes: &Image,
        gradients: &mut Gradients,
    ) -> Result<Vec<blend::Sums<f64>>, GradientError> {
        let picture = &self.rendering.colour;
        same_size(slopes, picture)?;
        gradients.check(self.prepared.frame)?;
        let shares = blend::backward(&self.view, picture, slopes);
        let projection = project::Projection::new(self.prepared, self.camera);
        projection.backward(&self.view.splats, &shares, &mut gradients.planes);
        Ok(shares)
    }
}

/// # Errors
/// Pictures of different sizes.
fn same_size(given: &Image, needed: &Image) -> Result<(), GradientError> {
    let [given, needed] = [given, needed].map(|image| [image.width(), image.height()]);
    if given == needed { Ok(()) } else { Err(GradientError::Size(given, needed)) }
}
