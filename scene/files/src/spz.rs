//! SPZ, versions 1 to 4, as published by Niantic (github.com/nianticlabs/spz).
//!
//! Version 4 is a plain header, a table of contents and one zstd frame an attribute; versions 1 to 3 are one
//! gzip stream of header and attributes. The attributes are the same, but for two: version 1 has `f16`
//! centres, and versions 1 and 2 store x, y, z of the rotation in a byte each.
//!
//! | attribute | bytes | value |
//! |---|---|---|
//! | centre | 3 × 3 | 24-bit fixed point with `fractional_bits` |
//! | opacity | 1 | 0 to 1 |
//! | colour | 3 × 1 | (byte / 255 − 0.5) / 0.15 is the DC coefficient |
//! | log scale | 3 × 1 | byte / 16 − 10 |
//! | rotation | 4 | place of the largest of x, y, z, w; the others as sign and 9 bits, ±1/√2 |
//! | SH | 1 each | (byte − 128) / 128, coefficient by coefficient, channels together |
//!
//! SPZ's axes are x right, y up, z back, unless an extension says otherwise; frames here are x right, y
//! down, z forward. Reading and writing convert.

mod attributes;
mod container;

use crate::clamped::Clamped;
use crate::error::SceneError;
use crate::limits::{Budget, ReadLimits};
use crate::reading::{checked, frame_of};
use splatstream_gaussians::GaussianFrame;

pub(crate) use container::{check, is_spz};

/// How [`write_with`] quantises.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WriteOptions {
    /// Fractional bits of centres, 0 to 23. None: the most with which the farthest centre fits in 24 bits.
    pub fractional_bits: Option<u8>,
    /// Bits kept of each band-1 coefficient, 1 to 8. Fewer compress better. Default 5, as the reference.
    pub sh1_bits: u8,
    /// Bits kept of each coefficient of bands 2 and 3, 1 to 8. Default 4, as the reference.
    pub sh_rest_bits: u8,
}

impl Default for WriteOptions {
    fn default() -> Self {
        Self { fractional_bits: None, sh1_bits: 5, sh_rest_bits: 4 }
    }
}

/// Reads an SPZ file of any version. Opacity 0 and 255 become finite logits, half a step inside. Spherical harmonics of
/// degree 4 are reduced to degree 3.
///
/// # Errors
/// Bytes that are no SPZ or end early, axes that are more than flipped, more than `limits`
/// allow, or a value that no frame may hold.
pub fn read(bytes: &[u8], limits: &ReadLimits) -> Result<GaussianFrame, SceneError> {
    checked(read_as_is(bytes, &mut Budget::new(limits))?)
}

/// As [`read`], with values as they are: none is checked.
pub(crate) fn read_as_is(bytes: &[u8], budget: &mut Budget) -> Result<GaussianFrame, SceneError> {
    let (shape, streams, planes) = container::read(bytes, budget)?;
    let frame = frame_of(shape.sh_degree, attributes::unpack(&shape, &streams, planes))?;
    Ok(frame.with_antialiased(shape.antialiased))
}

/// Writes version 3, which the most viewers read, with the default options.
///
/// # Errors
/// Those of [`write_with`].
pub fn write(frame: &GaussianFrame) -> Result<Vec<u8>, SceneError> {
    write_with(frame, &WriteOptions::default())
}

/// Writes version 3.
///
/// What comes back differs by at most half a step, and beyond the ends of a range is at its end:
///
/// | attribute | largest difference | range |
/// |---|---|---|
/// | centre | 2^(−1 − `fractional_bits`) | fits always |
/// | opacity | 1/510 | 0 to 1 |
/// | DC | 1/76.5 | −3.33 to 3.33 |
/// | log scale | 1/32 | −10 to 5.9375 |
/// | the smallest three of the rotation | 1/1445 | fits always |
/// | SH | 2^−bits | −1 to 1, less a step of 2^(1 − bits) at one end |
///
/// # Errors
/// A frame that does not pass [`GaussianFrame::validate`], a centre too far for 24 bits, or options outside
/// their ranges.
pub fn write_with(frame: &GaussianFrame, options: &WriteOptions) -> Result<Vec<u8>, SceneError> {
    frame.validate()?;
    let (shape, streams) = attributes::pack(frame, options)?;
    container::write(&shape, &streams)
}

/// The values that [`write_with`] cannot keep, since they are outside the ranges of its table. One entry per property that
/// has some.
pub fn clamped(frame: &GaussianFrame, options: &WriteOptions) -> Vec<Clamped> {
    attributes::clamped(frame, options)
}
