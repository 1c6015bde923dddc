//! What is written comes back: exactly from PLY, within the stated bounds from the others.

use proptest::prelude::*;
use splatstream_files::builtin::BuiltinScene;
use splatstream_files::spz::WriteOptions;
use splatstream_files::{Clamped, ply, splat, spz};
use splatstream_gaussians::GaussianFrame;

use super::samples::{LIMITS, frames};

fn bits(planes: &[Vec<f32>]) -> Vec<Vec<u32>> {
    planes.iter().map(|plane| plane.iter().map(|value| value.to_bits()).collect()).collect()
}

fn opacity(logit: f32) -> f64 {
    1.0 / (1.0 + libm::exp(-f64::from(logit)))
}

/// The largest difference between two sets of planes.
fn largest(a: &[Vec<f32>], b: &[Vec<f32>]) -> f64 {
    assert!(a.iter().flatten().count() == b.iter().flatten().count());
    let pairs = a.iter().flatten().zip(b.iter().flatten());
    pairs.map(|(&a, &b)| (f64::from(a) - f64::from(b)).abs()).fold(0.0, f64::max)
}

fn largest_opacity(a: &GaussianFrame, b: &GaussianFrame) -> f64 {
    let pairs = a.opacity_logit().iter().zip(b.opacity_logit());
    pairs.map(|(&a, &b)| (opacity(a) - opacity(b)).abs()).fold(0.0, f64::max)
}

/// The largest distance between the rotations of two frames, as unit quaternions of either sign.
fn largest_turn(a: &GaussianFrame, b: &GaussianFrame) -> f64 {
    let unit = |frame: &GaussianFrame, row: usize| {
        let q = frame.rotation().each_ref().map(|plane| f64::from(plane[row]));
        let norm = q.iter().map(|part| part * part).sum::<f64>().sqrt();
        q.map(|part| part / norm)
    };
    let distance = |a: [f64; 4], b: [f64; 4], sign: f64| {
        a.iter().zip(b).map(|(a, b)| (a - sign * b) * (a - sign * b)).sum::<f64>().sqrt()
    };
    (0..a.len())
        .map(|row| distance(unit(a, row), unit(b, row), 1.0).min(distance(unit(a, row), unit(b, row), -1.0)))
        .fold(0.0, f64::max)
}

/// By how much SH coefficients of so many bits differ more than they may: half a step, and as much as they
/// are past the end of the range.
fn sh_excess(back: &[Vec<f32>], frame: &[Vec<f32>], bits: u8) -> f64 {
    let step = 2.0 / f64::from(1_u32 << bits);
    let pairs = back.iter().flatten().zip(frame.iter().flatten());
    let excess = pairs.map(|(&back, &value)| {
        let past_end = f64::from(value.abs()) - (1.0 - step);
        f64::from((back - value).abs()) - past_end.max(step / 2.0)
    });
    excess.fold(0.0, f64::max)
}

proptest! {
    #[test]
    fn ply_keeps_every_bit(frame in frames()) {
        let back = ply::read(&ply::write(&frame), &LIMITS).unwrap();
        prop_assert_eq!(bits(back.position()), bits(frame.position()));
        prop_assert_eq!(bits(back.log_scale()), bits(frame.log_scale()));
        prop_assert_eq!(bits(back.dc()), bits(frame.dc()));
        prop_assert_eq!(bits(back.sh()), bits(frame.sh()));
        prop_assert_eq!(back.opacity_logit(), frame.opacity_logit());
        prop_assert!(largest_turn(&back, &frame) < 1e-6);
        // Once rotations have unit length, they too stay as they are.
        let bytes = ply::write(&back);
        let again = ply::read(&bytes, &LIMITS).unwrap();
        prop_assert_eq!(bits(again.rotation()), bits(back.rotation()));
        prop_assert_eq!(ply::write(&again), bytes);
    }

    #[test]
    fn splat_stays_within_its_quantiser(frame in frames()) {
        let back = splat::read(&splat::write(&frame).unwrap(), &LIMITS).unwrap();
        prop_assert_eq!(bits(back.position()), bits(frame.position()));
        prop_assert_eq!(back.sh_degree(), 0);
        prop_assert_eq!(splat::clamped(&back), []);
        prop_assert!(largest(back.log_scale(), frame.log_scale()) < 10.0 / f64::from(1 << 22));
        // Half a step of 255 colours; the DC coefficient is 3.545 times the colour. Frames stay within 0–1.
        prop_assert!(largest(back.dc(), frame.dc()) <= 0.5 / 255.0 / 0.282_094 + 1e-6);
        prop_assert!(largest_opacity(&back, &frame) <= 1.0 / 510.0 + 1e-6);
        // Three components off by half a step and one, near 1, by a whole step.
        prop_assert!(largest_turn(&back, &frame) < 0.02);
    }

    #[test]
    fn spz_stays_within_its_quantiser(frame in frames(), sh1_bits in 1..=8_u8, sh_rest_bits in 1..=8_u8) {
        let options = WriteOptions { sh1_bits, sh_rest_bits, ..WriteOptions::default() };
        let back = spz::read(&spz::write_with(&frame, &options).unwrap(), &LIMITS).unwrap();
        // Within ±128 there are 16 fractional bits at the least.
        prop_assert!(largest(back.position(), frame.position()) <= 0.5 / f64::from(1 << 16));
        prop_assert!(largest(back.log_scale(), frame.log_scale()) <= 1.0 / 32.0);
        prop_assert!(largest(back.dc(), frame.dc()) <= 1.0 / 76.5 + 1e-6);
        prop_assert!(largest_opacity(&back, &frame) <= 1.0 / 510.0 + 1e-6);
        prop_assert!(largest_turn(&back, &frame) < 0.003);
        let (one, rest) = (frame.sh().len().min(9), frame.sh().len());
        prop_assert!(sh_excess(&back.sh()[..one], &frame.sh()[..one], sh1_bits) < 1e-6);
        prop_assert!(sh_excess(&back.sh()[one..rest], &frame.sh()[one..rest], sh_rest_bits) < 1e-6);
    }

    #[test]
    fn what_spz_gives_it_takes_unchanged(frame in frames()) {
        let once = spz::read(&spz::write(&frame).unwrap(), &LIMITS).unwrap();
        let twice = spz::read(&spz::write(&once).unwrap(), &LIMITS).unwrap();
        prop_assert_eq!(bits(once.position()), bits(twice.position()));
        prop_assert_eq!(bits(once.log_scale()), bits(twice.log_scale()));
        prop_assert_eq!(bits(once.sh()), bits(twice.sh()));
        prop_assert_eq!(bits(once.dc()), bits(twice.dc()));
        prop_assert_eq!(spz::clamped(&once, &WriteOptions::default()), []);
    }
}

#[test]
fn what_a_format_cannot_keep_is_counted() {
    let frame = BuiltinScene { gaussians: 100, sh_degree: 1, ..BuiltinScene::default() }.frame(0);
    let mut planes = frame.into_planes();
    planes.dc.iter_mut().flatten().for_each(|dc| *dc = 0.0);
    planes.log_scale.iter_mut().flatten().for_each(|log| *log = -3.0);
    planes.sh.iter_mut().flatten().for_each(|sh| *sh = 0.0);
    (planes.dc[0][7], planes.dc[2][3], planes.dc[1][3]) = (9.0, -4.0, 1.8);
    planes.log_scale[1][50] = 6.5;
    planes.sh[4][20] = -1.5;
    let frame = GaussianFrame::from_planes(1, planes).unwrap();
    let clamped = |property, count, row, value| Clamped { property, count, row, value };
    let expected = [clamped("dc", 2, 3, -4.0), clamped("log_scale", 1, 50, 6.5), clamped("sh", 1, 20, -1.5)];
    assert_eq!(spz::clamped(&frame, &WriteOptions::default()), expected);
    // A colour goes from 0 to 1 there, which is a coefficient of 1.77 to either side.
    assert_eq!(splat::clamped(&frame), [clamped("dc", 3, 3, 1.8)]);
}
