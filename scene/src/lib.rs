//! A frame of 3D Gaussians in PLY's domain, and the files it comes from and goes to.
//!
//! * [`GaussianFrame`] is the one exchange type: structure of arrays, `f32`, log scale, opacity logit,
//!   unit quaternion `w x y z`, DC and spherical-harmonic coefficients.
//! * [`read_scene`] reads any supported file or directory; [`ply`], [`compressed_ply`], [`splat`], [`spz`]
//!   and [`sog`] read one format each, and the first, third and fourth write.
//! * [`importance`] scores Gaussians and orders them; [`builtin`] makes scenes from a seed, so that
//!   everything can be tried and tested without any input file.
//!
//! Axes are PLY's: x right, y down, z forward. Readers of formats with other axes convert.
//!
//! No function here panics on any bytes: a count in a header is compared with the bytes that follow it and
//! with [`ReadLimits`] before anything is allocated. All maths that is not a single IEEE operation goes
//! through `libm`, so the same input gives the same frame on every machine.

pub mod builtin;
pub mod compressed_ply;
pub mod importance;
pub mod ply;
pub mod sog;
pub mod splat;
pub mod spz;

mod activation;
mod cursor;
mod decompress;
mod defect;
mod error;
mod format;
mod frame;
mod limits;
mod rotation;
mod sh;

pub use defect::{Defect, DefectKind, Defects};
pub use error::{SceneError, SceneErrorKind};
pub use format::{SceneFormat, detect, read_scene, read_scene_as_is};
pub use frame::{FrameError, GaussianFrame, Planes};
pub use limits::ReadLimits;
pub use sh::{MAX_SH_DEGREE, sh_basis, sh_coefficients};
