//! What comes of coding a sample.

use splatstream_encoder::Report;
use splatstream_gaussians::GaussianFrame;

/// What a tool made of a sample.
#[derive(Default)]
pub(super) struct Attempt {
    /// The frames that come back, by their numbers.
    pub(super) shown: Vec<Option<GaussianFrame>>,
    /// Bytes; none if the tool refused, or packs nothing.
    pub(super) bytes: Option<u64>,
    /// Warnings and errors, each with who said it.
    pub(super) detected: Vec<String>,
    /// What was done otherwise than on the base.
    pub(super) fallback: Vec<String>,
    /// The stream and the encoder's report, if it was this encoder.
    pub(super) coded: Option<(Vec<u8>, Report)>,
}
