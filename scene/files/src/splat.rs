//! `.splat`: 32 bytes a Gaussian and nothing else; no header, no spherical harmonics.
//!
//! | bytes | content |
//! |---|---|
//! | 0–11 | centre, three `f32` little endian |
//! | 12–23 | semi-axes (not their logs), three `f32` little endian |
//! | 24–27 | red, green, blue, opacity; 0 to 255 |
//! | 28–31 | rotation w, x, y, z; (byte − 128) / 128 |

use crate::byte_values::{
    byte_of_logit, is_beyond_scales, log_scale_of, logit_of_byte, scale_of_log, to_byte,
};
use crate::clamped::{Clamped, is_no_byte};
use crate::error::{SceneError, SceneErrorKind};
use crate::limits::{Budget, ReadLimits, bytes_of_planes};
use crate::reading::{checked, frame_of, row_of};
use splatstream_gaussians::activation::{colour_of_dc, dc_of_colour};
use splatstream_gaussians::rotation::normalised;
use splatstream_gaussians::{GaussianFrame, Planes};

/// Bytes of one Gaussian.
pub const RECORD: usize = 32;
const OF_RECORD: u64 = RECORD as u64;

/// Reads `.splat` records. Opacity 0 and 255 become finite logits, half a step inside.
///
/// # Errors
/// A length that is no multiple of 32 (there is no other way to tell a `.splat` file from any other bytes),
/// more than `limits` allow, or a value that no frame may hold (row and property are named).
pub fn read(bytes: &[u8], limits: &ReadLimits) -> Result<GaussianFrame, SceneError> {
    checked(read_as_is(bytes, &mut Budget::new(limits))?)
}

/// As [`read`], with values as they are: none is checked.
pub(crate) fn read_as_is(bytes: &[u8], budget: &mut Budget) -> Result<GaussianFrame, SceneError> {
    check_records(bytes.len() as u64)?;
    let mut planes = budget.planes(0, (bytes.len() / RECORD) as u64)?;
    for record in bytes.as_chunks::<RECORD>().0 {
        push(&mut planes, record);
    }
    frame_of(0, planes)
}

/// Whether the budget has room for a file of `size` bytes and its frame, and the file is one of whole records.
///
/// # Errors
/// It has not, or the file is not.
pub(crate) fn check_size(size: u64, budget: &mut Budget) -> Result<(), SceneError> {
    budget.check(size.saturating_add(bytes_of_planes(0, size / OF_RECORD)), "the frame")?;
    check_records(size)
}

/// Refuses a size that is none of whole records.
fn check_records(size: u64) -> Result<(), SceneError> {
    let over = size % OF_RECORD;
    if over == 0 {
        return Ok(());
    }
    let what = format!("{over} bytes over the last whole 32-byte record");
    let advice = "this is not a .splat file, or it is incomplete";
    Err(SceneErrorKind::Malformed { at: size.saturating_sub(over), what, advice }.into())
}

fn push(planes: &mut Planes, record: &[u8; RECORD]) {
    let (floats, rest) = record.as_chunks::<4>().0.split_at(6);
    let (positions, scales) = floats.split_at(3);
    for (plane, &bytes) in planes.position.iter_mut().zip(positions) {
        plane.push(f32::from_le_bytes(bytes));
    }
    for (plane, &bytes) in planes.log_scale.iter_mut().zip(scales) {
        plane.push(log_scale_of(f32::from_le_bytes(bytes)));
    }
    let &[[red, green, blue, opacity], rotation] = rest else { return };
    for (plane, byte) in planes.dc.iter_mut().zip([red, green, blue]) {
        plane.push(dc_of_colour(f64::from(byte) / 255.0));
    }
    planes.opacity_logit.push(logit_of_byte(opacity));
    for (plane, byte) in planes.rotation.iter_mut().zip(rotation) {
        plane.push((f32::from(byte) - 128.0) / 128.0);
    }
}

/// Writes `.splat` records, in the order of the frame. Spherical harmonics are dropped.
///
/// Centres are exact. Log scales come back within 2⁻²² of their size plus 2⁻²², down to ln 1e-10, below
/// which they come back as that; colours, 0 to 1, and opacities within 1/510; rotation components, before
/// they are normalised again, within 1/256, and 1/128 where one is 1.
///
/// # Errors
/// A frame that does not pass [`GaussianFrame::validate`].
pub fn write(frame: &GaussianFrame) -> Result<Vec<u8>, SceneError> {
    frame.validate()?;
    let mut out = Vec::with_capacity(frame.len().saturating_mul(RECORD));
    for (row, &opacity) in frame.opacity_logit().iter().enumerate() {
        for value in row_of(frame.position(), row) {
            out.extend_from_slice(&value.to_le_bytes());
        }
        for log in row_of(frame.log_scale(), row) {
            out.extend_from_slice(&scale_of_log(log).to_le_bytes());
        }
        out.extend(row_of(frame.dc(), row).map(|dc| to_byte(byte_scale(dc))));
        out.push(byte_of_logit(opacity));
        let rotation = row_of(frame.rotation(), row);
        // Validated: no quaternion is zero.
        let rotation = normalised(rotation).unwrap_or([1.0, 0.0, 0.0, 0.0]);
        out.extend(rotation.map(|part| to_byte(f64::from(part) * 128.0 + 128.0)));
    }
    Ok(out)
}

/// The values that [`write()`] cannot keep: colours outside 0 to 1, and semi-axes beyond the largest float. One entry per
/// property that has some.
pub fn clamped(frame: &GaussianFrame) -> Vec<Clamped> {
    let dc = Clamped::of("dc", frame.dc(), |_, dc| is_no_byte(byte_scale(dc)));
    let scale = Clamped::of("log_scale", frame.log_scale(), |_, log| is_beyond_scales(log));
    dc.into_iter().chain(scale).collect()
}

/// A colour on the scale of bytes.
fn byte_scale(dc: f32) -> f64 {
    colour_of_dc(dc) * 255.0
}
