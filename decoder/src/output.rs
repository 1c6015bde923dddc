//! Clause 7.10: integers to f32. The only floating point of the decoder.
//!
//! Every line is one IEEE 754 operation, rounded to nearest even, in the order written: no fused
//! multiply-add, no reassociation. So the output is the same bits everywhere.
#![expect(clippy::float_arithmetic, reason = "clause 7.10: attributes leave the integer domain here")]

use crate::cores;
use crate::frame::QuantizedFrame;
use crate::interrupt::Interrupt;
use splatstream_format::syntax::SequenceParameters;
use splatstream_gaussians::{FrameError, GaussianFrame, Planes};

pub use crate::companding::Companding;

/// dc and sh integers are on a grid 64 times finer than their step.
const COLOUR_FRACTION: f32 = 1.0 / 64.0;

/// Gaussians of which a core finds w before it takes others.
const RUN: usize = 1 << 14;

/// The frame as Gaussians in PLY's domain. The planes of integers become the planes of f32: no third copy of a
/// frame is ever held.
///
/// # Errors
/// Planes of different lengths, or other SH planes than the degree of the sequence has. A decoded frame has neither.
pub fn to_gaussians(
    frame: QuantizedFrame,
    sequence: &SequenceParameters,
) -> Result<GaussianFrame, FrameError> {
    let values = frame.values();
    let QuantizedFrame { position, log_scale, opacity, rotation, dc, sh } = frame;
    let dc_step = sequence.dc_step() * COLOUR_FRACTION;
    let sh_step = sequence.sh_step() * COLOUR_FRACTION;
    // In the order in which they are taken out below.
    let shapes = log_scale.map(|plane| (plane, Some(sequence.log_scale_offset()), sequence.log_scale_step()));
    let opacities = [(opacity, Some(sequence.opacity_offset()), sequence.opacity_step())];
    let turns = rotation.map(|plane| (plane, None, sequence.rotation_step()));
    let colours = dc.map(|plane| (plane, None, dc_step));
    let harmonics = sh.into_iter().map(|plane| (plane, None, sh_step));
    let integers: Vec<(Vec<i32>, Option<f32>, f32)> =
        shapes.into_iter().chain(opacities).chain(turns).chain(colours).chain(harmonics).collect();
    let place = || scene_positions(values, position, sequence);
    let convert = || cores::map(values, integers, |(plane, offset, step)| affine(plane, offset, step));
    let (position, planes) = cores::join(values, place, convert);
    let mut planes = planes.into_iter();
    // As many as were put in. One that was missing would be empty, and the frame refused for its lengths.
    let mut next = || planes.next().unwrap_or_default();
    let log_scale = [next(), next(), next()];
    let opacity_logit = next();
    let [x, y, z] = [next(), next(), next()];
    let rotation = [unit_w(values, &x, &y, &z), x, y, z];
    let dc = [next(), next(), next()];
    let planes = Planes { position, log_scale, rotation, opacity_logit, dc, sh: planes.collect() };
    let frame = GaussianFrame::from_planes(sequence.sh_degree, planes)?;
    Ok(frame.with_antialiased(sequence.antialiased()))
}

fn scene_positions(values: usize, position: [Vec<u32>; 3], sequence: &SequenceParameters) -> [Vec<f32>; 3] {
    let (step, companding) = (sequence.position_step(), Companding::new(sequence));
    let axes = position.into_iter().zip(sequence.position_offset()).collect();
    let axis = |(plane, offset): (Vec<u32>, f32)| match companding.is_linear() {
        true => plane.into_iter().map(|q| offset + step * q as f32).collect(),
        false => plane.into_iter().map(|q| offset + step * companding.expand(q) as f32).collect(),
    };
    let mut axes = cores::map(values, axes, axis).into_iter();
    [(); 3].map(|()| axes.next().unwrap_or_default())
}

// Once in modules for web pages, which has two callers and takes as long as the plane does.
#[inline(never)]
fn affine(plane: Vec<i32>, offset: Option<f32>, step: f32) -> Vec<f32> {
    match offset {
        Some(offset) => plane.into_iter().map(|q| offset + step * q as f32).collect(),
        None => plane.into_iter().map(|q| step * q as f32).collect(),
    }
}

/// w is what makes the quaternion a unit, 0 if x, y, z are already longer than one.
fn unit_w(values: usize, x: &[f32], y: &[f32], z: &[f32]) -> Vec<f32> {
    let mut whole = x.to_vec();
    let parts = whole.chunks_mut(RUN).zip(y.chunks(RUN)).zip(z.chunks(RUN));
    cores::for_each(Interrupt::NEVER, values, parts, |((x, y), z)| {
        for ((x, y), z) in x.iter_mut().zip(y).zip(z) {
            // A choice: WebAssembly has the greater of two by a call.
            let rest = 1.0 - (*x * *x + y * y + z * z);
            *x = if rest > 0.0 { rest.sqrt() } else { 0.0 };
        }
    });
    whole
}
