//! Laws and facts of the rasteriser, of what Gaussians contribute, and of the cameras.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

mod cameras;
mod captures;
mod contributions;
mod exact;
mod gaussian;
mod pictures;
