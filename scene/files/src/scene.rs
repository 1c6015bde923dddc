//! A frame as it was read.

use crate::note::Note;
use splatstream_gaussians::GaussianFrame;

/// A frame that was read, and what a user should know of how.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// The Gaussians.
    pub frame: GaussianFrame,
    /// What the file has and the frame does not, or the reverse.
    pub notes: Vec<Note>,
}
