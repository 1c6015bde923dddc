//! What fitting values to pictures has done.

use super::receivers::Receiver;
use splatstream_decoder::operating_point::OperatingPoint;

/// What fitting an I frame has done.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct FinetuneReport {
    /// Display index of the frame.
    pub frame: u32,
    /// The spatial layer.
    pub spatial_layer: u8,
    /// Steps of descent that were taken.
    pub iterations: u32,
    /// Those of them that an earlier run had taken, from whose [state](crate::FinetuneState) this one went on.
    pub resumed: u32,
    /// How long it took, in all runs together.
    pub seconds: f64,
    /// PSNR before and after, decibels, in views that no slope was taken of, but by which it was chosen what is kept: the mean of
    /// the operating points by their weights.
    pub psnr: [f64; 2],
    /// Bits of all values but positions before and after, as their models estimate them.
    pub bits: [f64; 2],
    /// What receivers of each operating point that was optimised for see.
    pub points: Vec<PointReport>,
}

impl FinetuneReport {
    /// Of the fit of a layer to what these receivers see, before anything is known of it.
    pub(super) fn of_points<'r>(spatial_layer: u8, receivers: impl Iterator<Item = &'r Receiver>) -> Self {
        let point = |receiver: &Receiver| PointReport {
            point: receiver.point,
            weight: receiver.given_weight,
            psnr: [0.0; 2],
        };
        Self { spatial_layer, points: receivers.map(point).collect(), ..Self::default() }
    }
}

/// What fitting has done at an operating point.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct PointReport {
    /// The operating point.
    pub point: OperatingPoint,
    /// What a decibel there was worth beside one at others.
    pub weight: f64,
    /// Mean PSNR before and after, decibels, in views of the lines of its layer by which nothing was chosen.
    pub psnr: [f64; 2],
}
