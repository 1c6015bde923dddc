//! 7.10: integers to f32, to the last bit.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

use proptest::prelude::*;
use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::output::to_gaussians;
use splatstream_format::syntax::SequenceParameters;
use splatstream_gaussians::GaussianFrame;

fn sequence() -> SequenceParameters {
    SequenceParameters { block_log2: 6, frame_count: 1, ..SequenceParameters::PLAIN }
}

/// The output of one Gaussian.
fn output(edit: impl Fn(&mut QuantizedFrame, &mut SequenceParameters)) -> GaussianFrame {
    let (mut frame, mut sequence) = (QuantizedFrame::zeroed(1, 0), sequence());
    edit(&mut frame, &mut sequence);
    to_gaussians(frame, &sequence).unwrap()
}

fn bits<const N: usize>(planes: &[Vec<f32>; N]) -> [u32; N] {
    planes.each_ref().map(|plane| plane[0].to_bits())
}

// covers: SS-OUT-001
#[test]
fn position_scale_and_opacity_are_an_offset_and_a_product_each_rounded() {
    // 0.1f * 3 = 0.3f is 0.30000001192092896 rounded to 0x3E99999A; 1000 + it is rounded again to 0x447A1333.
    let out = output(|frame, sequence| {
        frame.position = [vec![3], vec![1], vec![0]];
        frame.log_scale = [const { 3 }; 3].map(|value| vec![value]);
        frame.opacity = vec![3];
        sequence.position_offset = [1000.0_f32.to_bits(), 0, (-0.0_f32).to_bits()];
        sequence.position_step = 0.1_f32.to_bits();
        sequence.log_scale_step = 0.1_f32.to_bits();
        sequence.opacity_offset = 1000.0_f32.to_bits();
        sequence.opacity_step = 0.1_f32.to_bits();
    });
    // Minus zero plus zero is zero.
    assert_eq!(bits(out.position()), [0x447A_1333, 0x3DCC_CCCD, 0]);
    assert_eq!(bits(out.log_scale()), [0x3E99_999A; 3]);
    assert_eq!(out.opacity_logit()[0].to_bits(), 0x447A_1333);
    // Not fused: 1 + 2^-24 * (1 + 2^-23) is above half a step, its product rounded is half a step, a tie to even.
    let fused = output(|frame, sequence| {
        frame.opacity = vec![1];
        sequence.opacity_offset = 1.0_f32.to_bits();
        sequence.opacity_step = 0x3380_0000;
    });
    assert_eq!(fused.opacity_logit()[0].to_bits(), 0x3F80_0000);
}

// covers: SS-OUT-001
#[test]
fn integers_beyond_24_bits_are_rounded_to_even_before_they_are_scaled() {
    let out = output(|frame, sequence| {
        frame.dc = [(1 << 24) + 1, (1 << 24) + 3, -(1 << 30)].map(|value| vec![value]);
        sequence.dc_step = 64.0_f32.to_bits();
    });
    assert_eq!(bits(out.dc()), [16_777_216.0_f32, 16_777_220.0, -1_073_741_824.0].map(f32::to_bits));
}

// covers: SS-OUT-002, SS-OUT-003
#[test]
fn w_makes_the_quaternion_a_unit_or_is_zero() {
    let rotated = |rotation: [i32; 3], step: f32| {
        let out = output(|frame, sequence| {
            frame.rotation = rotation.map(|value| vec![value]);
            sequence.rotation_step = step.to_bits();
        });
        bits(out.rotation())
    };
    let one = 1.0_f32.to_bits();
    assert_eq!(rotated([0; 3], 0.5), [one, 0, 0, 0]);
    // Longer than one: w is +0, the rest stays.
    assert_eq!(rotated([0, -3, 0], 0.5), [0, 0, (-1.5_f32).to_bits(), 0]);
    assert_eq!(rotated([32767, -32767, 1], 1.0), [0, 0x46FF_FE00, 0xC6FF_FE00, one]);
    // Exactly one.
    assert_eq!(rotated([1, 0, 0], 1.0), [0, one, 0, 0]);
    assert_eq!(rotated([0, 0, -2], 0.5), [0, 0, 0, (-1.0_f32).to_bits()]);
    // 1/4 + 1/4 + 1/4: w is 1/2.
    assert_eq!(rotated([1, -1, 1], 0.5), [0.5_f32, 0.5, -0.5, 0.5].map(f32::to_bits));
}

/// Rounds once from f64: a product of two f32 and a root of one are exact enough there.
fn product(a: f32, b: f32) -> f32 {
    (f64::from(a) * f64::from(b)) as f32
}

/// The f64 sum of two f32 may be inexact; double rounding then does no harm, for f64 has more than twice the bits.
fn sum(a: f32, b: f32) -> f32 {
    (f64::from(a) + f64::from(b)) as f32
}

proptest! {
    // covers: SS-OUT-001, SS-OUT-002, SS-OUT-003
    #[test]
    fn every_output_is_that_of_the_formulas_step_by_step(
        rotation in [-60..=60_i32, -60..=60, -60..=60],
        log_scale in [-32768..=32767_i32, -32768..=32767, -32768..=32767],
        dc in [any::<i32>(), any::<i32>(), any::<i32>()],
        step in 0x3C00_0000..0x3C80_0000_u32,
        offset in 0xC000_0000..0xC200_0000_u32,
    ) {
        let (step, offset) = (f32::from_bits(step), f32::from_bits(offset));
        let out = output(|frame, sequence| {
            frame.rotation = rotation.map(|value| vec![value]);
            frame.log_scale = log_scale.map(|value| vec![value]);
            frame.dc = dc.map(|value| vec![value]);
            (sequence.rotation_step, sequence.log_scale_step) = (step.to_bits(), step.to_bits());
            (sequence.dc_step, sequence.log_scale_offset) = (step.to_bits(), offset.to_bits());
        });
        let affine = |integer: i32| sum(offset, product(step, integer as f32)).to_bits();
        prop_assert_eq!(bits(out.log_scale()), log_scale.map(affine));
        prop_assert_eq!(bits(out.dc()), dc.map(|value| product(step / 64.0, value as f32).to_bits()));
        let [x, y, z] = rotation.map(|value| product(step, value as f32));
        let squares = sum(sum(product(x, x), product(y, y)), product(z, z));
        let rest = sum(1.0, -squares);
        let w = if rest > 0.0 { f64::from(rest).sqrt() as f32 } else { 0.0 };
        prop_assert_eq!(bits(out.rotation()), [w, x, y, z].map(f32::to_bits));
    }
}

#[test]
fn planes_that_do_not_fit_together_are_an_error() {
    let longer = |edit: fn(&mut QuantizedFrame)| {
        let mut frame = QuantizedFrame::zeroed(2, 0);
        edit(&mut frame);
        frame
    };
    for frame in [
        longer(|frame| frame.position[1].push(0)),
        longer(|frame| frame.rotation[2].clear()),
        longer(|frame| frame.dc[0].truncate(1)),
        longer(|frame| frame.sh.push(vec![0; 2])),
    ] {
        assert!(frame.check(0).is_err());
        assert!(to_gaussians(frame, &sequence()).is_err());
    }
    let frame = QuantizedFrame::zeroed(2, 0);
    assert_eq!((frame.check(0), to_gaussians(frame, &sequence()).map(|frame| frame.len())), (Ok(()), Ok(2)));
}
