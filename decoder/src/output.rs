//! Clause 7.10: integers to f32. The only floating point of the decoder.
//!
//! Every line is one IEEE 754 operation, rounded to nearest even, in the order written: no fused
//! multiply-add, no reassociation. So the output is the same bits everywhere.
#![expect(clippy::float_arithmetic, reason = "clause 7.10: attributes leave the integer domain here")]

use crate::frame::QuantizedFrame;
use rayon::prelude::*;
use splatstream_format::syntax::SequenceParameters;
use splatstream_scene::{GaussianFrame, Planes};

/// dc and sh integers are on a lattice 64 times finer than their step.
const COLOUR_FRACTION: f32 = 1.0 / 64.0;

/// The frame as Gaussians in PLY's domain.
pub fn to_gaussians(frame: &QuantizedFrame, sequence: &SequenceParameters) -> GaussianFrame {
    let [x, y, z] = &frame.position;
    let offset = sequence.position_offset();
    let step = sequence.position_step();
    let position = [(x, offset[0]), (y, offset[1]), (z, offset[2])]
        .map(|(plane, offset)| plane.par_iter().map(|&q| offset + step * q as f32).collect());
    let scaled = |plane: &Vec<i32>, offset: f32, step: f32| -> Vec<f32> {
        plane.par_iter().map(|&q| offset + step * q as f32).collect()
    };
    let log_scale = frame
        .log_scale
        .each_ref()
        .map(|plane| scaled(plane, sequence.log_scale_offset(), sequence.log_scale_step()));
    let opacity_logit = scaled(&frame.opacity, sequence.opacity_offset(), sequence.opacity_step());
    let colour = |plane: &Vec<i32>, step: f32| -> Vec<f32> {
        let fine_step = step * COLOUR_FRACTION;
        plane.par_iter().map(|&q| fine_step * q as f32).collect()
    };
    let dc = frame.dc.each_ref().map(|plane| colour(plane, sequence.dc_step()));
    let sh = frame.sh.iter().map(|plane| colour(plane, sequence.sh_step())).collect();
    let rotation = rotations(&frame.rotation, sequence.rotation_step());
    let planes = Planes { position, log_scale, rotation, opacity_logit, dc, sh };
    GaussianFrame::from_planes(sequence.sh_degree, planes).unwrap_or_default()
}

/// w is what makes the quaternion a unit, 0 if x, y, z are already longer than one.
fn rotations(planes: &[Vec<i32>; 3], step: f32) -> [Vec<f32>; 4] {
    let [x, y, z] =
        planes.each_ref().map(|plane| -> Vec<f32> { plane.par_iter().map(|&q| step * q as f32).collect() });
    let w = x
        .par_iter()
        .zip(&y)
        .zip(&z)
        .map(|((&x, &y), &z)| {
            let squares = x * x + y * y + z * z;
            (1.0 - squares).max(0.0).sqrt()
        })
        .collect();
    [w, x, y, z]
}
