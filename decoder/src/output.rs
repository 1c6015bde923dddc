//! Clause 7.10: integers to f32. The only floating point of the decoder.
//!
//! Every line is one IEEE 754 operation, rounded to nearest even, in the order written: no fused
//! multiply-add, no reassociation. So the output is the same bits everywhere.
#![expect(clippy::float_arithmetic, reason = "clause 7.10: attributes leave the integer domain here")]

use crate::companding::Companding;
use crate::frame::QuantizedFrame;
use rayon::prelude::*;
use splatstream_format::syntax::SequenceParameters;
use splatstream_gaussians::{FrameError, GaussianFrame, Planes};

/// dc and sh integers are on a grid 64 times finer than their step.
const COLOUR_FRACTION: f32 = 1.0 / 64.0;

/// The frame as Gaussians in PLY's domain. The planes of integers become the planes of f32: no third copy of a
/// frame is ever held.
///
/// # Errors
/// Planes of different lengths, or other SH planes than the degree of the sequence has. A decoded frame has neither.
pub fn to_gaussians(
    frame: QuantizedFrame,
    sequence: &SequenceParameters,
) -> Result<GaussianFrame, FrameError> {
    let QuantizedFrame { position, log_scale, opacity, rotation, dc, sh } = frame;
    let [log_scale_offset, opacity_offset] = [sequence.log_scale_offset(), sequence.opacity_offset()];
    let [log_scale_step, opacity_step] = [sequence.log_scale_step(), sequence.opacity_step()];
    let rotation_step = sequence.rotation_step();
    let dc_step = sequence.dc_step() * COLOUR_FRACTION;
    let sh_step = sequence.sh_step() * COLOUR_FRACTION;
    let quaternions = || {
        let [x, y, z] = each(rotation, |plane| scaled(plane, rotation_step));
        [unit_w(&x, &y, &z), x, y, z]
    };
    let colours = || {
        let of_sh = || sh.into_par_iter().map(|plane| scaled(plane, sh_step)).collect();
        rayon::join(|| each(dc, |plane| scaled(plane, dc_step)), of_sh)
    };
    let shapes = || {
        let of_opacity = || affine(opacity, opacity_offset, opacity_step);
        rayon::join(|| each(log_scale, |plane| affine(plane, log_scale_offset, log_scale_step)), of_opacity)
    };
    let ((position, rotation), ((log_scale, opacity_logit), (dc, sh))) = rayon::join(
        || rayon::join(|| scene_positions(position, sequence), quaternions),
        || rayon::join(shapes, colours),
    );
    let planes = Planes { position, log_scale, rotation, opacity_logit, dc, sh };
    let frame = GaussianFrame::from_planes(sequence.sh_degree, planes)?;
    Ok(frame.with_antialiased(sequence.antialiased()))
}

fn scene_positions(position: [Vec<u32>; 3], sequence: &SequenceParameters) -> [Vec<f32>; 3] {
    let (step, companding) = (sequence.position_step(), Companding::new(sequence));
    let [x, y, z] = position;
    let [of_x, of_y, of_z] = sequence.position_offset();
    each([(x, of_x), (y, of_y), (z, of_z)], |(plane, offset)| match companding.is_linear() {
        true => plane.into_iter().map(|q| offset + step * q as f32).collect(),
        false => plane.into_iter().map(|q| offset + step * companding.expand(q) as f32).collect(),
    })
}

/// What `f` makes of each of three planes, on all cores.
fn each<T: Send, U: Send>([x, y, z]: [T; 3], f: impl Fn(T) -> U + Sync) -> [U; 3] {
    let (x, (y, z)) = rayon::join(|| f(x), || rayon::join(|| f(y), || f(z)));
    [x, y, z]
}

fn affine(plane: Vec<i32>, offset: f32, step: f32) -> Vec<f32> {
    plane.into_iter().map(|q| offset + step * q as f32).collect()
}

fn scaled(plane: Vec<i32>, step: f32) -> Vec<f32> {
    plane.into_iter().map(|q| step * q as f32).collect()
}

/// w is what makes the quaternion a unit, 0 if x, y, z are already longer than one.
fn unit_w(x: &[f32], y: &[f32], z: &[f32]) -> Vec<f32> {
    let of = |((&x, &y), &z): ((&f32, &f32), &f32)| {
        let squares = x * x + y * y + z * z;
        (1.0 - squares).max(0.0).sqrt()
    };
    x.iter().zip(y).zip(z).map(of).collect()
}
