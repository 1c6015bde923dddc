//! Pictures to Gaussians.
//!
//! * [`Photograph`] is a picture with the camera that took it;
//! * [`load_photographs`] and [`load_points`] open what [`read_capture`](splatstream_render::camera::read_capture) found;
//! * [`trainer`] makes a frame of Gaussians of photographs and points;
//! * [`follow`] makes one sequence of frames that were trained apart, which [`in_common`] tells from others;
//! * [`simulator`] makes captures of a scene that is known exactly: pictures, cameras, points.
//!
//! Results are equal for any number of threads and on every machine: single IEEE operations in a stated order, `libm` for the
//! rest.

// In tests, an overflow is a failed test.
#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects))]
#![deny(clippy::expect_used, clippy::indexing_slicing, clippy::panic, clippy::unwrap_used)]

#[allow(
    clippy::arithmetic_side_effects,
    clippy::indexing_slicing,
    reason = "scenes are made from a few numbers that are clamped, not from input"
)]
pub mod simulator;
pub mod trainer;

mod likeness;
mod load;
mod photograph;
mod tracker;

pub use likeness::in_common;
pub use load::{LoadError, load_photographs, load_points};
pub use photograph::{Photograph, SizeError};
pub use tracker::{Followed, Following, follow};
