//! Laws and facts of the rasteriser, of what Gaussians contribute, and of the cameras.

mod cameras;
mod contributions;
mod exact;
mod gaussian;
mod pictures;
