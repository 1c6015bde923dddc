//! Files of 3D Gaussians in and out, and scenes made from a seed.
//!
//! * [`read_scene`] reads any supported file or directory; [`ply`], [`compressed_ply`], [`splat`], [`spz`], [`sog`],
//!   [`gltf`] and [`ksplat`] read one format each, and all but the last write; [`Clamped`] is what a format cannot keep of a
//!   frame, [`Note`] what a frame cannot hold of a file.
//! * [`srgb`] gives colours in linear light those of frames, which are encoded as sRGB.
//! * [`Sequence`] reads files of many frames, one at a time: archives, `.splatv` and `.splat4d`.
//! * [`builtin`] makes scenes from a seed, so that everything can be tried and tested without any input file.
//!
//! All of them give and take [`splatstream_gaussians::GaussianFrame`], whose axes are PLY's: x right, y down,
//! z forward. Readers of formats with other axes convert.
//!
//! No function here panics on any bytes: a count in a header is compared with the bytes that follow it and
//! with [`ReadLimits`] before anything is allocated. All maths that is not a single IEEE operation goes
//! through `libm`, so the same input gives the same frame on every machine.

#![deny(
    clippy::arithmetic_side_effects,
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used
)]

#[allow(
    clippy::arithmetic_side_effects,
    clippy::indexing_slicing,
    reason = "scenes are made from a few numbers that are clamped, not from input"
)]
pub mod builtin;
pub mod compressed_ply;
pub mod gltf;
pub mod ksplat;
pub mod ply;
pub mod sog;
pub mod splat;
pub mod spz;
pub mod srgb;

mod announced;
mod axes;
mod byte_values;
mod clamped;
mod cursor;
mod decompress;
mod error;
mod format;
mod half;
mod limits;
mod members;
mod morton;
mod note;
mod printable;
mod reading;
mod scene;
mod scene_file;
mod sequence;
mod smallest_three;
#[expect(clippy::arithmetic_side_effects, reason = "vectors of floats, which do not overflow")]
mod sphere;
mod walk;

pub use clamped::Clamped;
pub use error::{SceneError, SceneErrorKind};
pub use format::{HEAD, SceneFormat, detect};
pub use limits::ReadLimits;
pub use members::EXTENSIONS;
pub use note::Note;
pub use scene::Scene;
pub use scene_file::{read_scene, read_scene_as_is};
pub use sequence::{Sequence, SequenceOptions, natural_order};
