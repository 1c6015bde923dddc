//! The quantisers of SOG, version 2, without its images.
//!
//! Positions have 16 bits an axis over the range of sign(x) ln(1 + |x|); scales, colours and spherical harmonics have one
//! codebook of 256 values each; opacities a byte; rotations a byte for each of the smallest three components. SOG chooses
//! whole sets of harmonics from a palette; for scenes as small as these it has a row for each Gaussian.

use super::edits::edited;
use splatstream_gaussians::GaussianFrame;
use std::f64::consts::SQRT_2;

/// Values of a codebook, and rounds of choosing them.
const ENTRIES: usize = 256;
const ROUNDS: usize = 10;

/// Codes of a position.
const POSITIONS: f64 = 65535.0;

/// A frame as it comes back.
pub(super) fn quantised(frame: &GaussianFrame) -> GaussianFrame {
    edited(frame, |planes| {
        planes.position.iter_mut().for_each(|plane| position(plane));
        by_codebook(&mut planes.log_scale);
        by_codebook(&mut planes.dc);
        by_codebook(&mut planes.sh);
        planes.opacity_logit.iter_mut().for_each(|logit| *logit = opacity(*logit));
        for row in 0..frame.len() {
            let turned = rotation(planes.rotation.each_ref().map(|plane| f64::from(plane[row])));
            planes.rotation.iter_mut().zip(turned).for_each(|(plane, part)| plane[row] = part as f32);
        }
    })
}

/// 16 bits over the range of the logarithms.
fn position(plane: &mut [f32]) {
    let bent = |x: f32| f64::from(x).signum() * libm::log1p(f64::from(x).abs());
    let ends = |(low, high): (f64, f64), &x: &f32| (low.min(bent(x)), high.max(bent(x)));
    let (low, high) = plane.iter().fold((f64::INFINITY, f64::NEG_INFINITY), ends);
    let step = (high - low) / POSITIONS;
    for x in plane {
        let code = if step > 0.0 { ((bent(*x) - low) / step).round() } else { 0.0 };
        let value = low + code * step;
        *x = (value.signum() * libm::expm1(value.abs())) as f32;
    }
}

/// Every value becomes the nearest of a codebook that is made for all planes together: k-means over sorted values, from
/// their quantiles.
fn by_codebook(planes: &mut [&mut [f32]]) {
    let mut values: Vec<f32> = planes.iter().flat_map(|plane| plane.iter().copied()).collect();
    if values.is_empty() {
        return;
    }
    values.sort_unstable_by(f32::total_cmp);
    let quantile = |entry: usize| f64::from(values[(2 * entry + 1) * values.len() / (2 * ENTRIES)]);
    let mut codebook: Vec<f64> = (0..ENTRIES).map(quantile).collect();
    for _ in 0..ROUNDS {
        let mut sums = vec![(0.0, 0.0); ENTRIES];
        for &value in &values {
            let (sum, count) = &mut sums[nearest(&codebook, value.into())];
            *sum += f64::from(value);
            *count += 1.0;
        }
        let means = codebook.iter_mut().zip(sums).filter(|(_, (_, count))| *count > 0.0);
        means.for_each(|(entry, (sum, count))| *entry = sum / count);
        codebook.sort_unstable_by(f64::total_cmp);
    }
    let values = planes.iter_mut().flat_map(|plane| plane.iter_mut());
    values.for_each(|value| *value = codebook[nearest(&codebook, f64::from(*value))] as f32);
}

/// The place of the nearest value in a sorted codebook.
fn nearest(codebook: &[f64], value: f64) -> usize {
    let above = codebook.partition_point(|&entry| entry < value).min(codebook.len() - 1);
    let below = above.saturating_sub(1);
    if (value - codebook[below]).abs() <= (codebook[above] - value).abs() { below } else { above }
}

/// A byte of the opacity; its ends come back half a step inside, as our reader has them.
fn opacity(logit: f32) -> f32 {
    let byte = (255.0 / (1.0 + libm::exp(-f64::from(logit)))).round();
    let opacity = byte.clamp(0.5, 254.5) / 255.0;
    libm::log(opacity / (1.0 - opacity)) as f32
}

/// A byte for each component but the largest, over the range of what these can be.
fn rotation(parts: [f64; 4]) -> [f64; 4] {
    let largest = (0..4).max_by(|&a, &b| parts[a].abs().total_cmp(&parts[b].abs())).unwrap_or_default();
    let sign = if parts[largest] < 0.0 { -1.0 } else { 1.0 };
    let byte = |part: f64| ((part * sign * SQRT_2 + 1.0) * 127.5).round().clamp(0.0, 255.0);
    let mut turned = parts.map(|part| (byte(part) / 127.5 - 1.0) / SQRT_2);
    turned[largest] = 0.0;
    let squares: f64 = turned.iter().map(|part| part * part).sum();
    turned[largest] = (1.0 - squares).max(0.0).sqrt();
    turned
}

#[cfg(test)]
mod tests {
    use super::*;
    use splatstream_files::builtin::BuiltinScene;

    #[test]
    fn values_come_back_within_a_step() {
        let frame =
            BuiltinScene { gaussians: 300, frames: 1, sh_degree: 1, ..BuiltinScene::default() }.frame(0);
        let back = quantised(&frame);
        let far = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(far(&back.position()[0], &frame.position()[0]) < 1e-3);
        assert!(far(&back.log_scale()[1], &frame.log_scale()[1]) < 0.2);
        let opacity = |logit: f32| 1.0 / (1.0 + libm::expf(-logit));
        assert!((opacity(back.opacity_logit()[9]) - opacity(frame.opacity_logit()[9])).abs() < 0.004);
    }

    #[test]
    fn a_turn_and_its_negative_are_one() {
        let parts = [-0.8, 0.36, -0.48, 0.0];
        let turned = rotation(parts);
        assert!(parts.iter().zip(turned).all(|(part, turned)| (part + turned).abs() < 0.01));
        assert_eq!(rotation(parts.map(|part| -part)), turned);
    }

    #[test]
    fn one_value_is_its_own_codebook() {
        let mut planes = [vec![2.5f32; 3]];
        by_codebook(&mut planes.each_mut().map(Vec::as_mut_slice));
        assert_eq!(planes[0], [2.5; 3]);
    }
}
