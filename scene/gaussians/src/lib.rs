//! A frame of 3D Gaussians in PLY's domain: what the files, the codec and the renderer exchange.
//!
//! * [`GaussianFrame`] is the one exchange type: structure of arrays, `f32`, log scale, opacity logit,
//!   unit quaternion `w x y z`, DC and spherical-harmonic coefficients. [`Planes`] builds it.
//! * [`Defects`] are the values that no frame may hold: see [`GaussianFrame::validate`].
//! * [`activation`], [`rotation`] and [`sh_basis`] say what the values stand for; [`importance`] scores
//!   Gaussians and orders them.
//! * [`random`] gives numbers from a seed, for whatever makes or chooses Gaussians.
//!
//! Axes are PLY's: x right, y down, z forward.
//!
//! All maths that is not a single IEEE operation goes through `libm`, so the same input gives the same frame
//! on every machine. There is no I/O here, no file format and no thread.

// In tests, an overflow is a failed test.
#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects))]
#![deny(clippy::expect_used, clippy::indexing_slicing, clippy::panic, clippy::unwrap_used)]

pub mod activation;
pub mod importance;
pub mod random;
pub mod rotation;

mod defect;
mod frame;
mod sh;

pub use defect::{Defect, DefectKind, Defects};
pub use frame::{FrameError, GaussianFrame, Planes, PlanesMut, PlanesRef};
pub use sh::{MAX_SH_DEGREE, SH_C0, rest_index, sh_basis, sh_coefficients, sh_planes};
