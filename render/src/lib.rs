//! Gaussians to pixels, and how far apart two pictures are.
//!
//! * [`camera`]: pinhole cameras, read from the JSON files in use and models of COLMAP, with pictures and points, or made
//!   for a scene that has none;
//! * [`rasterise`]: a frame of Gaussians to a picture, as 3D Gaussian splatting defines it;
//! * [`ReferencePictures`]: a frame as cameras see it, to compare other frames with;
//! * [`PreparedFrame::strips`]: strips of a picture, which show nearly the errors of all of it;
//! * [`contribution`]: how much each Gaussian shows in a set of views;
//! * [`gradient`]: how a loss on pictures changes with every value of a frame;
//! * [`metrics`]: PSNR, SSIM, a learned metric, and the mean difference of two rate-distortion curves.
//!
//! Pictures are equal for any number of threads and on every machine: single IEEE operations in a stated
//! order, `libm` for the rest, and sums in a fixed order.
//!
//! Kernels of numbers index what they have counted themselves; each says at its head why that cannot fail.

// In tests, an overflow is a failed test.
#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects))]
#![deny(clippy::expect_used, clippy::indexing_slicing, clippy::panic, clippy::unwrap_used)]

pub mod camera;
pub mod contribution;
pub mod gradient;
pub mod image;
pub mod metrics;
pub mod rasterise;
mod reference;

pub use camera::Camera;
pub use image::Image;
pub use rasterise::{PreparedFrame, Rendering, Strips, draw_strips, render, touching_strips};
pub use reference::ReferencePictures;
