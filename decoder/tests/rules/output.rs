//! 7.10: integers to f32, to the last bit.

use crate::crafted::expect::decode;
use crate::crafted::sample::{self, Dice};
use crate::crafted::scene::{Gaussian, Scene, diagonal};
use splatstream_decoder::output::to_gaussians;
use splatstream_format::syntax::SequenceParameters;

/// The output of the one Gaussian of a stream.
fn output(gaussian: Gaussian, edit: impl Fn(&mut SequenceParameters)) -> splatstream_scene::GaussianFrame {
    let mut scene: Scene = sample::plain(vec![gaussian]);
    scene.sequence.sequence_flags = 0;
    scene.sequence.rotation_threshold = [0; 3];
    scene.sequence.position_bits = 20;
    edit(&mut scene.sequence);
    let decoded = decode(&scene.bytes());
    assert_eq!(decoded.end, None);
    let frame = decoded.frames.into_iter().next().unwrap();
    to_gaussians(frame.planes, &scene.sequence)
}

fn gaussian() -> Gaussian {
    Gaussian { dc: vec![0; 3], ..Gaussian::default() }
}

fn bits<const N: usize>(planes: &[Vec<f32>; N]) -> [u32; N] {
    planes.each_ref().map(|plane| plane[0].to_bits())
}

// covers: SS-OUT-001
#[test]
fn position_scale_and_opacity_are_an_offset_and_a_product_each_rounded() {
    // 0.1f * 3 = 0.3f is 0.30000001192092896 rounded to 0x3E99999A; 1000 + it is rounded again to 0x447A1333.
    let three = Gaussian { delta: 0b1011, log_scale: [3, 0, 0], opacity: 3, ..gaussian() };
    let edit = |sequence: &mut SequenceParameters| {
        sequence.position_offset = [1000.0_f32.to_bits(), 0, (-0.0_f32).to_bits()];
        sequence.position_step = 0.1_f32.to_bits();
        sequence.log_scale_offset = 0;
        sequence.log_scale_step = 0.1_f32.to_bits();
        sequence.opacity_offset = 1000.0_f32.to_bits();
        sequence.opacity_step = 0.1_f32.to_bits();
    };
    let out = output(three, edit);
    // x = 3, y = 1, z = 0; minus zero plus zero is zero.
    assert_eq!(bits(out.position()), [0x447A_1333, 0x3DCC_CCCD, 0]);
    assert_eq!(bits(out.log_scale()), [0x3E99_999A; 3]);
    assert_eq!(out.opacity_logit()[0].to_bits(), 0x447A_1333);
    // Not fused: 1 + 2^-24 * (1 + 2^-23) is above half a step, its product rounded is half a step, a tie to even.
    let fused = output(Gaussian { opacity: 1, ..gaussian() }, |sequence| {
        sequence.opacity_offset = 1.0_f32.to_bits();
        sequence.opacity_step = 0x3380_0000;
    });
    assert_eq!(fused.opacity_logit()[0].to_bits(), 0x3F80_0000);
}

// covers: SS-OUT-001
#[test]
fn integers_beyond_24_bits_are_rounded_to_even_before_they_are_scaled() {
    let mut scene = sample::plain(vec![gaussian()]);
    // The mean is the output: 2^24 + 1 and 2^24 + 3 are ties.
    let mut transform = diagonal(3, 0, 3, 1, 0, 0);
    transform.mean = vec![(1 << 24) + 1, (1 << 24) + 3, -(1 << 30)];
    scene.gops[0].transforms = vec![transform];
    scene.first().dc = vec![0];
    scene.sequence.dc_step = 64.0_f32.to_bits();
    let decoded = decode(&scene.bytes()).frames.remove(0);
    let out = to_gaussians(decoded.planes, &scene.sequence);
    assert_eq!(bits(out.dc()), [16_777_216.0_f32, 16_777_220.0, -1_073_741_824.0].map(f32::to_bits));
}

// covers: SS-OUT-001
#[test]
fn colour_is_a_64th_of_the_step_times_the_integer() {
    let mut scene = sample::scene();
    scene.sequence.dc_step = 0.03_f32.to_bits();
    // The smallest step there is: 2^-40 / 64 is far from subnormal.
    scene.sequence.sh_step = (127 - 40) << 23;
    let decoded = decode(&scene.bytes()).frames.remove(0).planes;
    let out = to_gaussians(decoded.clone(), &scene.sequence);
    for (integers, floats) in decoded.dc.iter().zip(out.dc()) {
        for (&integer, float) in integers.iter().zip(floats) {
            // 0.03f / 64 exactly, in f64; one product, rounded once.
            let exact = f64::from(0.03_f32) / 64.0 * f64::from(integer);
            assert_eq!(float.to_bits(), (exact as f32).to_bits());
        }
    }
    for (integers, floats) in decoded.sh.iter().zip(out.sh()) {
        for (&integer, float) in integers.iter().zip(floats) {
            assert_eq!(f64::from(*float), f64::from(integer) * 2_f64.powi(-46));
            assert!(integer != 0 || float.to_bits() == 0, "positive zero");
        }
    }
}

// covers: SS-OUT-002, SS-OUT-003
#[test]
fn w_makes_the_quaternion_a_unit_or_is_zero() {
    let turned = |rotation: [i64; 3], step: f32| {
        let out =
            output(Gaussian { rotation, ..gaussian() }, |sequence| sequence.rotation_step = step.to_bits());
        bits(out.rotation())
    };
    let one = 1.0_f32.to_bits();
    assert_eq!(turned([0; 3], 0.5), [one, 0, 0, 0]);
    // Longer than one: w is +0, the rest stays.
    assert_eq!(turned([0, -3, 0], 0.5), [0, 0, (-1.5_f32).to_bits(), 0]);
    assert_eq!(turned([32767, -32767, 1], 1.0), [0, 0x46FF_FE00, 0xC6FF_FE00, one]);
    // Exactly one.
    assert_eq!(turned([1, 0, 0], 1.0), [0, one, 0, 0]);
    assert_eq!(turned([0, 0, -2], 0.5), [0, 0, 0, (-1.0_f32).to_bits()]);
    // 1/4 + 1/4 + 1/4: w is 1/2.
    assert_eq!(turned([1, -1, 1], 0.5), [0.5_f32, 0.5, -0.5, 0.5].map(f32::to_bits));
    // 0.6f = 0.60000002384: squares 0.36f = 0x3EB851ED, rest 0.64f = 0x3F23D70A, root 0.8f = 0x3F4CCCCD or below.
    let [w, x, ..] = turned([6, 0, 0], 0.1);
    let six_tenths = 0.1_f32 * 6.0;
    assert_eq!(x, six_tenths.to_bits());
    let rest = 1.0 - six_tenths * six_tenths;
    assert_eq!(w, rest.sqrt().to_bits());
}

/// Rounds once from f64: a product of two f32 and a root of one are exact enough there.
fn product(a: f32, b: f32) -> f32 {
    (f64::from(a) * f64::from(b)) as f32
}

fn sum(a: f32, b: f32) -> f32 {
    // The f64 sum of two f32 may be inexact; double rounding then does no harm, for f64 has more than twice the bits.
    (f64::from(a) + f64::from(b)) as f32
}

// covers: SS-OUT-001, SS-OUT-002, SS-OUT-003
#[test]
fn every_output_is_that_of_the_formulas_step_by_step() {
    let mut dice = Dice::new(5);
    for _ in 0..200 {
        let rotation = [(); 3].map(|()| dice.within(-60, 60));
        let log_scale = [dice.within(-9999, 9999), dice.within(-99, 99), dice.within(-99, 99)];
        let opacity = dice.within(-32768, 32767);
        let step = f32::from_bits(0x3C00_0000 + dice.below(1 << 23) as u32);
        let offset = f32::from_bits(0xC000_0000 + dice.below(1 << 25) as u32);
        let out = output(Gaussian { rotation, log_scale, opacity, ..gaussian() }, |sequence| {
            sequence.rotation_step = step.to_bits();
            sequence.log_scale_step = step.to_bits();
            sequence.log_scale_offset = offset.to_bits();
            sequence.opacity_step = step.to_bits();
            sequence.opacity_offset = offset.to_bits();
        });
        let affine = |integer: i64| sum(offset, product(step, integer as f32)).to_bits();
        let q = [log_scale[0], log_scale[0] - log_scale[1], log_scale[0] - log_scale[1] - log_scale[2]];
        assert_eq!(bits(out.log_scale()), q.map(affine));
        assert_eq!(out.opacity_logit()[0].to_bits(), affine(opacity));
        let [x, y, z] = rotation.map(|value| product(step, value as f32));
        let squares = sum(sum(product(x, x), product(y, y)), product(z, z));
        let rest = sum(1.0, -squares);
        let w = if rest > 0.0 { f64::from(rest).sqrt() as f32 } else { 0.0 };
        assert_eq!(bits(out.rotation()), [w, x, y, z].map(f32::to_bits), "{rotation:?} {step}");
    }
}

// covers: SS-SP-006
#[test]
fn the_time_of_a_frame_is_an_exact_quotient_that_decoding_carries_unchanged() {
    let mut scene = sample::scene();
    (scene.sequence.ticks_per_second, scene.sequence.ticks_per_frame) = (90_000, 3003);
    let mut times = Vec::new();
    let options = splatstream_decoder::process::Options::default();
    let summary = splatstream_decoder::stream::decode_stream(&scene.bytes(), &options, |sequence, frame| {
        let ticks = u64::from(frame.number) * u64::from(sequence.ticks_per_frame);
        times.push((ticks, sequence.ticks_per_second));
        std::ops::ControlFlow::Continue(())
    });
    assert_eq!(summary.end, None);
    assert_eq!(times, [(0, 90_000), (3003, 90_000), (6006, 90_000)]);
}
